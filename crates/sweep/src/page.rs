//! Writes `sweep.html`: all variants on one page that needs nothing but a browser.

mod bars;
mod parallel;
mod scatter;

use askama::Template;
use html_page::{Markup, filters};
use numerics::text::significant;

use crate::statistics::Share;
use crate::summary::{Check, Method, Output, Summary, Worst};
use crate::table::{Column, Role, Table, Values};
use bars::Bars;
use parallel::Parallel;

/// Varied values that stand beside a worst variant.
const DRIVING: usize = 3;

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
enum Ending {
    Passed,
    Failed,
    Error,
}

impl Ending {
    /// Its class in the style.
    fn class(self) -> &'static str {
        match self {
            Ending::Passed => "passed",
            Ending::Failed => "failed",
            Ending::Error => "ended",
        }
    }

    /// In the legend.
    fn text(self) -> &'static str {
        match self {
            Ending::Passed => "passed",
            Ending::Failed => "failed a check",
            Ending::Error => "did not end",
        }
    }
}

#[derive(Template)]
#[template(path = "sweep.html")]
struct Page<'a> {
    title: &'a str,
    plan: &'a str,
    design: &'a str,
    table: &'a Table,
    summary: &'a Summary,
    bars: Vec<Bars<'a>>,
    parallel: Option<Parallel>,
    scatter: Vec<Markup>,
}

/// The page of a table and its summary.
#[must_use]
pub fn page(about: &About, table: &Table, summary: &Summary) -> String {
    let About { title, plan, design } = about;
    let outputs = summary.outputs.iter().filter(|output| !output.effects.is_empty());
    html_page::render(&Page {
        title,
        plan,
        design,
        table,
        summary,
        bars: outputs.map(Bars::new).collect(),
        parallel: Parallel::new(table, summary),
        scatter: scatter::plots(table, summary),
    })
}

impl Page<'_> {
    /// Results that never change, so nothing drives them.
    fn constant(&self) -> impl Iterator<Item = &String> {
        self.summary.outputs.iter().filter(|it| it.effects.is_empty()).map(|it| &it.name)
    }

    /// The varied values that drive a check most, or the first ones.
    fn driving(&self, check: &Check) -> Vec<&Column> {
        let names = [format!("margin.{}", check.name), format!("check.{}", check.name)];
        let output = self.summary.outputs.iter().find(|output| names.contains(&output.name));
        let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
        let driving = effects.iter().filter_map(|effect| self.table.column(&effect.parameter));
        let driving: Vec<&Column> = driving.take(DRIVING).collect();
        if driving.is_empty() {
            self.table.of(Role::Parameter).take(DRIVING).collect()
        } else {
            driving
        }
    }

    /// The command that runs a variant again, for a shell.
    fn replay(&self, variant: &i64) -> String {
        let path = format!("{}/{variant}", self.plan);
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%".contains(c);
        match path.chars().all(plain) && !path.starts_with('-') {
            true => format!("trackside replay {path}"),
            false => format!("trackside replay '{}'", path.replace('\'', "'\\''")),
        }
    }
}

impl Summary {
    /// Checks of which there are worst variants.
    fn ranked_checks(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| !check.worst.is_empty())
    }
}

impl Check {
    /// The variant with the smallest margin.
    fn smallest(&self) -> Option<&Worst> {
        self.worst.iter().find(|worst| !worst.margin.is_nan())
    }

    /// The margin of a variant, with its unit.
    fn margin(&self, worst: &Worst) -> String {
        let number = significant(worst.margin, 4);
        match self.unit.as_deref().filter(|unit| worst.margin.is_finite() && *unit != "1") {
            Some(unit) => format!("{number} {unit}"),
            None => number,
        }
    }
}

impl Column {
    /// Its name with its unit.
    fn label(&self) -> String {
        with_unit(&self.name, self.unit.as_deref())
    }
}

impl Output {
    /// Its name with its unit.
    fn label(&self) -> String {
        with_unit(&self.name, self.unit.as_deref())
    }
}

/// A name with its unit, unless that is 1.
fn with_unit(name: &str, unit: Option<&str>) -> String {
    unit.filter(|unit| *unit != "1")
        .map_or_else(|| name.to_owned(), |unit| format!("{name} [{unit}]"))
}

/// The value of a column in a variant.
fn cell(column: &Column, worst: &Worst) -> String {
    let row = worst.row;
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

/// How each variant ended.
fn endings(table: &Table) -> Vec<Ending> {
    let verdicts = table.of(Role::Verdict).next().and_then(Column::texts).unwrap_or_default();
    let ending = |verdict: &Option<String>| match verdict.as_deref() {
        Some("passed") => Ending::Passed,
        Some("failed") => Ending::Failed,
        _ => Ending::Error,
    };
    verdicts.iter().map(ending).collect()
}

/// At most so many rows out of all, evenly.
fn thinned(rows: &[usize], most: usize) -> Vec<usize> {
    let count = rows.len().min(most);
    (0..count).map(|k| rows[k * rows.len() / count]).collect()
}

/// The end of a name that is too long, which says more than its beginning.
fn shortened(name: &str, letters: usize) -> String {
    let count = name.chars().count();
    if count <= letters {
        return name.to_owned();
    }
    std::iter::once('…').chain(name.chars().skip(count + 1 - letters)).collect()
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
    }

    #[test]
    fn rows_are_thinned_evenly() {
        let rows: Vec<usize> = (0..10).collect();
        assert_eq!(thinned(&rows, 4), [0, 2, 5, 7]);
        assert_eq!(thinned(&rows, 20), rows);
        assert!(thinned(&[], 4).is_empty());
    }
}
