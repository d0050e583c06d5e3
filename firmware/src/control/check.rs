//! Whether settings can be used.

use model_core::link::messages::{Field, Refusal};
use model_core::link::settings::Settings;

/// Looks at every number of new settings.
///
/// # Errors
/// [`Refusal::Value`] with the group that a wrong number is in.
pub fn check_settings(settings: &Settings) -> Result<(), Refusal> {
    let positive = |value: f32| value > 0.0 && value.is_finite();
    let not_negative = |value: f32| value >= 0.0 && value.is_finite();
    let f = &settings.force_loop;
    let s = &settings.stroke_loop;
    let j = &settings.joint;
    let r = &settings.regulator;
    let l = &settings.limits;
    let watched = |w: &model_core::link::settings::SensorWatch| {
        w.low.is_finite() && w.high.is_finite() && w.low < w.high && positive(w.jump)
    };
    let groups = [
        (
            Field::ForceLoop,
            [f.proportional_pa_per_n, f.integral_pa_per_n_s, f.trim_limit_pa].into_iter().all(not_negative),
        ),
        (
            Field::StrokeLoop,
            [s.proportional_n_per_m, s.integral_n_per_m_s, s.damping_n_s_per_m].into_iter().all(not_negative)
                && s.load_n.is_finite()
                && s.load_stiffness_n_per_m.is_finite()
                && positive(s.force_limit_n),
        ),
        (
            Field::Joint,
            [j.proportional_nm_per_rad, j.integral_nm_per_rad_s, j.damping_nm_s_per_rad]
                .into_iter()
                .all(not_negative)
                && positive(j.radius_m)
                && j.rest_stroke_m.is_finite()
                && positive(j.torque_limit_nm),
        ),
        (
            Field::Regulator,
            positive(r.gain)
                && r.offset_pa.is_finite()
                && not_negative(r.lag_s)
                && not_negative(r.line_s)
                && positive(r.rate_pa_per_s)
                && not_negative(r.deadband_pa)
                && positive(r.command_max_pa)
                && (0.0..=1.0).contains(&r.lead),
        ),
        (
            Field::Limits,
            positive(l.pressure_pa)
                && l.stroke_min_m.is_finite()
                && l.stroke_max_m.is_finite()
                && l.stroke_min_m < l.stroke_max_m
                && positive(l.speed_m_per_s)
                && positive(l.force_n)
                && positive(l.slew_pa_per_s),
        ),
        (
            Field::SensorWatch,
            watched(&settings.pressure) && watched(&settings.stroke) && watched(&settings.force),
        ),
        (
            Field::Watch,
            not_negative(settings.watch.disagree_n)
                && positive(settings.watch.follow_pa)
                && settings.watch.host_silence_ticks > 0,
        ),
        (Field::Bands, positive(settings.motion_band_m) && positive(settings.pressure_band_pa)),
    ];
    match groups.into_iter().find(|(_, good)| !good) {
        Some((field, _)) => Err(Refusal::Value(field)),
        None => Ok(()),
    }
}
