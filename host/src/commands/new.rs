//! `host new`: a muscle description, by asking what to measure.

use std::io::{BufRead, Write};
use std::path::PathBuf;

use clap::Args;

use crate::console::Console;
use pam_data::error::{DataCode, Error, Result};
use pam_data::muscle_description::MuscleDescription;
use pam_data::output::write_whole;

/// Arguments of `host new`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host new -o mini.toml\n  printf 'mini-1\\n\\n39.16\\n77.4\\n3\\n0.5\\n\\n' | host new -o mini.toml"
)]
pub struct Arguments {
    /// The description to write; `-` is standard output.
    #[arg(short, long, value_name = "MUSCLE.toml", default_value = "muscle.toml")]
    output: PathBuf,
    /// Replace a file that is there.
    #[arg(long, alias = "force")]
    replace: bool,
}

const DRAWING: &str = r"
        |<------------- L0: rest length, vented ------------->|
   ___  |                                                     |  ___
  |   |=+====\\//\\//\\//\\//\\//\\//\\//\\//\\//\\//\\//\\===+=|   |   ---
  |___|=+====//\\//\\//\\//\\//\\//\\//\\//\\//\\//\\//\\//===+=|___|   D0: bladder, outside
        |                                                     |        ---
      fitting            braid over the bladder            fitting

   braid angle a0, from the radial plane:        bladder, cut:
        |   /  fibre                                 .------.
        |  /                                        /  .--.  \   t0: wall
        | /   a0 = 90 deg - (angle to the axis)    |  |    |  |<-->
        |/                                          \  '--'  /
   -----+-----> radial                               '------'
";

/// One question: key, what to ask, the default answer.
const QUESTIONS: [(&str, &str, Option<&str>); 7] = [
    ("name", "What is it called?", None),
    ("kind", "Does it pull (contractile) or push a rod (push)?", Some("contractile")),
    ("rest_length_mm", "L0, active length between the fittings, vented, mm?", None),
    ("braid_angle_deg", "a0, braid angle from the radial plane, degrees?", None),
    ("bladder_outer_diameter_mm", "D0, bladder's outer diameter, mm?", None),
    ("bladder_wall_mm", "t0, bladder's wall, mm?", None),
    ("max_pressure_kPa", "Largest pressure it may ever see, kPa (empty: unknown)?", Some("")),
];

impl Arguments {
    /// Asks, checks each answer as it comes, writes.
    ///
    /// # Errors
    /// [`DataCode::CallInvalid`] when the file already exists or the answers end early, [`DataCode::FileUnwritable`].
    pub fn run(self, console: &Console) -> Result<()> {
        if !self.replace && self.output.as_os_str() != "-" && self.output.exists() {
            return Err(Error::new(DataCode::CallInvalid, "the file already exists")
                .file(&self.output)
                .help("choose another name with -o, or replace it with --replace"));
        }
        // What cannot be written is better known before seven questions than after.
        let folder = self.output.parent().filter(|f| !f.as_os_str().is_empty());
        if let Some(folder) = folder
            && !folder.is_dir()
        {
            return Err(Error::new(DataCode::FileUnwritable, "the folder does not exist")
                .file(folder)
                .help("make it first"));
        }
        console.note(DRAWING);
        let text = ask(
            &mut std::io::stdin().lock(),
            |question| {
                if !console.quiet() {
                    let _ = write!(std::io::stderr(), "{question} ");
                }
            },
            |error| console.warning(error),
        );
        if text.is_err() && !console.quiet() {
            // The error begins on a line of its own, not behind the question.
            let _ = writeln!(std::io::stderr());
        }
        let text = text?;
        write_whole(&self.output, text.as_bytes())?;
        console.note(format!(
            "written to {}; next: host fit --muscle {} RECORDINGS",
            self.output.display(),
            self.output.display()
        ));
        Ok(())
    }
}

/// Asks every question until its answer fits; gives the text of the description.
fn ask(input: &mut impl BufRead, prompt: impl Fn(&str), complain: impl Fn(&str)) -> Result<String> {
    let mut answers: Vec<(&str, String)> = Vec::new();
    for (key, question, default) in QUESTIONS {
        loop {
            prompt(
                &default
                    .filter(|d| !d.is_empty())
                    .map_or(question.to_owned(), |d| format!("{question} [{d}]")),
            );
            let mut line = String::new();
            let count = input.read_line(&mut line).map_err(|e| Error::unreadable("standard input", &e))?;
            if count == 0 && default.is_none() {
                return Err(Error::new(DataCode::CallInvalid, format!("the answers end before `{key}`"))
                    .help("answer one question a line; `host new --help` shows an example"));
            }
            let given = match (line.trim(), default) {
                ("", Some(default)) => default.to_owned(),
                (text, _) => text.to_owned(),
            };
            if key == "max_pressure_kPa" && given.is_empty() {
                break;
            }
            answers.push((key, given));
            match wrong(&answers) {
                None => break,
                Some(error) => {
                    complain(&error);
                    answers.pop();
                }
            }
        }
    }
    Ok(text(&answers))
}

/// What is wrong with the answers so far: the rest is taken from a muscle that is right.
fn wrong(answers: &[(&str, String)]) -> Option<String> {
    let mut all = answers.to_vec();
    for (key, value) in [
        ("name", "x"),
        ("kind", "contractile"),
        ("rest_length_mm", "100"),
        ("braid_angle_deg", "75"),
        ("bladder_outer_diameter_mm", "1000"),
        ("bladder_wall_mm", "0.01"),
    ] {
        if !all.iter().any(|(k, _)| *k == key) {
            all.push((key, value.to_owned()));
        }
    }
    let error = MuscleDescription::parse(&text(&all)).err()?;
    // The description is not the user's yet, who has written no quotation marks.
    if let Some((key, answer)) = answers.last()
        && !["name", "kind"].contains(key)
        && answer.parse::<f64>().is_err()
    {
        let comma = answer.contains(',');
        let advice =
            if comma { "a decimal point, such as 39.16" } else { "a number without a unit, such as 39.16" };
        return Some(format!("`{answer}` is not a number; write {advice}"));
    }
    // Who is here already is not sent here.
    let advice = error.advice().filter(|advice| !advice.contains("host new"));
    Some(format!("{}{}", error.cause(), advice.map(|a| format!("; {a}")).unwrap_or_default()))
}

fn text(answers: &[(&str, String)]) -> String {
    let mut out = String::new();
    for (key, value) in answers {
        let number = value.parse::<f64>().is_ok();
        let value = match *key {
            "name" | "kind" => toml::Value::String(value.clone()).to_string(),
            // Whole numbers are numbers, too; anything else is left for the reader to refuse.
            _ if number && !value.contains(['.', 'e', 'E']) => format!("{value}.0"),
            _ if number => value.clone(),
            _ => toml::Value::String(value.clone()).to_string(),
        };
        let note = if *key == "braid_angle_deg" { "   # from the radial plane" } else { "" };
        out += &format!("{key} = {value}{note}\n");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    fn answered(lines: &str) -> (Result<String>, Vec<String>) {
        let complaints = RefCell::new(Vec::new());
        let text = ask(&mut lines.as_bytes(), |_| (), |c| complaints.borrow_mut().push(c.to_owned()));
        (text, complaints.into_inner())
    }

    #[test]
    fn answers_become_a_description_that_is_read_again() {
        let (text, complaints) = answered("mini-1\n\n39.16\n77.4\n3\n0.5\n\n");
        let muscle = MuscleDescription::parse(&text.unwrap()).unwrap();
        assert!(complaints.is_empty(), "{complaints:?}");
        assert_eq!((muscle.rest_length_mm, muscle.bladder_outer_diameter_mm), (39.16, 3.0));
        assert_eq!(muscle.max_pressure_kPa, None);
    }

    #[test]
    fn a_decimal_comma_or_a_unit_is_answered_with_what_to_write() {
        let (_, complaints) = answered("m\n\n39,16\n39.16 mm\n39.16\n77.4\n3\n0.5\n\n");
        let expected = [
            "`39,16` is not a number; write a decimal point, such as 39.16",
            "`39.16 mm` is not a number; write a number without a unit, such as 39.16",
        ];
        assert_eq!(complaints, expected);
    }

    #[test]
    fn a_wrong_answer_is_requested_again_immediately() {
        let (text, complaints) = answered("m\npull\npush\nlong\n0.039\n39\n28.6\n61.4\n3\n1.5\n0.5\n600\n");
        let muscle = MuscleDescription::parse(&text.unwrap()).unwrap();
        assert_eq!(muscle.max_pressure_kPa, Some(600.0));
        assert_eq!(complaints.len(), 5, "{complaints:?}");
        assert!(complaints[3].contains("61.4"), "{}", complaints[3]);
        assert!(complaints.iter().all(|c| !c.contains("host new")), "{complaints:?}");
        let (text, _) = answered("m\n");
        assert_eq!(text.unwrap_err().exit_status(), 2);
    }
}
