//! Pulses of an on/off valve in a recording: period, phase, and the readings that ring after each pulse.
//!
//! A valve that opens for some tens of milliseconds excites the gas and the bench: pressure and force oscillate at about 20 Hz, and the force
//! lags. The quasi-static model and every effect of the library are about slower changes, so these readings are set aside.

use super::criteria::valve_pulses::{
    CONCENTRATED, LEAST_PERIODICITY, NARROW_PART, PULSE_BEGINS, PULSE_BINS, PULSE_FINE_STEP,
    PULSE_FINE_STEPS, PULSE_GRID, PULSE_PEAK, PULSE_PERIODS, PULSE_STEPS, RING_TIME, WINDOW_FROM, WINDOW_TO,
};
use pam_data::recording::Recording;

/// Periodic pulses of a recording's pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ValvePulses {
    /// Time from the beginning of a pulse to that of the next, s.
    pub period: f64,
    /// When the first pulse begins, after the first reading, s.
    pub phase: f64,
    /// Whether the pressure changes in a small part of each period: a valve's pulse, not a wave.
    pub concentrated: bool,
}

/// The median distance between readings, s.
pub(crate) fn interval(recording: &Recording) -> f64 {
    let mut steps: Vec<f64> = recording.time.windows(2).map(|w| w[1] - w[0]).collect();
    pam_data::statistics::median(&mut steps)
}

impl ValvePulses {
    /// The pulses of a recording; `None` where its pressure does not repeat itself.
    pub(crate) fn find(recording: &Recording) -> Option<Self> {
        let interval = interval(recording);
        if !(interval > 0.0) {
            return None;
        }
        let (period, phase, concentrated) = pulses(recording, interval)?;
        Some(Self { period, phase, concentrated })
    }

    /// Whether a reading, so long after the first one (s), rings after a pulse or may already belong to the next one.
    fn rings(&self, after: f64) -> bool {
        let periods = (after - self.phase) / self.period;
        let since = (periods - periods.floor()) * self.period;
        !(since >= RING_TIME.min(WINDOW_FROM * self.period) && since < WINDOW_TO * self.period)
    }
}

/// Which readings of a recording ring after a pulse of its valve.
pub(crate) fn ringing(recording: &Recording) -> Vec<bool> {
    let Some(pulses) = ValvePulses::find(recording).filter(|p| p.concentrated) else {
        return vec![false; recording.len()];
    };
    let first = recording.time.first().copied().unwrap_or(0.0);
    recording.time.iter().map(|t| pulses.rings(t - first)).collect()
}

/// Period and phase (after the first row) of a valve's pulses, s, from the autocorrelation of |dP/dt|.
fn pulses(recording: &Recording, interval: f64) -> Option<(f64, f64, bool)> {
    let step = interval.max(PULSE_GRID);
    let first = *recording.time.first()?;
    let count = ((recording.duration() / step) as usize).min(PULSE_STEPS);
    let mut at = 0;
    let even: Vec<f64> = (0..count)
        .map(|k| {
            let time = first + k as f64 * step;
            while at + 2 < recording.len() && recording.time[at + 1] < time {
                at += 1;
            }
            let (t, p) = (&recording.time[at..], &recording.pressure[at..]);
            let share = ((time - t[0]) / (t.get(1)? - t[0])).clamp(0.0, 1.0);
            Some(p[0] + share * (p.get(1)? - p[0]))
        })
        .collect::<Option<_>>()?;
    let mut rate: Vec<f64> = even.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let mean = rate.iter().sum::<f64>() / rate.len().max(1) as f64;
    rate.iter_mut().for_each(|r| *r -= mean);
    let power: f64 = rate.iter().map(|r| r * r).sum();
    let lags = ((PULSE_PERIODS.0 / step).ceil() as usize).max(2)..(PULSE_PERIODS.1 / step) as usize;
    let correlation = |lag: usize| {
        let product: f64 = rate.iter().zip(rate.get(lag..).unwrap_or(&[])).map(|(a, b)| a * b).sum();
        product / power.max(f64::MIN_POSITIVE)
    };
    let found: Vec<(usize, f64)> = lags.map(|lag| (lag, correlation(lag))).collect();
    let best = found.iter().map(|f| f.1).fold(0.0, f64::max);
    if !(best >= LEAST_PERIODICITY) {
        return None;
    }
    // Multiples of a period correlate almost as well as the period itself.
    let peak = |w: &[(usize, f64)]| w[1].1 >= PULSE_PEAK * best && w[1].1 >= w[0].1 && w[1].1 >= w[2].1;
    let lag = found.windows(3).find(|w| peak(w))?[1].0;
    let near = |k: i32| (lag as f64 + PULSE_FINE_STEP * f64::from(k)) * step;
    let folds = (-PULSE_FINE_STEPS..=PULSE_FINE_STEPS).map(|k| (near(k), fold(&rate, step, near(k))));
    let (period, (_, phase, means)) = folds.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    Some((period, phase, is_concentrated(means.iter().map(|m| m + mean))))
}

/// Whether a part of the period holds clearly more of the pressure's change than a sine has there: of |cos| over half a turn the
/// steepest part `q` holds `sin(π q/2)`.
fn is_concentrated(rates: impl Iterator<Item = f64>) -> bool {
    let rates: Vec<f64> = rates.collect();
    let narrow = (NARROW_PART * rates.len() as f64).ceil() as usize;
    let held = |from: usize| (from..from + narrow).map(|i| rates[i % rates.len()]).sum::<f64>();
    let most = (0..rates.len()).map(held).fold(0.0, f64::max) / rates.iter().sum::<f64>();
    let sine = (0.5 * std::f64::consts::PI * narrow as f64 / rates.len() as f64).sin();
    most >= sine + CONCENTRATED * (1.0 - sine)
}

/// Folds |dP/dt| over a period: how unevenly it lies, where it begins to rise, and its mean in each bin.
fn fold(rate: &[f64], step: f64, period: f64) -> (f64, f64, Vec<f64>) {
    let bins = ((period / step) as usize).clamp(2, PULSE_BINS);
    let mut sums = vec![(0.0, 0.0); bins];
    for (k, r) in rate.iter().enumerate() {
        let periods = (k as f64 + 0.5) * step / period;
        let bin = (((periods - periods.floor()) * bins as f64) as usize).min(bins - 1);
        sums[bin] = (sums[bin].0 + r, sums[bin].1 + 1.0);
    }
    let means: Vec<f64> = sums.iter().map(|s| s.0 / f64::max(s.1, 1.0)).collect();
    let uneven = means.iter().map(|m| m * m).sum();
    let top = (0..bins).max_by(|a, b| means[*a].total_cmp(&means[*b])).unwrap_or(0);
    // The pulse may begin a bin before the steepest one.
    let before = (top + bins - 1) % bins;
    let start = if means[before] > PULSE_BEGINS * means[top] { before } else { top };
    (uneven, start as f64 / bins as f64 * period, means)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 30 s of a pressure at held length.
    fn recording(rate: f64, pressure: impl Fn(f64) -> f64) -> Recording {
        let n = (30.0 * rate) as usize;
        let time: Vec<f64> = (0..n).map(|i| i as f64 / rate).collect();
        let pressure = time.iter().map(|t| pressure(*t)).collect();
        Recording { time, stroke: vec![0.0; n], pressure, ..Recording::default() }
    }

    /// A step of 20 kPa every `period`, from 0.13 s on, and its ring.
    fn pulsed(period: f64) -> impl Fn(f64) -> f64 {
        move |t| {
            let pulse = ((t - 0.13) / period).floor();
            let since = t - 0.13 - pulse * period;
            2e4 * (pulse + (-since / 0.06).exp() * (125.0 * since).sin())
        }
    }

    #[test]
    fn readings_ring_after_a_pulse_and_are_settled_before_the_next() {
        for (rate, period) in [(106.0, 0.5), (12.2, 0.5), (106.0, 2.0)] {
            let r = recording(rate, pulsed(period));
            let ringing = ringing(&r);
            for (t, rings) in r.time.iter().zip(&ringing) {
                let since = (t - 0.13).rem_euclid(period);
                // The phase is known to a bin of the fold.
                let bin = (period / 20.0).max(1.0 / rate);
                if since < RING_TIME - bin {
                    assert!(rings, "{rate} Hz, {period} s: {since} s after a pulse");
                } else if (RING_TIME + bin..(WINDOW_TO * period) - bin).contains(&since) {
                    assert!(!rings, "{rate} Hz, {period} s: {since} s after a pulse");
                }
            }
        }
    }

    #[test]
    fn a_wave_or_a_ramp_rings_nowhere() {
        for rate in [12.0, 106.0] {
            for period in [1.0, 4.0] {
                let wave = recording(rate, |t| 3e5 + 1e5 * (std::f64::consts::TAU * t / period).sin());
                assert!(!ringing(&wave).contains(&true), "{rate} Hz, {period} s");
            }
            let ramp = recording(rate, |t| 1e4 * t + 300.0 * (1.7 * t).sin());
            assert!(!ringing(&ramp).contains(&true), "{rate} Hz");
        }
    }

    #[test]
    fn ringing_rows_carry_no_weight_and_a_remark_counts_them() {
        let mut campaign = pam_data::recording::Campaign::new(vec![recording(106.0, pulsed(0.5))]);
        for r in &mut campaign.recordings {
            r.force = Some(r.pressure.iter().map(|p| 1e-3 * p).collect());
        }
        let braid = crate::tests::geometry().build().expect("a braid");
        let (rows, remarks) = crate::rows::prepare(&campaign, &braid).expect("rows");
        let rings = ringing(&campaign.recordings[0]).iter().filter(|r| **r).count();
        assert!(
            remarks
                .iter()
                .any(|r| matches!(r, crate::remark::Remark::Ringing { excluded, .. } if *excluded == rings))
        );
        // Two thirds of each period ring.
        assert!((0.6..0.85).contains(&(rings as f64 / campaign.samples() as f64)), "{rings}");
        let counted = rows.effective() as f64;
        assert!(counted > 0.0 && counted < 0.4 * campaign.samples() as f64, "{counted}");
    }
}
