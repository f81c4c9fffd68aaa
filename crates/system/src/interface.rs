//! Lists the variables that the FMU of a scenario has, with the signals and parameters behind them.

use fmu_export::{Access, Kind, Value};
use serde::{Deserialize, Serialize};

/// What the library of the FMU has to know besides the scenario. A variable's place in the list is its value reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interface {
    /// Name of the FMU.
    pub name: String,
    /// Identity of the archive.
    pub guid: String,
    /// Communication step of the scenario [s].
    pub step: f64,
    /// The variables.
    pub variables: Vec<Exposed>,
}

/// A variable of the FMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposed {
    /// Its name, `node.variable`.
    pub name: String,
    /// Who determines it.
    pub role: Role,
    /// Its value at the beginning.
    pub start: Cell,
}

/// Who determines a variable of the FMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// The importer: it takes the place of this output of a signal or table.
    Input(String),
    /// The scenario.
    Output,
    /// The importer, before the run: it is a start value of the node.
    Parameter,
}

/// A value of one of the types that both versions of FMI have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cell {
    /// `Real`.
    Real(f64),
    /// `Integer`.
    Integer(i32),
    /// `Boolean`.
    Boolean(bool),
    /// `String`.
    String(String),
}

/// The accessor of a value that is a model of its own.
fn itself<T>(value: &mut T) -> &mut T {
    value
}

impl Cell {
    /// As the command line of a run takes it.
    pub(crate) fn text(&self) -> String {
        match self {
            Cell::Real(value) => format!("{value:?}").to_lowercase(),
            Cell::Integer(value) => value.to_string(),
            Cell::Boolean(value) => value.to_string(),
            Cell::String(value) => value.clone(),
        }
    }

    /// As descriptions have it.
    pub(crate) fn start(&self) -> String {
        match self {
            Cell::Real(value) => value.to_string(),
            other => other.text(),
        }
    }

    /// The value as a number of a run; none of a text.
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Cell::Real(value) => Some(*value),
            Cell::Integer(value) => Some(f64::from(*value)),
            Cell::Boolean(value) => Some(f64::from(u8::from(*value))),
            Cell::String(_) => None,
        }
    }

    /// Takes a number of a run, which is of the same type.
    pub(crate) fn set_number(&mut self, number: f64) {
        match self {
            Cell::Real(value) => *value = number,
            Cell::Integer(value) => *value = number as i32,
            Cell::Boolean(value) => *value = number != 0.0,
            Cell::String(_) => {}
        }
    }

    /// Its type.
    pub(crate) fn kind(&self) -> Kind {
        match self {
            Cell::Real(_) => Kind::Real,
            Cell::Integer(_) => Kind::Integer,
            Cell::Boolean(_) => Kind::Boolean,
            Cell::String(_) => Kind::String,
        }
    }

    /// The value, if it is of this type.
    pub(crate) fn read<T: Value>(&mut self) -> Option<T> {
        match self {
            Cell::Real(value) => T::read(&Access::Real(itself), value),
            Cell::Integer(value) => T::read(&Access::Integer(itself), value),
            Cell::Boolean(value) => T::read(&Access::Boolean(itself), value),
            Cell::String(value) => T::read(&Access::String(itself), value),
        }
    }

    /// Takes a value of the same type.
    pub(crate) fn write<T: Value>(&mut self, new: &T) {
        match self {
            Cell::Real(value) => new.write(&Access::Real(itself), value),
            Cell::Integer(value) => new.write(&Access::Integer(itself), value),
            Cell::Boolean(value) => new.write(&Access::Boolean(itself), value),
            Cell::String(value) => new.write(&Access::String(itself), value),
        }
    }
}
