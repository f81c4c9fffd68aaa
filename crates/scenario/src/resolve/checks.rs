//! Turns `[[check]]` into expressions over columns.

use diagnostics::{Error, closest};
use expression::{Expression, Operand};
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
        if let Some(result) = result_name(scenario, that, name) {
            let place = results.len();
            let is_text = result.is_text;
            results.push(result);
            return Some(if is_text { Operand::Text(place) } else { Operand::Number(place) });
        }
        signals += 1;
        Some(match columns.find(name)? {
            ColumnIndex::Number(index) => Operand::Number(index.position()),
            ColumnIndex::Text(index) => Operand::Text(index.position()),
        })
    });
    let expression = parsed.map_err(|error| {
        let span = inside(scenario, &check.that, error.span.clone());
        let unknown = error.unknown.as_deref();
        let hint = unknown.and_then(|name| closest(name, names.iter().map(String::as_str)));
        let help = hint.map(|hint| format!("did you mean `{hint}`?")).or(error.help);
        let error = scenario.source.error(
            span,
            format!("check `{}`: {}", check.name, error.message),
            "here",
        );
        match help {
            Some(help) => error.help(help),
            None => error,
        }
    })?;
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
    let subject = if results.is_empty() { Subject::Run } else { Subject::Results(results) };
    if subject != Subject::Run && (signals > 0 || check.during.is_some()) {
        let message = format!("check `{}`: results of analyses have no time", check.name);
        let place = check.during.as_ref().map_or(check.that.span(), toml::Spanned::span);
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

/// Whether a result is a text, which it is where it is compared with one.
fn compared_with_text(that: &str, name: &str) -> bool {
    let quoted = |rest: &str| rest.starts_with(['\'', '"']);
    that.match_indices(name).any(|(at, _)| {
        let after = that[at + name.len()..].trim_start();
        let compared = after.strip_prefix("==").or_else(|| after.strip_prefix("!="));
        compared.is_some_and(|rest| quoted(rest.trim_start()))
    })
}

/// What a name means that begins with an analysis or a validation.
fn result_name(scenario: &Scenario, that: &str, name: &str) -> Option<ResultName> {
    let document = &scenario.document;
    let analyses = document.analysis.iter().map(|analysis| &analysis.name);
    let validations = document.validation.iter().map(|validation| &validation.name);
    analyses.chain(validations).find_map(|of| {
        let path = name.strip_prefix(of.get_ref())?.strip_prefix('.')?;
        let (of, path) = (of.get_ref().clone(), path.to_owned());
        Some(ResultName { of, path, is_text: compared_with_text(that, name) })
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
    word: &toml::Spanned<String>,
    part: std::ops::Range<usize>,
) -> std::ops::Range<usize> {
    let whole = word.span();
    let written = scenario.source.letters(whole.clone());
    match written.find(word.get_ref().as_str()) {
        Some(quotes) => whole.start + quotes + part.start..whole.start + quotes + part.end,
        None => whole,
    }
}
