//! MATLAB files of version 7.3, which are HDF5, and plain HDF5 files: datasets of the root group and of the groups in it.

use std::path::Path;

use hdf5_pure::{File, Group};

use super::container::{Cells, Columns, damaged};
use crate::error::Result;

/// The vectors of a file; those of a group as `group.name`, or as `name` when the file holds one group and nothing else.
pub(super) fn columns(path: &Path) -> Result<Columns> {
    let file = File::open(path).map_err(damaged)?;
    let root = file.root();
    let mut columns = Vec::new();
    datasets(&root, "", &mut columns)?;
    let groups: Vec<String> =
        root.groups().map_err(damaged)?.into_iter().filter(|g| !g.starts_with('#')).collect();
    let alone = columns.is_empty() && groups.len() == 1;
    for group in groups {
        let prefix = if alone { String::new() } else { format!("{group}.") };
        datasets(&root.group(&group).map_err(damaged)?, &prefix, &mut columns)?;
    }
    Ok(columns)
}

fn datasets(group: &Group, prefix: &str, columns: &mut Columns) -> Result<()> {
    for name in group.datasets().map_err(damaged)? {
        let dataset = group.dataset(&name).map_err(damaged)?;
        let shape = dataset.shape().map_err(damaged)?;
        // Text, references and the like are no columns of a recording.
        let Ok(values) = dataset.read_f64() else { continue };
        if values.is_empty() {
            continue;
        }
        // MATLAB stores column by column, so its dimensions appear in reverse: (columns, rows).
        match shape[..] {
            [_] | [1, _] | [_, 1] => columns.push((format!("{prefix}{name}"), Cells::Numbers(values))),
            [wide, rows] if wide.checked_mul(rows) == Some(values.len() as u64) && wide <= 1000 => {
                let named = |(k, c): (usize, &[f64])| {
                    (format!("{prefix}{name}(:,{})", k + 1), Cells::Numbers(c.to_vec()))
                };
                columns.extend(values.chunks_exact(rows as usize).enumerate().map(named));
            }
            _ => {}
        }
    }
    Ok(())
}
