//! Holds a value of any type that a description knows, for instances whose variables are known when they run.

use serde::{Deserialize, Serialize};

use crate::value::Value;
use crate::variable::{Access, Kind};

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
    #[must_use]
    pub fn text(&self) -> String {
        match self {
            Cell::Real(value) => format!("{value:?}").to_lowercase(),
            Cell::Integer(value) => value.to_string(),
            Cell::Boolean(value) => value.to_string(),
            Cell::String(value) => value.clone(),
        }
    }

    /// As descriptions have it.
    #[must_use]
    pub fn start(&self) -> String {
        match self {
            Cell::Real(value) => value.to_string(),
            other => other.text(),
        }
    }

    /// The value as a number of a run; none of a text.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Cell::Real(value) => Some(*value),
            Cell::Integer(value) => Some(f64::from(*value)),
            Cell::Boolean(value) => Some(f64::from(u8::from(*value))),
            Cell::String(_) => None,
        }
    }

    /// Takes a number of a run, which is of the same type.
    pub fn set_number(&mut self, number: f64) {
        match self {
            Cell::Real(value) => *value = number,
            Cell::Integer(value) => *value = number as i32,
            Cell::Boolean(value) => *value = number != 0.0,
            Cell::String(_) => {}
        }
    }

    /// Its type.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Cell::Real(_) => Kind::Real,
            Cell::Integer(_) => Kind::Integer,
            Cell::Boolean(_) => Kind::Boolean,
            Cell::String(_) => Kind::String,
        }
    }

    /// The value, if it is of this type.
    pub fn read<T: Value>(&mut self) -> Option<T> {
        match self {
            Cell::Real(value) => T::read(&Access::Real(itself), value),
            Cell::Integer(value) => T::read(&Access::Integer(itself), value),
            Cell::Boolean(value) => T::read(&Access::Boolean(itself), value),
            Cell::String(value) => T::read(&Access::String(itself), value),
        }
    }

    /// Takes a value of the same type.
    pub fn write<T: Value>(&mut self, new: &T) {
        match self {
            Cell::Real(value) => new.write(&Access::Real(itself), value),
            Cell::Integer(value) => new.write(&Access::Integer(itself), value),
            Cell::Boolean(value) => new.write(&Access::Boolean(itself), value),
            Cell::String(value) => new.write(&Access::String(itself), value),
        }
    }
}
