//! Defines a value of any variable type, for instances whose variables are known only at run time.

use serde::{Deserialize, Serialize};

use crate::value::Value;
use crate::variable::{Access, Kind};

/// A value of one of the types that both versions of FMI have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VariableValue {
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

impl VariableValue {
    /// As the command line of a run takes it.
    #[must_use]
    pub fn text(&self) -> String {
        match self {
            VariableValue::Real(value) => format!("{value:?}").to_lowercase(),
            VariableValue::Integer(value) => value.to_string(),
            VariableValue::Boolean(value) => value.to_string(),
            VariableValue::String(value) => value.clone(),
        }
    }

    /// As descriptions have it.
    #[must_use]
    pub fn start(&self) -> String {
        match self {
            VariableValue::Real(value) => value.to_string(),
            other => other.text(),
        }
    }

    /// The value as a number of a run; none of a text.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            VariableValue::Real(value) => Some(*value),
            VariableValue::Integer(value) => Some(f64::from(*value)),
            VariableValue::Boolean(value) => Some(f64::from(u8::from(*value))),
            VariableValue::String(_) => None,
        }
    }

    /// Takes a number of a run, which is of the same type.
    pub fn set_number(&mut self, number: f64) {
        match self {
            VariableValue::Real(value) => *value = number,
            VariableValue::Integer(value) => *value = number as i32,
            VariableValue::Boolean(value) => *value = number != 0.0,
            VariableValue::String(_) => {}
        }
    }

    /// Its type.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            VariableValue::Real(_) => Kind::Real,
            VariableValue::Integer(_) => Kind::Integer,
            VariableValue::Boolean(_) => Kind::Boolean,
            VariableValue::String(_) => Kind::String,
        }
    }

    /// The value, if it is of this type.
    pub fn read<T: Value>(&mut self) -> Option<T> {
        match self {
            VariableValue::Real(value) => T::read(&Access::Real(itself), value),
            VariableValue::Integer(value) => T::read(&Access::Integer(itself), value),
            VariableValue::Boolean(value) => T::read(&Access::Boolean(itself), value),
            VariableValue::String(value) => T::read(&Access::String(itself), value),
        }
    }

    /// Takes a value of the same type.
    pub fn write<T: Value>(&mut self, new: &T) {
        match self {
            VariableValue::Real(value) => new.write(&Access::Real(itself), value),
            VariableValue::Integer(value) => new.write(&Access::Integer(itself), value),
            VariableValue::Boolean(value) => new.write(&Access::Boolean(itself), value),
            VariableValue::String(value) => new.write(&Access::String(itself), value),
        }
    }
}
