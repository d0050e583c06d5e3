//! Where the excess error is concentrated.

use pam_diagnose::verdict::Region;

/// A region as a sentence without its full stop.
#[must_use]
pub(crate) fn region(r: &Region) -> String {
    if r.coordinate == "frequency" {
        return format!(
            "{:.0} % of the excess error is periodic in time, at {:.2} Hz",
            100.0 * r.share,
            0.5 * (r.from + r.to)
        );
    }
    format!(
        "{:.0} % of the excess error is {}, in {:.0} % of the rows",
        100.0 * r.share,
        match &r.recordings[..] {
            [] => place(&r.coordinate, r.from, r.to),
            [one] => format!("in the recording \"{one}\""),
            [first, .., last] => format!("in the recordings from \"{first}\" to \"{last}\""),
        },
        100.0 * r.rows
    )
}

fn place(coordinate: &str, from: f64, to: f64) -> String {
    let range = |scale: f64, unit: &str, digits: usize| {
        let number = |value: f64| {
            let text = format!("{:.digits$}", value * scale);
            // Zero after rounding has no sign.
            let zero = text.trim_start_matches(['-', '0', '.']).is_empty();
            text.trim_start_matches(|c| c == '-' && zero).to_owned()
        };
        if number(from) == number(to) {
            format!("{}{unit}", number(from))
        } else {
            format!("{} to {}{unit}", number(from), number(to))
        }
    };
    match coordinate {
        "recording" => format!("in recording {}", range(1.0, "", 0)),
        "time" => format!("at times of {}", range(1.0, " s", 0)),
        "cycle" => format!("in cycle {} at a pressure", range(1.0, "", 0)),
        "run-in-mounting" => format!("in run {} of a mounting", range(1.0, "", 0)),
        "time-since-mounting" => format!("{} after the mounting", range(1.0, " s", 0)),
        "mounting" => format!("in mounting {}", range(1.0, "", 0)),
        "pressure" => format!("at {}", range(1e-3, " kPa", 0)),
        "contraction" => format!("at contractions of {}", range(100.0, " %", 2)),
        "direction" if from > 0.0 => "while shortening".to_owned(),
        "direction" if to < 0.0 => "while lengthening".to_owned(),
        "direction" => "in both directions".to_owned(),
        "speed" => format!("at speeds of {}", range(1e3, " mm/s", 2)),
        "acceleration" => format!("at accelerations of {}", range(1e3, " mm/s²", 1)),
        "force" => format!("at forces of {}", range(1.0, " N", 1)),
        "pressure-rate" => format!("at pressure rates of {}", range(1e-3, " kPa/s", 2)),
        "since-reversal" => format!("{} after a reversal", range(1.0, " s", 2)),
        "hold-time" => format!("after a hold of {}", range(1.0, " s", 1)),
        "largest-contraction-so-far" if to >= -1e-4 => "at the largest contraction so far".to_owned(),
        "largest-contraction-so-far" => {
            format!("{} below the largest contraction so far", range(-100.0, " %", 2))
        }
        "temperature" => format!("at {}", range(1.0, " K", 1)),
        _ => range(1.0, "", 3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_that_begins_at_nothing_has_no_minus() {
        let force = |from: f64| Region {
            coordinate: "force".into(),
            from,
            to: 13.1,
            share: 0.39,
            rows: 0.17,
            p: 0.01,
            unit: "N".into(),
            recordings: Vec::new(),
        };
        assert_eq!(
            region(&force(-0.04)),
            "39 % of the excess error is at forces of 0.0 to 13.1 N, in 17 % of the rows"
        );
        assert!(region(&force(-0.06)).contains("-0.1 to 13.1 N"));
        assert!(region(&force(13.06)).contains("at forces of 13.1 N,"));
    }
}
