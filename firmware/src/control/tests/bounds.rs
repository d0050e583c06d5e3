//! The highest pressure that is commanded: the lowest of what settings, table and board allow, as soon as one of them changes.

use model_core::table;
use model_core::units::Pressure;

use super::*;

/// The highest command of the first sixty ticks in which 600 kPa are demanded, before the muscle has followed.
fn highest(bench: &mut Bench) -> f32 {
    bench.pass(10);
    assert_eq!(bench.controller.arm(OWNER), Ok(()));
    assert_eq!(bench.controller.start(Mode::Pressure, OWNER), Ok(()));
    assert_eq!(bench.controller.set_point(to_pressure(600e3)), Ok(()));
    let mut most = 0.0_f32;
    for _ in 0..60 {
        bench.pass(1);
        most = most.max(bench.last.sides[0].pressure_pa);
    }
    assert_eq!((bench.latched(), bench.controller.disarm()), (None, Ok(())));
    bench.pass(1_000);
    most
}

#[test]
fn the_table_the_settings_and_the_board_each_limit_the_command() {
    let table =
        |kpa| table::MuscleTable { max_pressure: Pressure::from_kilopascals(kpa), ..table::example() };
    let mut bench = Bench::new(|settings| settings.regulator.lead = 0.0);
    let close = |found: f32, wanted: f32| assert!((found - wanted).abs() < 1e3, "{found} Pa, not {wanted}");
    close(highest(&mut bench), 600e3);
    assert_eq!(bench.controller.use_table(Side::Agonist, &table(300.0)), Ok(()));
    close(highest(&mut bench), 300e3);
    bench.controller.forget_table(Side::Agonist);
    close(highest(&mut bench), 600e3);
    assert_eq!(bench.controller.use_table(Side::Agonist, &table(500.0)), Ok(()));
    let mut settings = *bench.controller.settings();
    settings.limits.pressure_pa = 400e3;
    bench.controller.use_settings(&settings);
    close(highest(&mut bench), 400e3);
    settings.limits.pressure_pa = 700e3;
    bench.controller.use_settings(&settings);
    close(highest(&mut bench), 500e3);
}
