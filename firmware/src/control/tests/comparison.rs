//! When the load cell is compared with the table.

use model_core::effects::{EffectName, FittedEffect};
use model_core::link::messages::HealthSums;

use super::tracking::frictionless;
use super::*;
use crate::health::{BLOCK_TICKS, SAMPLE_TICKS};

/// Pressure at which the table's force is large enough to be compared, Pa.
const STANDS_PA: f32 = 300e3;

/// Blocks of the comparison of each muscle after three blocks of time, both under pressure whatever is commanded.
fn blocks(fitted: bool, prepare: impl FnOnce(&mut Controller)) -> [u32; 2] {
    let mut bench = Bench::new(|settings| {
        settings.watch.follow_pa = 1e6;
        settings.force.fitted = fitted;
    });
    for side in Side::ALL {
        assert_eq!(bench.controller.use_table(side, &frictionless()), Ok(()));
    }
    bench.pass(10);
    prepare(&mut bench.controller);
    let state = bench.controller.state();
    bench.pass_with(3 * u32::from(BLOCK_TICKS), |now, inputs| {
        now.pressure_pa += STANDS_PA - now.pressure_pa.round();
        inputs.sides[1] = Some((*now).into());
    });
    assert_eq!(bench.controller.state(), state, "{:?}", bench.latched());
    Side::ALL.map(|side| {
        let mut sums = HealthSums::default();
        bench.controller.health(side).describe(&mut sums);
        sums.blocks
    })
}

fn runs(mode: Mode) -> impl FnOnce(&mut Controller) {
    move |controller| {
        assert_eq!(controller.arm(OWNER), Ok(()));
        assert_eq!(controller.start(mode, OWNER), Ok(()));
    }
}

#[test]
fn a_load_cell_is_compared_only_on_the_muscles_of_a_mode_that_controls() {
    let none = [0; 2];
    let [compared, other] = blocks(true, runs(Mode::Pressure));
    assert!((2..=3).contains(&compared) && other == 0, "{compared} {other}");
    let [first, second] = blocks(true, runs(Mode::Pair));
    assert_eq!((first, second), (compared, compared), "both muscles of a joint");
    assert_eq!(blocks(true, |_| ()), none, "disarmed");
    assert_eq!(blocks(true, |controller| assert_eq!(controller.arm(OWNER), Ok(()))), none, "armed");
    assert_eq!(blocks(true, runs(Mode::Vent)), none, "venting");
    assert_eq!(blocks(false, runs(Mode::Pressure)), none, "without a load cell");
}

#[test]
fn a_block_is_the_mean_of_one_sample_every_sixteen_ticks() {
    let mut bench = Bench::new(|settings| settings.watch.follow_pa = 1e6);
    assert_eq!(bench.controller.use_table(Side::Agonist, &frictionless()), Ok(()));
    runs(Mode::Pressure)(&mut bench.controller);
    bench.pass_with(2 * u32::from(BLOCK_TICKS), |now, _| {
        now.pressure_pa += STANDS_PA - now.pressure_pa.round()
    });
    let mut sums = HealthSums::default();
    bench.controller.health(Side::Agonist).describe(&mut sums);
    assert_eq!((sums.blocks, SAMPLE_TICKS), (1, 16));
    // The first column is one in every sample.
    assert_eq!((sums.sums[0], sums.weight), (1.0, 1.0));
}

/// A false reading of a stroke or of a pressure, for some ticks, in a device that is disarmed.
#[test]
fn no_effect_remembers_a_reading_that_cannot_be_true() {
    let mut table = model_core::table::example();
    let mullins = FittedEffect::new(EffectName::MullinsSoftening, &[0.4, 0.02, 0.1]);
    table.effects.push(mullins).expect("room");
    let remembered = |bench: &Bench| {
        let model = bench.controller.model(Side::Agonist).expect("a table");
        model.chain.memories().next().expect("an effect").1[0]
    };
    let after = |ticks: u32, stroke_m: f32| {
        let mut bench = Bench::new(|_| ());
        assert_eq!(bench.controller.use_table(Side::Agonist, &table), Ok(()));
        bench.pass(200);
        let before = remembered(&bench);
        bench.pass_with(ticks, |now, _| now.stroke_m = stroke_m + 1e-7 * now.stroke_m);
        bench.pass(200);
        (before, remembered(&bench))
    };
    for ticks in [1, 2, 5, 18] {
        // Beyond what a sensor delivers, and a jump within it.
        for false_m in [0.3, 0.0528, -0.015, f32::NAN] {
            let (before, after) = after(ticks, false_m);
            assert_eq!(before, after, "{false_m} m for {ticks} ticks");
        }
    }
    let (before, after) = after(500, 3e-3);
    assert!(after > before, "a contraction is remembered: {before}, then {after}");
}
