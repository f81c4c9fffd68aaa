//! Lists the variables that the FMU of a scenario has, with the signals and parameters behind them.

use fmu_export::VariableValue;
use serde::{Deserialize, Serialize};

/// What the library of the FMU has to know besides the scenario. A variable's place in the list is its value reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScenarioFmuInterface {
    /// Name of the FMU.
    pub name: String,
    /// Identity of the archive.
    pub guid: String,
    /// Communication step of the scenario [s].
    pub step: f64,
    /// The variables.
    pub variables: Vec<ExposedVariable>,
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
    /// The importer, before the run: it is a start value of the node.
    Parameter,
}
