//! Writes what is wrong with a log, `doctor.html`.

use askama::Template;
use drive_doctor::LogExamination;

use crate::page::filters;

#[derive(Template)]
#[template(path = "doctor.html")]
struct DoctorPage<'a> {
    title: &'static str,
    log: &'a LogExamination,
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
