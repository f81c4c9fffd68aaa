//! Resolves `[[baseline]]` to columns and the sizes of their tubes.

use std::ops::Range;

use assessment::{BaselinePlan, BaselineSignal, TubeSize};
use cosim::clock::CommunicationClock;
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use recording::{AllVariables, Column, ColumnIndex, Columns, ValueKind};

use crate::document::{Baseline, BaselineTube, Scenario};
use crate::pattern::matches_wildcard;

pub(super) fn resolve_baselines(
    scenario: &Scenario,
    columns: &Columns<AllVariables>,
    clock: Option<CommunicationClock>,
) -> Result<Vec<BaselinePlan>, Error> {
    let baselines = scenario.document.baseline.iter().enumerate();
    ErrorCollector::collect_all(baselines.map(|(index, baseline)| {
        let unique = check_unique_name(scenario, index, baseline);
        ErrorCollector::collect_both(unique, plan_baseline(scenario, baseline, columns, clock))
            .map(|((), plan)| plan)
    }))
}

/// Reports tell baselines and checks by their names.
fn check_unique_name(scenario: &Scenario, index: usize, baseline: &Baseline) -> Result<(), Error> {
    let name = baseline.name.get_ref();
    let before = scenario.document.baseline[..index].iter().map(|other| &other.name);
    let mut others = scenario.document.check.iter().map(|check| &check.name).chain(before);
    match others.any(|other| other.get_ref() == name) {
        true => {
            let message = format!("there is another check or baseline called `{name}`");
            Err(scenario.source.error_at(baseline.name.span(), message, "the second one"))
        }
        false => Ok(()),
    }
}

fn plan_baseline(
    scenario: &Scenario,
    baseline: &Baseline,
    columns: &Columns<AllVariables>,
    clock: Option<CommunicationClock>,
) -> Result<BaselinePlan, Error> {
    let span = baseline.recording.span();
    let signals = compared_signals(scenario, baseline, columns);
    let during = comparison_window(scenario, baseline, clock);
    let form = check_format(scenario, baseline);
    let (signals, (during, ())) =
        ErrorCollector::collect_both(signals, ErrorCollector::collect_both(during, form))?;
    let (file, line) = scenario.source.file_and_line(baseline.name.span().start);
    Ok(BaselinePlan {
        file: file.to_owned(),
        line,
        name: baseline.name.get_ref().clone(),
        path: scenario.source.resolve_path(&baseline.recording),
        place: span,
        during,
        signals,
        chosen: baseline.signals.is_some(),
        has_tubes: !baseline.tubes.is_empty(),
    })
}

fn check_format(scenario: &Scenario, baseline: &Baseline) -> Result<(), Error> {
    let name = baseline.recording.get_ref();
    match name.rsplit_once('.') {
        Some((_, "mcap" | "csv")) => Ok(()),
        _ => {
            let message = format!("expected a recording `*.mcap` or `*.csv`, found `{name}`");
            Err(scenario.error_at(&baseline.recording, message))
        }
    }
}

fn comparison_window(
    scenario: &Scenario,
    baseline: &Baseline,
    clock: Option<CommunicationClock>,
) -> Result<Option<[f64; 2]>, Error> {
    let Some(word) = &baseline.during else { return Ok(None) };
    let [from, to] = *word.get_ref();
    let [start, stop] = clock.map_or([0.0, f64::INFINITY], |clock| [clock.start, clock.stop_time()]);
    if start <= from && from < to && to <= stop {
        return Ok(Some([from, to]));
    }
    let message = format!("expected a window from {start} to {stop} s, found {from} to {to} s");
    Err(scenario.error_at(word, message))
}

/// The compared signals, in the order of the row.
fn compared_signals(
    scenario: &Scenario,
    baseline: &Baseline,
    columns: &Columns<AllVariables>,
) -> Result<Vec<BaselineSignal>, Error> {
    let given = baseline.signals.iter().flatten();
    let patterns = given.chain(baseline.tubes.iter().flat_map(|tube| &tube.signals));
    let known =
        ErrorCollector::collect_all(patterns.map(|pattern| check_pattern(scenario, pattern, columns)));
    let all = TubeSize { absolute: baseline.absolute, relative: baseline.relative, time: baseline.time };
    let sizes = ErrorCollector::collect_all(
        std::iter::once(check_size(scenario, baseline.name.span(), all)).chain(
            baseline
                .tubes
                .iter()
                .map(|tube| check_size(scenario, tube_span(tube, baseline), tube_size(all, tube))),
        ),
    );
    ErrorCollector::collect_both(known, sizes)?;
    let except = &scenario.document.record.except;
    let numbers = columns.number_columns().map(|(index, column)| (ColumnIndex::Number(index), column));
    let texts = columns.text_columns().map(|(index, column)| (ColumnIndex::Text(index), column));
    let signal = |(index, column): (ColumnIndex<AllVariables>, &Column)| {
        let name = column.qualified_name();
        if columns.find(&name) != Some(index) {
            // An input of the same name as an output has no name of its own.
            return None;
        }
        let is =
            |patterns: &[Spanned<String>]| patterns.iter().any(|it| matches_wildcard(it.get_ref(), &name));
        let wanted = match &baseline.signals {
            Some(patterns) => is(patterns),
            None => !is(except),
        };
        let named = baseline.signals.iter().flatten().any(|it| *it.get_ref() == name);
        let tubes = baseline.tubes.iter().filter(|tube| is(&tube.signals));
        wanted.then(|| BaselineSignal {
            column: index,
            exact: column.kind != ValueKind::Real,
            unit: column.unit.clone(),
            named,
            size: tubes.fold(all, tube_size),
            name: name.clone(),
        })
    };
    Ok(numbers.chain(texts).filter_map(signal).collect())
}

/// A tube whose sizes are partly those of another one.
fn tube_size(size: TubeSize, tube: &BaselineTube) -> TubeSize {
    TubeSize {
        absolute: tube.absolute.unwrap_or(size.absolute),
        relative: tube.relative.unwrap_or(size.relative),
        time: tube.time.unwrap_or(size.time),
    }
}

fn tube_span(tube: &BaselineTube, baseline: &Baseline) -> Range<usize> {
    tube.signals.first().map_or(baseline.name.span(), Spanned::span)
}

fn check_size(scenario: &Scenario, span: Range<usize>, size: TubeSize) -> Result<(), Error> {
    let sizes = [("absolute", size.absolute), ("relative", size.relative), ("time", size.time)];
    match sizes.into_iter().find(|(_, size)| !(*size >= 0.0 && size.is_finite())) {
        None => Ok(()),
        Some((key, size)) => {
            let message = format!("expected a number from 0 on as `{key}` of the tube, found {size}");
            Err(scenario.source.error_at(span, message, ""))
        }
    }
}

fn check_pattern(
    scenario: &Scenario,
    pattern: &Spanned<String>,
    columns: &Columns<AllVariables>,
) -> Result<(), Error> {
    let names: Vec<_> = columns.iter().map(Column::qualified_name).collect();
    match names.iter().any(|name| matches_wildcard(pattern.get_ref(), name)) {
        true => Ok(()),
        false => {
            let known = names.iter().map(String::as_str);
            let unknown = suggest::unknown_name("signal", pattern.get_ref(), known);
            Err(unknown.into_error_at(&scenario.source, pattern.span()))
        }
    }
}
