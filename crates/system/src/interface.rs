//! Lists the variables that the FMU of a scenario has, with the signals and parameters behind them.

use std::path::PathBuf;

use fmu_export::VariableValue;
use scenario::resolve::Override;
use serde::{Deserialize, Serialize};

/// What the library of the FMU has to know besides the scenario. A variable's place in the list is its value reference.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ScenarioFmuInterface {
    /// Name of the FMU.
    pub name: String,
    /// Identity of the archive.
    pub guid: String,
    /// Communication step of the scenario [s].
    pub step: f64,
    /// The variables.
    pub variables: Vec<ExposedVariable>,
    /// How a session of another program runs the scenario; an FMU has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session: Option<SessionSettings>,
}

/// How a session runs its scenario: what the command line gives to a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SessionSettings {
    /// The program that FMUs in processes of their own run in.
    pub program: PathBuf,
    /// Values instead of the scenario's.
    pub starts: Vec<Override>,
    /// The seed of every random stream, instead of the scenario's.
    pub seed: Option<u64>,
    /// Whether all FMUs run in processes of their own, where the scenario does not say it.
    pub isolate: bool,
}

/// A variable of the FMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExposedVariable {
    /// Its name, `node.variable`.
    pub name: String,
    /// Who determines it.
    pub role: ExposedVariableRole,
    /// Its value at the beginning.
    pub start: VariableValue,
}

/// Who determines a variable of the FMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExposedVariableRole {
    /// The importer: it takes the place of this output of a signal or table.
    Input(String),
    /// The scenario.
    Output,
    /// The scenario, until the importer sets this output of a signal, a table or a driver. NaN gives it back to the scenario.
    SignalOverride,
    /// The scenario, until the importer sets this connected input of an FMU: from the next step on the value takes the place of the
    /// one that the connection brings. NaN gives it back to the connection.
    InputOverride,
    /// The importer, before the run: it is a start value of the node.
    Parameter,
}

impl ScenarioFmuInterface {
    /// The value of each variable at the beginning.
    pub(crate) fn start_values(&self) -> Vec<VariableValue> {
        self.variables.iter().map(|exposed| exposed.start.clone()).collect()
    }

    /// The value that the importer gives to each input at the beginning.
    pub(crate) fn start_inputs(&self) -> Vec<Option<f64>> {
        let is_given = |exposed: &ExposedVariable| matches!(exposed.role, ExposedVariableRole::Input(_));
        let start = |exposed: &ExposedVariable| is_given(exposed).then(|| exposed.start.to_f64()).flatten();
        self.variables.iter().map(start).collect()
    }
}

impl ExposedVariableRole {
    /// Whether the importer may set it at any time.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(self, ExposedVariableRole::Input(_)) || self.is_override()
    }

    /// Whether the scenario has a value of its own, which one of the importer stands in for.
    #[must_use]
    pub fn is_override(&self) -> bool {
        matches!(self, ExposedVariableRole::SignalOverride | ExposedVariableRole::InputOverride)
    }
}
