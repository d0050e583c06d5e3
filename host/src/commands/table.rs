//! `host table`: show, check and export a table.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use crate::console::{Console, name};
use crate::documents::{table as document, text};
use pam_data::error::{Error, Result};
use pam_data::output::{printed, to_standard_output, write_whole};
use pam_data::pluralise::pluralise;
use pam_fit::error::FitCode;
use pam_fit::table_export::{self, Format};
use pam_fit::table_faults::table_faults;
use pam_fit::table_file::TableFile;

/// The forms of an exported table, as the command line names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormatName {
    /// As `host table show --json` prints it.
    Json,
    /// One line per pressure node.
    Csv,
    /// Constants for firmware in C or C++.
    C,
    /// MATLAB level 5 (`load` reads it, also Octave and SciPy).
    Matlab,
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Json => Self::Json,
            FormatName::Csv => Self::Csv,
            FormatName::C => Self::C,
            FormatName::Matlab => Self::Matlab,
        }
    }
}

/// Arguments of `host table`.
#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print a table.
    #[command(
        after_help = "Examples:\n  host table show mini.pam\n  host table show mini.pam --json | jq .pressures"
    )]
    Show(File),
    /// Check a table: its numbers, and the model's behaviour with them.
    #[command(
        after_help = "Example:\n  host table check mini.pam && host flash mini.pam --port /dev/ttyACM0"
    )]
    Check(File),
    /// Write a table for other programs: JSON, CSV, a C header, a MATLAB file.
    Export(Export),
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host table export mini.pam -o mini.h\n  host table export mini.pam --format csv -o -"
)]
struct Export {
    /// The table file.
    #[arg(value_name = "TABLE.pam")]
    table: PathBuf,
    /// Where to write it; `-` is standard output.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The form; by default what the output's name ends in.
    #[arg(long, value_enum)]
    format: Option<FormatName>,
    /// Print JSON on what was written.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct File {
    /// The table file.
    #[arg(value_name = "TABLE.pam")]
    table: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    /// A file that cannot be read or is not a valid table.
    pub fn run(self, console: &Console) -> Result<()> {
        match self.action {
            Action::Show(file) => {
                let table = TableFile::read(&file.table)?;
                console.result(if file.json { text(&to_document(&table))? } else { to_text(&table) });
            }
            Action::Check(file) => {
                let table = TableFile::read(&file.table)?;
                let remarks = remarks(&table);
                let faults = table_faults(&table.table, table.about.uncertainty.as_ref(), &table.about.fit);
                let valid = faults.is_empty();
                let refused = Error::new(FitCode::FitImplausible, "the table is useless for control")
                    .file(&file.table)
                    .help("fit it again from better recordings or with other dimensions");
                if file.json {
                    let check = document::Check { schema: "pam-check/1", valid, remarks, faults };
                    console.result(text(&check)?);
                } else {
                    let verdict = if valid { "valid" } else { "not usable" };
                    console.result(format!("{}: {verdict}", file.table.display()));
                    for fault in faults {
                        console.result(format!("  fault: {fault}"));
                    }
                    for remark in remarks {
                        console.result(format!("  note: {remark}"));
                    }
                }
                return if valid { Ok(()) } else { Err(refused) };
            }
            Action::Export(export) => {
                to_standard_output(&[("-o", Some(&export.output)), ("--json", printed(export.json))])
                    .map_err(|e| e.help("`--format json -o -` gives the table as JSON"))?;
                let table = TableFile::read(&export.table)?;
                let format = match export.format {
                    Some(format) => format.into(),
                    None => Format::of(&export.output)?,
                };
                let bytes = match format {
                    Format::Json => (text(&to_document(&table))? + "\n").into_bytes(),
                    Format::Csv => table_export::csv(&table).into_bytes(),
                    Format::C => table_export::c_header(&table).into_bytes(),
                    Format::Matlab => table_export::matlab(&table),
                };
                write_whole(&export.output, &bytes)?;
                if export.json {
                    let (table, output) =
                        (export.table.display().to_string(), export.output.display().to_string());
                    let bytes = bytes.len();
                    console.result(text(&document::Export { schema: "pam-export/1", table, output, bytes })?);
                }
            }
        }
        Ok(())
    }
}

/// Properties of a valid table that limit its use.
fn remarks(file: &TableFile) -> Vec<String> {
    let mut remarks = Vec::new();
    let table = &file.table;
    if table.nodes.len() == 1 {
        remarks.push("one pressure only: forces at other pressures are not identifiable".to_owned());
    }
    if table.friction.iter().all(|k| *k == 0.0) {
        remarks.push("no friction: the recordings have no hysteresis, or one direction only".to_owned());
    }
    remarks
}

fn to_document(file: &TableFile) -> document::TableDocument<'_> {
    let (t, a) = (&file.table, &file.about);
    let g = &t.geometry;
    document::TableDocument {
        schema: "pam-table/1",
        muscle: &a.muscle,
        date: &a.date,
        tool: &a.tool,
        kind: match t.kind {
            model_core::table::Kind::Contractile => "contractile",
            model_core::table::Kind::Push => "push",
        },
        rest_length_mm: g.rest_length.millimetres(),
        braid_angle_deg: g.braid_angle.degrees(),
        bladder_outer_diameter_mm: g.outer_diameter.millimetres(),
        bladder_wall_mm: g.wall.millimetres(),
        tip_correction: g.tip_correction,
        order: t.order(),
        deadband_kPa: t.deadband.kilopascals(),
        goes_slack: t.goes_slack,
        blocked_force_N: t.blocked_force.newtons(),
        max_pressure_kPa: t.max_pressure.kilopascals(),
        tested: document::Tested {
            pressure_kPa: [t.tested.pressure_low.kilopascals(), t.tested.pressure_high.kilopascals()],
            contraction: [t.tested.contraction_low, t.tested.contraction_high],
        },
        pressures: (0..t.nodes.len()).map(|i| node(file, i)).collect(),
        effects: t.effects.iter().map(effect).collect(),
        corrections: a
            .corrections
            .iter()
            .map(|c| document::Correction { effect: &c.effect, parameters: &c.parameters })
            .collect(),
        fit: document::Fit {
            samples: a.fit.samples,
            rms_N: a.fit.rms_newtons,
            mean_error_pct: a.fit.mean_error_percent,
            max_error_pct: a.fit.max_error_percent,
            left_out_pressure_mean_error_pct: a.fit.left_out_percent,
            warnings: &a.fit.warnings,
        },
        sources: a
            .sources
            .iter()
            .map(|s| document::Source { path: &s.path, sha256: &s.sha256, samples: s.samples })
            .collect(),
    }
}

fn node(file: &TableFile, i: usize) -> document::Node {
    let t = &file.table;
    document::Node {
        pressure_kPa: t.nodes[i] / 1e3,
        E_MPa: t.elastic.iter().map(|c| c[i] / 1e6).collect(),
        k_F: t.friction[i],
    }
}

fn effect(e: &model_core::effects::FittedEffect) -> document::Effect {
    let info = e.effect.info();
    let values = info.parameters.iter().zip(&e.parameters);
    document::Effect {
        effect: info.name,
        parameters: values
            .map(|(p, v)| document::Parameter { name: p.name, value: *v, unit: p.unit })
            .collect(),
    }
}

fn to_text(file: &TableFile) -> String {
    let (t, a) = (&file.table, &file.about);
    let mut text = format!(
        "{}  ({:?}, made {} by {})\n\
         L0 {:.2} mm, braid {:.2}° from the radial plane, bladder {:.2} mm, wall {:.2} mm{}\n\
         P0 {:.1} kPa, blocked force {:.1} N, at most {:.0} kPa\n\
         tested {:.0} to {:.0} kPa, contraction {:.4} to {:.4}\n",
        name(&a.muscle),
        t.kind,
        name(&a.date),
        name(&a.tool),
        t.geometry.rest_length.millimetres(),
        t.geometry.braid_angle.degrees(),
        t.geometry.outer_diameter.millimetres(),
        t.geometry.wall.millimetres(),
        if t.geometry.tip_correction { ", tip correction" } else { "" },
        t.deadband.kilopascals(),
        t.blocked_force.newtons(),
        t.max_pressure.kilopascals(),
        t.tested.pressure_low.kilopascals(),
        t.tested.pressure_high.kilopascals(),
        t.tested.contraction_low,
        t.tested.contraction_high,
    );
    text += "\n   P kPa";
    for k in 1..=t.order() {
        text += &format!("   E_{k} MPa");
    }
    text += "      k_F\n";
    for i in 0..t.nodes.len() {
        text += &format!("{:8.1}", t.nodes[i] / 1e3);
        for curve in &t.elastic {
            text += &format!("{:10.4}", curve[i] / 1e6);
        }
        text += &format!("{:9.4}\n", t.friction[i]);
    }
    for e in &t.effects {
        let info = e.effect.info();
        let parameters: Vec<String> = info
            .parameters
            .iter()
            .zip(&e.parameters)
            .map(|(p, v)| format!("{} = {v} {}", p.name, p.unit))
            .collect();
        text += &format!("effect {}: {}\n", info.name, parameters.join(", "));
    }
    for c in &a.corrections {
        text += &format!("correction of the bench {}: {:?}\n", name(&c.effect), c.parameters);
    }
    text += &format!(
        "\n{} samples, rms {:.3} N, error {:.3} % mean, {:.3} % largest, of blocked force",
        a.fit.samples, a.fit.rms_newtons, a.fit.mean_error_percent, a.fit.max_error_percent
    );
    if let Some(left_out) = a.fit.left_out_percent {
        text += &format!("; {left_out:.3} % mean at held-out pressures");
    }
    for s in &a.sources {
        text += &format!(
            "\nfrom {} ({}, sha256 {})",
            name(&s.path),
            pluralise(s.samples, "row"),
            s.sha256.get(..16).unwrap_or("")
        );
    }
    for w in &a.fit.warnings {
        text += &format!("\nwarning: {}", name(w));
    }
    text
}
