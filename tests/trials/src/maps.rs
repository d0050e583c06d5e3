//! Static force maps of two commercial muscles, fitted and predicted between lengths and between pressures, beside the form of M. Martens and
//! I. Boblan and the formula of another laboratory.

use crate::answer::run_limited;
use crate::martens::Form;
use pam_data::muscle_description::MuscleDescription;
use pam_evaluate::published::Published;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A map and what belongs to it.
struct Map {
    name: &'static str,
    file: &'static str,
    muscle: &'static str,
    /// The formula of the other laboratory.
    published: &'static str,
    /// Largest error as a share of the largest force that M. Martens and I. Boblan state of their model, %.
    stated: f64,
    /// Their coefficients of `E(L)` in Pa and m, the correction of the braid angle in degrees, and the nominal diameter, m.
    coefficients: ([f64; 4], f64, f64),
}

const MAPS: [Map; 2] = [
    Map {
        name: "DMSP-10-250",
        file: "dmsp10_250_force_map.csv",
        muscle: "dmsp10-250",
        published: "bolen-10mm",
        stated: 4.4,
        coefficients: ([74.085e6, -689.20e6, 1.837e9, -848.79e6], -0.1, 10e-3),
    },
    Map {
        name: "DMSP-20-300",
        file: "dmsp20_300_force_map.csv",
        muscle: "dmsp20-300",
        published: "bolen-20mm",
        stated: 2.35,
        coefficients: ([93.232e6, -715.29e6, 1.5483e9, -502.95e6], -0.073, 20e-3),
    },
];

/// Beginning of the page.
const INTRODUCTION: &str = "# Static force maps\n\nWritten by `cargo run --release -p trials -- maps -o DIR --page docs/src/force-maps.md`; nothing here is typed \
    by hand. M. Martens and I. Boblan measured the isometric force of two commercial muscles over pressure and length (Actuators 6 (2017) 33, doi \
    10.3390/act6040033, tables A1 and A2; erratum Actuators 7 (2018) 9). The maps are read second hand, from the comparison script of another \
    laboratory, in `../shared/data` (not part of the project).\n\nA map has no time and no direction. An import description with `[grid]` reads each \
    of its columns as a recording at one length ([File formats](formats.md)), and every command takes it:\n\n\
    ```sh\nhost fit --muscle dmsp10-250.toml --import force-map.toml dmsp10_250_force_map.csv -o dmsp10.pam\n\
    host evaluate --muscle dmsp10-250.toml --import force-map.toml --leave-out contractions dmsp10_250_force_map.csv\n```\n\n\
    `examples/muscles` and `examples/imports` hold both descriptions.\n";

/// Paragraph on the errors, and the header of the table.
const ERRORS: &str = "## Errors\n\nMean and largest |F − F_model| over the cells, in percent of the largest force of the map. \"Between\": each inner \
    length (or pressure) is predicted from the others. \"Ends\": the longest and the shortest length, or the lowest and the highest pressure, \
    which is an extrapolation.\n\n\
    | map | model | all cells fitted | between lengths | end lengths | between pressures | end pressures |\n| --- | --- | --- | --- | --- | --- | --- |\n";

/// Paragraph on the other models.
const OTHERS: &str = "\"Their form\" is the model of M. Martens and I. Boblan, `F = −P dV/dL + F_perimeter dD/dL − F_length` with a bladder whose modulus \
    `E(L)` is a cubic polynomial, fitted here in the same way: modulus and diameter by least squares. \"Their coefficients\" are those that the \
    comparison script quotes, at the nominal diameter, evaluated and not fitted; they do not reach the accuracy that the authors state for their own, \
    so either the script or its reading of the model differs from the paper. The \"laboratory's formula\" (Bolen, Elzein, Pang, Hunt) was fitted to \
    other muscles of this type.\n";

/// Mean and largest error, as shares of the largest force.
#[derive(Clone, Copy, Default)]
struct Errors {
    sum: f64,
    count: f64,
    largest: f64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.sum += error.abs();
        self.count += 1.0;
        self.largest = self.largest.max(error.abs());
    }

    fn cell(&self, force: f64) -> String {
        if self.count == 0.0 {
            return "–".into();
        }
        format!("{:.2} %, {:.1} %", 100.0 * self.sum / self.count / force, 100.0 * self.largest / force)
    }
}

/// A cell of a map: pressure (Pa), length (m), force (N).
type Cell = (f64, f64, f64);

/// The cells of a map, as the tool reads them.
fn cells(path: &Path) -> Result<Vec<Cell>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().ok_or("an empty map")?.split(',').collect();
    let length = |name: &str| -> Option<f64> {
        Some(1e-3 * name.strip_prefix("F_L")?.strip_suffix("mm_N")?.parse::<f64>().ok()?)
    };
    let mut all = Vec::new();
    for line in lines {
        let numbers: Vec<f64> = line.split(',').filter_map(|c| c.parse().ok()).collect();
        for (name, force) in header.iter().zip(&numbers).skip(1) {
            all.push((numbers[0], length(name).ok_or("a heading without a length")?, *force));
        }
    }
    Ok(all)
}

/// What is left out: rows whose column has this value.
struct Part {
    column: &'static str,
    value: String,
    end: bool,
}

/// The lengths and the pressures of a map, one after the other.
fn parts(cells: &[Cell]) -> [Vec<Part>; 2] {
    let distinct = |of: &dyn Fn(&Cell) -> f64| {
        let mut values: Vec<f64> = cells.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let parts = |column: &'static str, values: Vec<f64>| {
        let last = values.len().saturating_sub(1);
        let of = |(k, v): (usize, &f64)| Part { column, value: format!("{v}"), end: k == 0 || k == last };
        values.iter().enumerate().map(of).collect()
    };
    let lengths = distinct(&|c| (1e6 * c.1).round() * 1e-3);
    [parts("length_mm", lengths), parts("pressure_Pa", distinct(&|c| c.0))]
}

/// Where the tool's files are.
struct Tool<'a> {
    host: &'a Path,
    map: PathBuf,
    muscle: PathBuf,
    import: PathBuf,
    output: &'a Path,
}

impl Tool<'_> {
    fn call(&self, command: &str) -> Command {
        let mut c = Command::new(self.host);
        c.arg(command).arg("--quiet").arg("--import").arg(&self.import);
        c
    }

    /// Errors at the cells of a part, by a table fitted without it; `None`: all cells, fitted with all.
    fn errors(&self, part: Option<&Part>, into: &mut Errors) -> Result<(), String> {
        let (table, out) = (self.output.join("map.pam"), self.output.join("map.csv"));
        let mut fit = self.call("fit");
        fit.arg("--muscle").arg(&self.muscle).arg(&self.map).arg("--force").arg("-o").arg(&table);
        let mut predict = self.call("predict");
        predict.arg("--table").arg(&table).arg(&self.map).arg("-o").arg(&out);
        if let Some(p) = part {
            fit.arg("--where").arg(format!("{}!={}", p.column, p.value));
            if p.column == "length_mm" {
                predict.arg("--where").arg(format!("{}={}", p.column, p.value));
            }
        }
        run_limited(&mut fit, Duration::from_secs(300))?;
        run_limited(&mut predict, Duration::from_secs(300))?;
        let text = std::fs::read_to_string(&out).map_err(|e| e.to_string())?;
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let header: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
        let column = |name: &str| {
            header
                .iter()
                .position(|h| h.starts_with(name))
                .ok_or(format!("no column {name} in {}", header.join(",")))
        };
        let (measured, model) = (column("force_N")?, column("force_model_N")?);
        let pressure = column("pressure_")?;
        let scale = if header[pressure].ends_with("kPa") { 1e3 } else { 1.0 };
        for line in lines {
            let numbers: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect();
            let at = numbers.get(pressure).copied().unwrap_or(f64::NAN) * scale;
            let wanted = part.filter(|p| p.column == "pressure_Pa").and_then(|p| p.value.parse::<f64>().ok());
            if wanted.is_none_or(|w| (w - at).abs() < 1.0) {
                let (Some(f), Some(m)) = (numbers.get(measured), numbers.get(model)) else { continue };
                into.add(f - m);
            }
        }
        Ok(())
    }
}

/// Errors of a model that is fitted to cells: all, between and at the ends, of lengths and of pressures.
fn of_form(cells: &[Cell], parts: &[Vec<Part>; 2], rest: f64, nominal: f64) -> Option<[Errors; 5]> {
    let mut all = [Errors::default(); 5];
    let whole = Form::fit(cells, rest, nominal)?;
    cells.iter().for_each(|c| all[0].add(c.2 - whole.force(c.0, c.1)));
    for (k, group) in parts.iter().enumerate() {
        for part in group {
            let value: f64 = part.value.parse().ok()?;
            let inside = |c: &&Cell| {
                let at = if part.column == "length_mm" { 1e3 * c.1 } else { c.0 };
                (at - value).abs() < 1e-3
            };
            let others: Vec<Cell> = cells.iter().filter(|c| !inside(c)).copied().collect();
            let form = Form::fit(&others, rest, nominal)?;
            let errors = &mut all[1 + 2 * k + usize::from(part.end)];
            cells.iter().filter(inside).for_each(|c| errors.add(c.2 - form.force(c.0, c.1)));
        }
    }
    Some(all)
}

fn row(text: &mut String, map: &str, model: &str, errors: &[Errors], force: f64) {
    let cells: Vec<String> = errors.iter().map(|e| e.cell(force)).collect();
    let rest = "| – ".repeat(5 - cells.len());
    let _ = writeln!(text, "| {map} | {model} | {} {rest}|", cells.join(" | "));
}

/// Writes force-maps.md.
pub fn run(data: &Path, output: &Path, host: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(output)?;
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut text = format!("{INTRODUCTION}\n{ERRORS}");
    let mut stated = String::new();
    for map in &MAPS {
        let file = data.join("martens-boblan-tables").join(map.file);
        let cells = cells(&file)?;
        let parts = parts(&cells);
        let force = cells.iter().map(|c| c.2).fold(0.0, f64::max);
        let path = project.join(format!("examples/muscles/{}.toml", map.muscle));
        let muscle = MuscleDescription::read(&path)?;
        let tool = Tool {
            host,
            map: file,
            muscle: path,
            import: project.join("examples/imports/force-map.toml"),
            output,
        };
        let mut own = [Errors::default(); 5];
        tool.errors(None, &mut own[0])?;
        for (k, group) in parts.iter().enumerate() {
            for part in group {
                tool.errors(Some(part), &mut own[1 + 2 * k + usize::from(part.end)])?;
            }
        }
        row(&mut text, map.name, "this program", &own, force);
        let (coefficients, correction, nominal) = map.coefficients;
        if let Some(form) = of_form(&cells, &parts, muscle.rest_length(), nominal) {
            row(&mut text, map.name, "their form, fitted here", &form, force);
        }
        let quoted = Form::quoted(coefficients, correction, nominal, muscle.rest_length());
        let published = Published::by_name(map.published)?;
        let mut others = [Errors::default(); 2];
        for (pressure, length, measured) in &cells {
            others[0].add(measured - quoted.force(*pressure, *length));
            let contraction = 1.0 - length / muscle.rest_length();
            others[1].add(measured - published.force(&muscle, *pressure, contraction));
        }
        row(&mut text, map.name, "their coefficients, second hand", &others[..1], force);
        row(&mut text, map.name, "the laboratory's formula", &others[1..], force);
        let _ = writeln!(
            stated,
            "- {}: largest error below {} %, as the authors state of their model fitted to this map.",
            map.name, map.stated
        );
    }
    let _ = write!(text, "\n{OTHERS}\n{stated}");
    std::fs::write(output.join("force-maps.md"), &text)?;
    println!("{text}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_the_book_has_these_texts() {
        crate::book::contains("force-maps.md", &[INTRODUCTION, ERRORS, OTHERS]);
    }

    #[test]
    fn the_descriptions_of_the_maps_are_among_the_examples() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        for map in &MAPS {
            let path = project.join(format!("examples/muscles/{}.toml", map.muscle));
            assert!(MuscleDescription::read(path).is_ok(), "{}", map.name);
            assert!(Published::by_name(map.published).is_ok());
        }
        assert!(pam_data::recording::Import::read(project.join("examples/imports/force-map.toml")).is_ok());
    }
}
