//! Finds checks that passed and that no value of the run could have failed.

use expression::Interval;
use recording::{AllVariables, Columns, NumberIndex, Row};
use units::display::{number_text, quantity_text, unit_suffix};

use super::{CheckCondition, CheckPlan, CheckVerdict, RunChecks};

/// A bound that so many times the largest value of its signals does not reach judges nothing.
const BEYOND: f64 = 1e6;

/// Signals that a warning tells the values of.
const MOST_SIGNALS: usize = 3;

/// The values of a signal within the window of a check.
#[derive(Debug, Clone, Copy)]
pub(super) struct SignalRange {
    index: NumberIndex<AllVariables>,
    low: f64,
    high: f64,
}

impl SignalRange {
    /// Those of all signals of a check, before the first sample.
    pub fn of_check(plan: &CheckPlan) -> Vec<Self> {
        let CheckCondition::Run(condition) = &plan.condition else { return Vec::new() };
        let mut extents: Vec<Self> = Vec::new();
        for index in condition.number_indices() {
            if extents.iter().all(|it| it.index != index) {
                extents.push(SignalRange { index, low: f64::INFINITY, high: f64::NEG_INFINITY });
            }
        }
        extents
    }

    #[inline]
    pub fn include_sample(&mut self, row: &Row<AllVariables>) {
        let value = row[self.index];
        (self.low, self.high) = (self.low.min(value), self.high.max(value));
    }

    /// The values that the signal could have in a run of another kind: far beyond those of this one, and 1 in any case, since a difference
    /// that is zero but for rounding says nothing of its size.
    fn far_interval(self) -> Interval {
        let largest = self.low.abs().max(self.high.abs());
        if largest == 0.0 || !largest.is_finite() {
            return Interval::ALL;
        }
        let far = (BEYOND * largest).max(1.0);
        Interval { low: -far, high: far }
    }

    /// In words: `plant.v_x` was 19.2 to 20 m/s.
    fn describe(self, columns: &Columns<AllVariables>) -> String {
        let column = &columns[self.index];
        let (name, unit) = (column.qualified_name(), unit_suffix(column.unit.as_deref()));
        match self.low == self.high {
            true => format!("`{name}` was {}{unit} all the time", number_text(self.low)),
            false => format!("`{name}` was {} to {}{unit}", number_text(self.low), number_text(self.high)),
        }
    }
}

impl RunChecks {
    /// A warning for each check that passed and could not have failed: its condition holds for all values of its signals, its bound is far
    /// beyond them, or its window has one sample. `verdicts` are those of all checks, in their order.
    #[must_use]
    pub fn unfailing_warnings(
        &self,
        verdicts: &[CheckVerdict],
        columns: &Columns<AllVariables>,
    ) -> Vec<String> {
        let checks = self.checks.iter().zip(&self.extents).zip(verdicts);
        let warning =
            |(((plan, _), extents), verdict): ((&(CheckPlan, _), &Vec<SignalRange>), &CheckVerdict)| {
                let why = match verdict.passed {
                    true => self.why_unfailing(plan, extents, verdict, columns)?,
                    false => return None,
                };
                let (file, line, name) = (plan.file.display(), plan.line, &plan.name);
                Some(format!("{file}:{line}: no value of this run could fail the check `{name}`: {why}"))
            };
        checks.filter_map(warning).collect()
    }

    fn why_unfailing(
        &self,
        plan: &CheckPlan,
        extents: &[SignalRange],
        verdict: &CheckVerdict,
        columns: &Columns<AllVariables>,
    ) -> Option<String> {
        let CheckPlan { that, during: [from, to], .. } = plan;
        let had: Vec<_> = extents.iter().take(MOST_SIGNALS).map(|it| it.describe(columns)).collect();
        let had = had.join(", ");
        if holds_for_all_values(plan) {
            let had = if had.is_empty() { "it is about no signal".to_owned() } else { had };
            return Some(format!("`{that}` holds for all values; {had}"));
        }
        let CheckCondition::Run(condition) = &plan.condition else { return None };
        // Nobody remembers the values before the checkpoint that a run went on from.
        if self.resumed || verdict.samples == 0 {
            return None;
        }
        let far = |index: NumberIndex<AllVariables>| {
            extents.iter().find(|it| it.index == index).map_or(Interval::ALL, |it| it.far_interval())
        };
        let during = Interval { low: *from, high: *to };
        if condition.holds_for_all_values(during, plan.tolerance, &far) {
            let unit = verdict.unit.as_deref();
            let bound = verdict.limit.map(|limit| format!(", {},", quantity_text(limit, unit)));
            let bound = bound.unwrap_or_default();
            return Some(format!(
                "the bound of `{that}`{bound} is more than a million times beyond its signals; {had}"
            ));
        }
        let is_wide = to - from > self.slack;
        (plan.windowed && is_wide && verdict.samples == 1).then(|| {
            format!("its window from {from} s to {to} s has one sample of the run; {had}. A `during` of several communication points judges more")
        })
    }
}

/// Whether the condition of a check holds whatever its signals or results are.
fn holds_for_all_values(plan: &CheckPlan) -> bool {
    let during = Interval { low: plan.during[0], high: plan.during[1] };
    match &plan.condition {
        CheckCondition::Run(condition) => {
            condition.holds_for_all_values(during, plan.tolerance, &|_| Interval::ALL)
        }
        CheckCondition::Results(condition, _) => {
            condition.holds_for_all_values(during, plan.tolerance, &|_| Interval::ALL)
        }
    }
}
