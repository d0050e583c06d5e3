//! Adding an effect takes its file and one line of a list: here both are outside the catalogue. From the file alone, the diagnosis finds the
//! effect, fits its shape and says what would show it, and a comparison with a reference names a change of it.

mod gain_fade;
mod stroke_ripple;

use super::*;
use crate::candidates::Law;
use crate::reference::shapes::{Change, Class, Owner};

model_core::effect_list! {
    /// Effects beyond the catalogue.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    AddedName:
    /// The gain of the load cell falls.
    GainFade = gain_fade;
    /// The stroke changes the force periodically.
    StrokeRipple = stroke_ripple;
}

fn diagnosed(campaign: &Campaign) -> Diagnosis {
    let added = vec![Law::Added(AddedName::StrokeRipple)];
    let options = Options { muscle: "test".into(), added, ..Options::default() };
    diagnose(campaign, &geometry(), &options).expect("an answer")
}

#[test]
fn an_effect_of_one_file_and_one_line_is_considered_and_found() {
    let plain = recorded(loops(&[0.2]), 5, coloured(0.1, 2.0), |_, _, _| 0.0);
    let without = diagnosed(&plain);
    assert_eq!(names(&without), [""; 0], "nothing is there");
    let considered = without.considered.iter().find(|c| c.effect == "stroke-ripple").expect("considered");
    assert!(considered.hidden_up_to_N.is_some_and(|h| h < 5.0), "{considered:?}");
    // 3 N over a period of 4 mm, by a formula of its own.
    let mut rippled = plain;
    for r in &mut rippled.recordings {
        let Recording { stroke, force: Some(force), .. } = r else { continue };
        for (force, x) in force.iter_mut().zip(stroke.iter()) {
            *force += 3.0 * (std::f64::consts::TAU * x / 4.0e-3).sin();
        }
    }
    assert!(!names(&ask(&rippled)).contains(&"stroke-ripple"), "the catalogue does not have it");
    let with = diagnosed(&rippled);
    assert_eq!(names(&with).first(), Some(&"stroke-ripple"), "{:?}", with.missing);
    let [size, period] = [0, 1].map(|i| with.missing[0].parameters[i].value);
    assert!((size - 3.0).abs() < 0.3 && (period - 4.0e-3).abs() < 1e-4, "{size} N over {period} m");
}

#[test]
fn the_change_of_an_effect_is_described_in_its_file() {
    let about = Change::Added(AddedName::StrokeRipple).about();
    assert_eq!(about.name, "stroke-ripple");
    assert_eq!(about.changed.class, Class::Alone("stroke-ripple"));
    assert_eq!((about.changed.owner, about.changed.remembers), (Owner::Rig, false));
}

/// An effect is defined in its file: no other production code of the diagnosis knows one by its name, and no comparison by its variant.
#[test]
fn no_effect_is_known_by_its_name() {
    let mut folders = vec![std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() && !path.ends_with("tests") {
                folders.push(path);
            } else if path.is_file() && !path.ends_with("tests.rs") {
                let text = std::fs::read_to_string(&path).expect("a source file");
                let production = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
                let compares =
                    path.components().any(|c| c.as_os_str() == "reference") || path.ends_with("health.rs");
                let named = |law: &pam_fit::bench::Candidate| {
                    let variant = format!("{law:?}");
                    let variant = variant.trim_end_matches(')').rsplit('(').next().unwrap_or_default();
                    production.contains(&format!("\"{}\"", law.name()))
                        || compares && production.contains(&format!("Name::{variant}"))
                };
                found
                    .extend(pam_fit::bench::Candidate::all().filter(named).map(|l| (path.clone(), l.name())));
            }
        }
    }
    assert!(found.is_empty(), "{found:?}");
}
