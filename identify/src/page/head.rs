//! Writes the beginning of the page: the verdict, errors of sensors and car that were found, the car, the log.

use std::fmt::Write;

use html_page::escape;
use numerics::text::{decimals, significant, with_std};
use tire_inference::model::{CauseEstimate, FitTest, ModelVerdict};

use crate::names::{class, words};
use crate::page::Page;
use crate::summary::IdentificationSummary;

/// All of it.
pub fn head(html: &mut String, page: &Page) {
    if let Some(overall) = page.overall {
        verdict(html, overall);
        causes(html, overall.causes);
        tests(html, &overall.model);
    }
    for (title, rows) in [("Car", page.car), ("Log", page.facts)] {
        if rows.is_empty() {
            continue;
        }
        let _ = writeln!(html, "<h2>{title}</h2>\n<table>");
        for (name, value) in rows {
            let _ = writeln!(html, "<tr><th>{}</th><td>{}</td></tr>", escape(name), escape(value));
        }
        html.push_str("</table>\n");
    }
}

fn verdict(html: &mut String, overall: &IdentificationSummary) {
    let (class, word) = match (overall.is_sound(), overall.is_tested()) {
        (false, _) => ("not_identifiable", "Doubtful"),
        (true, false) => ("weak", "Not tested"),
        (true, true) => ("identified", "Sound"),
    };
    let mut sentences = overall.summary().into_iter();
    let first = sentences.next().unwrap_or_default();
    let _ = writeln!(html, "<p class=\"banner {class}\"><b>{word}</b> {}</p>", escape(&first));
    let list: String = sentences.map(|it| format!("<li>{}</li>\n", escape(&it))).collect();
    if !list.is_empty() {
        let _ = writeln!(html, "<ul>\n{list}</ul>");
    }
}

fn causes(html: &mut String, causes: &[CauseEstimate]) {
    if causes.is_empty() {
        return;
    }
    html.push_str(
        "<h2>Errors estimated with the tires</h2>\n<table class=\"stack\">\n<tr><th>Error</th><th>Value</th><th>95 % interval</th>\
         <th>Verdict</th><th>Gain</th><th>Correction</th></tr>\n",
    );
    for cause in causes {
        let places = decimals(cause.value, cause.std);
        let [low, high] = cause.interval;
        let gain =
            cause.gain.map_or("–".to_owned(), |gain| format!("{} nat", significant(gain, 3)));
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"number\" data-label=\"value\">{} {}</td>\
             <td class=\"number\" data-label=\"95 %\">{low:.places$} … {high:.places$}</td><td class=\"verdict {}\">{}</td>\
             <td class=\"number\" data-label=\"gain\">{gain}</td><td><code>{}</code></td></tr>",
            escape(&cause.title),
            with_std(cause.value, cause.std),
            escape(&cause.unit),
            class(cause.verdict),
            words(cause.verdict),
            escape(&cause.correction).replace('\n', "<br/>")
        );
    }
    html.push_str("</table>\n");
}

fn tests(html: &mut String, model: &ModelVerdict) {
    if model.tests.is_empty() {
        return;
    }
    let (passed, failed): (Vec<_>, Vec<_>) = model.tests.iter().partition(|test| test.passed());
    let (count, all) = (passed.len(), model.tests.len());
    let _ = writeln!(html, "<h2>Does the model fit?</h2>\n<p>{count} of {all} tests passed.</p>");
    if !failed.is_empty() {
        html.push_str(
            "<table class=\"stack\">\n<tr><th>Failed test</th><th>Figure</th><th>Limit</th><th>Meaning</th></tr>\n",
        );
        for test in failed {
            let _ = writeln!(html, "<tr>{}<td>{}</td></tr>", figures(test), escape(&test.sentence));
        }
        html.push_str("</table>\n");
    }
    if !passed.is_empty() {
        html.push_str(
            "<details><summary>Passed tests</summary>\n<table>\n<tr><th>Test</th><th>Figure</th><th>Limit</th></tr>\n",
        );
        for test in passed {
            let _ = writeln!(html, "<tr>{}</tr>", figures(test));
        }
        html.push_str("</table>\n</details>\n");
    }
}

/// Name, figure and limit. The sentence tells what a failure means.
fn figures(test: &FitTest) -> String {
    format!(
        "<td>{}</td><td class=\"number\" data-label=\"figure\">{}</td><td class=\"number\" data-label=\"limit\">{}</td>",
        escape(&test.name),
        significant(test.statistic, 3),
        significant(test.limit, 3)
    )
}
