//! Holds the description of an FMU, in words common to all versions of FMI.

use units::Unit;

use crate::attributes::{Causality, Initial, Variability};

/// What an FMU says about itself.
#[derive(Debug)]
pub struct Description {
    /// Name of the model.
    pub name: String,
    /// Identity that the library is asked to confirm.
    pub guid: String,
    /// Name of the library.
    pub identifier: String,
    /// One line about the model.
    pub summary: Option<String>,
    /// The tool that made it.
    pub tool: Option<String>,
    /// Whether the communication step may differ from step to step.
    pub variable_step: bool,
    /// Whether the state can be stored and restored.
    pub state: bool,
    /// Whether the state can be turned into bytes.
    pub serialised_state: bool,
    /// Whether derivatives of outputs are given.
    pub directional_derivative: bool,
    /// Whether inputs may come with derivatives.
    pub interpolated_inputs: bool,
    /// Up to which order outputs have time derivatives.
    pub output_derivatives: u32,
    /// Whether a second instance in the process is impossible.
    pub only_once: bool,
    /// Preferred communication step [s].
    pub default_step: Option<f64>,
    /// Where a simulation starts unless somebody says otherwise [s].
    pub default_start: f64,
    /// Where a simulation stops unless somebody says otherwise [s].
    pub default_stop: Option<f64>,
    /// Relative tolerance of the FMU's own integration unless somebody says otherwise [-].
    pub default_tolerance: Option<f64>,
    /// The categories that messages may have.
    pub log_categories: Vec<String>,
    /// The variables, in the order of the file.
    pub variables: Vec<Variable>,
    /// What breaks the rules of FMI but does not hinder a run.
    pub problems: Vec<String>,
}

/// The type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// `Real`.
    Real,
    /// `Integer`.
    Integer,
    /// `Boolean`.
    Boolean,
    /// `String`.
    String,
    /// `Enumeration`.
    Enumeration,
}

/// An item of an enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Its name.
    pub name: String,
    /// The integer that stands for it.
    pub value: i32,
}

/// The items of an enumeration for a message: `off = 0, armed = 1`.
#[must_use]
pub fn list(items: &[Item]) -> String {
    let items = items.iter().map(|item| format!("{} = {}", item.name, item.value));
    items.collect::<Vec<_>>().join(", ")
}

/// A variable of an FMU.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its value reference.
    pub reference: u32,
    /// Its type.
    pub kind: Type,
    /// What an enumeration may be, in the order of the values.
    pub items: Vec<Item>,
    /// Who determines it.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How its first value comes about.
    pub initial: Option<Initial>,
    /// The smallest value that it may have.
    pub min: Option<f64>,
    /// The largest value that it may have.
    pub max: Option<f64>,
    /// What a usual value of it is.
    pub nominal: Option<f64>,
    /// Name of its unit.
    pub unit: Option<String>,
    /// Its unit, when the file or its name says what that is.
    pub dimension: Option<Unit>,
    /// Start value, as written.
    pub start: Option<String>,
    /// One line about it.
    pub description: Option<String>,
    /// For outputs, the indices of the variables that it follows directly; `None` means all inputs.
    pub dependencies: Option<Vec<usize>>,
}

impl Description {
    /// The index of the variable called `name`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|variable| variable.name == name)
    }

    /// The indices of the variables with a causality.
    pub fn with(&self, causality: Causality) -> impl Iterator<Item = usize> {
        (0..self.variables.len()).filter(move |&index| self.variables[index].causality == causality)
    }
}
