//! Lists what the library of the FMU has to know about the script: its variables, and what it can do.

use fmu_export::{Categories, Cell};
use serde::{Deserialize, Serialize};

/// The log category of what a script prints.
pub(crate) const PRINTED: &str = "logPython";

/// The log categories of all such FMUs.
pub(crate) const CATEGORIES: Categories = &[(PRINTED, "What the Python script prints")];

/// What the library knows. A variable's place in the list is its value reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interface {
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
    pub variables: Vec<Exposed>,
}

/// A variable of the script.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposed {
    /// Its name.
    pub name: String,
    /// Who determines it.
    pub role: Role,
    /// Its value at the beginning.
    pub start: Cell,
    /// Smallest legal value.
    pub min: Option<f64>,
    /// Largest legal value.
    pub max: Option<f64>,
}

/// Who determines a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The importer, at each communication point.
    Input,
    /// The importer, before the run.
    Parameter,
    /// The importer, also between two steps.
    Tunable,
    /// The script.
    Shown,
}

impl Interface {
    /// The variables whose values the script gets in each step.
    pub(crate) fn inputs(&self) -> Vec<usize> {
        self.with(|role| role == Role::Input)
    }

    /// The variables that the script gets from outside.
    pub(crate) fn given(&self) -> Vec<usize> {
        self.with(|role| role != Role::Shown)
    }

    /// The variables that the script determines.
    pub(crate) fn shown(&self) -> Vec<usize> {
        self.with(|role| role == Role::Shown)
    }

    /// Reals, integers, Booleans, texts: the order in which both sides write them.
    fn with(&self, wanted: impl Fn(Role) -> bool) -> Vec<usize> {
        let all = || 0..self.variables.len();
        let chosen = all().filter(|place| wanted(self.variables[*place].role));
        let mut chosen: Vec<_> = chosen.collect();
        chosen.sort_by_key(|place| match self.variables[*place].start {
            Cell::Real(_) => 0,
            Cell::Integer(_) => 1,
            Cell::Boolean(_) => 2,
            Cell::String(_) => 3,
        });
        chosen
    }
}
