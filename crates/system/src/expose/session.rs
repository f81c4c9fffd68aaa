//! Lists the variables of a scenario that a session of another program steps: all of them, with what the session may do to each.

use std::collections::BTreeSet;

use cosim::system::{NodeBody, System};
use diagnostics::{Error, ErrorCollector};
use fmu_export::{VariableKind, VariableValue};
use recording::{Column, ValueKind, VariableDirection};
use scenario::plan::RunPlan;
use serde::Serialize;

use super::{ChosenInput, ExposedVariableList, candidate_inputs, initial_source_value, unknown_name_error};
use crate::interface::{ExposedVariable, ExposedVariableRole, ScenarioFmuInterface, SessionSettings};

/// What a session knows of its scenario.
#[derive(Debug, Clone, Serialize)]
pub struct SessionDescription {
    /// The title of the scenario.
    pub title: String,
    /// Communication step [s].
    pub step: f64,
    /// The first communication point [s].
    pub start: f64,
    /// The end of the scenario [s].
    pub stop: f64,
    /// Whether a state can be saved and restored.
    pub state: bool,
    /// Whether a state can also be written as bytes.
    pub serialized_state: bool,
    /// The variables; the place of one is its value reference.
    pub variables: Vec<SessionVariable>,
}

/// A variable of a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionVariable {
    /// Its name, `node.variable`.
    pub name: String,
    /// Its type in the description of its FMU.
    pub kind: VariableType,
    /// The type that calls of FMI give and take it as: integers and truth values of a run are numbers there.
    pub access: VariableType,
    /// What the session may do to it.
    pub role: VariableRole,
    /// Its unit.
    pub unit: Option<String>,
    /// One line about it.
    pub description: Option<String>,
}

/// The type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum VariableType {
    /// A floating-point number.
    Real,
    /// An integer.
    Integer,
    /// True or false.
    Boolean,
    /// A text.
    String,
}

/// What a session may do to a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum VariableRole {
    /// Read it.
    Output,
    /// Set it at any time; nothing else does.
    Input,
    /// Set it at any time, and give it back to the scenario.
    Override,
    /// Set it before the first step.
    Parameter,
}

impl From<VariableKind> for VariableType {
    fn from(kind: VariableKind) -> Self {
        match kind {
            VariableKind::Real => VariableType::Real,
            VariableKind::Integer => VariableType::Integer,
            VariableKind::Boolean => VariableType::Boolean,
            VariableKind::String => VariableType::String,
        }
    }
}

impl From<ValueKind> for VariableType {
    fn from(kind: ValueKind) -> Self {
        match kind {
            ValueKind::Real => VariableType::Real,
            ValueKind::Integer | ValueKind::Int64 | ValueKind::UInt64 => VariableType::Integer,
            ValueKind::Boolean => VariableType::Boolean,
            ValueKind::String => VariableType::String,
        }
    }
}

/// The inputs of FMUs that nothing is connected to, and the chosen `tunable` parameters.
///
/// # Errors
/// When a choice is no tunable parameter without a connection.
pub fn free_input_names(system: &System, tunable: &[String]) -> Result<Vec<String>, Error> {
    let inputs = system.columns.iter().filter(|column| column.direction == VariableDirection::Input);
    let connected: BTreeSet<_> = inputs.map(Column::qualified_name).collect();
    let candidates = candidate_inputs(system);
    let is_free = |name: &String| !connected.contains(name);
    let parameters: Vec<_> = candidates.iter().filter(|it| it.tunable && is_free(&it.name)).collect();
    let mut mistakes = ErrorCollector::default();
    for name in tunable {
        if !parameters.iter().any(|it| it.name == *name) {
            let known = parameters.iter().map(|it| it.name.as_str());
            mistakes.push(unknown_name_error(
                "--tunable",
                "tunable parameter without a connection",
                name,
                known,
            ));
        }
    }
    mistakes.into_result()?;
    let is_input = |name: &String, tunable_parameter: bool| !tunable_parameter || tunable.contains(name);
    let free = candidates
        .into_iter()
        .filter(|it| it.inner.is_some() && is_free(&it.name) && is_input(&it.name, it.tunable));
    Ok(free.map(|it| it.name).collect())
}

/// The interface of a session with a scenario that [`extend_scenario_for_inputs`](super::extend_scenario_for_inputs) wrote for its free
/// inputs, without identity, and its description.
#[must_use]
pub fn build_session_interface(
    RunPlan { system, header, .. }: &mut RunPlan,
    inputs: &[ChosenInput],
    settings: SessionSettings,
) -> (ScenarioFmuInterface, SessionDescription) {
    let mut list = SessionVariableList::default();
    for plan in &system.nodes {
        list.add_parameters(system, plan);
    }
    for input in inputs {
        list.add_free_input(system, input);
    }
    // The node of the signals that stand for free inputs.
    let node = inputs.first().and_then(|input| input.signal.split_once('.')).map(|(node, _)| node);
    for column in system.columns.iter().filter(|column| Some(column.node.as_str()) != node) {
        list.add_column(system, column);
    }
    let fmus = || {
        system.nodes.iter().filter_map(|plan| match &plan.body {
            NodeBody::Fmu { fmu, .. } => Some(&fmu.description),
            _ => None,
        })
    };
    let clock = system.clock;
    let description = SessionDescription {
        title: header.title.clone(),
        step: clock.step,
        start: clock.start,
        stop: clock.stop_time(),
        state: fmus().all(|about| about.state || about.serialised_state),
        serialized_state: fmus().all(|about| about.serialised_state),
        variables: list.described,
    };
    let (name, variables) = ("session".to_owned(), list.variables);
    let (guid, step, session) = (String::new(), clock.step, Some(settings));
    (ScenarioFmuInterface { name, guid, step, variables, session }, description)
}

/// The variables so far.
#[derive(Default)]
struct SessionVariableList {
    variables: Vec<ExposedVariable>,
    described: Vec<SessionVariable>,
    names: BTreeSet<String>,
}

impl SessionVariableList {
    /// Adds a variable, unless one of this name is there.
    fn push_variable(&mut self, exposed: ExposedVariable, described: SessionVariable) {
        if self.names.insert(exposed.name.clone()) {
            self.variables.push(exposed);
            self.described.push(described);
        }
    }

    fn add_parameters(&mut self, system: &System, plan: &cosim::system::NodePlan) {
        let mut parameters = ExposedVariableList::default();
        parameters.add_parameters(system, plan);
        for (exposed, about) in parameters.variables.into_iter().zip(parameters.described) {
            let (kind, text) =
                (exposed.start.kind().into(), |text: &str| (!text.is_empty()).then(|| text.to_owned()));
            let described = SessionVariable {
                name: exposed.name.clone(),
                kind,
                access: kind,
                role: VariableRole::Parameter,
                unit: text(about.row.unit),
                description: text(about.row.description),
            };
            self.push_variable(exposed, described);
        }
    }

    fn add_free_input(&mut self, system: &mut System, ChosenInput { name, signal }: &ChosenInput) {
        let (node, output) = signal.split_once('.').unwrap_or_default();
        let start = VariableValue::Real(initial_source_value(system, node, output));
        let Some(column) = system.columns.iter().find(|column| column.qualified_name() == *name) else {
            return;
        };
        let role = ExposedVariableRole::Input(signal.clone());
        let described = describe_column(column, VariableRole::Input);
        self.push_variable(ExposedVariable { name: name.clone(), role, start }, described);
    }

    fn add_column(&mut self, system: &System, column: &Column) {
        let (name, is_input) = (column.qualified_name(), column.direction == VariableDirection::Input);
        let Some(plan) = system.nodes.iter().find(|plan| plan.name == column.node) else { return };
        let is_number = !matches!(column.kind, ValueKind::String) && !column.kind.is_64_bit_integer();
        let is_fmu = matches!(plan.body, NodeBody::Fmu { .. });
        let role = match (is_input, is_number && !plan.is_connector()) {
            (_, false) => ExposedVariableRole::Output,
            (true, true) => ExposedVariableRole::InputOverride,
            (false, true) if is_fmu => ExposedVariableRole::Output,
            (false, true) => ExposedVariableRole::SignalOverride,
        };
        let start = match column.kind {
            ValueKind::String => VariableValue::String(String::new()),
            _ => VariableValue::Real(0.0),
        };
        let shown = if role.is_override() { VariableRole::Override } else { VariableRole::Output };
        let described = describe_column(column, shown);
        self.push_variable(ExposedVariable { name, role, start }, described);
    }
}

/// A column of the run as a session shows it.
fn describe_column(column: &Column, role: VariableRole) -> SessionVariable {
    let kind = VariableType::from(column.kind);
    SessionVariable {
        name: column.qualified_name(),
        kind,
        access: if kind == VariableType::String { kind } else { VariableType::Real },
        role,
        unit: column.unit.clone(),
        description: column.description.clone(),
    }
}
