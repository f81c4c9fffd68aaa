//! Writes `sweep.html`: all variants on one page that needs nothing but a browser.

mod bars;
mod parallel;
mod value_plots;
mod variant_comparison;
mod worst_cases;

use std::collections::BTreeMap;

use askama::Template;
use diagnostics::shell_word;
use html_page::filters;
use units::display::{name_with_unit, number_text, quantity_text};

use crate::statistics::PassRate;
use crate::summary::{
    CheckSummary, FailureGroup, ResultEffects, SensitivityMethod, SweepSummary, WorstVariant,
};
use crate::table::{SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};
use crate::variant_table::{
    VariantColumn, VariantEnding, VariantTable, display_name, evenly_thinned, variant_endings,
};
use bars::EffectBarChart;
use parallel::ParallelCoordinatesPlot;
use value_plots::ResultPlots;
use variant_comparison::VariantComparison;
use worst_cases::{WorstCase, worst_cases};

/// Variants in the table of the page.
const MOST_VARIANTS: usize = 400;
/// The fewest variants whose lines across axes show more than a table does.
const LEAST_LINES: usize = 8;

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
    /// The reports of variants that were recorded, relative to the page.
    pub reports: BTreeMap<i64, String>,
    /// The table of all results as text, relative to the page, if there is one.
    pub csv: Option<String>,
    /// What the scenario itself has where variants leave something as it is: values by names, in the units of the columns.
    pub scenario_values: BTreeMap<String, String>,
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

    /// Its class as a verdict.
    fn verdict_class(self) -> &'static str {
        match self {
            VariantEnding::Passed => "pass",
            VariantEnding::NoChecks => "neutral",
            VariantEnding::Failed => "fail",
            VariantEnding::Error => "stop",
        }
    }

    /// In the legend.
    fn legend_text(self) -> &'static str {
        match self {
            VariantEnding::Failed => "failed a check",
            other => other.word(),
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
    about: &'a SweepPageHeader,
    variants: VariantTable<'a>,
    side_by_side: Option<VariantComparison>,
    worst_cases: Vec<WorstCase>,
    results: ResultPlots,
    bars: Vec<EffectBarChart<'a>>,
    parallel: Option<ParallelCoordinatesPlot>,
}

/// The page of a table and its summary.
#[must_use]
pub fn sweep_page(about: &SweepPageHeader, table: &SweepTable, summary: &SweepSummary) -> String {
    let SweepPageHeader { title, plan, design, .. } = about;
    let variants = VariantTable::new(table, MOST_VARIANTS, true).with_scenario_values(&about.scenario_values);
    let lines = ParallelCoordinatesPlot::new(table, summary);
    let outputs = summary.outputs.iter().filter(|output| !output.effects.is_empty());
    html_page::render_page(&SweepPage {
        title,
        plan,
        design,
        table,
        summary,
        about,
        side_by_side: VariantComparison::new(&variants),
        variants,
        worst_cases: worst_cases(table, summary),
        results: ResultPlots::new(table, summary),
        bars: outputs.map(EffectBarChart::new).collect(),
        parallel: lines.filter(|_| table.row_count() >= LEAST_LINES),
    })
}

impl SweepPage<'_> {
    /// Results that never change, so nothing drives them.
    fn constant_result_names(&self) -> impl Iterator<Item = String> {
        let constant = self.summary.outputs.iter().filter(|it| it.effects.is_empty());
        constant.filter_map(|it| self.table.column(&it.name)).map(display_name)
    }

    /// The report of a variant, if it was recorded.
    fn report_of(&self, variant: &i64) -> Option<&String> {
        self.about.reports.get(variant)
    }

    /// Whether a variant of the table was not recorded.
    fn lacks_reports(&self) -> bool {
        self.variants.rows.iter().any(|it| self.report_of(&it.variant).is_none())
    }

    /// What a variant is called, with its number.
    fn variant_label(&self, row: &usize, variant: &i64) -> String {
        let names =
            self.table.columns_with_role(SweepColumnRole::Name).next().and_then(SweepColumn::as_texts);
        match names.and_then(|names| names.get(*row)?.as_deref()) {
            Some(name) => format!("{variant} {name}"),
            None => variant.to_string(),
        }
    }

    /// Whether the worst cases have a table of their own: what stands side by side has them already, unless something went wrong.
    fn shows_worst_cases(&self) -> bool {
        self.side_by_side.is_none() || self.summary.share.passed < self.summary.share.of
    }

    /// The variant with the largest margin of a check, with that margin.
    fn best_variant(&self, check: &CheckSummary) -> Option<(String, String)> {
        let margins = self.table.column(&format!("margin.{}", check.name))?.as_numbers()?;
        let finite = margins.iter().enumerate().filter(|(_, margin)| margin.is_finite());
        // Of equal ones the first.
        let (row, margin) = finite.rev().max_by(|a, b| a.1.total_cmp(b.1))?;
        let variants = self.table.column("variant").and_then(SweepColumn::as_integers);
        let variant = variants.and_then(|all| all.get(row)).copied().unwrap_or(row as i64);
        Some((quantity_text(*margin, check.unit.as_deref()), self.variant_label(&row, &variant)))
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
        format!("trackside replay {}", shell_word(&format!("{}/{variant}", self.plan)))
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
        if worst.margin.is_nan() {
            "–".to_owned()
        } else {
            quantity_text(worst.margin, self.unit.as_deref())
        }
    }
}

impl SweepColumn {
    /// Its name with its unit.
    fn name_with_unit(&self) -> String {
        name_with_unit(&display_name(self), self.unit.as_deref())
    }
}

impl ResultEffects {
    /// Its name with its unit.
    fn name_with_unit(&self) -> String {
        let name = match (self.name.strip_prefix("collect."), self.name.strip_prefix("margin.")) {
            (Some(name), _) => name.to_owned(),
            (_, Some(name)) => format!("margin of {name}"),
            _ => self.name.strip_prefix("check.").unwrap_or(&self.name).to_owned(),
        };
        name_with_unit(&name, self.unit.as_deref())
    }
}

impl VariantColumn<'_> {
    /// The raw value of a variant, by which the page sorts; empty where there is none.
    fn sort_key(&self, row: &usize) -> String {
        match &self.column.values {
            SweepColumnValues::Texts(texts) => texts.get(*row).cloned().flatten().unwrap_or_default(),
            _ => {
                let number = match &self.column.values {
                    SweepColumnValues::Numbers(all) => all.get(*row).copied(),
                    SweepColumnValues::Integers(all) => all.get(*row).map(|it| *it as f64),
                    SweepColumnValues::Booleans(all) => all.get(*row).copied().flatten().map(f64::from),
                    SweepColumnValues::Texts(_) => None,
                };
                number.filter(|it| it.is_finite()).map(|it| it.to_string()).unwrap_or_default()
            }
        }
    }

    /// Whether its digits stand below each other.
    fn is_number(&self) -> bool {
        matches!(self.column.values, SweepColumnValues::Numbers(_) | SweepColumnValues::Integers(_))
    }

    /// The text of the row at a place in the table.
    fn text_at(&self, place: &usize) -> &str {
        self.texts.get(*place).map_or("", String::as_str)
    }

    /// The classes of a value: the lowest and the highest one of a result, the best margin, one that is below 0, and what is as in the
    /// scenario.
    fn value_class(&self, place: &usize, row: &usize) -> String {
        let is_margin = self.column.role == SweepColumnRole::Margin;
        let margin = self.column.as_numbers().and_then(|all| all.get(*row)).copied().filter(|_| is_margin);
        let fails = margin.is_some_and(|margin| margin < 0.0);
        let end = match self.is_extreme(*row) {
            [true, _] => " low",
            [_, true] if is_margin && !fails => " high best-value",
            [_, true] => " high",
            _ => "",
        };
        let own = if self.is_as_in_scenario(*place) { " own" } else { "" };
        format!("{end}{}{own}", if fails { " fail" } else { "" })
    }
}

impl FailureGroup {
    /// When it happened.
    fn time_text(&self) -> String {
        match self.time {
            Some([first, last]) if first < last => {
                format!("{} … {} s", number_text(first), number_text(last))
            }
            Some([first, _]) => format!("{} s", number_text(first)),
            None => "–".to_owned(),
        }
    }
}

/// The value of a column in a variant.
fn cell_text(column: &SweepColumn, worst: &WorstVariant) -> String {
    let row = worst.row;
    match &column.values {
        SweepColumnValues::Integers(values) => values.get(row).map(ToString::to_string),
        SweepColumnValues::Numbers(values) => values.get(row).map(|value| number_text(*value)),
        SweepColumnValues::Booleans(values) => {
            values.get(row).copied().flatten().map(|value| value.to_string())
        }
        SweepColumnValues::Texts(values) => values.get(row).cloned().flatten(),
    }
    .unwrap_or_else(|| "–".to_owned())
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
