//! Lines in the spectrum of the residual: mains hum, its alias with the sampling, an oscillating regulator.
//!
//! Mean power of overlapping windowed stretches (P. D. Welch, IEEE Trans. Audio and Electroacoustics 15 (1967) 70–73); a line is a
//! frequency whose power stands out from its neighbours'. How far it does by chance is estimated from the same recordings with their
//! half-strokes shuffled and turned round in themselves, which tears a steady beat apart and leaves the rest.

use rayon::prelude::*;

use super::criteria::location::{
    LINE_NEIGHBOURS, LINE_PERIODS, LINE_SHUFFLES, LINE_WIDTH, LONGEST_STRETCH, SHORTEST_STRETCH, STRETCHES,
};
use super::linear::Random;
use super::location::shuffled;
use super::rows::Rows;
use pam_data::statistics::median;

/// A line in the spectrum of the misfit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// Its frequency, Hz, and half the resolution.
    pub hertz: f64,
    /// Half the resolution, Hz.
    pub half: f64,
    /// Its share of the misfit's energy.
    pub share: f64,
    /// How often shuffled half-strokes show as strong a one.
    pub p: f64,
}

/// Fast Fourier transform in place (J. W. Cooley and J. W. Tukey, Mathematics of Computation 19 (1965) 297–301); the length is a
/// power of two.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    let mut j = 0;
    for i in 1..n {
        let mut bit = n >> 1;
        while j & bit != 0 {
            j ^= bit;
            bit >>= 1;
        }
        j |= bit;
        if i < j {
            re.swap(i, j);
            im.swap(i, j);
        }
    }
    let mut size = 2;
    while size <= n {
        let angle = -std::f64::consts::TAU / size as f64;
        let (sin, cos) = angle.sin_cos();
        for start in (0..n).step_by(size) {
            let (mut wr, mut wi) = (1.0, 0.0);
            for k in start..start + size / 2 {
                let other = k + size / 2;
                let (tr, ti) = (re[other] * wr - im[other] * wi, re[other] * wi + im[other] * wr);
                (re[other], im[other]) = (re[k] - tr, im[k] - ti);
                (re[k], im[k]) = (re[k] + tr, im[k] + ti);
                (wr, wi) = (wr * cos - wi * sin, wr * sin + wi * cos);
            }
        }
        size *= 2;
    }
}

/// Mean power of the stretches of a series, from the first frequency above zero on.
fn power(series: &[f64], length: usize) -> Vec<f64> {
    let mut sum = vec![0.0; length / 2];
    let window: Vec<f64> = (0..length)
        .map(|i| 0.5 - 0.5 * (std::f64::consts::TAU * (i as f64 + 0.5) / length as f64).cos())
        .collect();
    for start in (0..=series.len().saturating_sub(length)).step_by(length / 2) {
        let Some(part) = series.get(start..start + length) else { break };
        let mean = part.iter().sum::<f64>() / length as f64;
        let mut re: Vec<f64> = part.iter().zip(&window).map(|(v, w)| (v - mean) * w).collect();
        let mut im = vec![0.0; length];
        transform(&mut re, &mut im);
        for (k, s) in sum.iter_mut().enumerate() {
            *s += re[k + 1].powi(2) + im[k + 1].powi(2);
        }
    }
    sum
}

/// The strongest line: index, how often its neighbours' power it has, its share.
fn strongest(power: &[f64], lowest: usize) -> Option<(usize, f64, f64)> {
    let total: f64 = power.iter().sum();
    if !(total > 0.0) {
        return None;
    }
    (lowest.max(LINE_WIDTH + 1)..power.len().saturating_sub(LINE_WIDTH + 2))
        .map(|k| {
            let (from, to) = (k.saturating_sub(LINE_NEIGHBOURS), (k + LINE_NEIGHBOURS + 1).min(power.len()));
            let mut others: Vec<f64> =
                (from..to).filter(|j| j.abs_diff(k) > LINE_WIDTH).map(|j| power[j]).collect();
            let floor = median(&mut others).max(1e-300);
            let own: f64 = (k - LINE_WIDTH..=k + LINE_WIDTH).map(|j| (power[j] - floor).max(0.0)).sum();
            (k, power[k] / floor, own / total)
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))
}

/// The strongest line in a weighted residual, where there is enough of it to decide. What repeats with the strokes themselves is no
/// line: a quarter of a typical half-stroke is the longest period.
pub(crate) fn line(
    rows: &Rows,
    residual: &[f64],
    blocks: &[(usize, usize)],
    step: f64,
    seed: u64,
) -> Option<Line> {
    let length = (residual.len() / STRETCHES).max(1).next_power_of_two().min(LONGEST_STRETCH);
    if length < SHORTEST_STRETCH || !(step > 0.0) || rows.isometric {
        return None;
    }
    let mut spans: Vec<f64> = blocks.iter().map(|(a, b)| (b - a) as f64).collect();
    let lowest = (LINE_PERIODS * length as f64 / median(&mut spans).max(1.0)).ceil() as usize;
    let seen = power(residual, length);
    let (at, height, share) = strongest(&seen, lowest)?;
    let beyond: usize = (0..LINE_SHUFFLES)
        .into_par_iter()
        .map(|s| {
            let mut random = Random(seed.wrapping_mul(1000).wrapping_add(s as u64));
            let shuffled = shuffled(residual, blocks, &mut random);
            usize::from(strongest(&power(&shuffled, length), lowest).is_some_and(|s| s.1 >= height))
        })
        .sum();
    let resolution = 1.0 / (length as f64 * step);
    Some(Line {
        hertz: (at + 1) as f64 * resolution,
        half: LINE_WIDTH as f64 * resolution,
        share,
        p: (beyond as f64 + 1.0) / (LINE_SHUFFLES as f64 + 1.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows_and_blocks(n: usize) -> (Rows, Vec<(usize, usize)>) {
        (Rows::default(), (0..n / 200).map(|b| (b * 200, b * 200 + 200)).collect())
    }

    #[test]
    fn a_hum_is_found_at_its_frequency_and_noise_has_none() {
        let (rows, blocks) = rows_and_blocks(8000);
        let mut random = Random(5);
        let mut slow = 0.0;
        let noise: Vec<f64> = (0..8000)
            .map(|_| {
                slow = 0.95 * slow + 0.3 * random.normal();
                slow + random.normal()
            })
            .collect();
        let hum: Vec<f64> = (0..8000).map(|i| noise[i] + 1.5 * (i as f64 * 0.1 * 8.1).sin()).collect();
        let found = line(&rows, &hum, &blocks, 0.1, 3).expect("a line");
        assert!((found.hertz - 8.1 / std::f64::consts::TAU).abs() < found.half, "{found:?}");
        assert!(found.p <= 0.02 && found.share > 0.2, "{found:?}");
        let none = line(&rows, &noise, &blocks, 0.1, 3).expect("a strongest one");
        assert!(none.p > 0.02 || none.share < 0.05, "{none:?}");
    }
}
