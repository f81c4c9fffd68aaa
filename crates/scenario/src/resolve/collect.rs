//! Resolves `[sweep.collect]` to expressions over columns.

use assessment::{CollectPlan, CollectedOrigin};
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use expression::{Expression, ResolvedSignal};
use recording::Column;

use super::checks::{check_message_counts, result_name, span_within};
use super::signal_units::RunSignals;
use crate::document::Scenario;

/// The values that the scenario collects.
pub(super) fn resolve_collected(
    scenario: &Scenario,
    signals: RunSignals,
    mistakes: &mut ErrorCollector,
) -> Vec<CollectPlan> {
    let Some(sweep) = &scenario.document.sweep else { return Vec::new() };
    let plans = sweep.collect.iter().map(|(name, text)| plan_collected_value(scenario, name, text, signals));
    mistakes.ok_or_record(ErrorCollector::collect_all(plans)).unwrap_or_default()
}

fn plan_collected_value(
    scenario: &Scenario,
    name: &Spanned<String>,
    text: &Spanned<String>,
    RunSignals { columns, units }: RunSignals,
) -> Result<CollectPlan, Error> {
    let name = name.get_ref().clone();
    if let Some(result) = result_name(scenario, columns, text.get_ref()) {
        check_message_counts(scenario, columns, std::slice::from_ref(&result), text)?;
        return Ok(CollectPlan { name, unit: None, origin: CollectedOrigin::Result(result) });
    }
    let resolve = &mut |signal: &str| {
        let operand = columns.find(signal)?.into();
        Some(ResolvedSignal { operand, unit: units.unit_of_signal(signal) })
    };
    let expression = Expression::parse(text.get_ref(), resolve).map_err(|error| {
        let names: Vec<_> = columns.iter().map(Column::qualified_name).collect();
        let closest = error
            .unknown
            .as_deref()
            .and_then(|unknown| suggest::did_you_mean(unknown, names.iter().map(String::as_str)));
        let span = span_within(scenario, text, error.span);
        let message = format!("`{name}`: {}", error.message);
        scenario.source.error_at(span, message, "here").with_optional_help(closest.or(error.help))
    })?;
    if !expression.is_reduction() {
        let message =
            format!("`{name}`: expected one value of the whole run, found one of each communication point");
        return Err(scenario
            .error_at(text, message)
            .with_help("reduce it, for example by `max(...)`, `rms(...)` or `last(...)`"));
    }
    let unit = match expression.is_condition() {
        true => None,
        // What products make has no name: it is told in base units.
        false => expression.unit().map(|(unit, name)| match name {
            Some(name) => (name, 1.0),
            None => (unit.dimension_text(), unit.factor),
        }),
    };
    Ok(CollectPlan { name, unit, origin: CollectedOrigin::Run(expression) })
}
