//! Holds a value of any type of FMI 2.0, and moves one from and to an instance.

use crate::{CallError, Instance, Type};

/// A value of any type.
#[derive(Debug, Clone)]
pub enum Value {
    /// `Real`.
    Real(f64),
    /// `Integer` or `Enumeration`.
    Integer(i32),
    /// `Boolean`.
    Boolean(bool),
    /// `String`.
    String(String),
}

/// Equal numbers or equal bits: NaN equals itself, and 0 equals -0.
impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Value::Real(a), Value::Real(b)) => a == b || a.to_bits() == b.to_bits(),
            (Value::Integer(a), Value::Integer(b)) => a == b,
            (Value::Boolean(a), Value::Boolean(b)) => a == b,
            (Value::String(a), Value::String(b)) => a == b,
            _ => false,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Real(value) => write!(out, "{value:?}"),
            Value::Integer(value) => write!(out, "{value}"),
            Value::Boolean(value) => write!(out, "{value}"),
            Value::String(value) => write!(out, "{value:?}"),
        }
    }
}

impl Value {
    /// Its type; that of an `Enumeration` is `Integer`.
    #[must_use]
    pub fn kind(&self) -> Type {
        match self {
            Value::Real(_) => Type::Real,
            Value::Integer(_) => Type::Integer,
            Value::Boolean(_) => Type::Boolean,
            Value::String(_) => Type::String,
        }
    }
}

impl Instance {
    /// The value of one variable.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn read(&mut self, kind: Type, reference: u32) -> Result<Value, CallError> {
        let (mut real, mut integer) = ([0.0], [0]);
        match kind {
            Type::Real => self.get_real(&[reference], &mut real).map(|()| Value::Real(real[0])),
            Type::Integer | Type::Enumeration => {
                self.get_integer(&[reference], &mut integer).map(|()| Value::Integer(integer[0]))
            }
            Type::Boolean => self
                .get_boolean(&[reference], &mut integer)
                .map(|()| Value::Boolean(integer[0] != 0)),
            Type::String => self.get_string(reference).map(Value::String),
        }
    }

    /// Gives one variable a value.
    ///
    /// # Errors
    /// See [`Instance`]; also when a text contains NUL.
    pub fn write(&mut self, reference: u32, value: &Value) -> Result<(), CallError> {
        match value {
            Value::Real(value) => self.set_real(&[reference], &[*value]),
            Value::Integer(value) => self.set_integer(&[reference], &[*value]),
            Value::Boolean(value) => self.set_boolean(&[reference], &[(*value).into()]),
            Value::String(value) => self.set_string(reference, value),
        }
    }
}
