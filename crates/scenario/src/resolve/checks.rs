//! Resolves `[[check]]` to expressions over columns and results.

use std::collections::{BTreeSet, HashSet};

use assessment::{CheckCondition, CheckPlan, ResultName, ResultSpace};
use cosim::clock::CommunicationClock;
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use expression::{Expression, NumberIndex, ParseError, ResolvedSignal, SignalOperand, TextIndex};
use recording::{AllVariables, Column, ColumnIndex, Columns, IntegerIndex};

use super::manoeuvres;
use super::signal_units::{RunSignals, unit_help};
use crate::document::{Check, Scenario};
use crate::plan::MESSAGES;

pub(super) fn resolve_checks(
    scenario: &Scenario,
    signals: RunSignals,
    clock: Option<CommunicationClock>,
    mistakes: &mut ErrorCollector,
) -> Vec<CheckPlan> {
    let checks = &scenario.document.check;
    let mut names = HashSet::new();
    let plans = ErrorCollector::collect_all(checks.iter().map(|check| {
        let unique = check_unique_name(scenario, &mut names, check);
        let plan = plan_check(scenario, check, signals, clock);
        ErrorCollector::collect_both(unique, plan).map(|(_, plan)| plan)
    }));
    mistakes.ok_or_record(plans).unwrap_or_default()
}

/// Reports and test results tell checks by their names.
fn check_unique_name<'a>(
    scenario: &Scenario,
    names: &mut HashSet<&'a str>,
    check: &'a Check,
) -> Result<(), Error> {
    let name = check.name.get_ref();
    if !names.insert(name) {
        let message = format!("there are two checks called `{name}`");
        return Err(scenario.source.error_at(check.name.span(), message, "the second one"));
    }
    Ok(())
}

fn plan_check(
    scenario: &Scenario,
    check: &Check,
    signals: RunSignals,
    clock: Option<CommunicationClock>,
) -> Result<CheckPlan, Error> {
    let condition = parse_condition(scenario, check, signals);
    let during = match (&condition, &check.during) {
        (Ok(CheckCondition::Results(..)), Some(_)) => Err(window_error(scenario, check)),
        _ => window_of_check(scenario, check, clock),
    };
    let numbers = ErrorCollector::collect_both(tolerance_of_check(scenario, check), during);
    let (condition, (tolerance, during)) = ErrorCollector::collect_both(condition, numbers)?;
    let (file, line) = scenario.source.file_and_line(check.name.span().start);
    Ok(CheckPlan {
        name: check.name.get_ref().clone(),
        that: check.that.get_ref().clone(),
        file: file.to_owned(),
        line,
        integers: integers_in_condition(&condition, signals.columns),
        condition,
        during,
        windowed: check.during.is_some(),
        tolerance,
    })
}

/// The integers of 64 bits in a condition.
fn integers_in_condition(
    condition: &CheckCondition,
    columns: &Columns<AllVariables>,
) -> Vec<(IntegerIndex<AllVariables>, String)> {
    let CheckCondition::Run(expression) = condition else { return Vec::new() };
    let exact = |number| Some((columns.integer_index_of(number)?, columns[number].qualified_name()));
    expression.number_indices().into_iter().filter_map(exact).collect()
}

fn tolerance_of_check(scenario: &Scenario, check: &Check) -> Result<f64, Error> {
    if check.tolerance >= 0.0 && check.tolerance.is_finite() {
        return Ok(check.tolerance);
    }
    let (name, tolerance) = (check.name.get_ref(), check.tolerance);
    let message = format!("check `{name}`: the tolerance {tolerance} is not a number from 0 on");
    Err(scenario.error_at(&check.that, message))
}

/// Marks conditions that may mix signals with results: nothing evaluates them.
struct TypeCheckSpace;

/// The condition of a check, over the run or over results.
fn parse_condition(
    scenario: &Scenario,
    check: &Check,
    RunSignals { columns, units }: RunSignals,
) -> Result<CheckCondition, Error> {
    let result = |number| SignalOperand::Either(NumberIndex::new(number), TextIndex::new(number));
    let (mut signals, mut results) = (0, Vec::new());
    let mixed = parse_expression::<TypeCheckSpace>(scenario, check, columns, &mut |name| {
        if let Some(result) = result_name(scenario, columns, name) {
            results.push(result);
            return Some(SignalOperand::Either(NumberIndex::new(0), TextIndex::new(0)).into());
        }
        signals += 1;
        let operand = match columns.find(name)? {
            ColumnIndex::Number(_) => SignalOperand::Number(NumberIndex::new(0)),
            ColumnIndex::Text(_) => SignalOperand::Text(TextIndex::new(0)),
        };
        Some(ResolvedSignal { operand, unit: units.unit_of_signal(name) })
    })?;
    if !mixed.is_condition() {
        let message = format!("check `{}`: expected a comparison, found a value", check.name.get_ref());
        return Err(scenario
            .error_at(&check.that, message)
            .with_help("write for example `abs(plant.v_y) < 2`"));
    }
    if results.is_empty() {
        let resolve = &mut |name: &str| {
            let operand = columns.find(name)?.into();
            Some(ResolvedSignal { operand, unit: units.unit_of_signal(name) })
        };
        return parse_expression(scenario, check, columns, resolve).map(CheckCondition::Run);
    }
    if signals > 0 {
        return Err(window_error(scenario, check));
    }
    let mut numbers = 0..results.len();
    let mut resolve = |_: &str| Some(result(numbers.next()?).into());
    let condition = parse_expression::<ResultSpace>(scenario, check, columns, &mut resolve)?;
    for index in condition.text_indices() {
        results[index.position()].is_text = true;
    }
    manoeuvres::check_result_names(scenario, &results, &check.that)?;
    check_message_counts(scenario, columns, &results, &check.that)?;
    Ok(CheckCondition::Results(condition, results))
}

fn parse_expression<S>(
    scenario: &Scenario,
    check: &Check,
    columns: &Columns<AllVariables>,
    resolve: &mut dyn FnMut(&str) -> Option<ResolvedSignal<S>>,
) -> Result<Expression<S>, Error> {
    Expression::parse(check.that.get_ref(), resolve)
        .map_err(|error| expression_error(scenario, check, columns, error))
}

fn window_error(scenario: &Scenario, check: &Check) -> Error {
    let message = format!(
        "check `{}`: results of analyses have no time, nor have numbers of messages",
        check.name.get_ref()
    );
    let span = check.during.as_ref().map_or(check.that.span(), Spanned::span);
    scenario
        .source
        .error_at(span, message, "")
        .with_help("compare signals in a check of their own, and leave `during` out of this one")
}

/// A mistake in the text of a check, at its place.
fn expression_error(
    scenario: &Scenario,
    check: &Check,
    columns: &Columns<AllVariables>,
    error: ParseError,
) -> Error {
    let names: Vec<_> = columns.iter().map(Column::qualified_name).collect();
    let span = span_within(scenario, &check.that, error.span);
    let unknown = error.unknown.as_deref();
    let hint = unknown.and_then(|name| suggest::suggest_name(name, names.iter().map(String::as_str)));
    let closest = unknown.and_then(|name| suggest::did_you_mean(name, names.iter().map(String::as_str)));
    let message = format!("check `{}`: {}", check.name.get_ref(), error.message);
    let pointed = scenario.source.error_at(span, message, "here");
    let cure = error.unitless.map(|it| unit_help(scenario, &it.signal, &it.other));
    pointed.with_optional_help(closest.or(cure).or(error.help).or(hint)).with_unknown_name(error.unknown)
}

/// The names of all numbers of messages: of all nodes together, and of each.
fn message_counts(scenario: &Scenario, columns: &Columns<AllVariables>) -> BTreeSet<String> {
    let both = |of: &str| ["warnings", "errors"].map(|what| format!("{MESSAGES}{of}.{what}"));
    let fmus = scenario.document.fmu.iter().map(|fmu| fmu.name.get_ref().as_str());
    let nodes = columns.iter().map(|column| column.node.as_str()).chain(fmus);
    nodes.flat_map(|node| both(&format!(".{node}"))).chain(both("")).collect()
}

/// Refuses numbers of messages that nobody counts.
pub(super) fn check_message_counts(
    scenario: &Scenario,
    columns: &Columns<AllVariables>,
    results: &[ResultName],
    at: &Spanned<String>,
) -> Result<(), Error> {
    for ResultName { of, path, .. } in results.iter().filter(|it| it.of == MESSAGES) {
        let (name, known) = (format!("{of}.{path}"), message_counts(scenario, columns));
        if find_producer(scenario, of).is_none() && !known.contains(&name) {
            let known = known.iter().map(String::as_str);
            let unknown = suggest::unknown_name("number of messages", &name, known);
            return Err(unknown.into_error_at(&scenario.source, at.span()));
        }
    }
    Ok(())
}

/// The analysis, validation or manoeuvre of this name.
fn find_producer<'s>(scenario: &'s Scenario, name: &str) -> Option<&'s String> {
    result_producer_names(scenario).find(|of| *of == name)
}

/// The result that a name means when it begins with an analysis or a validation; or else with `messages`, unless that is a node.
pub(super) fn result_name(
    scenario: &Scenario,
    columns: &Columns<AllVariables>,
    name: &str,
) -> Option<ResultName> {
    let found = result_producer_names(scenario).find_map(|of| {
        let path = name.strip_prefix(of.as_str())?.strip_prefix('.')?;
        Some((of.clone(), path.to_owned()))
    });
    let counts = || {
        let path = name.strip_prefix(MESSAGES)?.strip_prefix('.')?;
        let is_node = columns.iter().any(|column| column.node == MESSAGES);
        (!is_node).then(|| (MESSAGES.to_owned(), path.to_owned()))
    };
    let (of, path) = found.or_else(counts)?;
    Some(ResultName { of, path, is_text: false })
}

/// The names of what gives results.
fn result_producer_names(scenario: &Scenario) -> impl Iterator<Item = &String> {
    let document = &scenario.document;
    let analyses = document.analysis.iter().map(|analysis| &analysis.name);
    let validations = document.validation.iter().map(|validation| &validation.name);
    let manoeuvres = document.manoeuvre.iter().map(|manoeuvre| &manoeuvre.name);
    analyses.chain(validations).chain(manoeuvres).map(Spanned::get_ref)
}

fn window_of_check(
    scenario: &Scenario,
    check: &Check,
    clock: Option<CommunicationClock>,
) -> Result<[f64; 2], Error> {
    let clock = clock.ok_or_else(Error::already_reported)?;
    let Some(written) = &check.during else { return Ok([clock.start, clock.stop_time()]) };
    let [from, to] = *written.get_ref();
    let stop = scenario.document.time.as_ref().map_or(0.0, |time| *time.stop.get_ref());
    // Half a step of slack: a window that ends with the run may be written with fewer digits.
    let start = clock.start;
    if from <= to && from >= start - 0.5 * clock.step && to <= stop + 0.5 * clock.step {
        return Ok([from, to]);
    }
    let message = format!(
        "check `{}`: expected a window within {start} .. {stop} s, found {from} .. {to} s",
        check.name.get_ref()
    );
    Err(scenario.error_at(written, message))
}

/// The place in the file of a part of a text that is written there in plain quotes; texts with
/// escapes are pointed at as a whole.
pub(super) fn span_within(
    scenario: &Scenario,
    word: &Spanned<String>,
    part: std::ops::Range<usize>,
) -> std::ops::Range<usize> {
    let whole = word.span();
    let written = scenario.source.text_at(whole.clone());
    match written.find(word.get_ref().as_str()) {
        Some(quotes) => whole.start + quotes + part.start..whole.start + quotes + part.end,
        None => whole,
    }
}
