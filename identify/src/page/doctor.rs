//! Writes what is wrong with a log, `doctor.html`.

use askama::Template;
use drive_doctor::Examination;

use crate::page::filters;

#[derive(Template)]
#[template(path = "doctor.html")]
struct Page<'a> {
    title: &'static str,
    log: &'a Examination,
}

/// The page.
pub fn page(log: &Examination) -> String {
    html_page::render(&Page { title: "What is wrong with the log", log })
}

/// Whether a section about it would not be empty.
pub fn has_something(log: &Examination) -> bool {
    let Examination { findings, not_told, understeer, rolling, .. } = log;
    !(findings.is_empty() && not_told.is_empty() && understeer.is_none() && rolling.is_empty())
}
