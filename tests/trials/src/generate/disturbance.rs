//! What spoils the recordings of a trial: noise, lost rows, and mistakes of the operator.

use crate::residuals::Residuals;
use crate::spec::Operator;
use virtual_bench::recording::Recording;
use virtual_bench::rng::Rng;

/// Samples per second of every protocol used here.
const RATE: f64 = 10.0;

/// Lose some rows: uneven sampling.
pub(super) fn downsample(files: &mut [Recording], part: f64, seed: u64) {
    if part <= 0.0 {
        return;
    }
    let mut r = Rng::stream(seed, "lost rows");
    for f in files {
        f.rows.retain(|_| !r.chance(part));
    }
}

/// Make every file as loud as it likes, up to `most` (N) of white noise.
pub(super) fn disturb(files: &mut [Recording], most: f64, seed: u64) {
    if most <= 0.0 {
        return;
    }
    let mut r = Rng::stream(seed, "uneven noise");
    for f in files {
        let loud = most * r.unit();
        f.rows.iter_mut().for_each(|row| row.force += loud * r.normal());
    }
}

/// Put resampled real residuals of deviation `deviation` (N) on the force.
pub(super) fn resample(files: &mut [Recording], residuals: &Residuals, deviation: f64, seed: u64) {
    let mut r = Rng::stream(seed, "real residuals");
    for f in files {
        let series = residuals.series(f.rows.len(), RATE, &mut r);
        f.rows.iter_mut().zip(series).for_each(|(row, v)| row.force += deviation * v);
    }
}

/// What the person at the bench makes of the files.
pub(super) fn mishandle(files: &mut Vec<Recording>, o: &Operator, blocked: f64, seed: u64) {
    let mut r = Rng::stream(seed, "operator");
    let tare = |f: &Recording| f.name.contains("tare");
    let lost = |r: &mut Rng, most: f64| if r.chance(0.34) { (r.range(0.0, most) * RATE) as usize } else { 0 };
    for f in files.iter_mut().filter(|f| !tare(f)) {
        let (first, last) = (lost(&mut r, o.late_s), lost(&mut r, o.early_s));
        if f.rows.len() > 2 * (first + last) {
            f.rows.drain(..first);
            f.rows.truncate(f.rows.len() - last);
        }
        let away = o.tared_drift * blocked * r.range(-1.0, 1.0) / f.rows.len().max(1) as f64;
        f.rows.iter_mut().enumerate().for_each(|(i, row)| row.force += away * i as f64);
    }
    let tares: Vec<usize> = (0..files.len()).filter(|&i| tare(&files[i])).collect();
    if o.forgot_tare && tares.len() > 1 {
        files.remove(tares[r.index(tares.len())]);
    }
    let long: Vec<usize> = (0..files.len()).filter(|&i| files[i].rows.len() > 600).collect();
    if o.restarted && !long.is_empty() {
        let at = long[r.index(long.len())];
        let cut = (files[at].rows.len() as f64 * r.range(0.3, 0.7)) as usize;
        let mut rows = files[at].rows.split_off(cut);
        rows.drain(..40);
        let name = format!("{}_again", files[at].name);
        files.insert(at + 1, Recording { name, rows });
    }
    for row in files.iter_mut().flat_map(|f| &mut f.rows) {
        row.time *= 1.0 + o.clock_skew;
    }
}
