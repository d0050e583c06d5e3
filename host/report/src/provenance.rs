//! What a report was made from, so that it can be made again: command, date, program, muscle, files with their hashes.

use std::path::PathBuf;

use pam_data::date;
use pam_data::muscle_description::MuscleDescription;

use super::Page;

/// Digits of a hash that are shown: enough to compare by eye, and to distinguish any two files of a laboratory.
const DIGITS: usize = 16;

/// Where a report comes from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Name and version of the program.
    pub program: String,
    /// Name and dimensions of every muscle.
    pub muscles: Vec<(String, String)>,
    /// Files with the SHA-256 of their bytes, in hexadecimal.
    pub files: Vec<(PathBuf, String)>,
}

impl Provenance {
    /// With the dimensions of a muscle, as described.
    #[must_use]
    pub fn muscle(mut self, muscle: &MuscleDescription) -> Self {
        let dimensions = format!(
            "rest length {} mm, braid angle {}° from the radial plane, bladder {} mm with a wall of {} mm",
            muscle.rest_length_mm,
            muscle.braid_angle_deg,
            muscle.bladder_outer_diameter_mm,
            muscle.bladder_wall_mm
        );
        self.muscles.push((muscle.name.clone(), dimensions));
        self
    }

    /// With files and their hashes.
    #[must_use]
    pub fn files(mut self, files: &[PathBuf], hashes: &[String]) -> Self {
        self.files.extend(files.iter().cloned().zip(hashes.iter().cloned()));
        self
    }
}

impl Page {
    /// Adds where the report comes from.
    pub fn provenance(&mut self, from: &Provenance) {
        self.origin("date", date::now_utc());
        if !from.command.is_empty() {
            self.origin("command", format!("`{}`", from.command.replace('`', "'")));
        }
        // The page may name its program already.
        if !from.program.is_empty() && !self.origin.iter().any(|(_, value)| *value == from.program) {
            self.origin("made by", from.program.clone());
        }
        for (name, dimensions) in &from.muscles {
            self.origin(name.clone(), dimensions.clone());
        }
        for (file, hash) in &from.files {
            let shown: String = hash.chars().take(DIGITS).collect();
            self.origin(file.display().to_string(), format!("SHA-256 {shown}…"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_lists_its_inputs() {
        let muscle = MuscleDescription::parse(
            "name = \"mini-1\"\nkind = \"contractile\"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
             bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n",
        )
        .unwrap();
        let from = Provenance {
            command: "host fit a.csv".into(),
            program: "host 0.1.0".into(),
            ..Provenance::default()
        };
        let from =
            from.muscle(&muscle).files(&[PathBuf::from("a.csv")], &["0123456789abcdef0123".to_owned()]);
        let mut page = Page::new("t", "");
        page.origin("made by", "host 0.1.0");
        page.provenance(&from);
        let html = page.html();
        for part in ["<code>host fit a.csv</code>", "braid angle 77.4°", "SHA-256 0123456789abcdef…"] {
            assert!(html.contains(part), "{part}: {html}");
        }
        assert_eq!(page.origin.iter().filter(|(what, _)| what == "made by").count(), 1);
        assert!(page.origin.iter().any(|(what, _)| what == "date"));
    }
}
