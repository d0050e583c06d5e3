//! What the program makes of recordings: one test program, as each one costs a link of the whole host.

#[path = "../bench_campaign/mod.rs"]
mod bench_campaign;

mod checks;
mod diagnose_odd_recordings;
mod effects_against_bench;
mod fit_bench;
mod fit_invariance;
mod fit_odd_recordings;
mod held_lengths;
mod history;
mod hostile;
mod import;
mod outputs;
mod plan;
mod real_recordings;
mod reference;
mod stock;
mod updated_table;
mod wrong_description;
