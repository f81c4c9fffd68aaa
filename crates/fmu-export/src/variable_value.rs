//! Defines a value of any variable type, for instances whose variables are known only at run time.

use serde::{Deserialize, Serialize};

use crate::value::FmiValue;
use crate::variable::{VariableAccess, VariableKind};

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
fn identity_accessor<T>(value: &mut T) -> &mut T {
    value
}

impl VariableValue {
    /// As the command line of a run takes it.
    #[must_use]
    pub fn to_argument_text(&self) -> String {
        match self {
            VariableValue::Real(value) => format!("{value:?}").to_lowercase(),
            VariableValue::Integer(value) => value.to_string(),
            VariableValue::Boolean(value) => value.to_string(),
            VariableValue::String(value) => value.clone(),
        }
    }

    /// As descriptions have it.
    #[must_use]
    pub fn to_start_attribute(&self) -> String {
        match self {
            VariableValue::Real(value) => value.to_string(),
            other => other.to_argument_text(),
        }
    }

    /// The value as a number of a run; none of a text.
    #[must_use]
    pub fn to_f64(&self) -> Option<f64> {
        match self {
            VariableValue::Real(value) => Some(*value),
            VariableValue::Integer(value) => Some(f64::from(*value)),
            VariableValue::Boolean(value) => Some(f64::from(u8::from(*value))),
            VariableValue::String(_) => None,
        }
    }

    /// Takes a number of a run, which is of the same type.
    pub fn set_from_f64(&mut self, number: f64) {
        match self {
            VariableValue::Real(value) => *value = number,
            VariableValue::Integer(value) => *value = number as i32,
            VariableValue::Boolean(value) => *value = number != 0.0,
            VariableValue::String(_) => {}
        }
    }

    /// Its type.
    #[must_use]
    pub fn kind(&self) -> VariableKind {
        match self {
            VariableValue::Real(_) => VariableKind::Real,
            VariableValue::Integer(_) => VariableKind::Integer,
            VariableValue::Boolean(_) => VariableKind::Boolean,
            VariableValue::String(_) => VariableKind::String,
        }
    }

    /// The value, if it is of this type.
    pub fn get_typed<T: FmiValue>(&mut self) -> Option<T> {
        match self {
            VariableValue::Real(value) => T::read_from_model(&VariableAccess::Real(identity_accessor), value),
            VariableValue::Integer(value) => {
                T::read_from_model(&VariableAccess::Integer(identity_accessor), value)
            }
            VariableValue::Boolean(value) => {
                T::read_from_model(&VariableAccess::Boolean(identity_accessor), value)
            }
            VariableValue::String(value) => {
                T::read_from_model(&VariableAccess::String(identity_accessor), value)
            }
        }
    }

    /// Takes a value of the same type.
    pub fn set_typed<T: FmiValue>(&mut self, new: &T) {
        match self {
            VariableValue::Real(value) => new.write_to_model(&VariableAccess::Real(identity_accessor), value),
            VariableValue::Integer(value) => {
                new.write_to_model(&VariableAccess::Integer(identity_accessor), value)
            }
            VariableValue::Boolean(value) => {
                new.write_to_model(&VariableAccess::Boolean(identity_accessor), value)
            }
            VariableValue::String(value) => {
                new.write_to_model(&VariableAccess::String(identity_accessor), value)
            }
        }
    }
}
