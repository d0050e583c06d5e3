//! A calm tick that is let pass leaves what a look at everything would, and nothing that is a finding is let pass.

use super::*;

/// Numbers between 0 and 1 that repeat with the seed.
struct Random(u32);

impl Random {
    fn part(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0
    }

    fn one_in(&mut self, n: u32) -> bool {
        self.part() * (n as f32) < 1.0
    }
}

/// A muscle at work, in which now and then something is wrong, repeats itself, or is missing.
fn tick(random: &mut Random, last: &Seen) -> Seen {
    let mut seen = good();
    let mut now = seen.readings.unwrap_or_default();
    now.pressure_pa += 400.0 * (random.part() - 0.5);
    now.stroke_m += 1e-4 * (random.part() - 0.5);
    now.force_n += 0.5 * (random.part() - 0.5);
    seen.most_above_n = if random.one_in(2) { 15.0 } else { 0.0 };
    seen.speed_m_per_s = 0.02 * random.part();
    seen.command.pressure_pa += 60e3 * (random.part() - 0.5);
    if let Some(before) = last.readings {
        for (reading, before) in [
            (&mut now.pressure_pa, before.pressure_pa),
            (&mut now.stroke_m, before.stroke_m),
            (&mut now.force_n, before.force_n),
        ] {
            if random.one_in(3) {
                *reading = before;
            }
        }
    }
    let odd = [f32::NAN, f32::INFINITY, -1e9, 1e9, 0.0][(random.part() * 5.0) as usize % 5];
    match (random.part() * 100.0) as u32 {
        0 => now.pressure_pa = odd,
        1 => now.stroke_m = odd,
        2 => now.force_n = odd,
        3 => seen.speed_m_per_s = odd,
        4 => seen.expected_pa = odd,
        5 => seen.model_n = Some(odd),
        6 => seen.model_n = None,
        7 => seen.command.vent = true,
        8 => now.pressure_pa += 60e3,
        9 => now.force_n += 30.0,
        10 => now.force_n -= 30.0,
        _ => (),
    }
    seen.readings = (!random.one_in(200)).then_some(now);
    seen
}

#[test]
fn a_tick_that_is_let_pass_is_one_in_which_nothing_is_found_and_leaves_the_same() {
    let mut random = Random(7);
    let (mut passed, mut found, mut looked) = (0, 0, 0);
    for run in 0..300_u32 {
        let mut settings = Settings::default();
        settings.watch.disagree_n = if run % 2 == 0 { 10.0 } else { 0.0 };
        settings.watch.second_pressure_pa = if run % 11 == 0 { 20e3 } else { 0.0 };
        settings.pressure.fitted = run % 5 != 0;
        settings.stroke.fitted = run % 7 != 0;
        settings.force.fitted = run % 3 != 0;
        (settings.watch.follow_ticks, settings.pressure.stuck_ticks) = (5, 3);
        let (mut quick, mut whole) = (SideWatch::default(), SideWatch::default());
        let mut seen = good();
        for _ in 0..1_000 {
            seen = tick(&mut random, &seen);
            let mut findings = Vec::new();
            whole.check(&seen, &settings, &mut |finding| findings.push(finding.fault));
            if quick.pass(&seen, &settings) {
                assert!(findings.is_empty(), "{findings:?} of {seen:?}");
                passed += 1;
            } else {
                let mut again = Vec::new();
                quick.check(&seen, &settings, &mut |finding| again.push(finding.fault));
                assert_eq!(again, findings);
                looked += 1;
            }
            found += findings.len();
            // As text, in which what is not a number is the same as itself, but only where it must: it takes longer than all else.
            if quick != whole {
                assert_eq!(format!("{quick:?}"), format!("{whole:?}"), "after {seen:?}");
            }
        }
    }
    assert!(passed > 30_000 && looked > 30_000 && found > 1_000, "{passed} {looked} {found}");
}
