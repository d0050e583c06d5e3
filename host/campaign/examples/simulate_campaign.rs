//! Simulates a campaign on the virtual bench and prints its steps: `cargo run --release -p pam-campaign --example simulate_campaign --
//! MUSCLE MINUTES`.

use pam_campaign::bench::VirtualBench;
use pam_campaign::campaign::simulate;
use pam_campaign::engine::{Engine, Purpose};
use pam_campaign::rig::Rig;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use virtual_bench::bench::BenchSpec;
use virtual_bench::presets;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "mini".into());
    let minutes: f64 = arguments.next().and_then(|m| m.parse().ok()).unwrap_or(10.0);
    let muscle = presets::by_name(&name)
        .ok_or_else(|| Error::new(DataCode::CallInvalid, "the bench has no such muscle"))?;
    let spec = BenchSpec::laboratory(muscle, 1);
    let description = MuscleDescription::parse(&spec.muscle.description())?;
    let mut engine = Engine::new(description, Rig::commanded(), Purpose::Both, 60.0 * minutes)?;
    for done in simulate(&mut engine, &mut VirtualBench::new(&spec), None)? {
        let c = &done.chosen;
        println!(
            "{:3} {:5.0}-{:5.0} s  {:28} {:5} rows  table {:.3} effect {:.3} unseen {:.3} nats, chosen in {:.2} s {:?}\n      {} {}",
            c.number,
            done.clock_s.0,
            done.clock_s.1,
            c.step.name(),
            done.rows,
            c.table_nats,
            c.effect_nats,
            c.unseen_nats,
            c.choosing_s,
            done.spoiled,
            c.why,
            done.finding,
        );
    }
    Ok(())
}
