//! Writes what is wrong with a log: a page of its own, or a section of another one.

use std::fmt::Write;

use drive_doctor::Examination;
use html_page::escape;

/// The page `doctor.html`.
pub fn page(found: &Examination) -> String {
    let mut html = String::new();
    for sentence in found.summary() {
        let _ = writeln!(html, "<p>{}</p>", escape(&sentence));
    }
    html.push_str(&section(found));
    html_page::page("What is wrong with the log", "", &html)
}

/// A table of all findings, the understeer gradient, and what could not be told; empty where there is none of them.
pub fn section(found: &Examination) -> String {
    let mut html = String::new();
    if !found.findings.is_empty() {
        html.push_str(
            "<table>\n<tr><th>Sure</th><th>Finding</th><th>If it is ignored</th><th>To correct it</th></tr>\n",
        );
        for it in &found.findings {
            let note = it.correction.note.as_ref();
            let note = note.map(|note| format!("<br>{}", escape(note))).unwrap_or_default();
            let _ = writeln!(
                html,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td><code>{}</code>{}</td></tr>",
                it.sure.word(),
                escape(&it.sentence),
                escape(&it.consequence),
                escape(&it.correction.text),
                note
            );
        }
        html.push_str("</table>\n");
    }
    if let Some(it) = &found.understeer {
        let _ = writeln!(html, "<p>{}</p>", escape(&it.sentence));
    }
    for it in &found.rolling {
        let _ = writeln!(html, "<p>{}</p>", escape(&it.sentence));
    }
    for it in &found.not_told {
        let _ = writeln!(
            html,
            "<p class=\"faint\">Cannot be told: {}, as {}. {}</p>",
            escape(it.check),
            escape(&it.reason),
            escape(it.advice)
        );
    }
    html
}
