//! Determines the start values of the scenarios that validate a run.

use std::path::PathBuf;
use std::sync::Arc;

use cosim::system::{NodeBody, NodePlan, StartValue, System};
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use fmu_import::description::Variable;
use fmu_import::{Causality, Value, to_hex};
use scenario::document::Validation;
use scenario::plan::RunPlan;
use scenario::resolve::{Override, OverrideValue, Overrides};
use scenario::{BuildArtifacts, Scenario};

use crate::report::RunReport;

/// Checks the validations of a scenario and theirs, as far as that can be done before anything runs; `run` is what the run has from outside.
///
/// # Errors
/// With the place in the file.
pub fn check_validations(
    scenario: &Scenario,
    built: &BuildArtifacts,
    system: &System,
    run: &Overrides,
) -> Result<(), Error> {
    let all = scenario.document.validation.iter().zip(&scenario.validations);
    let checked = all.map(|(validation, child)| {
        let overrides = validation_overrides(scenario, validation, system, None, run)?;
        let plan = RunPlan::resolve(child, built, &overrides, PathBuf::new())?;
        check_validations(child, built, &plan.system, &overrides)
    });
    ErrorCollector::collect_all(checked).map(drop)
}

/// What a validation of the run of `system` has from outside its scenario: start values, and what `run` has that holds for both. Files that analyses have left are in the report; before there is
/// one, those that may be left are passed over.
///
/// # Errors
/// At the words of the scenario that are wrong.
pub fn validation_overrides(
    scenario: &Scenario,
    validation: &Validation,
    system: &System,
    report: Option<&RunReport>,
    run: &Overrides,
) -> Result<Overrides, Error> {
    let defaults = validation.like.iter().map(|(node, model)| copied_starts(scenario, node, model, system));
    let starts = validation.set.iter().map(|entry| set_starts(scenario, entry, report));
    let (defaults, starts) = ErrorCollector::collect_both(
        ErrorCollector::collect_all(defaults),
        ErrorCollector::collect_all(starts),
    )?;
    Ok(Overrides {
        defaults: defaults.into_iter().flatten().collect(),
        starts: starts.into_iter().flatten().collect(),
        ..run.clone()
    })
}

/// The start values of `node` that an entry of `like` copies from the FMU `model`.
fn copied_starts(
    scenario: &Scenario,
    node: &Spanned<String>,
    model: &Spanned<String>,
    system: &System,
) -> Result<Vec<Override>, Error> {
    let fmus = || system.nodes.iter().filter(|node| matches!(node.body, NodeBody::Fmu { .. }));
    let Some(plan) = fmus().find(|plan| plan.name == *model.get_ref()) else {
        let known = fmus().map(|plan| plan.name.as_str());
        let unknown = suggest::unknown_name("FMU", model.get_ref(), known);
        return Err(unknown.into_error_at(&scenario.source, model.span()));
    };
    let source = Arc::new(scenario.source.clone());
    let starts = parameter_start_values(plan).map(|parameter| Override {
        name: format!("{}.{}", node.get_ref(), parameter.variable),
        value: OverrideValue::Toml(parameter.value),
        place: Some((source.clone(), node.span())),
    });
    Ok(starts.collect())
}

/// The start values that an entry of `set` gives.
fn set_starts(
    scenario: &Scenario,
    entry: &Spanned<String>,
    report: Option<&RunReport>,
) -> Result<Vec<Override>, Error> {
    let analysis_file = |file: &str| {
        let report = report?;
        let known = report.files.iter().any(|name| name == file);
        known.then(|| report.folder.join(file))
    };
    let beside = |file: &str| scenario.source.base_folder(entry.span()).join(file);
    if let Some(file) = entry.get_ref().strip_prefix('@') {
        let to_come = report.is_none() && !scenario.document.analysis.is_empty();
        if to_come && !beside(file).exists() {
            return Ok(Vec::new());
        }
        if report.is_some_and(|_| analysis_file(file).is_none()) && !beside(file).exists() {
            let message = format!("no analysis left `{file}`, and it is not beside the scenario");
            return Err(scenario.error_at(entry, message));
        }
    }
    let find = |file: &str| analysis_file(file).unwrap_or_else(|| beside(file));
    let mut starts =
        Override::parse(entry.get_ref(), find).map_err(|message| scenario.error_at(entry, message))?;
    let source = Arc::new(scenario.source.clone());
    starts.iter_mut().for_each(|it| it.place = Some((source.clone(), entry.span())));
    Ok(starts)
}

/// A parameter of an FMU and its start value.
struct ParameterStart {
    variable: String,
    value: toml::Value,
}

/// The start values of an FMU that are no inputs.
fn parameter_start_values(node: &NodePlan) -> impl Iterator<Item = ParameterStart> {
    let (fmu, starts) = match &node.body {
        NodeBody::Fmu { fmu, starts, .. } => (Some(fmu), starts.as_slice()),
        _ => (None, &[][..]),
    };
    starts.iter().filter_map(move |start| {
        let variable = fmu?.description.variables.iter().find(|it| is_of(start, it))?;
        let value = match &start.value {
            Value::Real(value) => toml::Value::Float(*value),
            Value::Integer(value) => i64::try_from(*value)
                .map_or_else(|_| toml::Value::String(value.to_string()), toml::Value::Integer),
            Value::Boolean(value) => toml::Value::Boolean(*value),
            Value::String(value) => toml::Value::String(value.clone()),
            Value::Binary(bytes) => toml::Value::String(to_hex(bytes)),
        };
        let is_parameter = variable.causality != Causality::Input;
        is_parameter.then(|| ParameterStart { variable: variable.name.clone(), value })
    })
}

/// Whether a start value is that of a variable: in FMI 2.0 variables of different types may share a reference.
fn is_of(start: &StartValue, variable: &Variable) -> bool {
    let of = (variable.reference, variable.storage, variable.element);
    (start.reference, start.storage, start.element) == of
}
