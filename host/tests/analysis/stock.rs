//! Muscles of one stock: two sets of real recordings, where they are present.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::Path;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::Campaign;
use pam_diagnose::stock::diagnose_stock;
use pam_fit::stock::{Law, Member};

fn members(stock: &[(MuscleDescription, Campaign)]) -> Vec<Member<'_>> {
    stock.iter().map(|(muscle, campaign)| Member { muscle, campaign }).collect()
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
fn ends_and_mounted_lengths_of_real_muscles_come_out_of_both_sets() {
    let sets: [(&str, &[&str]); 2] = [
        ("2022", &["83mm", "132mm", "182mm", "233mm", "281mm", "382mm"]),
        ("2021", &["13cm", "23cm", "27cm", "29cm", "30cm"]),
    ];
    for (year, names) in sets {
        let Some(stock) = real(year, names) else { return };
        let found = diagnose_stock(&members(&stock)).unwrap();
        let ends = found.considered.iter().find(|c| c.law == Some(Law::Ends)).unwrap();
        let size = ends.parameter.unwrap();
        let t = size.value / size.std;
        assert!((14e-3..27e-3).contains(&size.value) && t > 2.5, "{year}: {size:?}, t {t}");
        assert!(ends.error < found.considered[0].error, "{year}: {:#?}", found.considered);
        // Six lengths suffice to name it; five, of which one alone is short, do not quite.
        let named = found.named.map(|n| n.0);
        assert_eq!(named, (year == "2022").then_some(Law::Ends), "{year}: {:#?}", found.considered);
        // The lengths were set by tape measure, to within a millimetre.
        let lengths = found.mounted_lengths.unwrap();
        assert!(lengths.named() && (0.7e-3..1.6e-3).contains(&lengths.size.value), "{year}: {lengths:#?}");
        for own in lengths.muscles.iter().flatten() {
            assert!(own.with_length < 0.65 * own.before, "{year}: {own:?}");
        }
    }
}
