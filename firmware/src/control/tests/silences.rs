//! How long a run and a hold last without a host, to the tick.

use super::*;

/// The tick of the first fault, its value and its limit.
fn latched_after(bench: &mut Bench, most: u32) -> Option<(u32, Fault, f32, f32)> {
    (1..=most).find_map(|tick| {
        bench.pass(1);
        let report = bench.controller.faults().latched?;
        Some((tick, report.fault, report.value, report.limit))
    })
}

#[test]
fn a_run_that_controls_ends_when_its_host_is_silent() {
    let silent = |change: fn(&mut Settings), mode: Mode| {
        let mut bench = Bench::running(|settings| {
            settings.watch.host_silence_ticks = 300;
            change(settings);
        });
        if mode == Mode::Vent {
            assert_eq!(bench.controller.start(mode, OWNER), Ok(()));
        }
        bench.hears_host = false;
        latched_after(&mut bench, 2_000)
    };
    assert_eq!(silent(|_| (), Mode::Pressure), Some((301, Fault::HostSilence, 301.0, 300.0)));
    assert_eq!(silent(|_| (), Mode::Vent), None, "a mode that vents needs no host");
    assert_eq!(silent(|settings| settings.watch.autonomous = true, Mode::Pressure), None);
}

#[test]
fn a_run_that_controls_ends_when_setpoints_stay_away() {
    let silent = |silence_ticks: u32, mode: Mode| {
        let mut bench = Bench::running(|settings| settings.watch.silence_ticks = silence_ticks);
        if mode == Mode::Vent {
            assert_eq!(bench.controller.start(mode, OWNER), Ok(()));
        } else {
            assert_eq!(bench.controller.set_point(to_pressure(400e3)), Ok(()));
        }
        latched_after(&mut bench, 2_000)
    };
    let after = |ticks: u32| Some((ticks + 1, Fault::SetPointSilence, ticks as f32 + 1.0, ticks as f32));
    assert_eq!(silent(1_100, Mode::Pressure), after(1_100));
    assert_eq!(silent(1_100, Mode::Vent), None);
    assert_eq!(silent(0, Mode::Pressure), None, "a watch that is off");
}

#[test]
fn a_hold_ends_in_the_tick_after_its_time() {
    let mut bench = Bench::running(|settings| {
        settings.watch.silence_ticks = 1_500;
        settings.watch.hold_ticks = 700;
        settings.hold_on = 1 << Fault::SetPointSilence.code();
    });
    let found = latched_after(&mut bench, 600).map(|(tick, fault, ..)| (tick, fault));
    assert_eq!(found, Some((501, Fault::SetPointSilence)));
    bench.pass(700);
    assert!(!bench.is_vented());
    bench.pass(1);
    assert!(bench.is_vented());
    let kept = core::iter::from_fn(|| bench.controller.machine().take_unsaved()).last();
    let kept = kept.map(|report| (report.fault, report.value, report.limit));
    assert_eq!(kept, Some((Fault::HoldEnded, 701.0, 700.0)));
}
