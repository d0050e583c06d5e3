//! Motions whose directions are known, with noise: what is found must be the truth except for samples that noise hides.

use proptest::prelude::*;

use super::*;

/// One piece of a test's path.
#[derive(Debug, Clone, Copy)]
enum Piece {
    /// To a stroke (m) at a speed (m/s).
    Go(f64, f64),
    /// Held for so long (s).
    Rest(f64),
    /// Held while the pressure goes somewhere (Pa) in some seconds.
    Pressure(f64, f64),
}

struct Truth {
    recording: Recording,
    direction: Vec<i8>,
    /// Speed at which the stroke passes each sample, m/s.
    speed: Vec<f64>,
}

/// Pseudo-random numbers of a normal distribution: the sum of twelve uniform ones.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Carries out a path and samples it.
fn carry_out(path: &[Piece], rate: f64, stroke_noise: f64, ripple: f64, seed: u64) -> Truth {
    let (mut stroke, mut pressure) = (0.0, 300e3);
    let mut noise = Noise(seed);
    let mut truth = Truth { recording: Recording::default(), direction: Vec::new(), speed: Vec::new() };
    let (mut clock, mut begun, mut last) = (0.0, 0.0, 0i8);
    for piece in path {
        let (to, duration, at) = match *piece {
            Piece::Go(to, speed) => (to - stroke, ((to - stroke) / speed).abs(), pressure),
            Piece::Rest(duration) => (0.0, duration, pressure),
            Piece::Pressure(at, duration) => (0.0, duration, at),
        };
        let way = if to == 0.0 { at - pressure } else { to };
        if way != 0.0 {
            last = if way > 0.0 { 1 } else { -1 };
        }
        while clock <= begun + duration {
            let share = if duration > 0.0 { (clock - begun) / duration } else { 1.0 };
            truth.recording.time.push(clock);
            truth.recording.stroke.push(stroke + share * to + stroke_noise * noise.normal());
            let wave = ripple * (clock * 2.0 * std::f64::consts::PI * 3.7).sin();
            truth
                .recording
                .pressure
                .push(pressure + share * (at - pressure) + wave + 0.3 * ripple * noise.normal());
            truth.direction.push(last);
            truth.speed.push(if duration > 0.0 { to.abs() / duration } else { 0.0 });
            clock += 1.0 / rate;
        }
        begun += duration;
        stroke += to;
        pressure = at;
    }
    truth
}

/// Samples whose direction is wrong.
fn wrong(truth: &Truth, found: &Motion) -> Vec<usize> {
    (0..truth.direction.len()).filter(|i| truth.direction[*i] != found.direction[*i]).collect()
}

fn reversals(direction: &[i8]) -> usize {
    direction.windows(2).filter(|w| w[0] != w[1]).count()
}

const MM: f64 = 1e-3;

fn loops(count: usize, top: f64, speed: f64) -> Vec<Piece> {
    (0..count).flat_map(|_| [Piece::Go(top, speed), Piece::Go(0.0, speed)]).collect()
}

#[test]
fn triangles_turn_at_the_right_sample() {
    // 10 Hz at 1 mm/s: a step is 0.1 mm, the noise 2 µm. Every sample is certain.
    for seed in 1..20 {
        let truth = carry_out(&loops(3, 27.03 * MM, 1.0 * MM), 10.0, 2e-6, 250.0, seed);
        let found = Motion::of(&truth.recording);
        assert_eq!(wrong(&truth, &found), Vec::<usize>::new(), "seed {seed}");
        assert_eq!(found.reversals.len(), 6);
    }
}

#[test]
fn without_any_noise_every_sample_is_right() {
    for (rate, speed) in [(10.0, 1.0), (10.0, 0.3), (1000.0, 0.3), (100.0, 16.0), (30.0, 0.287)] {
        let truth = carry_out(&loops(2, 10.007 * MM, speed * MM), rate, 0.0, 0.0, 1);
        let found = Motion::of(&truth.recording);
        assert_eq!(wrong(&truth, &found), Vec::<usize>::new(), "{rate} Hz, {speed} mm/s");
    }
}

#[test]
fn smooth_reversals_are_no_rests() {
    // Off by no more than the time in which a sine moves by some standard deviations of the noise about its reversal.
    for (rate, noise, allowed) in
        [(10.0, 0.0, 0), (100.0, 0.0, 0), (1000.0, 0.0, 0), (1000.0, 5e-6, 40), (100.0, 2e-6, 4)]
    {
        let mut random = Noise(7);
        let n = (rate * 60.0) as usize;
        let time: Vec<f64> = (0..n).map(|i| i as f64 / rate).collect();
        let recording = Recording {
            stroke: time
                .iter()
                .map(|t| 5.0 * MM * (1.0 - (0.713 * t).cos()) + noise * random.normal())
                .collect(),
            pressure: time.iter().map(|t| 300e3 + 5e3 * (0.713 * t).sin()).collect(),
            time,
            ..Recording::default()
        };
        let found = Motion::of(&recording);
        let reversals: Vec<usize> = found.reversals.iter().skip(1).map(|t| t.index).collect();
        assert_eq!(reversals.len(), 13, "{rate} Hz {noise} m: {:?}", found.reversals);
        for (k, reversal) in reversals.iter().enumerate() {
            let truth = ((k + 1) as f64 * std::f64::consts::PI / 0.713 * rate).ceil() as i64;
            assert!(
                (*reversal as i64 - truth).abs() <= allowed,
                "{rate} Hz {noise} m: {reversal} for {truth} {:?}",
                found.holds
            );
        }
    }
}

/// Sines among few readings, from 7 a cycle on, at any phase: each half-stroke has its direction from its first sample on.
#[test]
fn a_sine_among_few_readings_turns_at_its_extremes() {
    for per_cycle in [7.3, 9.1, 12.7, 20.3, 41.9, 97.1] {
        for k in 0..40 {
            let phase = 0.157 * f64::from(k);
            let mut random = Noise(k as u64);
            let angle = |i: usize| std::f64::consts::TAU * i as f64 / per_cycle + phase;
            let recording = Recording {
                time: (0..300).map(|i| 0.1 * i as f64).collect(),
                stroke: (0..300)
                    .map(|i| 10.0 * MM * (1.0 - angle(i).cos()) + 2e-6 * random.normal())
                    .collect(),
                pressure: vec![300e3; 300],
                ..Recording::default()
            };
            let found = Motion::of(&recording);
            // A reading this near to an extreme belongs to either side: the noise moves it by as much.
            let clear = |i: &usize| angle(*i).sin().abs() > 0.08;
            let wrong: Vec<usize> = (2..298)
                .filter(clear)
                .filter(|i| f64::from(found.direction[*i]) != angle(*i).sin().signum())
                .collect();
            assert!(wrong.is_empty(), "{per_cycle} a cycle, phase {phase}: {wrong:?}");
        }
    }
}

/// Strokes that begin and end like a cosine, with rests between them, among few readings.
#[test]
fn a_smooth_stroke_after_a_rest_begins_with_its_first_sample() {
    for per_stroke in [6, 10, 15, 25] {
        let mut random = Noise(per_stroke as u64);
        let period = 2 * (per_stroke + 30);
        let place = |i: usize| {
            let at = i % period;
            let (half, up) = if at < period / 2 { (at, true) } else { (at - period / 2, false) };
            let share = (half.saturating_sub(30) as f64 / per_stroke as f64).min(1.0);
            let gone = 0.5 * (1.0 - (std::f64::consts::PI * share).cos());
            if up { gone } else { 1.0 - gone }
        };
        let n = 6 * period;
        let recording = Recording {
            time: (0..n).map(|i| 0.1 * i as f64).collect(),
            stroke: (0..n).map(|i| 20.0 * MM * place(i) + 2e-6 * random.normal()).collect(),
            pressure: vec![300e3; n],
            ..Recording::default()
        };
        let found = Motion::of(&recording);
        // A sample has moved when it is farther from the rest than the noise.
        let moved = |i: usize| {
            let step = place(i) - place(i - 1);
            let begun = 20.0 * MM * step.abs() > 12e-6;
            begun.then_some(if step > 0.0 { 1 } else { -1 })
        };
        let wrong: Vec<usize> =
            (1..n).filter(|i| moved(*i).is_some_and(|d| d != found.direction[*i])).collect();
        assert!(wrong.is_empty(), "{per_stroke} a stroke: {wrong:?}");
    }
}

#[test]
fn slow_motion_under_noise_turns_within_what_noise_hides() {
    // 1 kHz at 0.3 mm/s: a step is 0.3 µm, the noise 10 µm. Lines through some hundred samples on either side meet within a
    // few standard errors: 10 µm / √100 / 0.3 µm, some 3 to 10 samples.
    for seed in 1..6 {
        let truth = carry_out(&loops(2, 3.0 * MM, 0.3 * MM), 1000.0, 10e-6, 250.0, seed);
        let found = Motion::of(&truth.recording);
        assert_eq!(reversals(&found.direction), 3, "seed {seed}");
        assert!(wrong(&truth, &found).len() < 30, "seed {seed}: {} wrong", wrong(&truth, &found).len());
    }
}

#[test]
fn direction_is_kept_through_a_rest_and_changes_when_motion_continues() {
    let path = [
        Piece::Rest(3.0),
        Piece::Go(5.0 * MM, 1.0 * MM),
        Piece::Rest(10.0),
        Piece::Go(9.0 * MM, 1.0 * MM),
        Piece::Rest(20.0),
        Piece::Go(2.0 * MM, 2.0 * MM),
        Piece::Rest(5.0),
    ];
    for (rate, noise) in [(10.0, 2e-6), (100.0, 2e-6), (100.0, 20e-6), (1000.0, 5e-6)] {
        let truth = carry_out(&path, rate, noise, 250.0, 3);
        let found = Motion::of(&truth.recording);
        assert_eq!(
            reversals(&found.direction),
            2,
            "{rate} Hz {noise} m: {:?} {:?}",
            found.reversals,
            found.holds
        );
        assert!(
            wrong(&truth, &found).len() as f64 <= 2.0 + 0.03 * rate,
            "{rate} Hz {noise} m: {:?}",
            wrong(&truth, &found)
        );
        assert_eq!(found.direction[0], 0);
        let rest =
            found.holds.iter().filter(|h| truth.recording.time[h.end] - truth.recording.time[h.start] > 2.0);
        assert_eq!(rest.count(), 4, "{rate} Hz {noise} m: {:?}", found.holds);
        let columns = found.columns(&truth.recording);
        let late = truth.recording.time.partition_point(|t| *t < 43.0);
        assert!((columns.hold_time[late] - 20.0).abs() < 0.5, "{}", columns.hold_time[late]);
    }
}

#[test]
fn at_held_length_the_pressure_decides() {
    let path = [
        Piece::Rest(2.0),
        Piece::Pressure(500e3, 4.0),
        Piece::Rest(5.0),
        Piece::Pressure(100e3, 8.0),
        Piece::Rest(3.0),
        Piece::Pressure(200e3, 2.0),
    ];
    for (rate, noise) in [(10.0, 0.0), (10.0, 2e-6), (106.0, 5e-6)] {
        let truth = carry_out(&path, rate, noise, 250.0, 5);
        let found = Motion::of(&truth.recording);
        assert_eq!(reversals(&found.direction), 3, "{:?}", found.reversals);
        let at: Vec<f64> = found.reversals.iter().map(|t| truth.recording.time[t.index]).collect();
        for (found, true_time) in at.iter().zip([2.0, 11.0, 22.0]) {
            assert!((found - true_time).abs() < 0.25, "{at:?}");
        }
    }
}

#[test]
fn a_rest_with_pressure_in_the_middle_of_a_stroke() {
    let path = [
        Piece::Go(5.0 * MM, 1.0 * MM),
        Piece::Pressure(100e3, 2.0),
        Piece::Rest(5.0),
        Piece::Go(9.0 * MM, 1.0 * MM),
        Piece::Go(0.0, 1.0 * MM),
    ];
    let truth = carry_out(&path, 50.0, 3e-6, 250.0, 8);
    let found = Motion::of(&truth.recording);
    assert_eq!(reversals(&found.direction), 3, "{:?}", found.reversals);
    assert!(wrong(&truth, &found).len() <= 12, "{:?}", wrong(&truth, &found));
}

#[test]
fn ripple_and_noise_at_rest_flip_nothing() {
    let truth = carry_out(&[Piece::Rest(600.0)], 100.0, 20e-6, 1500.0, 2);
    let found = Motion::of(&truth.recording);
    assert!(found.direction.iter().all(|d| *d == 0), "{:?}", found.reversals);
}

#[test]
fn settled_points_of_a_staircase_turn_between_the_last_up_and_the_first_down() {
    let up = (0..30).map(|i| 640e3 * (1.0 - (-f64::from(i) / 8.0).exp()));
    let down = (1..28).map(|i| 625e3 * (-f64::from(i) / 9.0).exp());
    let pressure: Vec<f64> =
        up.chain(down).enumerate().map(|(i, p)| p + [300.0, -400.0, 100.0][i % 3]).collect();
    let recording = Recording {
        time: (0..57).map(|i| 0.415 + 0.5 * f64::from(i)).collect(),
        stroke: vec![12e-3; 57],
        pressure,
        ..Recording::default()
    };
    let found = Motion::of(&recording);
    let expected: Vec<i8> = (0..57).map(|i| if i < 30 { 1 } else { -1 }).collect();
    let known: Vec<usize> = (0..57).filter(|i| found.direction[*i] != expected[*i]).collect();
    assert!(known.iter().all(|i| *i < 2), "{known:?}");
}

#[test]
fn a_direction_in_the_file_is_kept() {
    let mut truth = carry_out(&loops(1, 5.0 * MM, 1.0 * MM), 10.0, 0.0, 0.0, 1);
    truth.recording.direction = Some(truth.direction.iter().map(|_| -1).collect());
    let found = Motion::of(&truth.recording);
    assert!(found.direction.iter().all(|d| *d == -1));
}

#[test]
fn cycles_are_counted_and_minor_loops_are_not() {
    let mut path = loops(2, 10.0 * MM, 1.0 * MM);
    path.extend([
        Piece::Go(10.0 * MM, 1.0 * MM),
        Piece::Go(8.0 * MM, 1.0 * MM),
        Piece::Go(9.0 * MM, 1.0 * MM),
        Piece::Go(0.0, 1.0 * MM),
        Piece::Go(10.0 * MM, 1.0 * MM),
    ]);
    let truth = carry_out(&path, 20.0, 2e-6, 100.0, 4);
    let found = Motion::of(&truth.recording);
    let cycle = found.columns(&truth.recording).cycle;
    let at = |t: f64| cycle[truth.recording.time.partition_point(|x| *x < t)];
    assert_eq!([at(1.0), at(15.0), at(25.0), at(45.0), at(51.5), at(55.0), at(65.0)], [1, 1, 2, 3, 3, 3, 4]);
}

#[test]
fn rates_are_those_of_the_motion() {
    let n = 4000;
    let time: Vec<f64> = (0..n).map(|i| i as f64 * 0.01).collect();
    let mut noise = Noise(9);
    let stroke = time.iter().map(|t| 5.0 * MM * (1.0 - (0.8 * t).cos()) + 3e-6 * noise.normal()).collect();
    let pressure = time.iter().map(|t| 300e3 + 100e3 * (0.5 * t).sin() + 100.0 * noise.normal()).collect();
    let recording = Recording { time: time.clone(), stroke, pressure, ..Recording::default() };
    let rates = Rates::of(&recording, &Motion::of(&recording));
    for i in (50..n - 50).step_by(7) {
        let t = time[i];
        assert!((rates.speed[i] - 4.0 * MM * (0.8 * t).sin()).abs() < 0.3 * MM, "speed at {t}");
        assert!((rates.pressure_rate[i] - 50e3 * (0.5 * t).cos()).abs() < 5e3, "pressure rate at {t}");
    }
    let rms = |f: &dyn Fn(usize) -> f64| ((0..n).map(|i| f(i).powi(2)).sum::<f64>() / n as f64).sqrt();
    assert!(rms(&|i| rates.speed[i] - 4.0 * MM * (0.8 * time[i]).sin()) < 0.08 * MM);
    assert!(rms(&|i| rates.acceleration[i] - 3.2 * MM * (0.8 * time[i]).cos()) < 1.6 * MM);
}

#[test]
fn a_shared_clock_carries_the_direction_over() {
    let mut truth = carry_out(&loops(1, 5.0 * MM, 1.0 * MM), 10.0, 0.0, 0.0, 1);
    let first = truth.recording.clone();
    let shift = truth.recording.duration() + 10.0;
    truth.recording.time.iter_mut().for_each(|t| *t += shift);
    truth.recording.stroke.fill(0.0);
    let campaign = Campaign::new(vec![first, truth.recording]);
    let motions = Motion::of_campaign(&campaign);
    assert!(motions[1].direction.iter().all(|d| *d == -1));
}

/// A rest whose noise happens to bend by three of its standard deviations, as one in some hundred does: it is a rest none the
/// less, and the muscle turns at its end.
#[test]
fn a_rest_is_one_even_where_noise_bends_it() {
    let mut path = vec![Piece::Rest(2.0)];
    path.extend([
        Piece::Go(6.072993815782304 * MM, 0.3873853206977795 * MM),
        Piece::Go(-5.367624481295414 * MM, 2.431892331717718 * MM),
        Piece::Go(5.598295535754076 * MM, 0.3 * MM),
        Piece::Rest(5.7986977169165925),
        Piece::Go(0.09294286087956 * MM, 2.7718853641922325 * MM),
    ]);
    let truth =
        carry_out(&path, 124.81665814799626, 18.239_109_915_835_14e-6, 250.0, 14_148_753_286_867_760_998);
    let found = Motion::of(&truth.recording);
    assert_eq!(reversals(&found.direction), reversals(&truth.direction), "{:?}", found.reversals);
    let off = wrong(&truth, &found).len();
    assert!(off < 40, "{off} samples have the wrong direction");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(64)))]

    #[test]
    fn noisy_motion_gives_its_true_reversals(
        seed: u64,
        points in prop::collection::vec((2.0..12.0f64, 0.3..4.0f64, 0.0..12.0f64), 2..7),
        rate in 20.0..400.0f64,
        noise in 0.5e-6..20e-6f64,
    ) {
        // Every move is at least 2 mm, a hundred times the noise. A rest is long enough to be one: four times as long as the slower
        // motion beside it takes for a change that noise cannot make, which is some sixteen standard deviations.
        let enough = |i: usize| {
            let slower = points[i].1.min(points.get(i + 1).map_or(f64::INFINITY, |p| p.1)) * MM;
            4.0 * 16.0 * noise / slower
        };
        let mut path = vec![Piece::Rest(2.0_f64.max(64.0 * noise / (points[0].1 * MM)))];
        let mut at = 0.0;
        for (i, (size, speed, rest)) in points.iter().enumerate() {
            at += if i % 2 == 0 { size * MM } else { -size * MM };
            path.push(Piece::Go(at, speed * MM));
            if *rest > enough(i).max(4.0) {
                path.push(Piece::Rest(*rest));
            }
        }
        let truth = carry_out(&path, rate, noise, 250.0, seed);
        let found = Motion::of(&truth.recording);
        prop_assert_eq!(reversals(&found.direction), reversals(&truth.direction), "{:?}", found.reversals);
        // A reversal is uncertain by the time in which the stroke moves by some standard deviations of the noise.
        let slowest = points.iter().map(|p| p.1 * MM).fold(f64::INFINITY, f64::min);
        let each = 2.0 + 4.0 * noise / slowest * rate;
        let off = wrong(&truth, &found).len() as f64;
        prop_assert!(off <= each * points.len() as f64, "{off} of {each} per reversal");
    }

    #[test]
    fn nothing_makes_it_panic(
        values in prop::collection::vec((1e-3..1.0f64, -1e6..1e6f64, -1.0..1.0f64), 0..60),
        constant in 0..3usize,
    ) {
        let mut clock = 0.0;
        let time = values.iter().map(|v| { clock += v.0; clock }).collect();
        let pressure = values.iter().map(|v| if constant == 1 { 3e5 } else { v.1 }).collect();
        let stroke = values.iter().map(|v| if constant == 2 { 0.01 } else { v.2 }).collect();
        let recording = Recording { time, pressure, stroke, ..Recording::default() };
        let motion = Motion::of(&recording);
        let columns = motion.columns(&recording);
        let rates = Rates::of(&recording, &motion);
        prop_assert_eq!(columns.travel.len(), recording.len());
        prop_assert_eq!(columns.cycle.len(), recording.len());
        prop_assert!(rates.speed.iter().chain(&rates.pressure_rate).all(|v| v.is_finite()));
        prop_assert!(columns.travel.iter().all(|v| *v >= 0.0));
    }
}
