//! Summary of a sweep table: pass rates, worst variants, effects of parameters, failures.

mod effects;
mod failures;

use effects::SweepEffects;
pub use effects::{ParameterEffect, ResultEffects, SensitivityMethod};
pub use failures::FailureGroup;

use serde::Serialize;

use crate::statistics::PassRate;
use crate::table::{ERROR, NO_CHECKS, PASSED, SweepColumn, SweepColumnRole, SweepTable};

/// The names of the columns of checks and their margins begin with these.
const CHECK: &str = "check.";
const MARGIN: &str = "margin.";
/// Worst variants that are told of a check.
const WORST: usize = 10;
/// The fewest variants by hand whose ranks say something.
const LEAST_RANKED: usize = 20;

/// What kind of choice the variants of a sweep are.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DesignKind {
    /// Draws from distributions, which stand for all that could have been drawn.
    #[default]
    Sample,
    /// All combinations of chosen values, or what a search tried.
    Combinations,
    /// Set-ups that somebody wrote down one by one.
    ByHand,
}

/// The summary of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepSummary {
    /// How its variants were chosen: only those of a sample are statistics of what was not run.
    pub design: DesignKind,
    /// Of all variants, how many pass all checks, or come to their end without any. One that did not end does not pass.
    pub share: PassRate,
    /// Variants that did not end.
    pub errors: u64,
    /// In the order of the table.
    pub checks: Vec<CheckSummary>,
    /// What drives each margin, check without a margin, and collected value.
    pub outputs: Vec<ResultEffects>,
    /// Values that vary but have no order, such as files: only a Saltelli design judges them.
    pub not_ordered: Vec<String>,
    /// Variants that did not end, by what failed; the most frequent first.
    pub failures: Vec<FailureGroup>,
}

/// The summary of a check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckSummary {
    /// Its name in the scenario.
    pub name: String,
    /// Of the variants in which it was judged.
    pub share: PassRate,
    /// The unit of its margin.
    pub unit: Option<String>,
    /// The variants with the smallest margins, or some that fail where there are no margins; the worst first.
    pub worst: Vec<WorstVariant>,
}

/// One of the worst variants of a check.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WorstVariant {
    /// The row of the table.
    pub row: usize,
    /// The number of the variant.
    pub variant: i64,
    /// Its margin; NaN where there is none.
    pub margin: f64,
    /// Whether the check passed.
    pub passed: Option<bool>,
}

impl SweepSummary {
    /// Of a table in the order of its design. Of a Saltelli design, `axes` are the names of its axes in their order; of others there is
    /// nothing. `seed` is that of the intervals.
    #[must_use]
    pub fn from_table(table: &SweepTable, axes: Option<&[String]>, seed: u64) -> Self {
        let verdicts = table.verdicts();
        let SweepEffects { outputs, not_ordered } = effects::effects_on_results(table, axes, seed);
        Self {
            design: DesignKind::default(),
            share: PassRate::from_verdicts(
                verdicts.iter().map(|it| matches!(it.as_deref(), Some(PASSED | NO_CHECKS))),
            ),
            errors: verdicts.iter().filter(|it| it.as_deref() == Some(ERROR)).count() as u64,
            checks: table
                .columns_with_role(SweepColumnRole::Check)
                .map(|column| CheckSummary::from_column(table, column))
                .collect(),
            outputs,
            not_ordered,
            failures: failures::group_failed_variants(table),
        }
    }

    /// The same of variants that were chosen in another way than by draws. A few set-ups by hand have no effects: which of the values that
    /// differ between them did it, ranks cannot say.
    #[must_use]
    pub fn with_design(mut self, design: DesignKind) -> Self {
        self.design = design;
        if design == DesignKind::ByHand && self.share.of < LEAST_RANKED as u64 {
            self.outputs.iter_mut().for_each(|output| output.effects.clear());
            self.not_ordered.clear();
        }
        self
    }

    /// Whether the variants are draws, so that intervals say something about all that could have been drawn.
    #[must_use]
    pub fn is_sample(&self) -> bool {
        self.design == DesignKind::Sample
    }
}

impl CheckSummary {
    fn from_column(table: &SweepTable, column: &SweepColumn) -> Self {
        let name = column.name.strip_prefix(CHECK).unwrap_or(&column.name).to_owned();
        let verdicts = column.as_booleans().unwrap_or_default();
        let margin = table.column(&format!("{MARGIN}{name}"));
        let margins = margin.and_then(SweepColumn::as_numbers);
        let at = |row: usize| margins.and_then(|it| it.get(row)).copied().unwrap_or(f64::NAN);
        // A check that never came to a margin failed worse than any that did.
        let failed = |row: &usize| verdicts[*row] == Some(false) && at(*row).is_nan();
        let has_margin = |row: &usize| verdicts[*row].is_some() && !at(*row).is_nan();
        let mut rows: Vec<usize> = (0..verdicts.len()).filter(failed).take(WORST).collect();
        let mut with_margin: Vec<usize> = (0..verdicts.len()).filter(has_margin).collect();
        // Of equal ones the first, whatever the sort does with them.
        let order = |&a: &usize, &b: &usize| at(a).total_cmp(&at(b)).then(a.cmp(&b));
        if with_margin.len() > WORST {
            with_margin.select_nth_unstable_by(WORST, order);
            with_margin.truncate(WORST);
        }
        with_margin.sort_by(order);
        rows.extend(with_margin);
        rows.truncate(WORST);
        let worst = rows.into_iter().map(|row| {
            let variant = variant_number(table, row);
            WorstVariant { row, variant, margin: at(row), passed: verdicts[row] }
        });
        Self {
            worst: worst.collect(),
            share: PassRate::from_verdicts(verdicts.iter().copied().flatten()),
            unit: margin.and_then(|it| it.unit.clone()),
            name,
        }
    }
}

/// The number of the variant in a row.
fn variant_number(table: &SweepTable, row: usize) -> i64 {
    let numbers = table.columns_with_role(SweepColumnRole::Variant).next().and_then(SweepColumn::as_integers);
    numbers.and_then(|it| it.get(row)).copied().unwrap_or(row as i64)
}
