//! Reads and writes a variable as one of the types of FMI.

use std::ffi::c_int;

use crate::variable::{VariableAccess, VariableKind};

/// A value that crosses the C interface.
pub trait FmiValue: Sized {
    /// The type of the variables that hold it.
    const KIND: VariableKind;
    /// Its value in the model, when the variable is of this type.
    fn read_from_model<M>(access: &VariableAccess<M>, model: &mut M) -> Option<Self>;
    /// Writes it into the model; a variable of another type is left alone.
    fn write_to_model<M>(&self, access: &VariableAccess<M>, model: &mut M);
    /// The number that limits apply to.
    fn numeric_value(&self) -> Option<f64>;
}

/// `fmi2Boolean`: every value but 0 is true.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FmiBoolean(pub c_int);

impl FmiValue for f64 {
    const KIND: VariableKind = VariableKind::Real;
    fn read_from_model<M>(access: &VariableAccess<M>, model: &mut M) -> Option<Self> {
        if let VariableAccess::Real(at) = access { Some(*at(model)) } else { None }
    }
    fn write_to_model<M>(&self, access: &VariableAccess<M>, model: &mut M) {
        if let VariableAccess::Real(at) = access {
            *at(model) = *self;
        }
    }
    fn numeric_value(&self) -> Option<f64> {
        Some(*self)
    }
}

impl FmiValue for c_int {
    const KIND: VariableKind = VariableKind::Integer;
    fn read_from_model<M>(access: &VariableAccess<M>, model: &mut M) -> Option<Self> {
        if let VariableAccess::Integer(at) = access { Some(*at(model)) } else { None }
    }
    fn write_to_model<M>(&self, access: &VariableAccess<M>, model: &mut M) {
        if let VariableAccess::Integer(at) = access {
            *at(model) = *self;
        }
    }
    fn numeric_value(&self) -> Option<f64> {
        Some(f64::from(*self))
    }
}

impl FmiValue for FmiBoolean {
    const KIND: VariableKind = VariableKind::Boolean;
    fn read_from_model<M>(access: &VariableAccess<M>, model: &mut M) -> Option<Self> {
        if let VariableAccess::Boolean(at) = access { Some(FmiBoolean((*at(model)).into())) } else { None }
    }
    fn write_to_model<M>(&self, access: &VariableAccess<M>, model: &mut M) {
        if let VariableAccess::Boolean(at) = access {
            *at(model) = self.0 != 0;
        }
    }
    fn numeric_value(&self) -> Option<f64> {
        None
    }
}

impl FmiValue for String {
    const KIND: VariableKind = VariableKind::String;
    fn read_from_model<M>(access: &VariableAccess<M>, model: &mut M) -> Option<Self> {
        if let VariableAccess::String(at) = access { Some(at(model).clone()) } else { None }
    }
    fn write_to_model<M>(&self, access: &VariableAccess<M>, model: &mut M) {
        if let VariableAccess::String(at) = access {
            at(model).clone_from(self);
        }
    }
    fn numeric_value(&self) -> Option<f64> {
        None
    }
}

/// `fmi3Boolean`, one byte: every value but 0 is true.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ByteBoolean(pub u8);

impl FmiValue for ByteBoolean {
    const KIND: VariableKind = VariableKind::Boolean;
    fn read_from_model<M>(access: &VariableAccess<M>, model: &mut M) -> Option<Self> {
        if let VariableAccess::Boolean(at) = access { Some(ByteBoolean((*at(model)).into())) } else { None }
    }
    fn write_to_model<M>(&self, access: &VariableAccess<M>, model: &mut M) {
        if let VariableAccess::Boolean(at) = access {
            *at(model) = self.0 != 0;
        }
    }
    fn numeric_value(&self) -> Option<f64> {
        None
    }
}
