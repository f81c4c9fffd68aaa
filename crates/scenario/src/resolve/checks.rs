//! Turns `[[check]]` into expressions over columns.

use diagnostics::{Error, Spanned, suggest};
use expression::{Expression, Operand, ParseError};
use recording::{Column, ColumnIndex, Columns, Full};

use crate::plan::{CheckPlan, Clock, ResultName, Subject};
use crate::words::{Check, Scenario};

pub(super) fn resolve(
    scenario: &Scenario,
    columns: &Columns<Full>,
    clock: Clock,
) -> Result<Vec<CheckPlan>, Error> {
    let plan = |check| plan(scenario, check, columns, clock);
    scenario.document.check.iter().map(plan).collect()
}

fn plan(
    scenario: &Scenario,
    check: &Check,
    columns: &Columns<Full>,
    clock: Clock,
) -> Result<CheckPlan, Error> {
    let names: Vec<_> = columns.iter().map(Column::name).collect();
    let that = check.that.get_ref();
    let (mut signals, mut results) = (0, Vec::new());
    let parsed = Expression::parse(that, &mut |name| {
        if let Some(result) = result_name(scenario, name) {
            results.push(result);
            return Some(Operand::Result(results.len() - 1));
        }
        signals += 1;
        Some(match columns.find(name)? {
            ColumnIndex::Number(index) => Operand::Number(index.position()),
            ColumnIndex::Text(index) => Operand::Text(index.position()),
        })
    });
    let expression = parsed.map_err(|error| malformed(scenario, check, &names, error))?;
    if !expression.is_condition() {
        let message = format!("check `{}`: expected a comparison, found a value", check.name);
        return Err(scenario
            .error(&check.that, message)
            .help("write for example `abs(plant.v_y) < 2`"));
    }
    if !(check.tolerance >= 0.0 && check.tolerance.is_finite()) {
        let message = format!(
            "check `{}`: the tolerance {} is not a number from 0 on",
            check.name, check.tolerance
        );
        return Err(scenario.error(&check.that, message));
    }
    for place in expression.texts() {
        results
            .get_mut(place)
            .into_iter()
            .for_each(|result: &mut ResultName| result.is_text = true);
    }
    let subject = if results.is_empty() { Subject::Run } else { Subject::Results(results) };
    if subject != Subject::Run && (signals > 0 || check.during.is_some()) {
        let message = format!("check `{}`: results of analyses have no time", check.name);
        let place = check.during.as_ref().map_or(check.that.span(), Spanned::span);
        return Err(scenario
            .source
            .error(place, message, "")
            .help("compare signals in a check of their own, and leave `during` out of this one"));
    }
    Ok(CheckPlan {
        subject,
        name: check.name.clone(),
        that: that.clone(),
        expression,
        during: during(scenario, check, clock)?,
        windowed: check.during.is_some(),
        tolerance: check.tolerance,
    })
}

/// A mistake in the text of a check, at its place.
fn malformed(scenario: &Scenario, check: &Check, names: &[String], error: ParseError) -> Error {
    let span = inside(scenario, &check.that, error.span);
    let unknown = error.unknown.as_deref();
    let hint = unknown.and_then(|name| suggest::hint(name, names.iter().map(String::as_str)));
    let closest =
        unknown.and_then(|name| suggest::closest_question(name, names.iter().map(String::as_str)));
    let message = format!("check `{}`: {}", check.name, error.message);
    scenario.source.error(span, message, "here").hint(closest.or(error.help).or(hint))
}

/// The result that a name means when it begins with an analysis or a validation.
fn result_name(scenario: &Scenario, name: &str) -> Option<ResultName> {
    let document = &scenario.document;
    let analyses = document.analysis.iter().map(|analysis| &analysis.name);
    let validations = document.validation.iter().map(|validation| &validation.name);
    analyses.chain(validations).find_map(|of| {
        let path = name.strip_prefix(of.get_ref())?.strip_prefix('.')?;
        let (of, path) = (of.get_ref().clone(), path.to_owned());
        Some(ResultName { of, path, is_text: false })
    })
}

fn during(scenario: &Scenario, check: &Check, clock: Clock) -> Result<[f64; 2], Error> {
    let Some(written) = &check.during else { return Ok([0.0, clock.stop()]) };
    let [from, to] = *written.get_ref();
    let stop = scenario.document.time.as_ref().map_or(0.0, |time| *time.stop.get_ref());
    // Half a step of slack: a window that ends with the run may be written with fewer digits.
    if from <= to && from >= 0.0 && to <= stop + 0.5 * clock.step {
        return Ok([from, to]);
    }
    let message = format!(
        "check `{}`: expected a window within 0 .. {stop} s, found {from} .. {to} s",
        check.name
    );
    Err(scenario.error(written, message))
}

/// The place in the file of a part of a text that is written there in plain quotes; texts with
/// escapes are pointed at as a whole.
pub(super) fn inside(
    scenario: &Scenario,
    word: &Spanned<String>,
    part: std::ops::Range<usize>,
) -> std::ops::Range<usize> {
    let whole = word.span();
    let written = scenario.source.letters(whole.clone());
    match written.find(word.get_ref().as_str()) {
        Some(quotes) => whole.start + quotes + part.start..whole.start + quotes + part.end,
        None => whole,
    }
}
