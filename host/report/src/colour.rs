//! The colours of every picture, for light and dark paper.
//!
//! A mark carries both a literal colour, which any program that reads SVG understands, and a class, which a browser
//! uses to follow the reader's preference. The eight series colours differ in lightness as well as in hue, after Okabe
//! and Ito's palette for people who cannot distinguish red from green.

use std::fmt::Write as _;

/// What a mark is painted with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Colour {
    /// One of eight colours for things that have no order.
    Series(usize),
    /// A place between 0 and 1 on the scale for things that have one, such as pressures: blue is low, orange is high.
    Ramp(f64),
    /// The colour of the text.
    Ink,
    /// Grey, for measurements behind a model and for reference lines.
    Muted,
    /// What the reader must look at: a region at fault.
    Alarm,
}

/// Light and dark form of one colour.
type Pair = (&'static str, &'static str);

const SERIES: [Pair; 8] = [
    ("#0067a5", "#5cb8ff"),
    ("#c8500a", "#ff9a56"),
    ("#00806a", "#3fd6b0"),
    ("#a8327e", "#f08cc8"),
    ("#7a6a00", "#e3cf4a"),
    ("#5b4bb5", "#ab9dff"),
    ("#3f88b8", "#9ad7f5"),
    ("#5f5f5f", "#bdbdbd"),
];
const INK: Pair = ("#1d2330", "#e8eaf0");
const MUTED: Pair = ("#858d9b", "#8b93a3");
const ALARM: Pair = ("#c22f2f", "#ff7d75");

/// Steps of the ordered scale.
const STEPS: usize = 16;
const RAMP_LIGHT: [[f64; 3]; 4] =
    [[30.0, 58.0, 170.0], [126.0, 50.0, 170.0], [203.0, 60.0, 98.0], [222.0, 128.0, 20.0]];
const RAMP_DARK: [[f64; 3]; 4] =
    [[116.0, 158.0, 255.0], [196.0, 132.0, 255.0], [255.0, 126.0, 158.0], [255.0, 190.0, 92.0]];

fn ramp(stops: &[[f64; 3]; 4], step: usize) -> String {
    let at = 3.0 * step as f64 / (STEPS - 1) as f64;
    let i = (at as usize).min(2);
    let u = at - i as f64;
    let mut out = String::from("#");
    for (low, high) in stops[i].iter().zip(stops[i + 1]) {
        let _ = write!(out, "{:02x}", (low + u * (high - low)).round() as u8);
    }
    out
}

impl Colour {
    /// The place of `index` among `count` things in order.
    ///
    /// ```
    /// use pam_report::Colour;
    /// assert_eq!(Colour::ordered(0, 3), Colour::Ramp(0.0));
    /// assert_eq!(Colour::ordered(2, 3), Colour::Ramp(1.0));
    /// ```
    #[must_use]
    pub fn ordered(index: usize, count: usize) -> Self {
        Self::Ramp(if count < 2 { 0.3 } else { index as f64 / (count - 1) as f64 })
    }

    fn step(place: f64) -> usize {
        if place.is_finite() { (place.clamp(0.0, 1.0) * (STEPS - 1) as f64).round() as usize } else { 0 }
    }

    /// The class that style sheets know it by.
    pub(crate) fn class(self) -> String {
        match self {
            Self::Series(i) => format!("s{}", i % SERIES.len()),
            Self::Ramp(place) => format!("r{}", Self::step(place)),
            Self::Ink => "ink".into(),
            Self::Muted => "mut".into(),
            Self::Alarm => "alm".into(),
        }
    }

    /// Its literal form on light paper.
    pub(crate) fn literal(self) -> String {
        match self {
            Self::Series(i) => SERIES[i % SERIES.len()].0.into(),
            Self::Ramp(place) => ramp(&RAMP_LIGHT, Self::step(place)),
            Self::Ink => INK.0.into(),
            Self::Muted => MUTED.0.into(),
            Self::Alarm => ALARM.0.into(),
        }
    }
}

/// Rules that let every class follow custom properties, and the properties themselves for light and dark.
///
/// `.S` paints lines, `.F` fills; a picture's own file and the page use the same rules.
pub(crate) fn style_sheet() -> String {
    let mut names: Vec<(String, String, String)> = Vec::new();
    for (i, (light, dark)) in SERIES.iter().enumerate() {
        names.push((format!("s{i}"), (*light).into(), (*dark).into()));
    }
    for i in 0..STEPS {
        names.push((format!("r{i}"), ramp(&RAMP_LIGHT, i), ramp(&RAMP_DARK, i)));
    }
    for (name, (light, dark)) in [("ink", INK), ("mut", MUTED), ("alm", ALARM)] {
        names.push((name.into(), light.into(), dark.into()));
    }
    names.push(("paper".into(), "#ffffff".into(), "#14171d".into()));
    names.push(("grid".into(), "#e6e9ee".into(), "#2b303a".into()));
    names.push(("axis".into(), "#9aa2b1".into(), "#5d6575".into()));
    let (mut light, mut dark, mut rules) = (String::new(), String::new(), String::new());
    for (name, l, d) in &names {
        let _ = write!(light, "--{name}:{l};");
        let _ = write!(dark, "--{name}:{d};");
        let _ = write!(rules, ".S.{name}{{stroke:var(--{name})}}.F.{name}{{fill:var(--{name})}}");
    }
    format!(
        ":root{{{light}color-scheme:light dark}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{rules}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_class_a_mark_can_carry_has_a_rule() {
        let css = style_sheet();
        let all = (0..9)
            .map(Colour::Series)
            .chain((0..=20).map(|i| Colour::Ramp(f64::from(i) / 20.0)))
            .chain([Colour::Ramp(f64::NAN), Colour::Ramp(7.0), Colour::Ink, Colour::Muted, Colour::Alarm]);
        for colour in all {
            let class = colour.class();
            assert!(css.contains(&format!(".S.{class}{{stroke:var(--{class})}}")), "{class}");
            assert_eq!(css.matches(&format!("--{class}:#")).count(), 2, "{class} in light and dark");
            assert!(css.contains(&colour.literal()));
        }
    }
}
