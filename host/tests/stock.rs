//! Muscles of one stock on the virtual bench: of different lengths, with ends as the bench makes them, and through the command line.

#![allow(clippy::unwrap_used)] // what fails here fails the test

mod bench_campaign;

use std::path::Path;
use std::process::Command;

use bench_campaign::{description, recordings};
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_diagnose::stock::diagnose_stock;
use pam_fit::stock::{Law, Member};
use published_schemas::Schemas;
use serde_json::Value;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::campaigns;
use virtual_bench::muscle::{Muscle, MuscleSpec};
use virtual_bench::presets;
use virtual_bench::recording::Columns;

/// Rest lengths, mm: from five diameters to twenty.
const LENGTHS: [f64; 4] = [80.0, 110.0, 170.0, 320.0];

/// The bench's contractile muscle with another length; its bladder, its braid and its ends are the same.
fn spec(length_mm: f64, ends: f64) -> MuscleSpec {
    let mut spec = presets::contractile();
    let ratio = length_mm * 1e-3 / spec.geometry.rest_length;
    spec.name = format!("stock-{length_mm}");
    spec.geometry.rest_length *= ratio;
    for (_, travel) in &mut spec.friction.bristles {
        *travel *= ratio;
    }
    spec.shape.ends = ends;
    spec
}

/// Staircases of pressure at three held lengths, without noise that no laboratory has.
fn files(spec: &MuscleSpec, seed: u64) -> Vec<virtual_bench::recording::Recording> {
    let muscle = Muscle::new(spec.clone());
    let mut protocol = campaigns::staircase(&muscle, &[600e3]);
    protocol.sample_hz = 5.0;
    Bench::new(&BenchSpec::laboratory(spec.clone(), seed)).run(&protocol).unwrap()
}

fn stock(ends: f64) -> Vec<(MuscleDescription, Campaign)> {
    let of = |(k, length): (usize, &f64)| {
        let spec = spec(*length, ends);
        let mut all = recordings(&files(&spec, 31 + k as u64));
        // As on a bench without a displacement sensor.
        for r in &mut all {
            let middle = r.stroke[r.len() / 2];
            r.stroke.fill(middle);
        }
        (description(&spec), Campaign::new(all))
    };
    LENGTHS.iter().enumerate().map(of).collect()
}

fn members(stock: &[(MuscleDescription, Campaign)]) -> Vec<Member<'_>> {
    stock.iter().map(|(muscle, campaign)| Member { muscle, campaign }).collect()
}

#[test]
fn the_ends_of_the_bench_are_named_and_a_cylinder_has_none() {
    let with = stock(1.0);
    let found = diagnose_stock(&members(&with)).unwrap();
    let (law, size, t) = found.named.unwrap_or_else(|| panic!("{:#?}", found.considered));
    assert_eq!(law.effect(), "tip-effect", "{:#?}", found.considered);
    assert!(size.low > 0.0 && t > 4.3, "{size:?}");
    let without = stock(0.0);
    let found = diagnose_stock(&members(&without)).unwrap();
    assert!(found.named.is_none(), "{:?} {:#?}", found.named, found.considered);
    let ends = found.considered.iter().find(|c| c.law == Some(Law::Ends)).unwrap();
    assert!(ends.parameter.unwrap().low < 0.5e-3, "{ends:?}");
}

fn host(folder: &Path, arguments: &[String]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_command_takes_each_muscle_with_its_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut call: Vec<String> = vec!["diagnose".into()];
    for (k, length) in LENGTHS.iter().enumerate() {
        let spec = spec(*length, 1.0);
        std::fs::write(folder.join(format!("{k}.toml")), spec.description()).unwrap();
        call.extend(["--muscle".into(), format!("{k}.toml")]);
        for file in files(&spec, 31 + k as u64) {
            let name = format!("{k}-{}.csv", file.name);
            std::fs::write(folder.join(&name), file.csv(Columns::default())).unwrap();
            call.push(name);
        }
    }
    let with =
        |more: &[&str]| call.iter().cloned().chain(more.iter().map(|m| (*m).to_owned())).collect::<Vec<_>>();
    let (code, out, told) = host(folder, &with(&["--json", "-", "--report", "stock.html"]));
    assert_eq!(code, 0, "{told}");
    let document: Value = serde_json::from_str(&out).unwrap();
    let errors = Schemas::read().unwrap().check(&document).unwrap();
    assert!(errors.is_empty(), "{errors:#?}");
    assert_eq!(document["muscles"].as_array().unwrap().len(), LENGTHS.len());
    let page = std::fs::read_to_string(folder.join("stock.html")).unwrap();
    assert!(page.contains("Blocked force and rest length") && page.contains("<svg"), "{}", page.len());
    // What belongs to one muscle is refused, and so are two muscles.
    let (code, _, told) = host(folder, &with(&["-o", "x.pam"]));
    assert!(code == 2 && told.contains("several muscles"), "{told}");
    let second = call.iter().skip(1).position(|w| w == "--muscle").unwrap();
    let third = call.iter().enumerate().filter(|(_, w)| *w == "--muscle").nth(2).unwrap().0;
    assert!(second < third);
    let (code, _, told) = host(folder, &call[..third]);
    assert!(code == 1 && told.contains("three muscles"), "{code} {told}");
}

/// The muscles of a real set, where it is present.
fn real(year: &str, names: &[&str]) -> Option<Vec<(MuscleDescription, Campaign)>> {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let file = project.join(format!("../shared/data/aarl-festo-10mm-{year}/settled_points.csv"));
    if !file.exists() {
        eprintln!("skipped: {} is not here", file.display());
        return None;
    }
    let import = pam_data::recording::Import::read(
        project.join(format!("examples/imports/festo-{year}-settled.toml")),
    )
    .unwrap();
    let of = |name: &&str| {
        let path = project.join(format!("examples/muscles/festo10-{year}-{name}.toml"));
        let muscle = MuscleDescription::read(path).unwrap();
        let campaign =
            pam_data::recording::Reader::of(&muscle).import(Some(&import)).campaign([&file]).unwrap();
        (muscle, campaign)
    };
    Some(names.iter().map(of).collect())
}

/// The blocked force of these muscles grows with their length. By the slopes of the force over pressure alone, 18.7 ± 3.1 and 16.9 ± 2.7 mm of them
/// do not pull (festo.md).
#[test]
fn ends_of_real_muscles_come_out_of_both_sets() {
    let sets: [(&str, &[&str]); 2] = [
        ("2022", &["83mm", "132mm", "182mm", "233mm", "281mm", "382mm"]),
        ("2021", &["13cm", "23cm", "27cm", "29cm", "30cm"]),
    ];
    for (year, names) in sets {
        let Some(stock) = real(year, names) else { return };
        let found = diagnose_stock(&members(&stock)).unwrap();
        let (law, size, t) = found.named.unwrap_or_else(|| panic!("{year}: {:#?}", found.considered));
        assert_eq!(law, Law::Ends, "{year}: {:#?}", found.considered);
        assert!((14e-3..27e-3).contains(&size.value) && t > 3.0, "{year}: {size:?}, t {t}");
    }
}
