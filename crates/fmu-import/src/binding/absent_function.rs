//! Stands for functions of FMI 2.0 that a library may lack, since its description promises nothing of them: many tools leave them out, and
//! FMI 1.0 has none of them.

use super::functions::StatePointer;
use super::{ERROR, FmiStatus, InstancePointer};
use crate::{FmiVersion, FmuDescription};

pub(super) unsafe extern "C" fn exchange_state(_: InstancePointer, _: *mut StatePointer) -> FmiStatus {
    ERROR
}

pub(super) unsafe extern "C" fn set_state(_: InstancePointer, _: StatePointer) -> FmiStatus {
    ERROR
}

pub(super) unsafe extern "C" fn serialised_size(
    _: InstancePointer,
    _: StatePointer,
    _: *mut usize,
) -> FmiStatus {
    ERROR
}

pub(super) unsafe extern "C" fn serialise(
    _: InstancePointer,
    _: StatePointer,
    _: *mut u8,
    _: usize,
) -> FmiStatus {
    ERROR
}

pub(super) unsafe extern "C" fn deserialise(
    _: InstancePointer,
    _: *const u8,
    _: usize,
    _: *mut StatePointer,
) -> FmiStatus {
    ERROR
}

pub(super) unsafe extern "C" fn directional_derivative(
    _: InstancePointer,
    _: *const u32,
    _: usize,
    _: *const u32,
    _: usize,
    _: *const f64,
    _: *mut f64,
) -> FmiStatus {
    ERROR
}

/// The address of what stands for a function of this name in the library of a description; nothing where the function must be there.
pub(super) fn absent_function(symbol: &str, about: &FmuDescription) -> Option<*const ()> {
    if about.version != FmiVersion::Two {
        return None;
    }
    let (is_promised, address) = match symbol {
        "fmi2GetFMUstate" | "fmi2FreeFMUstate" => (about.state, exchange_state as *const ()),
        "fmi2SetFMUstate" => (about.state, set_state as *const ()),
        "fmi2SerializedFMUstateSize" => (about.serialised_state, serialised_size as *const ()),
        "fmi2SerializeFMUstate" => (about.serialised_state, serialise as *const ()),
        "fmi2DeSerializeFMUstate" => (about.serialised_state, deserialise as *const ()),
        "fmi2GetDirectionalDerivative" => (about.directional_derivative, directional_derivative as *const ()),
        _ => return None,
    };
    (!is_promised).then_some(address)
}
