//! Setpoint profiles: the setpoint of a controller over time, as a user writes it.
//!
//! ```text
//! 60                                             this value, from now on
//! sine mean=60 amplitude=20 frequency=0.5        frequency in Hz
//! steps 40 60 80 hold=2                          each value for 2 s, again and again
//! trapezoid low=40 high=80 ramp=1 hold=1         times in s
//! chirp mean=60 amplitude=10 from=0.1 to=5 duration=30
//! @profile.csv                                   time in s and value, joined by straight lines
//! ```

use std::path::Path;

use model_core::link::messages::{Mode, Reference, SetPoint};

use pam_data::error::{DataCode, Error, Result, nearest};
use pam_data::file_kind::FileKind;

/// What is controlled, and the unit that people write it in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// Force of the muscle, written in N.
    Force,
    /// Gauge pressure, written in kPa.
    Pressure,
    /// Contraction stroke, written in mm.
    Stroke,
    /// Degrees, of a joint that two muscles move.
    Angle {
        /// Stiffness of the joint, N·m/rad.
        stiffness_nm_per_rad: f32,
    },
}

impl Quantity {
    /// The controller's mode.
    #[must_use]
    pub const fn mode(self) -> Mode {
        match self {
            Self::Force => Mode::Force,
            Self::Pressure => Mode::Pressure,
            Self::Stroke => Mode::Stroke,
            Self::Angle { .. } => Mode::Pair,
        }
    }

    /// The unit that people write.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Pressure => "kPa",
            Self::Stroke => "mm",
            Self::Angle { .. } => "°",
        }
    }

    /// SI units in one of them.
    #[must_use]
    pub const fn scale(self) -> f64 {
        match self {
            Self::Force => 1.0,
            Self::Pressure => 1e3,
            Self::Stroke => 1e-3,
            Self::Angle { .. } => std::f64::consts::PI / 180.0,
        }
    }

    /// The message for one value in SI units.
    #[must_use]
    pub const fn set_point(self, value: f32) -> SetPoint {
        match self {
            Self::Force => SetPoint::Force(value),
            Self::Pressure => SetPoint::Pressure(value),
            Self::Stroke => SetPoint::Stroke(value),
            Self::Angle { stiffness_nm_per_rad } => SetPoint::Pair { angle_rad: value, stiffness_nm_per_rad },
        }
    }
}

/// A setpoint profile in SI units.
#[derive(Debug, Clone, PartialEq)]
pub enum SetpointProfile {
    /// One value.
    Constant(f32),
    /// A waveform that the device generates.
    Wave(Reference),
    /// Values that the host sends in turn, repeatedly.
    Steps {
        /// The values.
        values: Vec<f32>,
        /// Time at each, s.
        hold_s: f64,
    },
    /// Points at equal intervals, played by the device.
    Points {
        /// Time between points, s.
        step_s: f32,
        /// The values.
        values: Vec<f32>,
    },
}

/// Points of a table reference that are made from a file: as many as the firmware holds.
const POINTS: usize = 256;
/// A tick of every controller, s.
const TICK_S: f64 = 1e-3;

fn wrong(cause: impl Into<String>) -> Error {
    Error::new(DataCode::CallInvalid, cause).help(
        "write a value, or: sine mean= amplitude= frequency= | steps V1 V2 … hold= | trapezoid low= high= ramp= hold= | \
         chirp mean= amplitude= from= to= duration= | @FILE.csv",
    )
}

/// `name=value` parts of a profile.
struct Arguments<'a> {
    kind: &'a str,
    keyed: Vec<(&'a str, f64)>,
    positional: Vec<f64>,
}

impl<'a> Arguments<'a> {
    fn read(text: &'a str) -> Result<Self> {
        let mut words = text.split_whitespace();
        let kind = words.next().unwrap_or_default();
        let (mut keyed, mut positional) = (Vec::new(), Vec::new());
        for word in words {
            let (name, number) = word.split_once('=').map_or((None, word), |(n, v)| (Some(n), v));
            let value: f64 = number
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| wrong("not a number").value(word))?;
            match name {
                Some(name) => keyed.push((name, value)),
                None => positional.push(value),
            }
        }
        Ok(Self { kind, keyed, positional })
    }

    /// The values of exactly these names.
    fn take<const N: usize>(&self, names: [&str; N]) -> Result<[f64; N]> {
        for (name, _) in &self.keyed {
            if !names.contains(name) {
                let near = nearest(name, names).map(|n| format!("; did you mean {n}=?")).unwrap_or_default();
                return Err(wrong(format!("{} knows no {name}={near}", self.kind)));
            }
        }
        let mut out = [0.0; N];
        for (to, name) in out.iter_mut().zip(names) {
            let mut found = self.keyed.iter().filter(|(n, _)| *n == name);
            *to = found.next().ok_or_else(|| wrong(format!("{} needs {name}=", self.kind)))?.1;
            if found.next().is_some() {
                return Err(wrong(format!("{name}= is given twice")));
            }
        }
        Ok(out)
    }
}

impl SetpointProfile {
    /// The smallest and the largest setpoint, SI; `None` where it comes later from elsewhere.
    #[must_use]
    pub fn range(&self) -> Option<(f32, f32)> {
        match self {
            Self::Constant(value) => Some((*value, *value)),
            Self::Wave(
                Reference::Sine { mean, amplitude, .. } | Reference::Chirp { mean, amplitude, .. },
            ) => Some((mean - amplitude.abs(), mean + amplitude.abs())),
            Self::Wave(Reference::Trapezoid { low, high, .. }) => Some((low.min(*high), low.max(*high))),
            Self::Wave(Reference::SetPoint | Reference::Table { .. }) => None,
            Self::Steps { values, .. } | Self::Points { values, .. } => {
                let smallest = values.iter().copied().reduce(f32::min)?;
                Some((smallest, values.iter().copied().reduce(f32::max)?))
            }
        }
    }

    /// Reads what a user wrote, in the quantity's unit.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] naming the word at fault; for `@FILE` also [`DataCode::FileUnreadable`] and the line at fault.
    pub fn parse(text: &str, quantity: Quantity) -> Result<Self> {
        let text = text.trim();
        if let Some(path) = text.strip_prefix('@') {
            return Self::from_file(Path::new(path), quantity);
        }
        let scale = quantity.scale();
        let si = |v: f64| (v * scale) as f32;
        if let Ok(value) = text.parse::<f64>() {
            return if value.is_finite() {
                Ok(Self::Constant(si(value)))
            } else {
                Err(wrong("not a number").value(text))
            };
        }
        let arguments = Arguments::read(text)?;
        if arguments.kind != "steps" && arguments.kind != "constant" && !arguments.positional.is_empty() {
            return Err(wrong(format!("{} takes name=value only", arguments.kind)).value(text));
        }
        let positive = |name: &str, value: f64| {
            if value > 0.0 { Ok(value) } else { Err(wrong(format!("{name}= must be above zero"))) }
        };
        match arguments.kind {
            "constant" => match arguments.positional[..] {
                [value] => Ok(Self::Constant(si(value))),
                _ => Err(wrong("constant takes one value")),
            },
            "sine" => {
                let [mean, amplitude, frequency] = arguments.take(["mean", "amplitude", "frequency"])?;
                Ok(Self::Wave(Reference::Sine {
                    mean: si(mean),
                    amplitude: si(amplitude),
                    frequency_hz: positive("frequency", frequency)? as f32,
                }))
            }
            "steps" => {
                let [hold] = arguments.take(["hold"])?;
                if arguments.positional.is_empty() {
                    return Err(wrong("steps needs at least one value"));
                }
                Ok(Self::Steps {
                    values: arguments.positional.iter().map(|v| si(*v)).collect(),
                    hold_s: positive("hold", hold)?,
                })
            }
            "trapezoid" => {
                let [low, high, ramp, hold] = arguments.take(["low", "high", "ramp", "hold"])?;
                Ok(Self::Wave(Reference::Trapezoid {
                    low: si(low),
                    high: si(high),
                    ramp_s: positive("ramp", ramp)? as f32,
                    hold_s: positive("hold", hold)? as f32,
                }))
            }
            "chirp" => {
                let [mean, amplitude, from, to, duration] =
                    arguments.take(["mean", "amplitude", "from", "to", "duration"])?;
                Ok(Self::Wave(Reference::Chirp {
                    mean: si(mean),
                    amplitude: si(amplitude),
                    from_hz: positive("from", from)? as f32,
                    to_hz: positive("to", to)? as f32,
                    duration_s: positive("duration", duration)? as f32,
                }))
            }
            other => {
                let known = ["sine", "steps", "trapezoid", "chirp", "constant"];
                let near = nearest(other, known).map(|n| format!("; did you mean {n}?")).unwrap_or_default();
                Err(wrong(format!("there is no setpoint profile `{other}`{near}")))
            }
        }
    }

    /// Two columns, time in seconds and value; a header line and `#` lines are passed over.
    fn from_file(path: &Path, quantity: Quantity) -> Result<Self> {
        let text = FileKind::Recording.read_text(path)?;
        let at = |line: usize, cause: &str| {
            Error::new(DataCode::RecordingNotANumber, cause).file(path).line(line as u64 + 1).help(format!(
                "a setpoint profile is lines of `time_s,value`, the value in {}",
                quantity.unit()
            ))
        };
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let cells: Vec<&str> = line.split([',', ';', '\t']).map(str::trim).collect();
            let parsed = match cells[..] {
                [time, value] => time.parse::<f64>().ok().zip(value.parse::<f64>().ok()),
                _ => return Err(at(number, "a line of a setpoint profile has two cells").value(line)),
            };
            match parsed.filter(|(t, v)| t.is_finite() && v.is_finite()) {
                Some((time, _)) if points.last().is_some_and(|(t, _)| time <= *t) => {
                    return Err(at(number, "time does not increase").value(line));
                }
                Some(point) => points.push(point),
                None if points.is_empty() && number == 0 => {}
                None => return Err(at(number, "not a number").value(line)),
            }
        }
        let [(begin, _), .., (end, _)] = points[..] else {
            return Err(at(0, "a setpoint profile needs at least two points"));
        };
        // The device joins points at equal times, whole ticks apart: the shortest interval, or what the room allows.
        let shortest = points.windows(2).map(|w| w[1].0 - w[0].0).fold(f64::INFINITY, f64::min);
        let least = shortest.max((end - begin) / (POINTS - 1) as f64);
        let step = (least / TICK_S - 1e-6).ceil().max(1.0) * TICK_S;
        let count = ((end - begin) / step - 1e-6).ceil() as usize + 1;
        let mut values = Vec::with_capacity(count);
        let mut behind = 1;
        for i in 0..count {
            let t = (begin + step * i as f64).min(end);
            while behind + 1 < points.len() && points[behind].0 < t {
                behind += 1;
            }
            let ((t0, v0), (t1, v1)) = (points[behind - 1], points[behind]);
            values
                .push(((v0 + (v1 - v0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)) * quantity.scale()) as f32);
        }
        Ok(Self::Points { step_s: step as f32, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_come_out_in_si_units() {
        let p = |t| SetpointProfile::parse(t, Quantity::Pressure).unwrap();
        assert_eq!(p("60"), SetpointProfile::Constant(60e3));
        assert_eq!(p("constant 60"), SetpointProfile::Constant(60e3));
        assert_eq!(p("steps 1 2 hold=0.5"), SetpointProfile::Steps { values: vec![1e3, 2e3], hold_s: 0.5 });
        assert_eq!(
            p("sine frequency=0.5 mean=60 amplitude=20"),
            SetpointProfile::Wave(Reference::Sine { mean: 60e3, amplitude: 20e3, frequency_hz: 0.5 })
        );
    }

    #[test]
    fn wrong_profiles_are_refused_with_the_reason() {
        let error = |t| SetpointProfile::parse(t, Quantity::Force).unwrap_err().to_string();
        assert!(error("sinus mean=1").contains("did you mean sine?"));
        assert!(error("sine mean=1 amplitude=2").contains("needs frequency="));
        assert!(error("sine mean=1 amplitud=2 frequency=1").contains("did you mean amplitude=?"));
        assert!(error("sine mean=x amplitude=2 frequency=1").contains("`mean=x`"));
        assert!(error("sine mean=1 mean=1 amplitude=2 frequency=1").contains("twice"));
        assert!(error("steps hold=1").contains("at least one"));
        assert!(error("trapezoid low=1 high=2 ramp=0 hold=1").contains("above zero"));
        assert!(error("nan").contains("not a number"));
        assert!(error("").contains("no setpoint profile"));
    }

    #[test]
    fn a_file_becomes_points_at_equal_times() {
        let path = std::env::temp_dir().join(format!("pam-profile-{}.csv", std::process::id()));
        std::fs::write(&path, "time_s,force_N\n0,10\n1,20\n# rest\n3,0\n").unwrap();
        let profile = SetpointProfile::parse(&format!("@{}", path.display()), Quantity::Force).unwrap();
        assert_eq!(profile, SetpointProfile::Points { step_s: 1.0, values: vec![10.0, 20.0, 10.0, 0.0] });
        // Many points become fewer, whole ticks apart: else the device would play them too fast.
        let many: String = (0..1_200).map(|n| format!("{},{n}\n", 0.0025 * f64::from(n))).collect();
        std::fs::write(&path, many).unwrap();
        let SetpointProfile::Points { step_s, values } =
            SetpointProfile::parse(&format!("@{}", path.display()), Quantity::Force).unwrap()
        else {
            panic!("a file is points")
        };
        assert_eq!((step_s, values.len()), (0.012, 251));
        assert!(
            (values[100] - 480.0).abs() < 1e-3 && values[250] == 1_199.0,
            "{} {}",
            values[100],
            values[250]
        );
        std::fs::write(&path, "0,10\n1,20\n1,30\n").unwrap();
        let error = SetpointProfile::parse(&format!("@{}", path.display()), Quantity::Force).unwrap_err();
        assert_eq!(error.place().line, Some(3));
        std::fs::remove_file(&path).unwrap();
    }
}
