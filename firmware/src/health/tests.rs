//! A change is named, correlated noise is none.

use core::f32::consts::TAU;

use super::*;

/// Normal numbers, the same in each run.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as f32 + 0.5) / (1_u64 << 24) as f32
    }

    fn normal(&mut self) -> f32 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}

/// A muscle of blocked force 1 at pressure 1, moved over its range; blocks are a quarter of a second.
struct Bench {
    health: Health,
    noise: Noise,
    correlated: f32,
    block: u32,
}

/// What is added to the residual of a block: rms and correlation of the noise, and a change of some shape.
struct Case {
    rms: f32,
    correlation: f32,
    change: fn(&[f32; COLUMNS]) -> f32,
}

impl Bench {
    fn new(seed: u64) -> Self {
        Self { health: Health::default(), noise: Noise(seed), correlated: 0.0, block: 0 }
    }

    fn means(&self) -> [f32; COLUMNS] {
        let time = self.block as f32;
        // Two periods without a common measure, so that pressure and stroke are not the same.
        let pressure = 0.6 + 0.35 * (TAU * (time % 23.0) / 23.0).sin();
        let (sine, cosine) = (TAU * (time % 41.0) / 41.0).sin_cos();
        let stroke = 0.45 + 0.4 * sine;
        let (by_pressure, by_stroke) = (1.1 * (1.0 - stroke), -1.1 * (pressure - 0.1));
        let force = 1.1 * (pressure - 0.1) * (1.0 - stroke);
        let direction = cosine.signum();
        [
            1.0,
            force,
            pressure * by_pressure,
            pressure,
            by_pressure,
            by_stroke,
            force * by_stroke,
            direction,
            by_stroke * 0.4 * cosine * TAU / (41.0 * 0.256),
            0.0,
            0.0,
        ]
    }

    fn pass(&mut self, case: &Case) {
        let mut means = self.means();
        let fresh = (1.0 - case.correlation * case.correlation).sqrt();
        self.correlated = case.correlation * self.correlated + fresh * self.noise.normal();
        means[RESIDUAL] = case.rms * self.correlated + (case.change)(&means);
        self.health.now = means;
        self.health.age();
        while self.health.row < IDLE {
            self.health.add_row();
        }
        self.block += 1;
    }
}

/// Blocks of an hour of running.
const HOUR: u32 = 3_600_000 / BLOCK_TICKS as u32;

/// Hours of running, in how many of them an alarm was raised, and how many would be if each sample were independent.
fn alarms(hours: u32) -> (u32, u32) {
    // What a table leaves out at best is within the tolerance, and no change.
    let inexact = |m: &[f32; COLUMNS]| 0.01 * (TAU * m[Shape::CrossTalk as usize]).sin();
    let (mut found, mut naive) = (0, 0);
    for (seed, correlation) in [0.0, 0.5, 0.8, 0.95].into_iter().enumerate() {
        let mut bench = Bench::new(seed as u64 + 1);
        let case = Case { rms: 0.03, correlation, change: inexact };
        for _ in 0..hours / 4 {
            let (mut changed, mut taken) = (false, false);
            for _ in 0..HOUR {
                let before = bench.health.state();
                bench.pass(&case);
                let now = bench.health.state();
                changed |= now == TableHealth::Changed && before != now;
                taken |= by_samples(&bench.health);
            }
            found += u32::from(changed);
            naive += u32::from(taken);
        }
    }
    (found, naive)
}

/// Whether an offset would be significant if each sample were an independent observation.
fn by_samples(health: &Health) -> bool {
    let count = health.weight * f32::from(BLOCK_SAMPLES);
    let mean = health.sums[place(0, RESIDUAL)] / health.weight;
    let variance = health.sums[place(RESIDUAL, RESIDUAL)] / health.weight - mean * mean;
    health.blocks > 100 && (mean.abs() - TOLERANCE) / (variance / count).sqrt() > ALARM
}

#[test]
fn correlated_noise_raises_less_than_one_alarm_in_a_hundred_hours() {
    // 300 hours without an alarm: with 95 % confidence less than one in 100 hours.
    let hours = 300;
    let (found, naive) = alarms(hours);
    println!("{found} of {hours} hours with an alarm; {naive} if each sample were independent");
    assert_eq!(found, 0);
    assert!(naive > 0, "the noise would not mislead a test that counts samples either");
}

#[test]
fn each_change_raises_the_alarm_under_its_own_name() {
    type Change = fn(&[f32; COLUMNS]) -> f32;
    // Several times the tolerance each, by the rms of its shape.
    let changes: [(Shape, Change); 5] = [
        (Shape::ForceOffset, |_| 0.06),
        (Shape::ForceGain, |m| 0.15 * m[Shape::ForceGain as usize]),
        (Shape::PressureOffset, |m| -0.09 * m[Shape::PressureOffset as usize]),
        (Shape::Friction, |m| -0.06 * m[Shape::Friction as usize]),
        (Shape::Length, |m| 0.1 * m[Shape::Length as usize]),
    ];
    for (shape, change) in changes {
        for correlation in [0.0, 0.8] {
            let mut bench = Bench::new(9);
            for _ in 0..3_000 {
                bench.pass(&Case { rms: 0.01, correlation, change });
            }
            assert_eq!(bench.health.state(), TableHealth::Changed, "{shape:?}, {correlation}");
            assert_eq!(bench.health.suspect.0, shape);
            let mut answer = HealthSums::default();
            bench.health.describe(&mut answer);
            assert_eq!((answer.sums.len(), answer.lagged.len()), (SUMS, LAGGED));
            // What is over is forgotten.
            for _ in 0..8_000 {
                bench.pass(&Case { rms: 0.01, correlation, change: |_| 0.0 });
            }
            assert_eq!(bench.health.state(), TableHealth::Describes, "{shape:?}");
        }
    }
}

#[test]
fn the_sums_are_those_of_the_weighted_blocks_with_time_counted_back() {
    let mut bench = Bench::new(3);
    let mut all = Vec::new();
    for _ in 0..500 {
        bench.pass(&Case { rms: 0.02, correlation: 0.5, change: |m| 0.1 * m[1] });
        all.push(bench.health.now);
    }
    let mut sums = [0.0_f64; SUMS];
    for (age, block) in all.iter().rev().enumerate() {
        let mut block = block.map(f64::from);
        block[DRIFT] = -(age as f64) / f64::from(WINDOW);
        for row in 0..COLUMNS {
            for column in row..COLUMNS {
                sums[place(row, column)] += f64::from(DECAY).powi(age as i32) * block[row] * block[column];
            }
        }
    }
    for (at, (kept, sum)) in bench.health.sums.iter().zip(sums).enumerate() {
        assert!((f64::from(*kept) - sum).abs() < 2e-3 * sum.abs().max(1.0), "{at}: {kept}, not {sum}");
    }
}

#[test]
fn samples_make_a_block_and_an_interruption_drops_them() {
    let scales = Scales { force_n: 100.0, pressure_pa: 500e3, stroke_m: 2e-3, stroke_low_m: 0.0 };
    let mut health = Health::new(scales);
    let sample = Sample {
        measured_n: 55.0,
        model_n: 50.0,
        pressure_pa: 250e3,
        by_pressure: 2e-4,
        by_stroke: -10e3,
        direction: 1.0,
    };
    let run = |health: &mut Health, ticks: u16, sample: &Sample| {
        for _ in 0..ticks {
            if health.tick() {
                health.sample(sample);
            }
        }
    };
    run(&mut health, BLOCK_TICKS - SAMPLE_TICKS, &sample);
    health.interrupt();
    run(&mut health, BLOCK_TICKS - SAMPLE_TICKS, &sample);
    assert_eq!(health.blocks, 0);
    run(&mut health, SAMPLE_TICKS + 12, &sample);
    assert_eq!((health.blocks, health.weight), (1, 1.0));
    let expected = [1.0, 0.5, 0.5, 0.5, 1.0, -0.2, -0.1, 1.0, 0.0, 0.0, 0.05];
    for (found, expected) in health.now.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{:?}", health.now);
    }
    let broken = Sample { measured_n: f32::NAN, ..sample };
    run(&mut health, 10 * BLOCK_TICKS, &broken);
    assert_eq!((health.blocks, health.state()), (1, TableHealth::Unknown));
    assert!(scales.covers(400e3, 1e-3, 50.0));
    assert!(!scales.covers(600e3, 1e-3, 50.0) && !scales.covers(400e3, 3e-3, 50.0));
    assert!(!scales.covers(400e3, 1e-3, 0.5) && !scales.covers(f32::NAN, 1e-3, 50.0));
}
