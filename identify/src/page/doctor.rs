//! Writes what is wrong with a log, `doctor.html`.

use askama::Template;
use drive_doctor::LogExamination;

use crate::conclusion::{ConclusionLine, first_sentence};
use crate::page::filters;

#[derive(Template)]
#[template(path = "doctor.html")]
struct DoctorPage<'a> {
    title: &'static str,
    log: &'a LogExamination,
}

impl DoctorPage<'_> {
    /// The three lines that every page begins with.
    fn lines(&self) -> [ConclusionLine; 3] {
        let worst = self.log.refusing_finding().or_else(|| self.log.serious_findings().next());
        let [usable, unusable, next] = match worst {
            Some(worst) => [
                "what the findings below do not name".to_owned(),
                format!("anything that rests on this: {}", first_sentence(&worst.sentence)),
                format!("nothing yet. Put the log right first: {}", first_sentence(&worst.correction.text)),
            ],
            None if self.log.too_short => [
                "the log at your own risk".to_owned(),
                "this examination: the log has too few rows".to_owned(),
                "a longer log".to_owned(),
            ],
            None => [
                "the log as it is".to_owned(),
                "nothing is ruled out".to_owned(),
                "nothing for the log; what could not be told stands below".to_owned(),
            ],
        };
        let line = |head, text: String| ConclusionLine { head, text: format!("{text}.") };
        [line("You can use", usable), line("You cannot use", unusable), line("Drive this next", next)]
    }
}

/// The page.
pub fn render_doctor_page(log: &LogExamination) -> String {
    html_page::render_page(&DoctorPage { title: "What is wrong with the log", log })
}

/// Whether a section about it would not be empty.
pub fn has_something(log: &LogExamination) -> bool {
    let LogExamination { findings, not_told, understeer, rolling, .. } = log;
    !(findings.is_empty() && not_told.is_empty() && understeer.is_none() && rolling.is_empty())
}
