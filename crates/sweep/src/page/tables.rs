//! Writes the tables of the page: checks, worst variants, and variants that did not end.

use std::fmt::Write as _;

use html_page::escape;
use numerics::text::significant;

use super::{About, grouped, interval, percent};
use crate::summary::{Check, Failures, Summary};
use crate::table::{Column, Role, Table, Values};

/// Varied values that stand beside a worst variant.
const MOST_VALUES: usize = 3;

/// All checks with their shares and smallest margins.
pub fn checks(html: &mut String, summary: &Summary) {
    if summary.checks.is_empty() {
        return;
    }
    html.push_str(
        "<h2>Checks</h2>\n<table>\n<tr><th>Check</th><th>Passed</th><th>95 % interval</th><th>Variants</th>\
         <th>Smallest margin</th><th>in variant</th></tr>\n",
    );
    for check in &summary.checks {
        let class = if check.share.passed == check.share.of { "pass" } else { "fail" };
        let worst = check.worst.iter().find(|worst| !worst.margin.is_nan());
        let (margin, variant) = match worst {
            Some(worst) => {
                (with_unit(worst.margin, check.unit.as_deref()), worst.variant.to_string())
            }
            None => ("–".to_owned(), String::new()),
        };
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"verdict {class}\">{}</td><td class=\"number\">{}</td><td class=\"number\">{} of {}</td>\
             <td class=\"number\">{margin}</td><td class=\"number\">{variant}</td></tr>",
            escape(&check.name),
            percent(&check.share),
            interval(&check.share).unwrap_or_default(),
            grouped(check.share.passed),
            grouped(check.share.of)
        );
    }
    html.push_str("</table>\n");
}

/// The worst variants of each check, with the commands that replay them.
pub fn worst(html: &mut String, about: &About, table: &Table, summary: &Summary) {
    let with_worst: Vec<&Check> =
        summary.checks.iter().filter(|check| !check.worst.is_empty()).collect();
    if with_worst.is_empty() {
        return;
    }
    html.push_str("<h2>Worst variants</h2>\n");
    for check in with_worst {
        let values = driving_parameters(check, table, summary);
        let _ = write!(
            html,
            "<h3>{}</h3>\n<table class=\"worst\">\n<tr><th>Variant</th><th>Margin</th>",
            escape(&check.name)
        );
        for value in &values {
            let _ = write!(
                html,
                "<th>{}</th>",
                escape(&super::with_unit(&value.name, value.unit.as_deref()))
            );
        }
        html.push_str("<th>Replay it with</th></tr>\n");
        for worst in &check.worst {
            let class = if worst.passed == Some(true) { "pass" } else { "fail" };
            let margin = with_unit(worst.margin, check.unit.as_deref());
            let _ = write!(
                html,
                "<tr><td class=\"number\">{}</td><td class=\"number {class}\">{margin}</td>",
                worst.variant
            );
            for value in &values {
                let _ =
                    write!(html, "<td class=\"number\">{}</td>", escape(&cell(value, worst.row)));
            }
            let _ = writeln!(html, "<td><code>{}</code></td></tr>", replay(about, worst.variant));
        }
        html.push_str("</table>\n");
    }
}

/// The varied values that drive a check most, or the first ones.
fn driving_parameters<'a>(check: &Check, table: &'a Table, summary: &Summary) -> Vec<&'a Column> {
    let names = [format!("margin.{}", check.name), format!("check.{}", check.name)];
    let output = summary.outputs.iter().find(|output| names.contains(&output.name));
    let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
    let driving = effects.iter().filter_map(|effect| table.column(&effect.parameter));
    let driving: Vec<&Column> = driving.take(MOST_VALUES).collect();
    if driving.is_empty() { table.of(Role::Parameter).take(MOST_VALUES).collect() } else { driving }
}

/// Variants that did not end, by what failed.
pub fn failures(html: &mut String, about: &About, summary: &Summary) {
    if summary.failures.is_empty() {
        return;
    }
    html.push_str(
        "<h2 id=\"errors\">Variants that did not end</h2>\n<table class=\"worst\">\n<tr><th>Variants</th><th>Node</th><th>Call</th><th>At</th>\
         <th>Message of the first</th><th>Replay it with</th></tr>\n",
    );
    for Failures { node, call, count, variants, text, time } in &summary.failures {
        let name = |name: &Option<String>| name.as_deref().map_or("–".to_owned(), escape);
        let time = match time {
            Some([first, last]) if first < last => {
                format!("{} … {} s", significant(*first, 4), significant(*last, 4))
            }
            Some([time, _]) => format!("{} s", significant(*time, 4)),
            None => "–".to_owned(),
        };
        let first = variants.first().map(|&variant| replay(about, variant)).unwrap_or_default();
        let _ = writeln!(
            html,
            "<tr><td class=\"number\">{}</td><td>{}</td><td>{}</td><td class=\"number\">{time}</td><td>{}</td><td><code>{first}</code></td></tr>",
            grouped(*count),
            name(node),
            name(call),
            escape(text)
        );
    }
    html.push_str("</table>\n");
}

fn with_unit(margin: f64, unit: Option<&str>) -> String {
    let number = significant(margin, 4);
    match unit.filter(|unit| margin.is_finite() && *unit != "1") {
        Some(unit) => format!("{number} {}", escape(unit)),
        None => number,
    }
}

fn cell(column: &Column, row: usize) -> String {
    match &column.values {
        Values::Integers(values) => values.get(row).map(ToString::to_string),
        Values::Numbers(values) => values.get(row).map(|value| significant(*value, 5)),
        Values::Booleans(values) => {
            values.get(row).copied().flatten().map(|value| value.to_string())
        }
        Values::Texts(values) => values.get(row).cloned().flatten(),
    }
    .unwrap_or_else(|| "–".to_owned())
}

/// The command that runs a variant again, for a shell and safe in HTML.
fn replay(about: &About, variant: i64) -> String {
    let path = format!("{}/{variant}", about.plan);
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%".contains(c);
    let word = match path.chars().all(plain) && !path.starts_with('-') {
        true => path,
        false => format!("'{}'", path.replace('\'', "'\\''")),
    };
    format!("trackside replay {}", escape(&word))
}
