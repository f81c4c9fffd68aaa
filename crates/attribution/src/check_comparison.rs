//! Compares the checks of two runs: value, limit, margin and verdict of each, and what changed a verdict, the values or the check.

use expression::comparison_sides;
use serde::Serialize;
use units::Unit;
use units::display::{number_text, unit_suffix};

use crate::check_evaluation::evaluate_check;
use crate::number_pair::{NumberPair, quantity_change};
use crate::run_inputs::RecordedCheck;
use crate::trajectory::Trajectory;

/// A part of the definition of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckPart {
    /// What is compared, and how.
    Condition,
    /// What it is compared with.
    Limit,
    /// By how much it may be off.
    Tolerance,
    /// The window.
    Window,
}

/// What changed the verdict of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FlipCause {
    /// The values of the signals: the check of A fails with those of B, or passes with them.
    Value,
    /// The definition of the check, such as its limit.
    Check,
    /// Both together: neither changes the verdict alone.
    Both,
    /// Each of both: either changes the verdict alone.
    Either,
    /// Both differ, and the recordings do not tell which of them it is.
    Unknown,
}

/// A check of two runs.
#[derive(Debug, Clone, Serialize)]
pub struct CheckComparison {
    /// Its name.
    pub name: String,
    /// What it was in A, with its outcome; none if A does not have it.
    pub a: Option<RecordedCheck>,
    /// In B, with values in the unit of A where that is possible.
    pub b: Option<RecordedCheck>,
    /// What of its definition differs.
    pub changes: Vec<CheckPart>,
    /// What changed its verdict; none if that is the same.
    pub flipped_by: Option<FlipCause>,
    /// What changed its verdict, as a sentence.
    pub text: Option<String>,
}

/// Compares the checks of two runs by their names. First come those whose verdicts differ, then those that differ in anything else.
/// `values_are_same` says whether no signal differs.
pub(crate) fn compare_checks(
    checks: [&[RecordedCheck]; 2],
    trajectories: [Option<&Trajectory>; 2],
    values_are_same: bool,
) -> Vec<CheckComparison> {
    let [of_a, of_b] = checks;
    let find = |list: &[RecordedCheck], name: &str| list.iter().find(|it| it.name == name).cloned();
    let of_both = of_a.iter().map(|check| (Some(check.clone()), find(of_b, &check.name)));
    let new = of_b.iter().filter(|check| of_a.iter().all(|it| it.name != check.name));
    let pairs = of_both.chain(new.map(|check| (None, Some(check.clone()))));
    let mut comparisons: Vec<_> = pairs
        .map(|(a, b)| CheckComparison::new(a, b).with_flip_cause(trajectories, values_are_same))
        .collect();
    comparisons.sort_by_key(|it| (it.flipped_by.is_none(), it.is_unchanged()));
    comparisons
}

impl CheckComparison {
    fn new(a: Option<RecordedCheck>, b: Option<RecordedCheck>) -> Self {
        let name = a.as_ref().or(b.as_ref()).map(|it| it.name.clone()).unwrap_or_default();
        let unit = a.as_ref().and_then(|it| it.unit.clone());
        let b = b.map(|it| convert_to_unit(it, unit));
        let changes = match (&a, &b) {
            (Some(a), Some(b)) => changed_parts(a, b),
            _ => Vec::new(),
        };
        CheckComparison { name, a, b, changes, flipped_by: None, text: None }
    }

    fn with_flip_cause(mut self, trajectories: [Option<&Trajectory>; 2], values_are_same: bool) -> Self {
        let (Some(a), Some(b)) = (&self.a, &self.b) else { return self };
        if a.passed == b.passed {
            return self;
        }
        let cause = match self.changes.is_empty() {
            true => FlipCause::Value,
            false => flip_cause(a, b, trajectories).unwrap_or(FlipCause::Unknown),
        };
        self.flipped_by = Some(cause);
        self.text = Some(format!(
            "{}: {} -> {} because {}",
            self.name,
            verdict_word(a),
            verdict_word(b),
            self.reason(cause, values_are_same)
        ));
        self
    }

    /// Whether definition, value, limit, margin and verdict are the same in both.
    #[must_use]
    pub fn is_unchanged(&self) -> bool {
        let (Some(a), Some(b)) = (&self.a, &self.b) else { return false };
        self.changes.is_empty()
            && (a.passed, a.value, a.limit, a.margin) == (b.passed, b.value, b.limit, b.margin)
    }

    /// The unit of values, limits and margins.
    #[must_use]
    pub fn unit(&self) -> Option<&str> {
        self.a.as_ref().or(self.b.as_ref())?.unit.as_deref()
    }

    /// What was measured in A and B. Of several comparisons joined by `and` the deciding one may be another in each run: they have none.
    #[must_use]
    pub fn values(&self) -> [Option<f64>; 2] {
        self.of_single_comparison(|check| check.value)
    }

    /// The limits of A and B, as the values.
    #[must_use]
    pub fn limits(&self) -> [Option<f64>; 2] {
        self.of_single_comparison(|check| check.limit)
    }

    fn of_single_comparison(&self, pick: fn(&RecordedCheck) -> Option<f64>) -> [Option<f64>; 2] {
        [&self.a, &self.b]
            .map(|check| check.as_ref().filter(|it| comparison_sides(&it.that).is_some()).and_then(pick))
    }

    /// The margins of A and B.
    #[must_use]
    pub fn margins(&self) -> [Option<f64>; 2] {
        [&self.a, &self.b].map(|check| check.as_ref()?.margin)
    }

    /// The verdicts of A and B.
    #[must_use]
    pub fn verdicts(&self) -> [&'static str; 2] {
        [&self.a, &self.b].map(|check| check.as_ref().map_or("–", verdict_word))
    }

    /// What differs, in a few words.
    #[must_use]
    pub fn cause_words(&self) -> String {
        let part = self.part_names();
        match (&self.a, &self.b, self.flipped_by) {
            (_, None, _) => "only A has it".to_owned(),
            (None, ..) => "only B has it".to_owned(),
            (.., Some(FlipCause::Value)) => "the value moved".to_owned(),
            (.., Some(FlipCause::Both)) => format!("value and {part} together, neither alone"),
            (.., Some(FlipCause::Either)) => format!("value and {part}, each alone"),
            (.., Some(FlipCause::Unknown)) => format!("value or {part}"),
            (.., Some(FlipCause::Check)) => format!("the {part} moved"),
            _ if !self.changes.is_empty() => format!("another {part}"),
            _ => String::new(),
        }
    }

    fn part_names(&self) -> String {
        let name = |part: &CheckPart| match part {
            CheckPart::Condition => "condition",
            CheckPart::Limit => "limit",
            CheckPart::Tolerance => "tolerance",
            CheckPart::Window => "window",
        };
        self.changes.iter().map(name).collect::<Vec<_>>().join(" and ")
    }

    /// The parts of the definition that differ, from A to B: `14 -> 18 m/s²`.
    fn part_changes(&self) -> String {
        let (Some(a), Some(b)) = (&self.a, &self.b) else { return String::new() };
        let change = |part: &CheckPart| match part {
            CheckPart::Limit => match self.limits() {
                [Some(a), Some(b)] if a != b => quantity_change(a, b, self.unit()),
                _ => format!("{} -> {}", limit_text(a), limit_text(b)),
            },
            CheckPart::Condition => format!("{} -> {}", a.that, b.that),
            CheckPart::Tolerance => quantity_change(a.tolerance, b.tolerance, self.unit()),
            CheckPart::Window => {
                let [[from_a, to_a], [from_b, to_b]] = [a.during, b.during];
                format!("{from_a} to {to_a} s -> {from_b} to {to_b} s")
            }
        };
        self.changes.iter().map(change).collect::<Vec<_>>().join(" and ")
    }

    /// Why the verdict changed, behind `because`.
    fn reason(&self, cause: FlipCause, values_are_same: bool) -> String {
        if let Some(reason) = self.reason_without_margin() {
            return reason;
        }
        let unit = self.unit();
        let moved = |[a, b]: [Option<f64>; 2]| match (a, b) {
            (Some(a), Some(b)) if a != b => Some(quantity_change(a, b, unit)),
            _ => None,
        };
        let stayed = |what: &str, value: Option<f64>| match value {
            Some(value) => format!(", at an unchanged {what} of {}{}", number_text(value), unit_suffix(unit)),
            None => String::new(),
        };
        let value_moved = moved(self.values());
        let value = match (&value_moved, moved(self.margins())) {
            (Some(change), _) => format!("the value moved, {change}"),
            (None, Some(margin)) => format!("the values moved, margin {margin}"),
            (None, None) => "the values moved".to_owned(),
        };
        let (part, change) = (self.part_names(), self.part_changes());
        let check = format!("the {part} moved, {change}");
        match cause {
            FlipCause::Value if !self.changes.is_empty() => {
                format!("{value}; the {part} moved, too, {change}, which alone changes no verdict")
            }
            FlipCause::Value => match moved(self.limits()) {
                Some(limit) => format!("{value}; the limit, which is of signals, moved, too, {limit}"),
                None => value + &stayed("limit", self.limits()[0]),
            },
            FlipCause::Check => match (value_moved, values_are_same) {
                (None, _) => check + &stayed("value", self.values()[0]),
                (Some(change), true) => format!("{check}; no signal differs, the value there is {change}"),
                (Some(change), false) => {
                    format!("{check}; the value moved, too, {change}, which alone changes no verdict")
                }
            },
            FlipCause::Both => format!("{value}, and {check}: neither changes the verdict alone"),
            FlipCause::Either => format!("{value}, and {check}: each changes the verdict alone"),
            FlipCause::Unknown => {
                format!("{value}, or {check}: the recordings do not tell which of both it is")
            }
        }
    }

    /// Why a check failed that did so by no margin: the run ended before its window, a value is no number, a truth value is wrong.
    fn reason_without_margin(&self) -> Option<String> {
        let both = [("A", self.a.as_ref()?), ("B", self.b.as_ref()?)];
        let (name, failed) = both.into_iter().find(|(_, check)| check.passed == Some(false))?;
        let unexplained = failed.margin.is_none_or(|margin| margin >= 0.0) && self.changes.is_empty();
        failed.reason.as_ref().filter(|_| unexplained).map(|reason| format!("in {name} {reason}"))
    }
}

/// What differs between the definitions of checks, for a sentence; none if nothing does.
pub(crate) fn definition_sentence(checks: &[CheckComparison]) -> Option<String> {
    let is_in_both = |it: &&CheckComparison| it.a.is_some() && it.b.is_some();
    let differing: Vec<_> = checks.iter().filter(|it| !is_in_both(it) || !it.changes.is_empty()).collect();
    let are_limits = differing.iter().all(|it| it.changes == [CheckPart::Limit]);
    match (differing.as_slice(), are_limits) {
        ([], _) => None,
        ([only], true) => Some(format!("the limit of the check `{}` ({})", only.name, only.part_changes())),
        (all, true) => Some(format!("limits of {} checks", all.len())),
        ([only], false) if only.changes.is_empty() => {
            Some(format!("the check `{}`, which {}", only.name, only.cause_words()))
        }
        ([only], false) => {
            Some(format!("the {} of the check `{}` ({})", only.part_names(), only.name, only.part_changes()))
        }
        (all, false) => Some(format!("{} checks", all.len())),
    }
}

fn verdict_word(check: &RecordedCheck) -> &'static str {
    match check.passed {
        Some(true) => "passed",
        Some(false) => "failed",
        None => "not judged",
    }
}

/// The right side of the comparison as it is written.
fn limit_text(check: &RecordedCheck) -> &str {
    comparison_sides(&check.that).map_or(check.that.as_str(), |[_, limit]| limit)
}

/// The quantity and the relation of a single comparison: what is written before its limit.
fn quantity_and_relation(that: &str) -> Option<(&str, &str)> {
    let [quantity, limit] = comparison_sides(that)?;
    let relation = that.trim().strip_prefix(quantity)?.strip_suffix(limit)?.trim();
    Some((quantity, relation))
}

fn changed_parts(a: &RecordedCheck, b: &RecordedCheck) -> Vec<CheckPart> {
    let mut parts = Vec::new();
    if a.that != b.that {
        let same_quantity = match (quantity_and_relation(&a.that), quantity_and_relation(&b.that)) {
            (Some(a), Some(b)) => a == b,
            _ => false,
        };
        let numbers = [a, b].map(|check| limit_text(check).parse::<f64>());
        match (same_quantity, numbers) {
            (true, [Ok(a), Ok(b)]) if a == b => {}
            (true, _) => parts.push(CheckPart::Limit),
            (false, _) => parts.push(CheckPart::Condition),
        }
    }
    if a.tolerance != b.tolerance {
        parts.push(CheckPart::Tolerance);
    }
    if a.during != b.during {
        parts.push(CheckPart::Window);
    }
    parts
}

/// Which of both changed the verdict: each check is judged on the values of the other run.
fn flip_cause(
    a: &RecordedCheck,
    b: &RecordedCheck,
    trajectories: [Option<&Trajectory>; 2],
) -> Option<FlipCause> {
    let values_alone = judge_on_other(a, b, trajectories)? == b.passed?;
    let check_alone = judge_on_other(b, a, [trajectories[1], trajectories[0]])? == b.passed?;
    Some(match (values_alone, check_alone) {
        (true, false) => FlipCause::Value,
        (false, true) => FlipCause::Check,
        (false, false) => FlipCause::Both,
        (true, true) => FlipCause::Either,
    })
}

/// Whether a check holds with the values of the other run. A judgement counts if it gives the verdict of the run on its own values.
fn judge_on_other(
    check: &RecordedCheck,
    other: &RecordedCheck,
    [own_run, other_run]: [Option<&Trajectory>; 2],
) -> Option<bool> {
    let by_recordings = || {
        let own = evaluate_check(check, own_run?)?.passed;
        (Some(own) == check.passed).then_some(())?;
        Some(evaluate_check(check, other_run?)?.passed)
    };
    let is_same_quantity = check.during == other.during
        && quantity_and_relation(&check.that).map(|it| it.0)
            == quantity_and_relation(&other.that).map(|it| it.0);
    by_recordings().or_else(|| is_same_quantity.then(|| judge_by_numbers(check, other.value?))?)
}

/// Whether a check with a constant limit holds for a value that the other run measured for the same quantity and window.
fn judge_by_numbers(check: &RecordedCheck, value: f64) -> Option<bool> {
    let (_, relation) = quantity_and_relation(&check.that)?;
    let limit = limit_text(check).parse::<f64>().ok()?;
    let tolerance = check.tolerance;
    Some(match relation {
        "<" => value < limit + tolerance,
        "<=" => value <= limit + tolerance,
        ">" => value > limit - tolerance,
        ">=" => value >= limit - tolerance,
        _ => return None,
    })
}

/// A check with its numbers in another unit, if they can be converted.
fn convert_to_unit(check: RecordedCheck, unit: Option<String>) -> RecordedCheck {
    let conversion = match (&check.unit, &unit) {
        (Some(from), Some(to)) if from != to => Unit::parse(from)
            .ok()
            .zip(Unit::parse(to).ok())
            .and_then(|(from, to)| Unit::conversion(&from, &to)),
        _ => None,
    };
    let Some((factor, offset)) = conversion else { return check };
    RecordedCheck {
        value: check.value.map(|it| it * factor + offset),
        limit: check.limit.map(|it| it * factor + offset),
        margin: check.margin.map(|it| it * factor),
        unit,
        ..check
    }
}

/// Values of A and B in the cells of a table.
pub(crate) fn pair_text([a, b]: [Option<f64>; 2], arrow: &str) -> String {
    match (a, b) {
        (None, None) => String::new(),
        _ => NumberPair::new(a, b).change_text(arrow),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::SignalName;

    fn check(that: &str, passed: bool, value: f64, limit: f64) -> RecordedCheck {
        RecordedCheck {
            name: "a_y".to_owned(),
            that: that.to_owned(),
            passed: Some(passed),
            during: [0.0, 1.0],
            margin: Some(limit - value),
            value: Some(value),
            limit: Some(limit),
            unit: Some("m/s2".to_owned()),
            ..RecordedCheck::default()
        }
    }

    fn run(values: [f64; 3]) -> Trajectory {
        let name = SignalName {
            node: "car".to_owned(),
            variable: "a_y".to_owned(),
            input: false,
            unit: Some("m/s2".to_owned()),
        };
        Trajectory::from_columns(vec![name], vec![0.0, 0.5, 1.0], values.to_vec())
    }

    fn compare(checks: [RecordedCheck; 2], runs: [[f64; 3]; 2]) -> CheckComparison {
        let same = runs[0] == runs[1];
        let [a, b] = runs.map(run);
        let [check_a, check_b] = checks;
        compare_checks([&[check_a], &[check_b]], [Some(&a), Some(&b)], same).remove(0)
    }

    #[test]
    fn what_flips_a_verdict_is_the_value_the_limit_or_both() {
        let (low, high) = ([0.0, 10.0, 5.0], [0.0, 12.0, 5.0]);
        let of = |limit: &str, passed, value| {
            let that = format!("max(abs(car.a_y)) < {limit}");
            check(&that, passed, value, limit.parse().expect("a number"))
        };
        let cases = [
            ([of("11", true, 10.0), of("11", false, 12.0)], [low, high], FlipCause::Value),
            ([of("11", true, 10.0), of("9", false, 10.0)], [low, low], FlipCause::Check),
            ([of("11", true, 10.0), of("9", false, 12.0)], [low, high], FlipCause::Either),
            ([of("11", false, 12.0), of("13", true, 10.0)], [high, low], FlipCause::Either),
            ([of("9", false, 10.0), of("13", true, 12.0)], [low, high], FlipCause::Check),
            ([of("11", true, 10.0), of("11.5", false, 12.0)], [low, high], FlipCause::Value),
            ([of("10", false, 12.0), of("11.5", true, 11.0)], [high, [0.0, 11.0, 5.0]], FlipCause::Both),
        ];
        for (checks, runs, cause) in cases {
            let found = compare(checks, runs);
            assert_eq!(found.flipped_by, Some(cause), "{:?}", found.text);
        }
        let found = compare([of("11", true, 10.0), of("9", false, 10.0)], [low, low]);
        let text =
            "a_y: passed -> failed because the limit moved, 11 -> 9 m/s², at an unchanged value of 10.0 m/s²";
        assert_eq!(found.text.as_deref(), Some(text));
        assert_eq!(
            definition_sentence(&[found]).as_deref(),
            Some("the limit of the check `a_y` (11 -> 9 m/s²)")
        );
    }

    #[test]
    fn limits_that_differ_in_their_digits_are_the_same_and_windows_are_told() {
        let (a, b) = (check("car.a_y < 11", true, 10.0, 11.0), check("car.a_y < 11.0", true, 10.0, 11.0));
        assert!(changed_parts(&a, &b).is_empty());
        let short = RecordedCheck { during: [0.0, 0.2], ..a.clone() };
        let late = RecordedCheck { passed: Some(false), margin: Some(-1.0), value: Some(12.0), ..a };
        let found = compare([short, late], [[0.0, 12.0, 5.0]; 2]);
        assert_eq!(
            (found.changes.as_slice(), found.flipped_by),
            (&[CheckPart::Window][..], Some(FlipCause::Check))
        );
    }

    #[test]
    fn checks_of_one_run_are_named_and_units_are_converted() {
        let own = check("car.a_y < 11", true, 10.0, 11.0);
        let found = compare_checks([std::slice::from_ref(&own), &[]], [None, None], true);
        assert_eq!(found[0].cause_words(), "only A has it");
        let in_g = RecordedCheck { unit: Some("g0".to_owned()), value: Some(1.0), limit: Some(2.0), ..own };
        let converted = convert_to_unit(in_g, Some("m/s2".to_owned()));
        assert_eq!((converted.value, converted.unit.as_deref()), (Some(9.806_65), Some("m/s2")));
    }
}
