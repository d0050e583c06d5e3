//! Checks of the bench: dead weights on the load cell, a rigid bar in the muscle's place, a reference gauge, the load cell with and
//! without muscle and fittings, and the muscle behind a closed valve.
//!
//! They are what protocol C of the catalogue adds: each shows one instrument against something known, and so splits what loops
//! of the muscle confuse (gain of cell and gauge, cross-talk, what the frame gives, play, weight in the load path, leak).

use crate::bench::BenchSpec;
use crate::rig::RigState;
use crate::sensors::Channel;
use std::fmt::Write as _;

/// One check as a file: CSV with a header, units behind the last underscore.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// File name without extension.
    pub name: &'static str,
    /// The table.
    pub csv: String,
}

/// Samples per second.
const RATE: f64 = 10.0;
/// Steps of the physics per sample.
const WITHIN: u32 = 10;
/// Seconds at each weight and each pressure.
const STAY: f64 = 6.0;

/// All checks of a bench, for forces up to `force` (N) and pressures up to `pressure` (Pa), done after `clock` (s).
pub fn all(bench: &BenchSpec, force: f64, pressure: f64, clock: f64) -> Vec<Check> {
    vec![
        dead_weights(bench, force, pressure, clock),
        rigid_bar(bench, force, clock + 200.0),
        gauge(bench, pressure, clock + 400.0),
        weighing(bench, clock + 600.0),
        closed_valve(bench, pressure, clock + 700.0),
    ]
}

fn channel(bench: &BenchSpec, which: &str) -> Channel {
    let i = &bench.instruments;
    let sensor = match which {
        "pressure" => i.pressure,
        "stroke" => i.stroke,
        _ => i.force,
    };
    Channel::new(sensor, bench.seed ^ 0xC4EC, which)
}

/// The rig, its cell as warm as it is after `clock` (s).
fn warm(bench: &BenchSpec, clock: f64) -> RigState {
    let mut rig = RigState::new(bench.rig);
    rig.at_cell(0.0, 0.0, 0.0, clock);
    rig
}

/// Known weights hang on the cell, up and down, first with the line vented, then with the line under pressure.
fn dead_weights(bench: &BenchSpec, force: f64, pressure: f64, clock: f64) -> Check {
    let (mut rig, mut cell, mut gauge) =
        (warm(bench, clock), channel(bench, "force"), channel(bench, "pressure"));
    let mut csv = String::from("time_s,pressure_kPa,force_N,reference_force_N\n");
    let mut t = clock;
    for line in [0.0, pressure] {
        for part in [0.0, 0.25, 0.5, 0.75, 1.0, 0.5, 0.0] {
            let weight = part * force;
            for i in 0..(STAY * RATE) as u32 {
                for _ in 0..WITHIN {
                    let dt = 1.0 / RATE / f64::from(WITHIN);
                    t += dt;
                    let at = rig.at_cell(weight, line, 0.0, dt);
                    cell.follow(dt, at);
                    gauge.follow(dt, line);
                }
                let (f, p) = (cell.sample(1.0 / RATE), gauge.sample(1.0 / RATE));
                // The first second swings.
                if f64::from(i) >= RATE {
                    let _ = writeln!(csv, "{t:.3},{:.4},{f:.4},{weight:.4}", p * 1e-3);
                }
            }
        }
    }
    Check { name: "dead_weights", csv }
}

/// A bar that does not give is in the muscle's place, and the crosshead pulls and pushes at it: what is read as stroke is
/// what the frame and its joints give.
fn rigid_bar(bench: &BenchSpec, force: f64, clock: f64) -> Check {
    let (mut rig, mut cell, mut ruler) =
        (warm(bench, clock), channel(bench, "force"), channel(bench, "stroke"));
    let with = bench.rig;
    let mut csv = String::from("time_s,displacement_mm,force_N,reference_displacement_mm\n");
    let mut t = clock;
    let seconds = 60.0;
    for _ in 0..(2.0 * seconds * RATE) as u32 {
        for _ in 0..WITHIN {
            let dt = 1.0 / RATE / f64::from(WITHIN);
            t += dt;
            let pull = force * (std::f64::consts::TAU * (t - clock) / seconds).sin();
            // The joint bears on that side of its play to which it is drawn; the frame gives by its spring rate.
            let side = (pull / (0.01 * force.max(1e-9))).clamp(-1.0, 1.0);
            let give = if with.stiffness > 0.0 { pull / with.stiffness } else { 0.0 };
            ruler.follow(dt, -with.offset - give - 0.5 * with.play * side);
            let at = rig.at_cell(pull, 0.0, 0.0, dt);
            cell.follow(dt, at);
        }
        let (x, f) = (ruler.sample(1.0 / RATE), cell.sample(1.0 / RATE));
        let _ = writeln!(csv, "{t:.3},{:.5},{f:.4},0.0", x * 1e3);
    }
    Check { name: "rigid_bar", csv }
}

/// A reference gauge beside the bench's own, vented and at three pressures.
fn gauge(bench: &BenchSpec, pressure: f64, clock: f64) -> Check {
    let mut gauge = channel(bench, "pressure");
    let mut csv = String::from("time_s,pressure_kPa,reference_pressure_kPa\n");
    let mut t = clock;
    for part in [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 0.0] {
        for i in 0..(STAY * RATE) as u32 {
            for _ in 0..WITHIN {
                let dt = 1.0 / RATE / f64::from(WITHIN);
                t += dt;
                gauge.follow(dt, part * pressure);
            }
            let p = gauge.sample(1.0 / RATE);
            if f64::from(i) >= RATE {
                let _ = writeln!(csv, "{t:.3},{:.4},{:.4}", p * 1e-3, part * pressure * 1e-3);
            }
        }
    }
    Check { name: "gauge_check", csv }
}

/// The vented cell with muscle and fittings attached and with nothing attached, in turn.
fn weighing(bench: &BenchSpec, clock: f64) -> Check {
    let (mut rig, mut cell) = (warm(bench, clock), channel(bench, "force"));
    let mut csv = String::from("time_s,force_N,attached\n");
    let mut t = clock;
    for attached in [1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0] {
        for i in 0..(STAY * RATE) as u32 {
            for _ in 0..WITHIN {
                let dt = 1.0 / RATE / f64::from(WITHIN);
                t += dt;
                let taken_off = (1.0 - attached) * bench.rig.weight;
                let at = rig.at_cell(0.0, 0.0, 0.0, dt) - taken_off;
                cell.follow(dt, at);
            }
            let f = cell.sample(1.0 / RATE);
            // The first second swings.
            if f64::from(i) >= RATE {
                let _ = writeln!(csv, "{t:.3},{f:.4},{attached}");
            }
        }
    }
    Check { name: "weighing", csv }
}

/// The muscle at rest length under pressure; a valve before its line closes three times for a while.
fn closed_valve(bench: &BenchSpec, pressure: f64, clock: f64) -> Check {
    let mut gauge = channel(bench, "pressure");
    let air = &bench.pneumatics;
    // The conductance of the leak is a share of that of the line, which fills the muscle in its time.
    let loss = air.leak / air.line.max(1e-5);
    let mut csv = String::from("time_s,pressure_kPa,valve_closed\n");
    let (mut t, mut inside) = (clock, pressure);
    for closed in [false, true, false, true, false, true] {
        if !closed {
            inside = pressure;
        }
        let stay = if closed { 3.0 * STAY } else { STAY };
        for i in 0..(stay * RATE) as u32 {
            for _ in 0..WITHIN {
                let dt = 1.0 / RATE / f64::from(WITHIN);
                t += dt;
                if closed {
                    inside *= (-loss * dt).exp();
                }
                gauge.follow(dt, inside);
            }
            let p = gauge.sample(1.0 / RATE);
            if closed || f64::from(i) >= RATE {
                let _ = writeln!(csv, "{t:.3},{:.4},{}", p * 1e-3, u8::from(closed));
            }
        }
    }
    Check { name: "closed_valve", csv }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets;

    fn columns(check: &Check) -> Vec<Vec<f64>> {
        check.csv.lines().skip(1).map(|l| l.split(',').filter_map(|v| v.parse().ok()).collect()).collect()
    }

    fn slope(rows: &[Vec<f64>], x: usize, y: usize) -> f64 {
        let n = rows.len() as f64;
        let (mx, my) =
            (rows.iter().map(|r| r[x]).sum::<f64>() / n, rows.iter().map(|r| r[y]).sum::<f64>() / n);
        rows.iter().map(|r| (r[x] - mx) * (r[y] - my)).sum::<f64>()
            / rows.iter().map(|r| (r[x] - mx).powi(2)).sum::<f64>()
    }

    #[test]
    fn each_check_shows_the_fault_that_it_is_for() {
        let mut bench = BenchSpec::laboratory(presets::miniature(), 3);
        bench.instruments.force.gain = 0.02;
        bench.instruments.pressure.gain = -0.01;
        bench.rig.stiffness = 2e5;
        bench.rig.hose = 3e-6;
        let all = all(&bench, 100.0, 500e3, 1000.0);
        let weights = columns(&all[0]);
        assert!((slope(&weights, 3, 2) - 1.02).abs() < 1e-3, "{}", slope(&weights, 3, 2));
        let mean = |loaded: bool| {
            let rows: Vec<f64> =
                weights.iter().filter(|r| (r[1] > 100.0) == loaded && r[3] == 0.0).map(|r| r[2]).collect();
            rows.iter().sum::<f64>() / rows.len() as f64
        };
        assert!((mean(true) - mean(false) - 1.53).abs() < 0.05, "{} {}", mean(true), mean(false));
        // N per mm of the frame, the cell's gain in it.
        let give = slope(&columns(&all[1]), 2, 1);
        assert!((-1.0 / give / (200.0 * 1.02) - 1.0).abs() < 0.02, "{give}");
        assert!((slope(&columns(&all[2]), 2, 1) - 0.99).abs() < 1e-3);
        // A leak of a hundredth of a line that fills the muscle in 4 ms.
        let lowest = |bench: &BenchSpec| {
            columns(&closed_valve(bench, 500e3, 0.0)).iter().map(|r| r[1]).fold(f64::INFINITY, f64::min)
        };
        assert!(lowest(&bench) > 490.0, "{}", lowest(&bench));
        bench.pneumatics.leak = 0.01;
        assert!(lowest(&bench) < 10.0, "{}", lowest(&bench));
    }
}
