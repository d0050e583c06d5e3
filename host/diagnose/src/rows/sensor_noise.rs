//! Readings of pressure and stroke without most of the noise of their sensors.
//!
//! The model computes its force from the pressure and the stroke that were read. The noise of these readings is then an error of the model's
//! force, and any effect that smooths this force explains a part of it: a filter in the force channel above all. (It is the problem of errors
//! in the variables: W. A. Fuller, Measurement Error Models, Wiley 1987, section 1.2.)

use crate::criteria::rows::{SMOOTHED, SMOOTHED_QUANTILE, STEPPED_REPEATS};
use pam_data::recording::white_noise;

/// Pressures without the part of their scatter that the force does not follow. `pull` is the force per pressure, m².
pub(super) fn smoothed_pressure(pressure: &[f64], force: &[f64], pull: f64) -> Vec<f64> {
    smooth(pressure, white_noise(pressure), share_felt(pressure, force, pull), &[])
}

/// Strokes without the scatter of their sensor. No muscle moves back and forth from reading to reading. Across a reversal nothing is
/// averaged: a rounded corner would look like a force that comes late. Where most readings equal the one before, they are steps of a converter.
pub(super) fn smoothed_stroke(stroke: &[f64], reversals: &[usize]) -> Vec<f64> {
    let equal = stroke.windows(2).filter(|pair| pair[0] == pair[1]).count();
    let stepped = equal * STEPPED_REPEATS > stroke.len();
    smooth(stroke, white_noise(stroke), 0.0, if stepped { &[] } else { reversals })
}

/// The share of the pressure's fast scatter that the muscle feels: where the regulator makes it, the force follows; where the sensor makes
/// it, it does not. From second differences, which slow changes hardly enter.
fn share_felt(pressure: &[f64], force: &[f64], pull: f64) -> f64 {
    let second = |x: &[f64]| x[0] - 2.0 * x[1] + x[2];
    let (mut both, mut squares) = (0.0, 0.0);
    for (p, f) in pressure.windows(3).zip(force.windows(3)) {
        let (p, f) = (second(p), second(f));
        both += p * f;
        squares += p * p;
    }
    let share = both / (squares * pull);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

/// A series with white scatter of this standard deviation, without the share of it that is not `felt`: each value moves to the mean of its
/// neighbours, which is that of a line through them, where the scatter about the line is that of the noise. Of several windows the widest
/// counts for which this is so; where the series changes faster than a line in the narrowest, it stays the more, the larger the scatter
/// (J. S. Lee, IEEE Trans. Pattern Anal. Mach. Intell. 2 (1980) 165–168, with a line in place of a constant). It delays nothing. No window
/// reaches across a reversal, which is given by its first value; windows near one are narrower.
fn smooth(series: &[f64], scatter: f64, felt: f64, reversals: &[usize]) -> Vec<f64> {
    let mut smoothed = series.to_vec();
    if !(scatter > 0.0) {
        return smoothed;
    }
    let usual = SMOOTHED.map(|n| n / 2);
    let narrowest = usual[usual.len() - 1];
    let mut legs = reversals.iter().copied().chain([series.len()]).peekable();
    let mut leg = 0..0;
    for (i, value) in smoothed.iter_mut().enumerate() {
        while let Some(end) = legs.next_if(|_| leg.end <= i) {
            leg = leg.end..end;
        }
        let room = (i - leg.start).min(leg.end - 1 - i);
        let narrow = (1..narrowest).contains(&room).then_some(room);
        for half in usual.into_iter().filter(|half| *half <= room).chain(narrow) {
            let (mean, variance) = about_line(&series[i - half..=i + half]);
            let limit = scatter * scatter * chi_squared_over_degrees((2 * half - 1) as f64);
            if variance <= limit || half <= narrowest {
                let removed = (1.0 - felt) * (limit / variance).min(1.0);
                *value -= removed * (*value - mean);
                break;
            }
        }
    }
    smoothed
}

/// The mean of an odd number of values, and their variance about a line through them.
fn about_line(window: &[f64]) -> (f64, f64) {
    let n = window.len() as f64;
    let mean = window.iter().sum::<f64>() / n;
    let (mut along, mut squares) = (0.0, 0.0);
    for (k, v) in window.iter().enumerate() {
        along += (k as f64 - (n - 1.0) / 2.0) * (v - mean);
        squares += (v - mean) * (v - mean);
    }
    let explained = along * along / (n * (n * n - 1.0) / 12.0);
    (mean, (squares - explained).max(0.0) / (n - 2.0))
}

/// The quantile of chi-squared over its degrees of freedom (E. B. Wilson and M. Hilferty, PNAS 17 (1931) 684–688).
fn chi_squared_over_degrees(degrees: f64) -> f64 {
    let variance = 2.0 / (9.0 * degrees);
    (1.0 - variance + SMOOTHED_QUANTILE * variance.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(i: usize) -> f64 {
        (43_758.5 * (12.9898 * i as f64).sin()).rem_euclid(1.0) - 0.5
    }

    fn deviation(a: &[f64], b: impl Fn(usize) -> f64) -> f64 {
        let squares: f64 = a.iter().enumerate().map(|(i, x)| (x - b(i)).powi(2)).sum();
        (squares / a.len() as f64).sqrt()
    }

    const PULL: f64 = 2e-4;

    #[test]
    fn the_noise_of_the_sensor_goes_and_what_the_muscle_feels_stays() {
        let (level, scatter) = (300e3, |i: usize| 1.5e3 * noise(i));
        let read: Vec<f64> = (0..5000).map(|i| level + scatter(i)).collect();
        let of_true: Vec<f64> = (0..5000).map(|i| PULL * level + 0.05 * noise(i + 7000)).collect();
        assert!(
            deviation(&smoothed_pressure(&read, &of_true, PULL), |_| level)
                < 0.45 * deviation(&read, |_| level)
        );
        let of_read: Vec<f64> =
            read.iter().enumerate().map(|(i, p)| PULL * p + 0.05 * noise(i + 7000)).collect();
        assert!(
            deviation(&smoothed_pressure(&read, &of_read, PULL), |i| read[i])
                < 0.1 * deviation(&read, |_| level)
        );
    }

    /// Half of the scatter is the regulator's, half the sensor's: the best estimate keeps half of it, and errs by 0.71 of either.
    #[test]
    fn of_what_the_muscle_feels_in_part_that_part_stays() {
        let truth = |i: usize| 300e3 + 1e3 * noise(i);
        let read: Vec<f64> = (0..5000).map(|i| truth(i) + 1e3 * noise(i + 9000)).collect();
        let force: Vec<f64> = (0..5000).map(|i| PULL * truth(i) + 0.02 * noise(i + 20_000)).collect();
        let left = deviation(&smoothed_pressure(&read, &force, PULL), truth);
        assert!(left < 0.8 * deviation(&read, truth), "{left}");
    }

    #[test]
    fn steps_and_ramps_of_the_pressure_stay_where_they_are() {
        let pressure = |i: usize| match i % 400 {
            k @ 0..200 => 100e3 + 1e3 * k as f64,
            _ => 150e3,
        };
        let read: Vec<f64> = (0..2000).map(|i| pressure(i) + 400.0 * noise(i)).collect();
        let smooth = smooth(&read, white_noise(&read), 0.0, &[]);
        assert!(smooth.iter().enumerate().all(|(i, p)| (p - pressure(i)).abs() < 400.0), "{smooth:?}");
    }

    /// Slow strokes, of which a row is no more than the noise: the corners of all reversals together show what smoothing takes away.
    #[test]
    fn the_corner_of_a_reversal_is_not_rounded() {
        let stroke = |i: usize| 1e-5 * (i % 200).min(200 - i % 200) as f64;
        let read: Vec<f64> = (0..20_000).map(|i| stroke(i) + 6e-5 * noise(i)).collect();
        let tops: Vec<usize> = (0..100).map(|k| 200 * k + 100).collect();
        let rounded = |smooth: &[f64]| tops.iter().map(|i| stroke(*i) - smooth[*i]).sum::<f64>() / 100.0;
        let reversals: Vec<usize> = (1..200).map(|k| 100 * k + 1).collect();
        let (across, within) = (smoothed_stroke(&read, &[]), smoothed_stroke(&read, &reversals));
        assert!(rounded(&across) > 1e-5, "{}", rounded(&across));
        assert!(rounded(&within).abs() < 4e-6, "{}", rounded(&within));
        // Elsewhere it is as smooth as before.
        let middle =
            |series: &[f64]| (0..100).map(|k| (series[200 * k + 50] - stroke(50)).abs()).sum::<f64>();
        assert_eq!(middle(&within), middle(&across));
    }

    #[test]
    fn short_constant_and_unfelt_series_stay() {
        for series in [&[][..], &[1.0, 2.0], &[3.0; 40]] {
            assert_eq!(smoothed_pressure(series, series, PULL), series);
        }
        assert_eq!(share_felt(&[1.0, 2.0, 1.0], &[1.0, 2.0, 1.0], 0.0), 0.0);
    }
}
