//! Defines the interface of a packed script: its variables, capabilities and interpreter.

use fmu_export::{LogCategories, VariableValue};
use serde::{Deserialize, Serialize};

/// The log category of what a script prints.
pub(crate) const PRINTED: &str = "logPython";

/// The log categories of all such FMUs.
pub(crate) const CATEGORIES: LogCategories = &[(PRINTED, "What the Python script prints")];

/// What the library knows. A variable's place in the list is its value reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScriptFmuInterface {
    /// Name of the FMU.
    pub name: String,
    /// Identity of the archive.
    pub guid: String,
    /// The script in the folder of resources.
    pub script: String,
    /// The class in it.
    pub class: String,
    /// The interpreter that the FMU was packed with.
    pub python: String,
    /// Whether outputs change with inputs, without a step in between.
    pub direct: bool,
    /// Preferred communication step [s].
    pub step: f64,
    /// Whether steps of other sizes do.
    pub variable_step: bool,
    /// How long a call may take [s].
    pub patience: f64,
    /// The variables.
    pub variables: Vec<ScriptVariable>,
}

/// A variable of the script.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScriptVariable {
    /// Its name.
    pub name: String,
    /// Who determines it.
    pub role: ScriptVariableRole,
    /// Its value at the beginning.
    pub start: VariableValue,
    /// Smallest legal value.
    pub min: Option<f64>,
    /// Largest legal value.
    pub max: Option<f64>,
}

/// Who determines a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScriptVariableRole {
    /// The importer, at each communication point.
    Input,
    /// The importer, before the run.
    Parameter,
    /// The importer, also between two steps.
    Tunable,
    /// The script.
    Output,
}

impl ScriptFmuInterface {
    /// The variables whose values the script gets in each step.
    pub(crate) fn step_input_indices(&self) -> Vec<usize> {
        self.indices_by_role(|role| role == ScriptVariableRole::Input)
    }

    /// The variables that the script gets from outside.
    pub(crate) fn external_input_indices(&self) -> Vec<usize> {
        self.indices_by_role(|role| role != ScriptVariableRole::Output)
    }

    /// The variables that the script determines.
    pub(crate) fn output_indices(&self) -> Vec<usize> {
        self.indices_by_role(|role| role == ScriptVariableRole::Output)
    }

    /// Reals, integers, Booleans, texts: the order in which both sides write them.
    fn indices_by_role(&self, wanted: impl Fn(ScriptVariableRole) -> bool) -> Vec<usize> {
        let all = || 0..self.variables.len();
        let chosen = all().filter(|place| wanted(self.variables[*place].role));
        let mut chosen: Vec<_> = chosen.collect();
        chosen.sort_by_key(|place| match self.variables[*place].start {
            VariableValue::Real(_) => 0,
            VariableValue::Integer(_) => 1,
            VariableValue::Boolean(_) => 2,
            VariableValue::String(_) => 3,
        });
        chosen
    }
}
