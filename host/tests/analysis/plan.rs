//! `host plan`: protocols for people, best first, whose recordings continue the plan.

#![allow(clippy::unwrap_used, reason = "what fails here fails the test")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::presets;
use virtual_bench::recording::Columns;

fn host(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_host"))
        .args(arguments)
        .current_dir(folder)
        .env("XDG_CONFIG_HOME", folder)
        .env_remove("PAM_SETTINGS")
        .output()
        .unwrap()
}

fn plan(folder: &Path, arguments: &[&str]) -> Value {
    let call: Vec<&str> =
        ["plan", "--muscle", "m.toml", "--json", "-"].iter().chain(arguments).copied().collect();
    let output = host(folder, &call);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Records the protocols of a plan in their order, on one bench whose clock continues.
fn record(folder: &Path, plan: &Path, bench: &mut Bench, made: &mut Vec<String>) {
    let mut protocols: Vec<PathBuf> = std::fs::read_dir(folder.join(plan))
        .unwrap()
        .map(|f| f.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .collect();
    protocols.sort();
    for path in protocols {
        let text = std::fs::read_to_string(&path).unwrap();
        let protocol = pam_diagnose::protocol_simulation::parse(&text).unwrap();
        for file in bench.run(&protocol).unwrap() {
            let name = format!("{:02}_{}.csv", made.len(), file.name);
            std::fs::write(folder.join(&name), file.csv(Columns::default())).unwrap();
            made.push(name);
        }
    }
}

#[test]
fn a_plan_without_recordings_begins_with_the_first_steps_and_continues_with_theirs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let spec = BenchSpec::laboratory(presets::miniature(), 1);
    std::fs::write(folder.join("m.toml"), spec.muscle.description()).unwrap();
    let first = plan(folder, &["--steps", "3", "-o", "first"]);
    let names = |plan: &Value| -> Vec<String> {
        plan["steps"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(names(&first), ["tare", "blocked_ramp", "survey"]);
    let page = std::fs::read_to_string(folder.join("first/plan.md")).unwrap();
    assert!(page.contains("Start the recording.") && page.contains("01_tare.toml"), "{page}");

    let mut bench = Bench::new(&spec);
    let mut made = Vec::new();
    record(folder, Path::new("first"), &mut bench, &mut made);
    let recordings: Vec<&str> = made.iter().map(String::as_str).collect();
    let arguments = [recordings.as_slice(), &["--steps", "3", "-o", "second"]].concat();
    let second = plan(folder, &arguments);
    let again = plan(folder, &arguments);
    assert_eq!(second, again, "the same data give the same plan");
    let steps = second["steps"].as_array().unwrap();
    assert!((1..=4).contains(&steps.len()), "{second:#}");
    for step in steps {
        let why = step["why"].as_str().unwrap();
        assert!(why.ends_with('.') && why.matches(". ").count() == 0, "one sentence: {why}");
    }
    // Each step has the most information per second after those before it, so the rate falls.
    let rates: Vec<f64> = steps
        .iter()
        .map(|s| {
            let nats: f64 =
                ["table_nats", "effect_nats", "unseen_nats"].iter().map(|n| s[n].as_f64().unwrap()).sum();
            nats / s["seconds"].as_f64().unwrap()
        })
        .collect();
    assert!(rates[0] > 0.0 && rates[0] >= rates[rates.len() - 1], "{rates:?}");
    let before = second["predicted_error_N"].as_f64().unwrap();
    record(folder, Path::new("second"), &mut bench, &mut made);
    let recordings: Vec<&str> = made.iter().map(String::as_str).collect();
    let third = plan(folder, &recordings);
    let after = third["predicted_error_N"].as_f64().unwrap();
    assert!(after < before, "the recorded plan makes the table more certain: {before} to {after} N");
}

#[test]
fn a_plan_is_the_choice_of_the_campaign() {
    use pam_campaign::engine::{Decision, Engine, Purpose};
    use pam_campaign::{bench::VirtualBench, campaign::simulate, rig::Rig};
    use pam_data::muscle_description::MuscleDescription;
    let spec = BenchSpec::laboratory(presets::miniature(), 2);
    let muscle = MuscleDescription::parse(&spec.muscle.description()).unwrap();
    let mut engine = Engine::new(muscle.clone(), Rig::commanded(), Purpose::Fit, 150.0).unwrap();
    simulate(&mut engine, &mut VirtualBench::new(&spec), None).unwrap();
    let mut more = Engine::new(muscle.clone(), Rig::commanded(), Purpose::Fit, 1e4).unwrap();
    for (step, recording) in engine.steps().iter().zip(engine.recordings()) {
        more.add(*step, Some(recording.clone()));
    }
    more.fit();
    let Decision::Step(chosen) = more.next(150.0).unwrap() else { panic!("more is to be learnt") };
    let planned = more.plan(1, 1e4);
    assert_eq!(planned.steps[0].step, chosen.step);
    let from_files = Engine::of_recordings(
        muscle,
        Rig::commanded(),
        Purpose::Fit,
        engine.recordings().to_vec(),
        Vec::new(),
    );
    assert!(!from_files.unwrap().plan(2, 1e4).steps.is_empty());
}

/// The free stroke is unknown before the muscle has moved. A recording at a length at which it hangs slack does not count, and the next
/// length is longer.
#[test]
fn lengths_set_by_hand_come_back_from_where_the_muscle_hangs_slack() {
    use pam_campaign::engine::{Engine, Purpose};
    use pam_campaign::{bench::VirtualBench, campaign::simulate, rig::Rig, step::Step, watch::Spoiled};
    use pam_data::muscle_description::MuscleDescription;
    let spec = BenchSpec::laboratory(presets::miniature(), 2);
    let muscle = MuscleDescription::parse(&spec.muscle.description()).unwrap();
    // 30 % of what the rig allows is more than this muscle's free stroke of about 3 mm.
    let rig = Rig::parse("axis = 'prompt'\nstroke_max_mm = 12.0\n").unwrap();
    let mut engine = Engine::new(muscle, rig, Purpose::Fit, 900.0).unwrap();
    let steps = simulate(&mut engine, &mut VirtualBench::new(&spec), None).unwrap();
    let slack = steps.iter().filter(|d| d.spoiled.contains(&Spoiled::Slack)).count();
    assert!(slack >= 1, "the first length is too short: {steps:#?}");
    let held: Vec<(f64, f64)> = engine
        .steps()
        .iter()
        .zip(engine.recordings())
        .filter(|(step, _)| matches!(step, Step::Staircase { part, .. } if *part > 0.0))
        .map(|(_, r)| {
            let largest = r.force.iter().flatten().copied().fold(0.0, f64::max);
            (r.stroke.iter().copied().fold(0.0, f64::max), largest)
        })
        .collect();
    let blocked = engine.places().blocked;
    assert!(held.len() >= 2, "{held:?}");
    assert!(
        held.iter().all(|(x, f)| *x > 2e-4 && *f > 0.05 * blocked),
        "each length pulls: {held:?}, {blocked}"
    );
    let free = engine.places().free;
    assert!((2e-3..4e-3).contains(&free), "free stroke {free} m");
    assert!(engine.findings().is_some());
}

#[test]
fn a_folder_with_other_files_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("m.toml"), presets::miniature().description()).unwrap();
    std::fs::create_dir(folder.join("mine")).unwrap();
    std::fs::write(folder.join("mine/01_precious.toml"), "x").unwrap();
    let output = host(folder, &["plan", "--muscle", "m.toml", "-o", "mine"]);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(folder.join("mine/01_precious.toml").exists());
}
