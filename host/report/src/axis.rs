//! Axes: what they are called, where their ticks are, how numbers on them are written.

/// How an axis maps numbers to places.
#[derive(Debug, Clone, PartialEq)]
pub enum Scale {
    /// Equal steps are equally far apart.
    Linear,
    /// Equal steps are equally far apart, and only whole numbers exist: runs, recordings.
    Whole,
    /// Equal ratios are equally far apart; numbers that are not positive are not drawn.
    Log,
    /// Named places 0, 1, 2, … for bars.
    Names(Vec<String>),
}

/// One axis of a panel.
///
/// ```
/// use pam_report::Axis;
/// let axis = Axis::new("pressure P", "kPa").from_zero();
/// assert_eq!(axis.title(), "pressure P (kPa)");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it shows, with its symbol.
    pub label: String,
    /// Unit, or empty.
    pub unit: String,
    /// How numbers become places.
    pub scale: Scale,
    /// Fixed ends; found from the data when absent.
    pub range: Option<(f64, f64)>,
    /// Whether zero is always shown.
    pub zero: bool,
}

impl Axis {
    /// A linear axis.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), scale: Scale::Linear, range: None, zero: false }
    }

    /// A linear axis of something that is counted.
    pub fn whole(label: impl Into<String>) -> Self {
        Self { scale: Scale::Whole, ..Self::new(label, "") }
    }

    /// A logarithmic axis.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { scale: Scale::Log, ..Self::new(label, unit) }
    }

    /// An axis of named places 0, 1, 2, …
    pub fn names(label: impl Into<String>, names: Vec<String>) -> Self {
        Self { scale: Scale::Names(names), ..Self::new(label, "") }
    }

    /// With fixed ends.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Always showing zero, for quantities whose size matters and not only their change.
    #[must_use]
    pub fn from_zero(mut self) -> Self {
        self.zero = true;
        self
    }

    /// Label and unit.
    #[must_use]
    pub fn title(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} ({})", self.label, self.unit) }
    }

    /// The ends of the axis for data from `low` to `high`, with some air, on whole ticks where that costs little.
    pub(crate) fn ends(&self, data: Option<(f64, f64)>) -> (f64, f64) {
        let (low, high) = match (self.range, &self.scale) {
            (Some((low, high)), _) if low < high && low.is_finite() && high.is_finite() => {
                if self.scale != Scale::Log || low > 0.0 {
                    return (low, high);
                }
                (high * 1e-3, high)
            }
            (_, Scale::Names(names)) => return (-0.5, names.len().max(1) as f64 - 0.5),
            (_, Scale::Log) => return log_ends(data),
            (_, Scale::Linear | Scale::Whole) => data.unwrap_or((0.0, 1.0)),
        };
        let (mut low, mut high) = (low, high);
        if self.zero {
            low = low.min(0.0);
            high = high.max(0.0);
        }
        let span = high - low;
        if !(span > 1e-12 * low.abs().max(high.abs())) {
            let half = if low == 0.0 { 0.5 } else { low.abs() * 0.05 };
            return (low - half, high + half);
        }
        let air = span * 0.04;
        let padded_low = if self.zero && low == 0.0 { 0.0 } else { low - air };
        let padded_high = if self.zero && high == 0.0 { 0.0 } else { high + air };
        (padded_low, padded_high)
    }
}

fn log_ends(data: Option<(f64, f64)>) -> (f64, f64) {
    let (low, high) = data.filter(|(l, _)| *l > 0.0).unwrap_or((0.1, 10.0));
    if high / low < 3.0 { (low / 2.0, high * 2.0) } else { (low / 1.15, high * 1.15) }
}

/// A tick: where, and what is written there (nothing at minor ticks).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    /// In units of the axis.
    pub at: f64,
    /// In rich text; empty at minor ticks.
    pub text: String,
}

/// Ticks of a linear axis, about `wanted` of them, at multiples of 1, 2 or 5 times a power of ten, with as many decimals
/// as they need to differ.
pub(crate) fn linear_ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    let span = high - low;
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let raw = span / wanted.max(2) as f64;
    let power = 10f64.powf(raw.log10().floor());
    // The nearest round step, not the next larger one, or half the ticks would be lost.
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * power >= raw * 0.7).unwrap_or(10.0);
    let count = |step: f64| (high / step + 1e-9).floor() - (low / step - 1e-9).ceil() + 1.0;
    // One number alone gives no scale.
    let finer = [factor, 5.0, 2.0, 1.0, 0.5].into_iter().filter(|f| *f <= factor);
    let step = finer.map(|f| f * power).find(|step| count(*step) >= 2.0).unwrap_or(factor * power);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let largest = low.abs().max(high.abs());
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last)
        .map(|i| {
            let at = i as f64 * step;
            let text = if largest >= 1e6 || decimals > 5 { scientific(at) } else { fixed(at, decimals) };
            Tick { at, text }
        })
        .collect()
}

/// Ticks of a linear axis at whole numbers only.
pub(crate) fn whole_ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    let mut ticks = linear_ticks(low, high, wanted);
    ticks.retain(|tick| (tick.at - tick.at.round()).abs() < 1e-6);
    for tick in &mut ticks {
        if tick.text.contains('.') {
            tick.text = fixed(tick.at.round(), 0);
        }
    }
    ticks
}

/// Ticks of a logarithmic axis: whole decades written, and 2 and 5 as well where there are few decades.
pub(crate) fn log_ticks(low: f64, high: f64, wanted: usize) -> Vec<Tick> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let decades = high.log10() - low.log10();
    let every = ((decades / wanted.max(2) as f64).ceil() as i32).max(1);
    // One number alone gives no scale.
    let alone = (first..=last).filter(|e| (low..=high).contains(&10f64.powi(*e))).count() < 2;
    let mut ticks = Vec::new();
    for exponent in first..=last {
        for mantissa in 1..10 {
            let at = f64::from(mantissa) * 10f64.powi(exponent);
            if at < low * 0.999_999 || at > high * 1.000_001 {
                continue;
            }
            let written = match mantissa {
                1 => exponent.rem_euclid(every) == 0,
                2 | 5 => alone || decades < wanted as f64 / 2.6,
                _ => false,
            };
            if mantissa != 1 && every > 1 {
                continue;
            }
            let text = if written { decade_text(at, exponent) } else { String::new() };
            ticks.push(Tick { at, text });
        }
    }
    ticks
}

fn decade_text(at: f64, exponent: i32) -> String {
    match exponent {
        -3..=4 => fixed(at, (-exponent).max(0) as usize),
        _ => scientific(at),
    }
}

/// A number with a fixed count of decimals, a true minus sign and thin spaces between thousands.
///
/// ```
/// assert_eq!(pam_report::fixed(-12345.678, 1), "−12\u{202f}345.7");
/// assert_eq!(pam_report::fixed(-0.04, 1), "0.0");
/// ```
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let text = format!("{:.*}", decimals.min(12), value.abs());
    let zero = text.bytes().all(|b| b == b'0' || b == b'.');
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let mut out = String::from(if value < 0.0 && !zero { "−" } else { "" });
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && whole.len() > 4 && (whole.len() - i) % 3 == 0 {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    if !fraction.is_empty() {
        out.push('.');
        out.push_str(fraction);
    }
    out
}

/// A number with about `digits` significant figures, in the usual notation.
///
/// ```
/// use pam_report::significant;
/// assert_eq!(significant(0.041_87, 2), "0.042");
/// assert_eq!(significant(135.71, 3), "136");
/// assert_eq!(significant(1.234e-9, 3), "1.23·10^{−9}");
/// ```
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "–".into();
    }
    let digits = digits.max(1);
    let exponent = value.abs().log10().floor() as i32;
    if (-4..7).contains(&exponent) {
        fixed(value, (digits as i32 - 1 - exponent).max(0) as usize)
    } else {
        let mantissa = value / 10f64.powi(exponent);
        format!("{}·10^{{{}}}", fixed(mantissa, digits - 1), fixed(f64::from(exponent), 0))
    }
}

fn scientific(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = (value.abs().log10() + 1e-9).floor() as i32;
    let mantissa = value / 10f64.powi(exponent);
    let power = format!("10^{{{}}}", fixed(f64::from(exponent), 0));
    if (mantissa.abs() - 1.0).abs() < 1e-9 {
        format!("{}{power}", if mantissa < 0.0 { "−" } else { "" })
    } else {
        let decimals = usize::from((mantissa - mantissa.round()).abs() > 1e-6);
        format!("{}·{power}", fixed(mantissa, decimals))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|t| t.text.as_str()).filter(|t| !t.is_empty()).collect()
    }

    #[test]
    fn ticks_are_round_and_distinct() {
        assert_eq!(texts(&linear_ticks(-0.3, 10.2, 5)), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(texts(&linear_ticks(0.0, 0.08, 5)), ["0.00", "0.02", "0.04", "0.06", "0.08"]);
        assert_eq!(texts(&linear_ticks(-1.0, 1.0, 4)), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(texts(&linear_ticks(0.0, 3e6, 3)), ["0", "10^{6}", "2·10^{6}", "3·10^{6}"]);
        assert_eq!(texts(&linear_ticks(-45.0, 45.0, 2)), ["−40", "−20", "0", "20", "40"]);
        assert!(linear_ticks(1.0, 1.0, 5).is_empty());
        assert!(linear_ticks(f64::NAN, 1.0, 5).is_empty());
    }

    #[test]
    fn counts_have_whole_ticks() {
        assert_eq!(texts(&whole_ticks(0.92, 3.08, 5)), ["1", "2", "3"]);
        assert_eq!(texts(&whole_ticks(0.7, 8.3, 4)), ["2", "4", "6", "8"]);
        assert_eq!(texts(&whole_ticks(0.95, 1.05, 4)), ["1"]);
    }

    #[test]
    fn log_ticks_write_decades_and_more_where_there_is_room() {
        assert_eq!(texts(&log_ticks(0.01, 100.0, 6)), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(texts(&log_ticks(0.9, 12.0, 6)), ["1", "2", "5", "10"]);
        assert_eq!(texts(&log_ticks(1e-12, 1.0, 4)), ["10^{−12}", "10^{−9}", "10^{−6}", "0.001", "1"]);
        // A single decade in a small panel: 1 alone would not identify the others.
        assert_eq!(texts(&log_ticks(0.27, 6.0, 3)), ["0.5", "1", "2", "5"]);
        assert!(log_ticks(0.0, 1.0, 4).is_empty());
    }

    #[test]
    fn ends_hold_any_data() {
        let cases = [None, Some((0.0, 0.0)), Some((5.0, 5.0)), Some((-1.0, 3.0)), Some((1e-9, 1e9))];
        for axis in [Axis::new("a", ""), Axis::log("a", ""), Axis::new("a", "").from_zero()] {
            for data in cases {
                let (low, high) = axis.ends(data);
                assert!(low < high && low.is_finite() && high.is_finite(), "{axis:?} {data:?}");
                if let Some((l, h)) = data.filter(|d| axis.scale == Scale::Linear || d.0 > 0.0) {
                    assert!(low <= l && h <= high);
                }
            }
        }
        assert_eq!(Axis::new("a", "").from_zero().ends(Some((2.0, 10.0))).0, 0.0);
    }
}
