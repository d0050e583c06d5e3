//! Recordings of which every channel passed the same low-pass filter.

use super::*;

/// Filters of columns at 10 Hz: a centred mean, a first-order one, and a Butterworth filter of second order, each well below the strokes'
/// frequencies.
fn mean_of_fifteen(column: &[f64]) -> Vec<f64> {
    let around = |i: usize| &column[i.saturating_sub(7)..(i + 8).min(column.len())];
    (0..column.len()).map(|i| around(i).iter().sum::<f64>() / around(i).len() as f64).collect()
}

fn first_order(column: &[f64]) -> Vec<f64> {
    let mut state = column[0];
    let step = |x: &f64| {
        state += (1.0 - (-0.1_f64 / 0.4).exp()) * (x - state);
        state
    };
    column.iter().map(step).collect()
}

/// Cut-off frequency 0.5 Hz, by the bilinear transform.
fn butterworth(column: &[f64]) -> Vec<f64> {
    let k = (std::f64::consts::PI * 0.5 / 10.0).tan();
    let norm = 1.0 / (1.0 + std::f64::consts::SQRT_2 * k + k * k);
    let (b, a1, a2) =
        (k * k * norm, 2.0 * (k * k - 1.0) * norm, (1.0 - std::f64::consts::SQRT_2 * k + k * k) * norm);
    let (mut x1, mut x2, mut y1, mut y2) = (column[0], column[0], column[0], column[0]);
    let step = |x: &f64| {
        let y = b * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
        (x2, x1, y2, y1) = (x1, *x, y1, y);
        y
    };
    column.iter().map(step).collect()
}

fn filtered(mut campaign: Campaign, filter: fn(&[f64]) -> Vec<f64>) -> Campaign {
    for r in &mut campaign.recordings {
        let Recording { pressure, stroke, force: Some(force), .. } = r else { continue };
        for column in [pressure, stroke, force] {
            *column = filter(column);
        }
    }
    campaign
}

/// Sines of 12 s at six pressures.
fn sines() -> Campaign {
    let mut step = Vec::new();
    for p in [230.0, 290.0, 350.0, 410.0, 480.0, 550.0] {
        step.push(Step::Pressure { to_kpa: p, rate_kpa_s: Some(50.0), settle_s: 1.0 });
        step.push(Step::Move { to: Place { free: Some(0.5), ..Place::default() }, speed_mm_s: 1.0 });
        step.push(Step::File { name: format!("{p:.0}kPa") });
        step.push(Step::Sine { amplitude_mm: 2.0, frequency_hz: 1.0 / 12.0, seconds: 72.0 });
        step.push(Step::EndFile);
    }
    play(&Protocol { name: "sines".into(), sample_hz: 10.0, step }, &muscle()).expect("playable")
}

/// Time over which friction turns, where the recordings are found to be filtered.
fn turns_over(d: &Diagnosis) -> Option<f64> {
    d.remarks.iter().find_map(|r| if let Remark::FilteredChannels { over } = r { Some(*over) } else { None })
}

#[test]
fn a_filter_of_all_channels_is_no_missing_effect() {
    let noise = || coloured(0.2, 2.0);
    for (motion, campaign) in [("loops", loops(&[0.5])), ("sines", sines())] {
        let plain = recorded(campaign, 3, noise(), |_, _, _| 0.0);
        assert_eq!(turns_over(&ask(&plain)), None, "{motion}");
        for (name, filter) in [
            ("mean", mean_of_fifteen as fn(&[f64]) -> Vec<f64>),
            ("first order", first_order),
            ("Butterworth", butterworth),
        ] {
            let d = ask(&filtered(plain.clone(), filter));
            assert_eq!(names(&d), [""; 0], "{motion}, {name}: {:?}", d.remarks);
            let over = turns_over(&d).unwrap_or_else(|| panic!("{motion}, {name}: {:?}", d.remarks));
            assert!((0.5..4.0).contains(&over), "{motion}, {name}: {over} s");
        }
    }
}

/// Presliding turns friction over a travel, after the reversal: that is physics.
#[test]
fn friction_that_turns_over_a_travel_is_no_filter() {
    let mut campaign = recorded(loops(&[0.5]), 4, coloured(0.2, 2.0), |_, _, _| 0.0);
    for r in &mut campaign.recordings {
        let Recording { stroke, force: Some(force), .. } = r else { continue };
        let (mut bent, mut sign) = (1.0, 1.0);
        for i in 1..force.len() {
            let travel = stroke[i] - stroke[i - 1];
            if travel.abs() > 1e-5 {
                sign = travel.signum();
            }
            bent = sign + (bent - sign) * (-travel.abs() / 6e-4).exp();
            let quasi = force[i] / (1.0 - 0.08 * sign);
            force[i] += 0.08 * quasi * (sign - bent);
        }
    }
    let d = ask(&campaign);
    assert_eq!(turns_over(&d), None);
    assert!(!d.missing.is_empty(), "{:?} {:?}", d.verdict(), d.remarks);
}
