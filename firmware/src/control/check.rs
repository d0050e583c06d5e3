//! Whether settings can be used.

use model_core::link::messages::{Field, Refusal};
use model_core::link::settings::Settings;

/// Looks at every number of new settings.
///
/// # Errors
/// [`Refusal::Value`] with the group that a wrong number is in.
pub fn check_settings(settings: &Settings) -> Result<(), Refusal> {
    let f = &settings.force_loop;
    let s = &settings.stroke_loop;
    let j = &settings.joint;
    let r = &settings.regulator;
    let l = &settings.limits;
    let w = &settings.watch;
    let groups = [
        (Field::ForceLoop, not_negative(&[f.proportional_pa_per_n, f.integral_pa_per_n_s, f.trim_limit_pa])),
        (
            Field::StrokeLoop,
            not_negative(&[s.proportional_n_per_m, s.integral_n_per_m_s, s.damping_n_s_per_m])
                && finite(&[s.load_n, s.load_stiffness_n_per_m])
                && positive(&[s.force_limit_n]),
        ),
        (
            Field::Joint,
            not_negative(&[j.proportional_nm_per_rad, j.integral_nm_per_rad_s, j.damping_nm_s_per_rad])
                && finite(&[j.rest_stroke_m])
                && positive(&[j.radius_m, j.torque_limit_nm]),
        ),
        (
            Field::Regulator,
            positive(&[r.gain, r.rate_pa_per_s, r.command_max_pa])
                && finite(&[r.offset_pa])
                && not_negative(&[r.lag_s, r.line_s, r.deadband_pa, r.lead, 1.0 - r.lead]),
        ),
        (
            Field::Limits,
            positive(&[l.pressure_pa, l.speed_m_per_s, l.force_n, l.slew_pa_per_s])
                && in_order(l.stroke_min_m, l.stroke_max_m),
        ),
        (
            Field::SensorWatch,
            [&settings.pressure, &settings.stroke, &settings.force]
                .into_iter()
                .all(|sensor| in_order(sensor.low, sensor.high) && positive(&[sensor.jump])),
        ),
        (Field::Watch, not_negative(&[w.disagree_n]) && positive(&[w.follow_pa]) && w.host_silence_ticks > 0),
        (Field::Bands, positive(&[settings.motion_band_m, settings.pressure_band_pa])),
    ];
    match groups.into_iter().find(|(_, good)| !good) {
        Some((field, _)) => Err(Refusal::Value(field)),
        None => Ok(()),
    }
}

#[inline(never)]
fn finite(values: &[f32]) -> bool {
    values.iter().all(|value| value.is_finite())
}

#[inline(never)]
fn not_negative(values: &[f32]) -> bool {
    finite(values) && values.iter().all(|value| *value >= 0.0)
}

#[inline(never)]
fn positive(values: &[f32]) -> bool {
    finite(values) && values.iter().all(|value| *value > 0.0)
}

fn in_order(low: f32, high: f32) -> bool {
    finite(&[low, high]) && low < high
}
