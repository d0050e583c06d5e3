//! A table in forms that other programs read: CSV, a C header, a MATLAB file.

use std::fmt::Write;
use std::path::Path;

use model_core::table::Kind;

use crate::table_file::TableFile;
use pam_data::error::{DataCode, Error, Result};

/// The forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// As `host table show --json` prints it.
    Json,
    /// One line per pressure node.
    Csv,
    /// Constants for firmware in C or C++.
    C,
    /// MATLAB level 5 (`load` reads it, also Octave and SciPy).
    Matlab,
}

impl Format {
    /// What a file's name ends in.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] for an unknown file name extension.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("json") => Ok(Self::Json),
            Some("csv") => Ok(Self::Csv),
            Some("h" | "hpp") => Ok(Self::C),
            Some("mat") => Ok(Self::Matlab),
            _ => Err(Error::new(
                DataCode::CallInvalid,
                "the extension of the output's name is not a known format",
            )
            .file(path)
            .help("use .json, .csv, .h or .mat, or give --format")),
        }
    }
}

/// One line per node: pressure, E_1 …, k_F, in SI units as the header says.
#[must_use]
pub fn csv(file: &TableFile) -> String {
    let t = &file.table;
    let mut text = "pressure_Pa".to_owned();
    for k in 1..=t.order() {
        let _ = write!(text, ",E_{k}_Pa");
    }
    text += ",k_F\n";
    for i in 0..t.nodes.len() {
        let _ = write!(text, "{}", t.nodes[i]);
        for curve in &t.elastic {
            let _ = write!(text, ",{}", curve[i]);
        }
        let _ = writeln!(text, ",{}", t.friction[i]);
    }
    text
}

/// A header with every number of the table as a constant, SI units, and the equations in a comment.
#[must_use]
pub fn c_header(file: &TableFile) -> String {
    let t = &file.table;
    let name: String = file
        .about
        .muscle
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' })
        .collect();
    let name = format!("PAM_{name}");
    let list = |values: &[f32]| values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", ");
    let g = &t.geometry;
    let comment: String = file.about.muscle.chars().filter(|c| !c.is_control() && *c != '*').collect();
    let mut text = format!(
        "/* Muscle {comment}, written by host table export from a table made {} by {}.\n\
         \x20* SI units: Pa, m, N, rad. P gauge pressure, x contraction stroke, s = +1 shortening, -1 lengthening.\n\
         \x20*   L = L0 - x   B = L0 / sin(alpha)   N = B cos(alpha) / (pi D)   R = sqrt(B^2 - L^2) / (2 pi N)\n\
         \x20*   V = pi/4 L0 (D^2 - (D - 2 t0)^2)   t = R - sqrt(R^2 - V/(pi L))\n\
         \x20*   F = (1 - kF(P) s) [ (P - P0) (3 L^2 - B^2)/(4 pi N^2)\n\
         \x20*       + sum_k E_k(P) (V/L (L/L0 - 1)^k - t L^2 (R/R0 - 1)^k / (2 pi N^2 R)) ]\n\
         \x20* E_k and kF are natural cubic splines through the nodes, held at their end values outside. */\n\
         #ifndef {name}_H\n#define {name}_H\n\n",
        file.about.date, file.about.tool
    );
    if g.tip_correction {
        text += "/* With the tip correction L' = L - 2 (pi/2 - 1)(R - R0) represents L in the forces. */\n";
    }
    if t.goes_slack {
        text += "/* A slack muscle exerts no force: replace F below zero by zero (GOES_SLACK). */\n";
    }
    if !t.effects.is_empty() {
        text += "/* The table also carries effects, which are not in this header. */\n";
    }
    let scalars = [
        ("REST_LENGTH", g.rest_length.metres()),
        ("BRAID_ANGLE", g.braid_angle.radians()),
        ("OUTER_DIAMETER", g.outer_diameter.metres()),
        ("WALL", g.wall.metres()),
        ("DEADBAND", t.deadband.pascals()),
        ("MAX_PRESSURE", t.max_pressure.pascals()),
        ("BLOCKED_FORCE", t.blocked_force.newtons()),
    ];
    for (what, value) in scalars {
        let _ = writeln!(text, "#define {name}_{what} {}", number(value));
    }
    let _ = writeln!(text, "#define {name}_TIP_CORRECTION {}", u8::from(g.tip_correction));
    let _ = writeln!(text, "#define {name}_GOES_SLACK {}", u8::from(t.goes_slack));
    let _ = writeln!(text, "#define {name}_PUSHES {}", u8::from(t.kind == Kind::Push));
    let _ = writeln!(text, "#define {name}_NODES {}", t.nodes.len());
    let _ = writeln!(text, "#define {name}_ORDER {}\n", t.order());
    let _ =
        writeln!(text, "static const float {name}_PRESSURE[{}] = {{ {} }};", t.nodes.len(), list(&t.nodes));
    let _ = writeln!(text, "static const float {name}_E[{}][{}] = {{", t.order(), t.nodes.len());
    for curve in &t.elastic {
        let _ = writeln!(text, "    {{ {} }},", list(curve));
    }
    text += "};\n";
    let _ = writeln!(text, "static const float {name}_KF[{}] = {{ {} }};", t.nodes.len(), list(&t.friction));
    let _ = writeln!(text, "\n#endif");
    text
}

/// A float literal that C reads back to the same bits.
fn number(value: f32) -> String {
    format!("{value:e}f")
}

/// A MATLAB level 5 file with one matrix per quantity: `nodes`, `E` (orders × nodes), `k_F`, `deadband`, … in SI units.
///
/// Format: MathWorks, *MAT-File Format*, level 5: a header of 128 bytes, then elements of type miMATRIX (14) with sub-elements for
/// flags, dimensions, name and numbers, each padded to eight bytes.
#[must_use]
pub fn matlab(file: &TableFile) -> Vec<u8> {
    let t = &file.table;
    let mut header = format!("MATLAB 5.0 MAT-file, written by {}", file.about.tool).into_bytes();
    header.resize(116, b' ');
    header.resize(124, 0);
    header.extend_from_slice(&0x0100_u16.to_le_bytes());
    header.extend_from_slice(b"IM");
    let mut bytes = header;
    let row = |v: &[f32]| v.iter().map(|x| f64::from(*x)).collect::<Vec<f64>>();
    let mut matrix = |name: &str, rows: usize, columns: usize, values: &[f64]| {
        let mut body = Vec::new();
        element(&mut body, 6, &[6_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat());
        element(&mut body, 5, &[(rows as i32).to_le_bytes(), (columns as i32).to_le_bytes()].concat());
        element(&mut body, 1, name.as_bytes());
        element(&mut body, 9, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
        element(&mut bytes, 14, &body);
    };
    let n = t.nodes.len();
    // Columns first, as MATLAB keeps them.
    let elastic: Vec<f64> =
        (0..n).flat_map(|j| t.elastic.iter().map(move |c| f64::from(c[j])).collect::<Vec<_>>()).collect();
    matrix("nodes", 1, n, &row(&t.nodes));
    matrix("E", t.order(), n, &elastic);
    matrix("k_F", 1, n, &row(&t.friction));
    let scalars = [
        ("deadband", t.deadband.pascals()),
        ("rest_length", t.geometry.rest_length.metres()),
        ("braid_angle", t.geometry.braid_angle.radians()),
        ("outer_diameter", t.geometry.outer_diameter.metres()),
        ("wall", t.geometry.wall.metres()),
        ("tip_correction", if t.geometry.tip_correction { 1.0 } else { 0.0 }),
        ("goes_slack", if t.goes_slack { 1.0 } else { 0.0 }),
        ("blocked_force", t.blocked_force.newtons()),
        ("max_pressure", t.max_pressure.pascals()),
    ];
    for (name, value) in scalars {
        matrix(name, 1, 1, &[f64::from(value)]);
    }
    bytes
}

fn element(to: &mut Vec<u8>, kind: u32, content: &[u8]) {
    to.extend_from_slice(&kind.to_le_bytes());
    to.extend_from_slice(&(content.len() as u32).to_le_bytes());
    to.extend_from_slice(content);
    // A matrix's own length counts its padding; all others are padded beyond it.
    to.resize(to.len().next_multiple_of(8), 0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table_file::About;

    fn example() -> TableFile {
        let about = About { muscle: "mini-1".into(), ..About::default() };
        TableFile { table: model_core::table::example(), about }
    }

    #[test]
    fn numbers_of_the_header_are_read_back_to_the_bit() {
        let text = c_header(&example());
        let line = text.lines().find(|l| l.contains("PAM_MINI_1_KF")).expect("a line");
        let inside = line.split(['{', '}']).nth(1).expect("numbers");
        let back: Vec<f32> =
            inside.split(',').map(|v| v.trim().trim_end_matches('f').parse().expect("a number")).collect();
        assert_eq!(back, example().table.friction.to_vec());
        assert!(text.contains("PAM_MINI_1_E[4][6]"));
    }

    #[test]
    fn a_matlab_file_is_made_of_whole_elements() {
        let bytes = matlab(&example());
        assert_eq!(&bytes[124..128], &[0, 1, b'I', b'M']);
        let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let (mut at, mut count) = (128, 0);
        while at < bytes.len() {
            assert_eq!(word(at), 14);
            at += 8 + word(at + 4) as usize;
            count += 1;
        }
        // Three arrays and nine numbers.
        assert_eq!((at, count), (bytes.len(), 3 + 9));
    }
}
