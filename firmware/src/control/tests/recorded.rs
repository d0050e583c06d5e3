//! What a tick leaves behind for the host.

use model_core::link::messages::{Event, TraceArm, TraceInfo, TracePiece, Trigger, Variable};
use model_core::link::settings::FeedForward;

use super::*;
use crate::tick::TICK_US;

#[test]
fn a_sample_is_due_every_n_ticks_and_none_without_a_rate() {
    let mut bench = Bench::new(|_| ());
    let due = |bench: &mut Bench| {
        bench.pass(1);
        bench.controller.take_sample().map(|sample| (sample.number, sample.tick))
    };
    assert_eq!(due(&mut bench), None);
    bench.controller.set_telemetry(3);
    let samples: Vec<_> = (0..8).map(|_| due(&mut bench)).collect();
    assert_eq!(
        samples,
        [Some((0, 2)), None, None, Some((1, 5)), None, None, Some((2, 8)), None],
        "numbers of samples and of their ticks"
    );
    bench.controller.set_telemetry(1);
    assert_eq!([due(&mut bench), due(&mut bench)], [Some((3, 10)), Some((4, 11))]);
    bench.controller.set_telemetry(0);
    assert_eq!(due(&mut bench), None);
}

#[test]
fn a_tick_reports_the_demand_and_the_levels_of_the_outputs() {
    let mut bench = Bench::running(|settings| settings.feed_forward = FeedForward::Off);
    assert_eq!((bench.last.state, bench.last.setpoint), (State::Running, 0.0), "no force is demanded");
    let part = bench.controller.settings().command.part(bench.last.sides[0].pressure_pa);
    assert!(part > 0.0 && bench.last.levels == [part, bench.controller.settings().command.part(0.0)]);
    assert_eq!(bench.controller.start(Mode::Force, OWNER), Ok(()));
    let order = SetPointOrder { set_point: SetPoint::Force(30.0), session: OWNER };
    assert_eq!(bench.controller.set_point(order), Ok(()));
    bench.pass(1);
    assert_eq!(bench.last.setpoint, 30.0);
}

#[test]
fn a_trace_has_the_variables_of_each_tick_and_reports_when_it_is_full() {
    use Variable::*;
    let mut bench = Bench::running(|_| ());
    while bench.controller.take_event().is_some() {}
    let variables = [Pressure, Stroke, Setpoint, State, StepTime, Command, PressureDemand, ModelForce];
    let request =
        TraceArm { variables: variables.into_iter().collect(), every_ticks: 1, trigger: Trigger::Now };
    assert_eq!(bench.controller.trace().arm(&request), Ok(()));
    let started = bench.controller.ticks();
    let mut last = 0.0;
    let mut info = TraceInfo::default();
    for _ in 0..100_000 {
        bench.pass_with(1, |_, inputs| inputs.step_us = 250.0);
        if info.records == 0 {
            last = bench.last.sides[0].pressure_pa;
        }
        bench.controller.trace().describe(&mut info);
        if info.complete {
            break;
        }
        assert_eq!(bench.controller.take_event(), None);
    }
    assert_eq!(bench.controller.take_event(), Some(Event::TraceFull));
    assert_eq!(bench.controller.take_event(), None, "once");
    assert_eq!(info.first_tick, started + 1);
    let mut piece = TracePiece::default();
    assert_eq!(bench.controller.trace().read(0, &mut piece), Ok(()));
    let state = f32::from(bench.controller.state() as u8);
    // In the order of the variables, as exact as three bytes are.
    let expected = [400e3, 1e-3, 400e3, state, 250.0, last, 400e3, 0.0];
    for ((variable, value), wanted) in variables.iter().zip(&piece.values).zip(expected) {
        assert!((value - wanted).abs() <= 2e-3 * wanted.abs(), "{variable:?}: {value}, not {wanted}");
    }
    assert_eq!(bench.controller.time_us(), bench.controller.ticks() * TICK_US);
}
