//! Recordings that begin otherwise than the one before ended, because the muscle was vented and filled in between.

use super::*;

/// Friction of 8 % that passes over to the other direction with the travel, m, by an exponential law. `begins` is its direction at the
/// beginning of each recording.
fn friction_that_builds_up(mut campaign: Campaign, travel: f64, begins: f64) -> Campaign {
    let mut random = Random(6);
    for r in &mut campaign.recordings {
        let Recording { stroke, force: Some(force), .. } = r else { continue };
        let mut direction = begins;
        for i in 0..force.len() {
            let moved = stroke[i] - stroke[i.max(1) - 1];
            if moved != 0.0 {
                direction = moved.signum() + (direction - moved.signum()) * (-moved.abs() / travel).exp();
            }
            force[i] = force[i] * (1.0 - 0.08 * direction) + 0.05 * random.normal();
        }
        stroke.iter_mut().for_each(|x| *x += 1e-6 * random.normal());
    }
    campaign
}

#[test]
fn friction_that_builds_up_is_named_wherever_it_stands_at_the_beginning() {
    for begins in [1.0, -1.0] {
        let campaign = friction_that_builds_up(loops(&[0.2]), 1.5e-4, begins);
        let d = ask(&campaign);
        assert_eq!(names(&d), ["presliding-hysteresis"], "begins at {begins}");
        let remarked = d.remarks.iter().any(|r| matches!(r, Remark::BeginsWithinStroke(_)));
        assert_eq!(remarked, begins > 0.0, "{:?}", d.remarks);
        let table = refitted_table::refit(&campaign, &described(), &d).expect("a table");
        assert_eq!(table.file.table.effects.len(), 1, "{:?}", table.comparison);
        assert!(table.rms_after < 0.4 * table.rms_before, "{} {}", table.rms_after, table.rms_before);
        assert!(d.missing[0].share_explained > 0.8, "begins at {begins}: {}", d.missing[0].share_explained);
    }
}

/// The force falls by 4 % of what the pressure makes within the first minute after filling, by the logarithm of the time, in each recording.
#[test]
fn creep_from_the_filling_on_is_no_gain_of_a_sensor() {
    let mut campaign = recorded(loops(&[0.1, 0.3, 0.9]), 8, coloured(0.05, 0.3), |_, _, _| 0.0);
    let blocked = quantile(&mut campaign.recordings[5].force.clone().expect("a force"), 0.999);
    for r in &mut campaign.recordings {
        let Recording { time, pressure, force: Some(force), .. } = r else { continue };
        for ((f, t), p) in force.iter_mut().zip(&*time).zip(&*pressure) {
            *f -= 0.04 * blocked * p / 550e3 * (t - time[0]).ln_1p() / 61.0_f64.ln();
        }
    }
    let d = ask(&campaign);
    assert_eq!(names(&d).first(), Some(&"log-creep"), "{:?}", names(&d));
    assert!(d.remarks.contains(&Remark::BeginsJustFilled("log-creep".into())), "{:?}", d.remarks);
}
