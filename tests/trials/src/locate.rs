//! Where an effect really sits, and whether a stated region sits there too.

use crate::answer::Region;
use crate::ledger::name;
use std::fmt::Write as _;
use std::path::Path;
use virtual_bench::recording::Row;

/// The sealed trace of what is hidden: per kept row its coordinates and what a flexible base leaves of the effect.
pub fn trace(files: &[Vec<Row>], rest: &[Vec<f64>], rest_length: f64) -> String {
    let mut out = String::from("recording,time,cycle,pressure,contraction,direction,left_N\n");
    let total: usize = files.iter().map(Vec::len).sum();
    let step = (total / 4000).max(1);
    for (n, (file, left)) in files.iter().zip(rest).enumerate() {
        for i in (1..file.len().min(left.len())).step_by(step) {
            let r = &file[i];
            let way = (r.stroke - file[i - 1].stroke).signum();
            let _ = writeln!(
                out,
                "{},{:.2},{},{:.1},{:.5},{way},{:.5}",
                n + 1,
                r.time,
                r.cycle,
                r.pressure,
                r.stroke / rest_length,
                left[i]
            );
        }
    }
    out
}

/// Whether the first stated region that can be checked holds the effect's energy more densely than chance: half again as
/// dense as its share of the rows, or more than half of the energy and denser than its rows.
pub fn hit(set: &Path, id: usize, regions: &[Region]) -> Option<bool> {
    let text = std::fs::read_to_string(set.join("sealed").join(name(id)).join("trace.csv")).ok()?;
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|l| l.split(',').filter_map(|v| v.parse().ok()).collect()).collect();
    let rows: Vec<&Vec<f64>> = rows.iter().filter(|r: &&Vec<f64>| r.len() == 7).collect();
    let energy: f64 = rows.iter().map(|r| r[6] * r[6]).sum();
    if energy <= 0.0 {
        return None;
    }
    for region in regions {
        let column = match region.coordinate.as_str() {
            "recording" => 0,
            "time" => 1,
            "cycle" => 2,
            "pressure" => 3,
            "contraction" => 4,
            "direction" => 5,
            _ => continue,
        };
        let (Some(mut from), Some(mut to)) = (region.from, region.to) else { continue };
        if from > to {
            std::mem::swap(&mut from, &mut to);
        }
        if column == 3 && to.abs() < 2000.0 {
            // A pressure of this size is meant in kPa.
            (from, to) = (from * 1e3, to * 1e3);
        }
        let edge = 1e-6 + 1e-6 * to.abs();
        let inside = |r: &&&Vec<f64>| r[column] >= from - edge && r[column] <= to + edge;
        let n = rows.iter().filter(inside).count() as f64 / rows.len().max(1) as f64;
        let e = rows.iter().filter(inside).map(|r| r[6] * r[6]).sum::<f64>() / energy;
        if n <= 0.0 || n >= 0.999 {
            continue;
        }
        return Some(e / n >= 1.5 || (e > 0.5 && e > n));
    }
    None
}
