//! Reads and writes a variable as one of the types of FMI.

use std::ffi::c_int;

use crate::variable::{Access, Kind};

/// A value that crosses the C interface.
pub trait Value: Sized {
    /// The type of the variables that hold it.
    const KIND: Kind;
    /// Its value in the model, when the variable is of this type.
    fn read<M>(access: &Access<M>, model: &mut M) -> Option<Self>;
    /// Writes it into the model; a variable of another type is left alone.
    fn write<M>(&self, access: &Access<M>, model: &mut M);
    /// The number that limits apply to.
    fn number(&self) -> Option<f64>;
}

/// `fmi2Boolean`: every value but 0 is true.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FmiBoolean(pub c_int);

impl Value for f64 {
    const KIND: Kind = Kind::Real;
    fn read<M>(access: &Access<M>, model: &mut M) -> Option<Self> {
        if let Access::Real(at) = access { Some(*at(model)) } else { None }
    }
    fn write<M>(&self, access: &Access<M>, model: &mut M) {
        if let Access::Real(at) = access {
            *at(model) = *self;
        }
    }
    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl Value for c_int {
    const KIND: Kind = Kind::Integer;
    fn read<M>(access: &Access<M>, model: &mut M) -> Option<Self> {
        if let Access::Integer(at) = access { Some(*at(model)) } else { None }
    }
    fn write<M>(&self, access: &Access<M>, model: &mut M) {
        if let Access::Integer(at) = access {
            *at(model) = *self;
        }
    }
    fn number(&self) -> Option<f64> {
        Some(f64::from(*self))
    }
}

impl Value for FmiBoolean {
    const KIND: Kind = Kind::Boolean;
    fn read<M>(access: &Access<M>, model: &mut M) -> Option<Self> {
        if let Access::Boolean(at) = access { Some(FmiBoolean((*at(model)).into())) } else { None }
    }
    fn write<M>(&self, access: &Access<M>, model: &mut M) {
        if let Access::Boolean(at) = access {
            *at(model) = self.0 != 0;
        }
    }
    fn number(&self) -> Option<f64> {
        None
    }
}

impl Value for String {
    const KIND: Kind = Kind::String;
    fn read<M>(access: &Access<M>, model: &mut M) -> Option<Self> {
        if let Access::String(at) = access { Some(at(model).clone()) } else { None }
    }
    fn write<M>(&self, access: &Access<M>, model: &mut M) {
        if let Access::String(at) = access {
            at(model).clone_from(self);
        }
    }
    fn number(&self) -> Option<f64> {
        None
    }
}

/// `fmi3Boolean`, one byte: every value but 0 is true.
#[repr(transparent)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ByteBoolean(pub u8);

impl Value for ByteBoolean {
    const KIND: Kind = Kind::Boolean;
    fn read<M>(access: &Access<M>, model: &mut M) -> Option<Self> {
        if let Access::Boolean(at) = access { Some(ByteBoolean((*at(model)).into())) } else { None }
    }
    fn write<M>(&self, access: &Access<M>, model: &mut M) {
        if let Access::Boolean(at) = access {
            *at(model) = self.0 != 0;
        }
    }
    fn number(&self) -> Option<f64> {
        None
    }
}
