//! Writes `sweep.html`: all variants on one page that needs nothing but a browser.

mod bars;
mod parallel;
mod scatter;
mod tables;

use std::fmt::Write as _;

use html_page::escape;

use crate::statistics::Share;
use crate::summary::{Method, Output, Summary};
use crate::table::{Column, Role, Table};

/// What the page says of the sweep besides its numbers.
#[derive(Clone, Debug)]
pub struct About {
    /// The title.
    pub title: String,
    /// The folder of the plan, as it stands in commands.
    pub plan: String,
    /// How the variants were chosen, a sentence.
    pub design: String,
}

/// How a variant ended.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
enum Ended {
    Passed,
    Failed,
    Error,
}

impl Ended {
    /// Its class in the style.
    fn class(self) -> &'static str {
        match self {
            Ended::Passed => "passed",
            Ended::Failed => "failed",
            Ended::Error => "ended",
        }
    }
}

/// The page of a table and its summary.
#[must_use]
pub fn page(about: &About, table: &Table, summary: &Summary) -> String {
    let mut html = String::new();
    head(&mut html, about, summary);
    tables::checks(&mut html, summary);
    effects(&mut html, summary);
    parallel::write(&mut html, table, summary);
    scatter::write(&mut html, table, summary);
    tables::worst(&mut html, about, table, summary);
    tables::failures(&mut html, about, summary);
    html_page::page(&about.title, include_str!("page/style.css"), &html)
}

fn head(html: &mut String, about: &About, summary: &Summary) {
    let Summary { share, errors, .. } = summary;
    let class = if share.passed == share.of { "pass" } else { "fail" };
    let variants = if share.of == 1 { "variant passes" } else { "variants pass" };
    let _ = write!(
        html,
        "<p class=\"banner {class}\"><b>{}</b> {} of {} {variants}",
        percent(share),
        grouped(share.passed),
        grouped(share.of)
    );
    if let Some(interval) = interval(share) {
        let _ = write!(html, "; 95 % interval {interval}");
    }
    html.push_str("</p>\n");
    let _ = writeln!(html, "<p class=\"faint\">{}</p>", escape(&about.design));
    if *errors > 0 {
        let variants = if *errors == 1 { "variant" } else { "variants" };
        let count = grouped(*errors);
        let _ = writeln!(
            html,
            "<p class=\"warning\"><b>{count} {variants} did not end</b>: see <a href=\"#errors\">below</a>.</p>"
        );
    }
}

/// What drives the results, a figure for each.
fn effects(html: &mut String, summary: &Summary) {
    let told: Vec<&Output> =
        summary.outputs.iter().filter(|output| !output.effects.is_empty()).collect();
    let Some(first) = told.first() else { return };
    html.push_str("<h2>What drives what?</h2>\n");
    html.push_str(match first.method {
        Method::Indices => {
            "<p>Sobol's indices: the share of a result's variance that goes when one value is known (first, dark), and that stays when all \
             others are known (total, light). Where the total is larger, the value acts together with others. Lines are 95 % intervals.</p>\n"
        }
        Method::Ranks => {
            "<p>Correlations of ranks: 1 or −1 when a result only rises or only falls with a value, however it bends. One that rises and \
             falls again is not seen. Lines are 95 % intervals.</p>\n"
        }
    });
    html.push_str("<div class=\"grid two\">\n");
    told.iter().for_each(|output| bars::write(html, output));
    html.push_str("</div>\n");
    let constant = summary.outputs.iter().filter(|output| output.effects.is_empty());
    listed(html, "Without effects, since they never change", constant.map(|output| &output.name));
    listed(html, "Not judged, since names have no order", summary.not_ordered.iter());
}

fn listed<'a>(html: &mut String, what: &str, names: impl Iterator<Item = &'a String>) {
    let names: Vec<String> = names.map(|name| format!("<code>{}</code>", escape(name))).collect();
    if !names.is_empty() {
        let _ = writeln!(html, "<p class=\"faint\">{what}: {}.</p>", names.join(", "));
    }
}

/// How each variant ended.
fn ended(table: &Table) -> Vec<Ended> {
    let verdicts = table.of(Role::Verdict).next().and_then(Column::texts).unwrap_or_default();
    let ended = |verdict: &Option<String>| match verdict.as_deref() {
        Some("passed") => Ended::Passed,
        Some("failed") => Ended::Failed,
        _ => Ended::Error,
    };
    verdicts.iter().map(ended).collect()
}

/// At most so many rows out of all, evenly.
fn thinned(rows: &[usize], most: usize) -> Vec<usize> {
    let count = rows.len().min(most);
    (0..count).map(|k| rows[k * rows.len() / count]).collect()
}

/// A name with its unit, unless that is 1.
fn with_unit(name: &str, unit: Option<&str>) -> String {
    unit.filter(|unit| *unit != "1")
        .map_or_else(|| name.to_owned(), |unit| format!("{name} [{unit}]"))
}

/// A share with as many decimals as it has variants: never 100 % unless all pass.
fn percent(share: &Share) -> String {
    if share.of == 0 {
        return "–".to_owned();
    }
    format!("{} %", decimal(share.passed as f64 / share.of as f64, share.of))
}

fn interval(share: &Share) -> Option<String> {
    let [low, high] = share.estimate()?.interval;
    Some(format!("{} to {} %", decimal(low, share.of), decimal(high, share.of)))
}

fn decimal(share: f64, of: u64) -> String {
    let digits = of.max(1).ilog10() as usize;
    let decimals = (digits + usize::from(10_u64.pow(digits as u32) < of)).saturating_sub(2);
    format!("{:.decimals$}", 100.0 * share)
}

/// A count with its thousands apart.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_never_rounded_to_all() {
        let of = |passed, of| percent(&Share { passed, of });
        assert_eq!(of(1, 1), "100 %");
        assert_eq!(of(9, 10), "90 %");
        assert_eq!(of(999, 1000), "99.9 %");
        assert_eq!(of(999_999, 1_000_000), "99.9999 %");
        assert_eq!(of(1_000_000, 1_000_000), "100.0000 %");
        assert_eq!(of(0, 0), "–");
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }

    #[test]
    fn rows_are_thinned_evenly() {
        let rows: Vec<usize> = (0..10).collect();
        assert_eq!(thinned(&rows, 4), [0, 2, 5, 7]);
        assert_eq!(thinned(&rows, 20), rows);
        assert!(thinned(&[], 4).is_empty());
    }
}
