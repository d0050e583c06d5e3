//! Why an effect is not named.

use pam_diagnose::experiment::what_would_show;
use pam_diagnose::verdict::{Considered, WhyNot};

use super::{measure, sentence};

/// The reason as text without its full stop.
#[must_use]
pub fn why_not(c: &Considered) -> String {
    let reason = match &c.why_not {
        WhyNot::NotJudged => return "not identifiable from these recordings".to_owned(),
        WhyNot::Confusable => return "cannot be distinguished from a named effect".to_owned(),
        WhyNot::Measured { check, value } => {
            let most = c.hidden_up_to_N.map_or(String::new(), |h| format!("; at most {h:.2} N here"));
            return format!("measured with {check}: {value}{most}");
        }
        WhyNot::Hidden => return hidden(c),
        WhyNot::SlackReading => "more of it would show in the readings of the slack muscle".to_owned(),
        WhyNot::NotExcited => "not excited by these recordings".to_owned(),
        WhyNot::Chance(p) => format!("explains no more than chance does over all effects tried (p = {p:.2})"),
        WhyNot::Refused => {
            "explains a part of the excess error, but was not confirmed (see the remarks)".to_owned()
        }
        WhyNot::WithinInexactness => {
            "explains much of the excess error, which is within the model's own inexactness".to_owned()
        }
        WhyNot::TooLittle => "explains too little of the excess error".to_owned(),
        WhyNot::LessThanNamed => "explains less than the named effects, and little beside them".to_owned(),
    };
    format!("{reason}. {}", sentence(&hidden(c)).trim_end_matches('.'))
}

fn hidden(c: &Considered) -> String {
    let size = c.hidden_up_to_N.map_or("at any size".to_owned(), |h| format!("up to {h:.2} N"));
    format!("could be hidden {size}. To find out: {}", measure(what_would_show(&c.effect)))
}
