//! Short texts with the little mark-up that formulas and file names need, in every form a report takes.
//!
//! | written | means |
//! | --- | --- |
//! | `E_{1}` | subscript |
//! | `mm^{2}` | superscript |
//! | `*word*` | emphasis |
//! | `` `host fit` `` | literal |
//!
//! Anything else is taken as it stands, so a text from a recording needs no escaping: mark-up that is not closed is text.

use maud::{Markup, PreEscaped};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Plain,
    Sub,
    Super,
    Emphasis,
    Literal,
}

/// Splits a text into its parts.
fn parts(text: &str) -> Vec<(Kind, &str)> {
    let mut parts = Vec::new();
    let mut rest = text;
    let mut plain = 0;
    while plain < rest.len() {
        let at = &rest[plain..];
        let opened = if at.starts_with("_{") {
            Some((Kind::Sub, 2, "}"))
        } else if at.starts_with("^{") {
            Some((Kind::Super, 2, "}"))
        } else if at.starts_with('`') {
            Some((Kind::Literal, 1, "`"))
        } else if at.starts_with('*') && at[1..].chars().next().is_some_and(char::is_alphanumeric) {
            Some((Kind::Emphasis, 1, "*"))
        } else {
            None
        };
        let closed = opened.and_then(|(kind, open, close)| {
            let inner = &at[open..];
            let end = inner.find(close)?;
            (end > 0).then_some((kind, &inner[..end], open + end + close.len()))
        });
        if let Some((kind, inner, used)) = closed {
            if plain > 0 {
                parts.push((Kind::Plain, &rest[..plain]));
            }
            parts.push((kind, inner));
            rest = &rest[plain + used..];
            plain = 0;
        } else {
            plain += at.chars().next().map_or(1, char::len_utf8);
        }
    }
    if !rest.is_empty() {
        parts.push((Kind::Plain, rest));
    }
    parts
}

/// The text with the characters that XML gives a meaning to made harmless; control characters, which XML forbids, are
/// shown as their pictures.
#[must_use]
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(' '),
            c if (c as u32) < 0x20 => out.push(char::from_u32(0x2400 + c as u32).unwrap_or('?')),
            c if c == '\u{7f}' || c == '\u{fffe}' || c == '\u{ffff}' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Numbers stay on one line with their unit, and both sides of an equation with its sign.
fn kept_together(text: &str) -> String {
    let mut out = text.replace(" = ", "\u{a0}=\u{a0}").replace("p &lt; ", "p\u{a0}&lt;\u{a0}");
    for unit in ["%", "N", "kPa", "MPa", "mm", "s"] {
        for digit in '0'..='9' {
            for end in [" ", ",", ".", ";", ":", ")"] {
                let loose = format!("{digit} {unit}{end}");
                if out.contains(&loose) {
                    out = out.replace(&loose, &format!("{digit}\u{a0}{unit}{end}"));
                }
            }
        }
    }
    out
}

/// As HTML.
///
/// ```
/// assert_eq!(pam_report::inline_markup::html("P_{0} < 1").into_string(), "P<sub>0</sub> &lt; 1");
/// ```
#[must_use]
pub fn html(text: &str) -> Markup {
    let mut out = String::new();
    for (kind, inner) in parts(text) {
        let inner = if kind == Kind::Plain { kept_together(&escape(inner)) } else { escape(inner) };
        let tag = match kind {
            Kind::Plain => "",
            Kind::Sub => "sub",
            Kind::Super => "sup",
            Kind::Emphasis => "em",
            Kind::Literal => "code",
        };
        if tag.is_empty() { out.push_str(&inner) } else { out.push_str(&format!("<{tag}>{inner}</{tag}>")) }
    }
    PreEscaped(out)
}

/// As the content of an SVG text element.
#[must_use]
pub(crate) fn svg(text: &str) -> String {
    let mut out = String::new();
    for (kind, inner) in parts(text) {
        let inner = escape(inner);
        match kind {
            Kind::Plain | Kind::Literal => out.push_str(&inner),
            Kind::Emphasis => out.push_str(&format!("<tspan font-style=\"italic\">{inner}</tspan>")),
            // A shift lasts until the end of the text, so an empty-looking part takes it back.
            Kind::Sub => out.push_str(&format!(
                "<tspan dy=\"3\" font-size=\"0.78em\">{inner}</tspan><tspan dy=\"-3\">\u{200b}</tspan>"
            )),
            Kind::Super => out.push_str(&format!(
                "<tspan dy=\"-4\" font-size=\"0.78em\">{inner}</tspan><tspan dy=\"4\">\u{200b}</tspan>"
            )),
        }
    }
    out
}

/// Without any mark-up, for titles, file names and column heads.
#[must_use]
pub fn plain(text: &str) -> String {
    let mut out = String::new();
    for (kind, inner) in parts(text) {
        match kind {
            Kind::Sub if inner.len() > 1 && !inner.chars().all(|c| c.is_ascii_digit()) => {
                out.push('_');
                out.push_str(inner);
            }
            Kind::Super => {
                out.push('^');
                out.push_str(inner);
            }
            _ => out.push_str(inner),
        }
    }
    out
}

/// As Markdown, for forges and mails.
#[must_use]
pub(crate) fn markdown(text: &str) -> String {
    let mut out = String::new();
    for (kind, inner) in parts(text) {
        match kind {
            Kind::Plain => {
                for c in inner.chars() {
                    if matches!(c, '|' | '<' | '*' | '_' | '[' | ']' | '`' | '\\') {
                        out.push('\\');
                    }
                    out.push(if c == '\n' { ' ' } else { c });
                }
            }
            Kind::Sub => out.push_str(&format!("<sub>{}</sub>", escape(inner))),
            Kind::Super => out.push_str(&format!("<sup>{}</sup>", escape(inner))),
            Kind::Emphasis => out.push_str(&format!("*{inner}*")),
            Kind::Literal => out.push_str(&format!("`{inner}`")),
        }
    }
    out
}

/// How wide a text is at a font size of one, in a common sans-serif face. An estimate to leave room by, on the wide side.
#[must_use]
pub(crate) fn width(text: &str) -> f64 {
    parts(text)
        .into_iter()
        .map(|(kind, inner)| {
            let scale = if matches!(kind, Kind::Sub | Kind::Super) { 0.78 } else { 1.0 };
            scale * inner.chars().map(char_width).sum::<f64>()
        })
        .sum()
}

fn char_width(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '|' | '\'' | '.' | ',' | ':' | ';' | '!' | ' ' => 0.31,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' => 0.42,
        'm' | 'M' | 'W' | '%' | '@' => 0.92,
        'w' | 'A'..='Z' => 0.72,
        '0'..='9' | 'a'..='z' => 0.58,
        '\u{200b}' => 0.0,
        '\u{2009}' | '\u{202f}' => 0.2,
        _ => 0.66,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_text_takes_every_form() {
        let text = "*Force* F_{AVG} in `a<b` at 10^{3} kPa, x_1 and 2*3";
        assert_eq!(
            html(text).into_string(),
            "<em>Force</em> F<sub>AVG</sub> in <code>a&lt;b</code> at 10<sup>3</sup> kPa, x_1 and 2*3"
        );
        assert_eq!(plain(text), "Force F_AVG in a<b at 10^3 kPa, x_1 and 2*3");
        assert_eq!(markdown(text), "*Force* F<sub>AVG</sub> in `a<b` at 10<sup>3</sup> kPa, x\\_1 and 2\\*3");
        assert!(svg(text).contains("<tspan dy=\"3\" font-size=\"0.78em\">AVG</tspan>"));
    }

    #[test]
    fn text_that_is_not_mark_up_stays_and_cannot_break_out() {
        for text in ["a_{", "`", "*", "_{}", "x^{ü", "</svg><script>", "é*é", "\u{1}\u{0}"] {
            assert!(!html(text).into_string().contains("<script"));
            assert!(!svg(text).contains("</svg"));
            assert!(svg(text).chars().all(|c| c as u32 >= 0x20));
        }
        assert_eq!(html("a_{b").into_string(), "a_{b");
    }
}
