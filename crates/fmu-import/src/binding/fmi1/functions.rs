//! Declares the functions of a library of FMI 1.0. The name of the model stands before each name.

use std::ffi::{c_char, c_int, c_void};

use super::super::functions::{Fmi2GetFn, Fmi2SetFn, GetTextFn, SymbolLoader, functions};
use super::super::{ComponentFn, FmiStatus, InstancePointer};
use crate::OpenError;

/// The callbacks of model exchange.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Fmi1Callbacks {
    pub(super) logger:
        unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...),
    pub(super) allocate_memory: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    pub(super) free_memory: unsafe extern "C" fn(*mut c_void),
}

/// The callbacks of co-simulation.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Fmi1SlaveCallbacks {
    pub(super) common: Fmi1Callbacks,
    pub(super) step_finished: Option<unsafe extern "C" fn(*mut c_void, FmiStatus)>,
}

/// `fmiEventInfo`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct EventInfo1 {
    pub(super) iteration_converged: u8,
    pub(super) state_value_references_changed: u8,
    pub(super) state_values_changed: u8,
    pub(super) terminate_simulation: u8,
    pub(super) upcoming_time_event: u8,
    pub(super) next_event_time: f64,
}

type GetStatesFn = unsafe extern "C" fn(InstancePointer, *mut f64, usize) -> FmiStatus;

functions! {
    /// What both interfaces have.
    Fmi1Functions {
        get_version: "fmiGetVersion" as GetTextFn,
        set_debug_logging: "fmiSetDebugLogging" as unsafe extern "C" fn(InstancePointer, u8) -> FmiStatus,
        get_real: "fmiGetReal" as Fmi2GetFn<f64>,
        get_integer: "fmiGetInteger" as Fmi2GetFn<c_int>,
        get_boolean: "fmiGetBoolean" as Fmi2GetFn<u8>,
        get_string: "fmiGetString" as Fmi2GetFn<*const c_char>,
        set_real: "fmiSetReal" as Fmi2SetFn<f64>,
        set_integer: "fmiSetInteger" as Fmi2SetFn<c_int>,
        set_boolean: "fmiSetBoolean" as Fmi2SetFn<u8>,
        set_string: "fmiSetString" as Fmi2SetFn<*const c_char>,
    }
}

functions! {
    /// What co-simulation has.
    Fmi1SlaveFunctions {
        get_types_platform: "fmiGetTypesPlatform" as GetTextFn,
        instantiate: "fmiInstantiateSlave" as unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, *const c_char, f64, u8, u8, Fmi1SlaveCallbacks, u8) -> InstancePointer,
        initialize: "fmiInitializeSlave" as unsafe extern "C" fn(InstancePointer, f64, u8, f64) -> FmiStatus,
        terminate: "fmiTerminateSlave" as ComponentFn,
        reset: "fmiResetSlave" as ComponentFn,
        free_instance: "fmiFreeSlaveInstance" as unsafe extern "C" fn(InstancePointer),
        set_input_derivatives: "fmiSetRealInputDerivatives" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const c_int, *const f64) -> FmiStatus,
        get_output_derivatives: "fmiGetRealOutputDerivatives" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const c_int, *mut f64) -> FmiStatus,
        do_step: "fmiDoStep" as unsafe extern "C" fn(InstancePointer, f64, f64, u8) -> FmiStatus,
        cancel_step: "fmiCancelStep" as ComponentFn,
        get_status: "fmiGetStatus" as unsafe extern "C" fn(InstancePointer, c_int, *mut c_int) -> FmiStatus,
        get_real_status: "fmiGetRealStatus" as unsafe extern "C" fn(InstancePointer, c_int, *mut f64) -> FmiStatus,
    }
}

functions! {
    /// What model exchange has.
    Fmi1ModelFunctions {
        get_types_platform: "fmiGetModelTypesPlatform" as GetTextFn,
        instantiate: "fmiInstantiateModel" as unsafe extern "C" fn(*const c_char, *const c_char, Fmi1Callbacks, u8) -> InstancePointer,
        initialize: "fmiInitialize" as unsafe extern "C" fn(InstancePointer, u8, f64, *mut EventInfo1) -> FmiStatus,
        terminate: "fmiTerminate" as ComponentFn,
        free_instance: "fmiFreeModelInstance" as unsafe extern "C" fn(InstancePointer),
        set_time: "fmiSetTime" as unsafe extern "C" fn(InstancePointer, f64) -> FmiStatus,
        set_states: "fmiSetContinuousStates" as unsafe extern "C" fn(InstancePointer, *const f64, usize) -> FmiStatus,
        get_states: "fmiGetContinuousStates" as GetStatesFn,
        get_derivatives: "fmiGetDerivatives" as GetStatesFn,
        get_event_indicators: "fmiGetEventIndicators" as GetStatesFn,
        get_nominals: "fmiGetNominalContinuousStates" as GetStatesFn,
        event_update: "fmiEventUpdate" as unsafe extern "C" fn(InstancePointer, u8, *mut EventInfo1) -> FmiStatus,
        completed_integrator_step: "fmiCompletedIntegratorStep" as unsafe extern "C" fn(InstancePointer, *mut u8) -> FmiStatus,
    }
}
