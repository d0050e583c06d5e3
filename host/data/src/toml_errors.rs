//! Errors of TOML files in terms of the file, not of the parser.

use crate::error::{Code, Error, nearest};

/// The parser's complaint about `text` as an error with its line.
pub fn toml_error(code: impl Into<Code>, text: &str, error: &toml::de::Error) -> Error {
    let said = error.message().trim().replace('\n', "; ");
    let (cause, help) = explained(&said);
    let mut ours = Error::new(code, cause);
    // A missing field has no line.
    if let Some(span) = error.span().filter(|_| !said.starts_with("missing field")) {
        let before = text.get(..span.start).unwrap_or(text);
        ours = ours.line(before.matches('\n').count() as u64 + 1);
    }
    match help {
        Some(help) => ours.help(help),
        None => ours,
    }
}

/// Cause and remedy.
fn explained(said: &str) -> (String, Option<String>) {
    let quoted =
        |text: &str| -> Vec<String> { text.split('`').skip(1).step_by(2).map(str::to_owned).collect() };
    if let Some((found, wanted)) =
        said.strip_prefix("invalid type: ").and_then(|r| r.split_once(", expected "))
    {
        let wanted = match wanted {
            "f64" | "f32" => "a number",
            "a string" | "string" => "a text in quotes",
            "a boolean" => "true or false",
            "u8" | "u16" | "u32" | "u64" | "usize" | "i64" => "a whole number",
            other => other,
        };
        let found = found.replace("string \"", "the text \"").replace("floating point ", "the number ");
        let found = found.replace("integer ", "the number ");
        let help = (wanted == "a number" && found.starts_with("the text"))
            .then(|| "write numbers without quotes and with a point, such as 39.16".to_owned());
        return (format!("{wanted} is expected here, not {found}"), help);
    }
    if let Some(rest) = said.strip_prefix("missing field ") {
        return (format!("{rest} is missing"), None);
    }
    if said.starts_with("unknown field ") || said.starts_with("unknown variant ") {
        let names = quoted(said);
        if let Some((name, known)) = names.split_first() {
            let near = nearest(name, known.iter().map(String::as_str));
            let near = near.map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
            let what = if said.starts_with("unknown field") { "there is no" } else { "this cannot be" };
            return (format!("{what} `{name}`"), Some(format!("{near}it is one of {}", known.join(", "))));
        }
    }
    (said.to_owned(), None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::DataCode;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)] // only the parser's complaints are read
    struct Example {
        length_mm: f64,
        name: String,
        count: Option<u32>,
    }

    fn message(text: &str) -> String {
        let error = toml::from_str::<Example>(text).unwrap_err();
        let error = toml_error(DataCode::MuscleInvalid, text, &error);
        let advice = if error.advised() { error.advice().unwrap_or_default() } else { "" };
        format!("{error} | {advice}")
    }

    #[test]
    fn complaints_are_in_plain_words() {
        let cases = [
            (
                "name = \"a\"\nlength_mm = \"39,16\"\n",
                "a number is expected here, not the text \"39,16\" (line 2) | write numbers without quotes and with a point, such as 39.16",
            ),
            (
                "name = 3\nlength_mm = 1\n",
                "a text in quotes is expected here, not the number `3` (line 1) | ",
            ),
            ("name = \"a\"\n", "`length_mm` is missing | "),
            (
                "name = \"a\"\nlenght_mm = 1\n",
                "there is no `lenght_mm` (line 2) | did you mean `length_mm`? it is one of length_mm, name, count",
            ),
        ];
        for (text, words) in cases {
            assert_eq!(message(text), words);
        }
    }
}
