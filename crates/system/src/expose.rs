//! Chooses the variables of a scenario that its FMU has, and describes them.

mod session;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use cosim::system::{NodeBody, NodePlan, System};
use diagnostics::{Error, ErrorCollector, suggest};
use fmu_export::description::{DescribedVariable, DescriptionTable, FmuCapabilities};
use fmu_export::{Causality, Info, Initial, OutputDependencies, Variability, VariableRow, VariableValue};
use fmu_import::Value;
use fmu_import::description::{self, StorageType};
use recording::{Column, ValueKind, VariableDirection};
use scenario::document::toml_string;
use scenario::pattern::matches_wildcard;
use scenario::plan::RunPlan;

use crate::interface::{ExposedVariable, ExposedVariableRole, ScenarioFmuInterface};

pub use session::{SessionDescription, SessionVariable, build_session_interface, free_input_names};

/// The choice of variables; `*` stands for any letters.
#[derive(Debug, Clone, Default)]
pub struct VariableChoice {
    /// Name of the FMU.
    pub name: String,
    /// Inputs of FMUs, and outputs of signals and tables, `node.variable`.
    pub inputs: Vec<String>,
    /// Outputs; those of all FMUs if there is none.
    pub outputs: Vec<String>,
}

/// A chosen input, and the output of a signal or table that it takes the place of.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenInput {
    name: String,
    signal: String,
}

/// The chosen inputs, and the text of a scenario that extends the one in the file `base`: it has a signal for each chosen input of an
/// FMU, and nothing of the `lists` that judge a run. `written` are the inputs that have a connection of their own in the scenario.
///
/// # Errors
/// When a choice is no input of an FMU and no output of a signal or table.
pub fn extend_scenario_for_inputs(
    system: &System,
    lists: &[&str],
    written: &BTreeSet<&str>,
    base: &str,
    choice: &VariableChoice,
) -> Result<(Vec<ChosenInput>, String), Error> {
    let mut inputs = Vec::new();
    let mut mistakes = ErrorCollector::default();
    let (mut without, mut added) = (String::new(), String::new());
    let mut node = "inputs".to_owned();
    while system.nodes.iter().any(|plan| plan.name == node) {
        node.push('_');
    }
    let known = candidate_inputs(system);
    for pattern in &choice.inputs {
        let found: Vec<_> = known.iter().filter(|it| it.is_matched_by(pattern)).collect();
        if found.is_empty() {
            mistakes.push(unknown_name_error(
                "--inputs",
                "input of an FMU, signal or column of a table",
                pattern,
                known.iter().map(|it| it.name.as_str()),
            ));
        }
        for input in found {
            if inputs.iter().any(|it: &ChosenInput| it.name == input.name) {
                continue;
            }
            let name = input.name.clone();
            let Some(inner) = &input.inner else {
                inputs.push(ChosenInput { signal: name.clone(), name });
                continue;
            };
            let signal = format!("{node}.{name}");
            if written.contains(name.as_str()) {
                let _ = write!(without, "{}, ", toml_string(&name));
            }
            let unit = inner.unit.as_ref();
            let unit = unit.map(|unit| format!("unit = {}\n", toml_string(unit))).unwrap_or_default();
            let (quoted_signal, to, start) = (toml_string(&signal), toml_string(&name), inner.start);
            // Writing into a string cannot fail.
            let _ = write!(
                added,
                "\n[[signal]]\nname = {quoted_signal}\nconstant = {start:?}\n{unit}\n[[connect]]\nfrom = {quoted_signal}\nto = {to}\n"
            );
            inputs.push(ChosenInput { name, signal });
        }
    }
    mistakes.into_result()?;
    let mut text = format!("extends = {}\n\n[without]\n", toml_string(base));
    for list in lists {
        let _ = writeln!(text, "{list} = [\"*\"]");
    }
    if !without.is_empty() {
        let _ = writeln!(text, "connect = [{}]", without.trim_end_matches(", "));
    }
    Ok((inputs, text + &added))
}

/// What may become an input of the FMU.
struct CandidateInput {
    name: String,
    /// Nothing for an output of a signal or table.
    inner: Option<FmuInput>,
    /// Whether it is a tunable parameter, which has to be chosen by its whole name.
    tunable: bool,
}

impl CandidateInput {
    fn is_matched_by(&self, pattern: &str) -> bool {
        if self.tunable { pattern == self.name } else { matches_wildcard(pattern, &self.name) }
    }
}

/// An input of an FMU of the scenario.
struct FmuInput {
    unit: Option<String>,
    start: f64,
}

fn candidate_inputs(system: &System) -> Vec<CandidateInput> {
    let mut known = Vec::new();
    for plan in system.nodes.iter().filter(|plan| !plan.is_connector()) {
        let NodeBody::Fmu { fmu, starts, .. } = &plan.body else {
            let outputs = plan.outputs.indices().map(|index| CandidateInput {
                name: system.columns[index].qualified_name(),
                inner: None,
                tunable: false,
            });
            known.extend(outputs);
            continue;
        };
        let takes = |it: &&description::Variable| match it.causality {
            fmu_import::Causality::Input => true,
            fmu_import::Causality::Parameter => it.variability == fmu_import::Variability::Tunable,
            _ => false,
        };
        for variable in fmu.description.variables.iter().filter(takes) {
            if matches!(variable.storage, StorageType::String | StorageType::Binary | StorageType::Clock) {
                continue;
            }
            let name = format!("{}.{}", plan.name, variable.name);
            let given = starts.iter().find(|start| start.name == variable.name);
            let start = given.map(|start| start.value.clone()).or_else(|| variable.start_value());
            let start = start.as_ref().and_then(numeric_value).unwrap_or_default();
            let inner = FmuInput { unit: variable.unit.clone(), start };
            let tunable = variable.causality == fmu_import::Causality::Parameter;
            known.push(CandidateInput { name, inner: Some(inner), tunable });
        }
    }
    known
}

/// The interface of the FMU of a scenario that [`extend_scenario_for_inputs`] wrote, without identity, and its description; and what was left out.
///
/// # Errors
/// When a choice is no output, or nothing is left that the FMU shows.
pub fn build_fmu_interface(
    RunPlan { system, header, .. }: &mut RunPlan,
    choice: &VariableChoice,
    inputs: &[ChosenInput],
) -> Result<(ScenarioFmuInterface, DescriptionTable, Vec<String>), Error> {
    let mut list = ExposedVariableList::default();
    for input in inputs {
        list.add_input(system, input);
    }
    let outputs = system.columns.iter().filter(|column| column.direction == VariableDirection::Output);
    let outputs: Vec<_> = outputs.cloned().collect();
    let mut mistakes = ErrorCollector::default();
    let of_fmu = |column: &Column| {
        let mut nodes = system.nodes.iter();
        nodes.any(|plan| plan.name == column.node && matches!(plan.body, NodeBody::Fmu { .. }))
    };
    for pattern in &choice.outputs {
        if !outputs.iter().any(|column| matches_wildcard(pattern, &column.qualified_name())) {
            let names: Vec<_> = outputs.iter().map(Column::qualified_name).collect();
            mistakes.push(unknown_name_error(
                "--outputs",
                "output",
                pattern,
                names.iter().map(String::as_str),
            ));
        }
    }
    mistakes.into_result()?;
    for column in &outputs {
        let chosen = match choice.outputs.as_slice() {
            [] => of_fmu(column),
            patterns => patterns.iter().any(|pattern| matches_wildcard(pattern, &column.qualified_name())),
        };
        if chosen {
            list.add_output(system, column);
        }
    }
    for plan in &system.nodes {
        list.add_parameters(system, plan);
    }
    let clock = system.clock;
    let name: &'static str = choice.name.clone().leak();
    let title: &'static str = header.title.clone().leak();
    let info = Info::new(name, title, clock.step).start(clock.start).stop(clock.stop_time());
    let fmus = || {
        system.nodes.iter().filter_map(|plan| match &plan.body {
            NodeBody::Fmu { fmu, .. } => Some(&fmu.description),
            _ => None,
        })
    };
    let state = fmus().all(|about| about.state || about.serialised_state);
    let capabilities = FmuCapabilities {
        state,
        serialized_state: fmus().all(|about| about.serialised_state),
        only_once: fmus().any(|about| about.only_once),
        ..FmuCapabilities::default()
    };
    let ExposedVariableList { variables, described, left_out } = list;
    let interface = ScenarioFmuInterface {
        name: choice.name.clone(),
        guid: String::new(),
        step: clock.step,
        variables,
        session: None,
    };
    Ok((interface, DescriptionTable { info, variables: described, capabilities, arrays: false }, left_out))
}

/// The variables so far.
#[derive(Default)]
struct ExposedVariableList {
    variables: Vec<ExposedVariable>,
    described: Vec<DescribedVariable>,
    left_out: Vec<String>,
}

impl ExposedVariableList {
    fn push_variable(&mut self, exposed: ExposedVariable, row: VariableRow) {
        let kind = exposed.start.kind();
        let start = (!matches!(exposed.role, ExposedVariableRole::Output))
            .then(|| exposed.start.to_start_attribute());
        self.described.push(DescribedVariable { row, kind, start });
        self.variables.push(exposed);
    }

    fn add_input(&mut self, system: &mut System, ChosenInput { name, signal }: &ChosenInput) {
        let (node, output) = signal.split_once('.').unwrap_or_default();
        let start = initial_source_value(system, node, output);
        let inner = find_fmu_variable(system, name);
        let column = system.columns.iter().find(|column| column.qualified_name() == *signal);
        let cell = match inner.map(|variable| variable.storage) {
            Some(StorageType::Boolean) => VariableValue::Boolean(start != 0.0),
            Some(storage) if is_int32(storage) => VariableValue::Integer(start as i32),
            _ => VariableValue::Real(start),
        };
        let unit = inner.and_then(|it| it.unit.clone()).or(column.and_then(|it| it.unit.clone()));
        let about = inner.and_then(|it| it.description.clone());
        let row = variable_table_row(name, unit, about, &cell);
        let relative = inner.is_some_and(|it| it.relative.is_some());
        let row = VariableRow { causality: Causality::Input, initial: None, relative, ..row };
        let exposed = ExposedVariable {
            name: name.clone(),
            role: ExposedVariableRole::Input(signal.clone()),
            start: cell,
        };
        self.push_variable(exposed, row);
    }

    fn add_output(&mut self, system: &System, column: &Column) {
        let name = column.qualified_name();
        let inner = find_fmu_variable(system, &name);
        let storage = inner.map(|variable| variable.storage);
        // A difference keeps the unit of its description, whose offset does not count.
        let difference = inner.filter(|it| it.relative.is_some());
        let unit = difference.map_or_else(|| column.unit.clone(), |it| it.unit.clone());
        let cell = match (column.kind, storage) {
            (ValueKind::String, _) => VariableValue::String(String::new()),
            (ValueKind::Boolean, _) => VariableValue::Boolean(false),
            (ValueKind::Integer, Some(storage)) if is_int32(storage) => VariableValue::Integer(0),
            // Integers of 64 bits are numbers outside.
            _ => VariableValue::Real(0.0),
        };
        // A signal that is an input now is none of the outputs.
        if self.variables.iter().any(|it| it.name == name) {
            return;
        }
        let row = variable_table_row(&name, unit, column.description.clone(), &cell);
        let row = VariableRow { depends: OutputDependencies::On(&[]), relative: difference.is_some(), ..row };
        self.push_variable(ExposedVariable { name, role: ExposedVariableRole::Output, start: cell }, row);
    }

    fn add_parameters(&mut self, system: &System, plan: &NodePlan) {
        let NodeBody::Fmu { fmu, starts, .. } = &plan.body else { return };
        // A tunable one that is connected takes its values from there.
        let inputs = system.columns.iter().filter(|it| it.direction == VariableDirection::Input);
        let fed: BTreeSet<_> = inputs.map(Column::qualified_name).collect();
        let parameters = fmu.description.indices_with_causality(fmu_import::Causality::Parameter);
        for variable in parameters.map(|index| &fmu.description.variables[index]) {
            let name = format!("{}.{}", plan.name, variable.name);
            if fed.contains(&name) {
                continue;
            }
            let given = starts.iter().find(|start| start.name == variable.name);
            let value = given.map(|start| start.value.clone()).or_else(|| variable.start_value());
            let cell = match value {
                Some(Value::Real(value)) if value.is_finite() => VariableValue::Real(value),
                Some(Value::Integer(value)) if is_int32(variable.storage) => {
                    VariableValue::Integer(i32::try_from(value).unwrap_or_default())
                }
                Some(Value::Boolean(value)) => VariableValue::Boolean(value),
                Some(Value::String(value)) => VariableValue::String(value),
                _ => {
                    self.left_out.push(name);
                    continue;
                }
            };
            let row = variable_table_row(&name, variable.unit.clone(), variable.description.clone(), &cell);
            let row = VariableRow {
                causality: Causality::Parameter,
                variability: Variability::Fixed,
                initial: Some(Initial::Exact),
                min: variable.min,
                max: variable.max,
                relative: variable.relative.is_some(),
                ..row
            };
            self.push_variable(
                ExposedVariable { name, role: ExposedVariableRole::Parameter, start: cell },
                row,
            );
        }
    }
}

/// A row of an output. Its texts live as long as the program, which packs one FMU.
fn variable_table_row(
    name: &str,
    unit: Option<String>,
    about: Option<String>,
    cell: &VariableValue,
) -> VariableRow {
    let text = |text: String| -> &'static str { text.leak() };
    let unit = unit.filter(|_| matches!(cell, VariableValue::Real(_)));
    let row = fmu_export::output(
        text(name.to_owned()),
        text(unit.unwrap_or_default()),
        text(about.unwrap_or_default()),
    );
    match cell {
        VariableValue::Real(_) => row,
        _ => row.discrete(),
    }
}

/// Whether all integers of this form are integers of both versions of FMI.
fn is_int32(storage: StorageType) -> bool {
    let inside = |[low, high]: [i128; 2]| low >= i32::MIN.into() && high <= i32::MAX.into();
    storage.integer_range().is_some_and(inside)
}

fn numeric_value(value: &Value) -> Option<f64> {
    match value {
        Value::Real(value) => Some(*value),
        Value::Integer(value) => Some(*value as f64),
        Value::Boolean(value) => Some(f64::from(u8::from(*value))),
        Value::String(_) | Value::Binary(_) => None,
    }
}

/// The variable of an FMU behind a name.
fn find_fmu_variable<'a>(system: &'a System, name: &str) -> Option<&'a description::Variable> {
    let (node, variable) = name.split_once('.')?;
    let plan = system.nodes.iter().find(|plan| plan.name == node)?;
    let NodeBody::Fmu { fmu, .. } = &plan.body else { return None };
    fmu.description.find_variable(variable).map(|index| &fmu.description.variables[index])
}

/// The value of a signal or of a column of a table at the first communication point.
fn initial_source_value(system: &mut System, node: &str, output: &str) -> f64 {
    let (start, columns) = (system.clock.start, &system.columns);
    let Some(plan) = system.nodes.iter_mut().find(|plan| plan.name == node) else { return 0.0 };
    let mut places = plan.outputs.indices();
    let Some(place) = places.position(|index| columns[index].variable == output) else {
        return 0.0;
    };
    match &mut plan.body {
        NodeBody::Signals(signals) => signals[place].value_at(start),
        NodeBody::Table(table) => table.value_at(place, start),
        NodeBody::Fmu { .. } | NodeBody::Driver(_) | NodeBody::Own | NodeBody::Inlet | NodeBody::Outlet => {
            0.0
        }
    }
}

fn unknown_name_error<'a>(
    option: &str,
    what: &str,
    pattern: &str,
    known: impl Iterator<Item = &'a str>,
) -> Error {
    let unknown = suggest::unknown_name(what, pattern, known);
    Error::invalid_input(format!("{option}: {}", unknown.message)).with_optional_help(unknown.help)
}
