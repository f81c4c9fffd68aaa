//! Writes `sweep.html`: all variants on one page that needs nothing but a browser.

mod bars;
mod parallel;
mod scatter;

use askama::Template;
use html_page::{Markup, filters};
use numerics::text::format_significant;

use crate::statistics::PassRate;
use crate::summary::{CheckSummary, ResultEffects, SensitivityMethod, SweepSummary, WorstVariant};
use crate::table::{FAILED, NO_CHECKS, PASSED, SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};
use bars::EffectBarChart;
use parallel::ParallelCoordinatesPlot;

/// Varied values that stand beside a worst variant.
const DRIVING: usize = 3;

/// What the page says of the sweep besides its numbers.
#[derive(Clone, Debug)]
pub struct SweepPageHeader {
    /// The title.
    pub title: String,
    /// The folder of the plan, as it stands in commands.
    pub plan: String,
    /// How the variants were chosen, a sentence.
    pub design: String,
}

/// How a variant ended.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
enum VariantEnding {
    Passed,
    NoChecks,
    Failed,
    Error,
}

impl VariantEnding {
    /// Its class in the style.
    fn css_class(self) -> &'static str {
        match self {
            VariantEnding::Passed | VariantEnding::NoChecks => "passed",
            VariantEnding::Failed => "failed",
            VariantEnding::Error => "ended",
        }
    }

    /// In the legend.
    fn legend_text(self) -> &'static str {
        match self {
            VariantEnding::Passed => "passed",
            VariantEnding::NoChecks => "no checks",
            VariantEnding::Failed => "failed a check",
            VariantEnding::Error => "did not end",
        }
    }
}

#[derive(Template)]
#[template(path = "sweep.html")]
struct SweepPage<'a> {
    title: &'a str,
    plan: &'a str,
    design: &'a str,
    table: &'a SweepTable,
    summary: &'a SweepSummary,
    bars: Vec<EffectBarChart<'a>>,
    parallel: Option<ParallelCoordinatesPlot>,
    scatter: Vec<Markup>,
}

/// The page of a table and its summary.
#[must_use]
pub fn sweep_page(about: &SweepPageHeader, table: &SweepTable, summary: &SweepSummary) -> String {
    let SweepPageHeader { title, plan, design } = about;
    let outputs = summary.outputs.iter().filter(|output| !output.effects.is_empty());
    html_page::render_page(&SweepPage {
        title,
        plan,
        design,
        table,
        summary,
        bars: outputs.map(EffectBarChart::new).collect(),
        parallel: ParallelCoordinatesPlot::new(table, summary),
        scatter: scatter::margin_scatter_plots(table, summary),
    })
}

impl SweepPage<'_> {
    /// Results that never change, so nothing drives them.
    fn constant_result_names(&self) -> impl Iterator<Item = &String> {
        self.summary.outputs.iter().filter(|it| it.effects.is_empty()).map(|it| &it.name)
    }

    /// The varied values that drive a check most, or the first ones.
    fn driving_columns(&self, check: &CheckSummary) -> Vec<&SweepColumn> {
        let names = [format!("margin.{}", check.name), format!("check.{}", check.name)];
        let output = self.summary.outputs.iter().find(|output| names.contains(&output.name));
        let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
        let driving = effects.iter().filter_map(|effect| self.table.column(&effect.parameter));
        let driving: Vec<&SweepColumn> = driving.take(DRIVING).collect();
        if driving.is_empty() {
            self.table.columns_with_role(SweepColumnRole::Parameter).take(DRIVING).collect()
        } else {
            driving
        }
    }

    /// The command that runs a variant again, for a shell.
    fn replay_command(&self, variant: &i64) -> String {
        let path = format!("{}/{variant}", self.plan);
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%".contains(c);
        match path.chars().all(plain) && !path.starts_with('-') {
            true => format!("trackside replay {path}"),
            false => format!("trackside replay '{}'", path.replace('\'', "'\\''")),
        }
    }
}

impl SweepSummary {
    /// Checks of which there are worst variants.
    fn checks_with_worst_variants(&self) -> impl Iterator<Item = &CheckSummary> {
        self.checks.iter().filter(|check| !check.worst.is_empty())
    }
}

impl CheckSummary {
    /// The variant with the smallest margin.
    fn worst_variant(&self) -> Option<&WorstVariant> {
        self.worst.iter().find(|worst| !worst.margin.is_nan())
    }

    /// The margin of a variant, with its unit.
    fn margin_text(&self, worst: &WorstVariant) -> String {
        let number = format_significant(worst.margin, 4);
        match self.unit.as_deref().filter(|unit| worst.margin.is_finite() && *unit != "1") {
            Some(unit) => format!("{number} {unit}"),
            None => number,
        }
    }
}

impl SweepColumn {
    /// Its name with its unit.
    fn name_with_unit(&self) -> String {
        append_unit(&self.name, self.unit.as_deref())
    }
}

impl ResultEffects {
    /// Its name with its unit.
    fn name_with_unit(&self) -> String {
        append_unit(&self.name, self.unit.as_deref())
    }
}

/// A name with its unit, unless that is 1.
fn append_unit(name: &str, unit: Option<&str>) -> String {
    unit.filter(|unit| *unit != "1").map_or_else(|| name.to_owned(), |unit| format!("{name} [{unit}]"))
}

/// The value of a column in a variant.
fn cell_text(column: &SweepColumn, worst: &WorstVariant) -> String {
    let row = worst.row;
    match &column.values {
        SweepColumnValues::Integers(values) => values.get(row).map(ToString::to_string),
        SweepColumnValues::Numbers(values) => values.get(row).map(|value| format_significant(*value, 5)),
        SweepColumnValues::Booleans(values) => {
            values.get(row).copied().flatten().map(|value| value.to_string())
        }
        SweepColumnValues::Texts(values) => values.get(row).cloned().flatten(),
    }
    .unwrap_or_else(|| "–".to_owned())
}

/// How each variant ended.
fn variant_endings(table: &SweepTable) -> Vec<VariantEnding> {
    let ending = |verdict: &Option<String>| match verdict.as_deref() {
        Some(PASSED) => VariantEnding::Passed,
        Some(NO_CHECKS) => VariantEnding::NoChecks,
        Some(FAILED) => VariantEnding::Failed,
        _ => VariantEnding::Error,
    };
    table.verdicts().iter().map(ending).collect()
}

/// At most so many rows out of all, evenly.
fn evenly_thinned(rows: &[usize], most: usize) -> Vec<usize> {
    let count = rows.len().min(most);
    (0..count).map(|k| rows[k * rows.len() / count]).collect()
}

/// The end of a name that is too long, which says more than its beginning.
fn shortened_name(name: &str, letters: usize) -> String {
    let count = name.chars().count();
    if count <= letters {
        return name.to_owned();
    }
    std::iter::once('…').chain(name.chars().skip(count + 1 - letters)).collect()
}

/// A share with as many decimals as it has variants: never 100 % unless all pass.
fn pass_rate_percent(share: &PassRate) -> String {
    if share.of == 0 {
        return "–".to_owned();
    }
    format!("{} %", percent_digits(share.passed as f64 / share.of as f64, share.of))
}

fn pass_rate_interval(share: &PassRate) -> Option<String> {
    let [low, high] = share.wilson_estimate()?.interval;
    Some(format!("{} to {} %", percent_digits(low, share.of), percent_digits(high, share.of)))
}

fn percent_digits(share: f64, of: u64) -> String {
    let digits = of.max(1).ilog10() as usize;
    let decimals = (digits + usize::from(10_u64.pow(digits as u32) < of)).saturating_sub(2);
    format!("{:.decimals$}", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_never_rounded_to_all() {
        let of = |passed, of| pass_rate_percent(&PassRate { passed, of });
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
        assert_eq!(evenly_thinned(&rows, 4), [0, 2, 5, 7]);
        assert_eq!(evenly_thinned(&rows, 20), rows);
        assert!(evenly_thinned(&[], 4).is_empty());
    }
}
