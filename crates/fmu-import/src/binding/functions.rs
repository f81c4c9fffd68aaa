//! Declares the functions of an FMU's library, as FMI 2.0 and 3.0 have them.

use std::ffi::{c_char, c_int, c_void};

use super::{ComponentFn, FmiStatus, InstancePointer};
use crate::{FmiInterface, FmiVersion, OpenError};

pub(super) type GetTextFn = unsafe extern "C" fn() -> *const c_char;
/// `fmi3Boolean`, in which any value but 0 is true.
#[derive(Clone, Copy, Default)]
#[repr(transparent)]
pub(super) struct Fmi3Boolean(pub(super) u8);
/// `fmi2FMUstate` and `fmi3FMUState`.
pub(super) type StatePointer = *mut c_void;

/// Value references as C hands them over.
#[derive(Clone, Copy)]
pub(super) struct References {
    pub(super) first: *const u32,
    pub(super) count: usize,
}

type SetTimeFn = unsafe extern "C" fn(InstancePointer, f64) -> FmiStatus;
type SetStatesFn = unsafe extern "C" fn(InstancePointer, *const f64, usize) -> FmiStatus;
type GetStatesFn = unsafe extern "C" fn(InstancePointer, *mut f64, usize) -> FmiStatus;
pub(super) type UpdateDiscreteStatesFn =
    unsafe extern "C" fn(InstancePointer, *mut u8, *mut u8, *mut u8, *mut u8, *mut u8, *mut f64) -> FmiStatus;

/// `fmi2EventInfo`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct EventInfo {
    pub(super) new_discrete_states_needed: c_int,
    pub(super) terminate_simulation: c_int,
    pub(super) nominals_of_continuous_states_changed: c_int,
    pub(super) values_of_continuous_states_changed: c_int,
    pub(super) next_event_time_defined: c_int,
    pub(super) next_event_time: f64,
}

/// Finds functions in a library by name.
pub(super) struct SymbolLoader<'a> {
    /// The address of a function by its name.
    pub find: &'a dyn Fn(&'static str) -> Option<*const ()>,
    pub lacks: &'a dyn Fn(&'static str) -> OpenError,
}

impl SymbolLoader<'_> {
    /// A function by its name.
    ///
    /// # Safety
    /// The function of this name must be of type `T`.
    pub(super) unsafe fn load_symbol<T: Copy>(&self, symbol: &'static str) -> Result<T, OpenError> {
        const { assert!(size_of::<T>() == size_of::<*const ()>()) };
        let found = (self.find)(symbol).ok_or_else(|| (self.lacks)(symbol))?;
        // SAFETY: the caller vouches for the type.
        Ok(unsafe { std::mem::transmute_copy(&found) })
    }
}

/// Declares functions by name, with those that are asked for and never called.
macro_rules! functions {
    ($(#[$about:meta])* $name:ident { $($member:ident: $symbol:literal as $type:ty,)* } $($uncalled:literal,)*) => {
        $(#[$about])*
        #[derive(Clone, Copy)]
        pub(super) struct $name {
            $(pub(super) $member: $type,)*
        }

        impl $name {
            /// All of them.
            pub(super) const SYMBOLS: &[&str] = &[$($symbol,)* $($uncalled,)*];

            /// Finds those that are called.
            ///
            /// # Errors
            /// At the first one that is not there.
            pub(super) fn new(finder: &SymbolLoader) -> Result<Self, OpenError> {
                Ok($name {
                    $(
                        // SAFETY: FMI gives the function of this name the type of the member.
                        $member: unsafe { finder.load_symbol::<$type>($symbol) }?,
                    )*
                })
            }
        }
    };
}

pub(super) use functions;

/// Functions that FMI 2.0 and 3.0 have with the same arguments.
#[derive(Clone, Copy)]
pub(super) struct CommonFunctions {
    pub(super) free_instance: unsafe extern "C" fn(InstancePointer),
    pub(super) get_version: GetTextFn,
    pub(super) exit_initialization_mode: ComponentFn,
    pub(super) terminate: ComponentFn,
    pub(super) reset: ComponentFn,
    pub(super) get_state: unsafe extern "C" fn(InstancePointer, *mut StatePointer) -> FmiStatus,
    pub(super) set_state: unsafe extern "C" fn(InstancePointer, StatePointer) -> FmiStatus,
    pub(super) free_state: unsafe extern "C" fn(InstancePointer, *mut StatePointer) -> FmiStatus,
    pub(super) serialised_size: unsafe extern "C" fn(InstancePointer, StatePointer, *mut usize) -> FmiStatus,
    pub(super) serialise: unsafe extern "C" fn(InstancePointer, StatePointer, *mut u8, usize) -> FmiStatus,
    pub(super) deserialise:
        unsafe extern "C" fn(InstancePointer, *const u8, usize, *mut StatePointer) -> FmiStatus,
}

impl CommonFunctions {
    /// Finds them.
    ///
    /// # Errors
    /// At the first one that is not there.
    pub(super) fn new(finder: &SymbolLoader, version: FmiVersion) -> Result<Self, OpenError> {
        let name = |two, three| match version {
            FmiVersion::One | FmiVersion::Two => two,
            FmiVersion::Three => three,
        };
        // SAFETY: both versions give the functions of these names the types of the members.
        unsafe {
            Ok(CommonFunctions {
                free_instance: finder.load_symbol(name("fmi2FreeInstance", "fmi3FreeInstance"))?,
                get_version: finder.load_symbol(name("fmi2GetVersion", "fmi3GetVersion"))?,
                exit_initialization_mode: finder
                    .load_symbol(name("fmi2ExitInitializationMode", "fmi3ExitInitializationMode"))?,
                terminate: finder.load_symbol(name("fmi2Terminate", "fmi3Terminate"))?,
                reset: finder.load_symbol(name("fmi2Reset", "fmi3Reset"))?,
                get_state: finder.load_symbol(name("fmi2GetFMUstate", "fmi3GetFMUState"))?,
                set_state: finder.load_symbol(name("fmi2SetFMUstate", "fmi3SetFMUState"))?,
                free_state: finder.load_symbol(name("fmi2FreeFMUstate", "fmi3FreeFMUState"))?,
                serialised_size: finder
                    .load_symbol(name("fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize"))?,
                serialise: finder.load_symbol(name("fmi2SerializeFMUstate", "fmi3SerializeFMUState"))?,
                deserialise: finder
                    .load_symbol(name("fmi2DeSerializeFMUstate", "fmi3DeserializeFMUState"))?,
            })
        }
    }
}

unsafe extern "C" {
    /// What FMUs take memory by.
    pub(super) fn calloc(count: usize, size: usize) -> *mut c_void;
    pub(super) fn free(pointer: *mut c_void);
}

/// The callbacks of FMI 2.0.
#[repr(C)]
pub(super) struct CallbackFunctions {
    pub(super) logger:
        unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...),
    pub(super) allocate_memory: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    pub(super) free_memory: unsafe extern "C" fn(*mut c_void),
    pub(super) step_finished: Option<unsafe extern "C" fn(*mut c_void, FmiStatus)>,
    pub(super) environment: *mut c_void,
}

pub(super) type Fmi2GetFn<T> = unsafe extern "C" fn(InstancePointer, *const u32, usize, *mut T) -> FmiStatus;
pub(super) type Fmi2SetFn<T> =
    unsafe extern "C" fn(InstancePointer, *const u32, usize, *const T) -> FmiStatus;

functions! {
    /// What FMI 2.0 alone has, or has with other arguments.
    Fmi2Functions {
        get_types_platform: "fmi2GetTypesPlatform" as GetTextFn,
        set_debug_logging: "fmi2SetDebugLogging" as unsafe extern "C" fn(InstancePointer, c_int, usize, *const *const c_char) -> FmiStatus,
        instantiate: "fmi2Instantiate" as unsafe extern "C" fn(*const c_char, c_int, *const c_char, *const c_char, *const CallbackFunctions, c_int, c_int) -> InstancePointer,
        setup_experiment: "fmi2SetupExperiment" as unsafe extern "C" fn(InstancePointer, c_int, f64, f64, c_int, f64) -> FmiStatus,
        enter_initialization_mode: "fmi2EnterInitializationMode" as ComponentFn,
        get_real: "fmi2GetReal" as Fmi2GetFn<f64>,
        get_integer: "fmi2GetInteger" as Fmi2GetFn<c_int>,
        get_boolean: "fmi2GetBoolean" as Fmi2GetFn<c_int>,
        get_string: "fmi2GetString" as Fmi2GetFn<*const c_char>,
        set_real: "fmi2SetReal" as Fmi2SetFn<f64>,
        set_integer: "fmi2SetInteger" as Fmi2SetFn<c_int>,
        set_boolean: "fmi2SetBoolean" as Fmi2SetFn<c_int>,
        set_string: "fmi2SetString" as Fmi2SetFn<*const c_char>,
        directional_derivative: "fmi2GetDirectionalDerivative" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const u32, usize, *const f64, *mut f64) -> FmiStatus,
    }
    "fmi2GetVersion", "fmi2FreeInstance", "fmi2ExitInitializationMode", "fmi2Terminate", "fmi2Reset",
    "fmi2GetFMUstate", "fmi2SetFMUstate", "fmi2FreeFMUstate", "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate", "fmi2DeSerializeFMUstate",
}

pub(super) type DoStep2 = unsafe extern "C" fn(InstancePointer, f64, f64, c_int) -> FmiStatus;

functions! {
    /// What FMI 2.0 has for co-simulation.
    Fmi2CoSimulationFunctions {
        set_input_derivatives: "fmi2SetRealInputDerivatives" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const c_int, *const f64) -> FmiStatus,
        get_output_derivatives: "fmi2GetRealOutputDerivatives" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const c_int, *mut f64) -> FmiStatus,
        do_step: "fmi2DoStep" as DoStep2,
        cancel_step: "fmi2CancelStep" as ComponentFn,
        get_status: "fmi2GetStatus" as unsafe extern "C" fn(InstancePointer, c_int, *mut c_int) -> FmiStatus,
        get_real_status: "fmi2GetRealStatus" as unsafe extern "C" fn(InstancePointer, c_int, *mut f64) -> FmiStatus,
        get_boolean_status: "fmi2GetBooleanStatus" as unsafe extern "C" fn(InstancePointer, c_int, *mut c_int) -> FmiStatus,
    }
    "fmi2GetIntegerStatus", "fmi2GetStringStatus",
}

pub(super) type Fmi3GetFn<T> =
    unsafe extern "C" fn(InstancePointer, *const u32, usize, *mut T, usize) -> FmiStatus;
pub(super) type Fmi3SetFn<T> =
    unsafe extern "C" fn(InstancePointer, *const u32, usize, *const T, usize) -> FmiStatus;
/// `fmi3IntermediateUpdateCallback`.
pub(super) type IntermediateUpdate =
    unsafe extern "C" fn(*mut c_void, f64, u8, u8, u8, u8, *mut u8, *mut f64);
pub(super) type LogMessage = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

functions! {
    /// What FMI 3.0 alone has, or has with other arguments.
    Fmi3Functions {
        enter_initialization_mode: "fmi3EnterInitializationMode" as unsafe extern "C" fn(InstancePointer, bool, f64, f64, bool, f64) -> FmiStatus,
        set_debug_logging: "fmi3SetDebugLogging" as unsafe extern "C" fn(InstancePointer, bool, usize, *const *const c_char) -> FmiStatus,
        get_float32: "fmi3GetFloat32" as Fmi3GetFn<f32>,
        get_float64: "fmi3GetFloat64" as Fmi3GetFn<f64>,
        get_int8: "fmi3GetInt8" as Fmi3GetFn<i8>,
        get_uint8: "fmi3GetUInt8" as Fmi3GetFn<u8>,
        get_int16: "fmi3GetInt16" as Fmi3GetFn<i16>,
        get_uint16: "fmi3GetUInt16" as Fmi3GetFn<u16>,
        get_int32: "fmi3GetInt32" as Fmi3GetFn<i32>,
        get_uint32: "fmi3GetUInt32" as Fmi3GetFn<u32>,
        get_int64: "fmi3GetInt64" as Fmi3GetFn<i64>,
        get_uint64: "fmi3GetUInt64" as Fmi3GetFn<u64>,
        get_boolean: "fmi3GetBoolean" as Fmi3GetFn<Fmi3Boolean>,
        get_string: "fmi3GetString" as Fmi3GetFn<*const c_char>,
        get_binary: "fmi3GetBinary" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *mut usize, *mut *const u8, usize) -> FmiStatus,
        set_float32: "fmi3SetFloat32" as Fmi3SetFn<f32>,
        set_float64: "fmi3SetFloat64" as Fmi3SetFn<f64>,
        set_int8: "fmi3SetInt8" as Fmi3SetFn<i8>,
        set_uint8: "fmi3SetUInt8" as Fmi3SetFn<u8>,
        set_int16: "fmi3SetInt16" as Fmi3SetFn<i16>,
        set_uint16: "fmi3SetUInt16" as Fmi3SetFn<u16>,
        set_int32: "fmi3SetInt32" as Fmi3SetFn<i32>,
        set_uint32: "fmi3SetUInt32" as Fmi3SetFn<u32>,
        set_int64: "fmi3SetInt64" as Fmi3SetFn<i64>,
        set_uint64: "fmi3SetUInt64" as Fmi3SetFn<u64>,
        set_boolean: "fmi3SetBoolean" as Fmi3SetFn<Fmi3Boolean>,
        set_string: "fmi3SetString" as Fmi3SetFn<*const c_char>,
        set_binary: "fmi3SetBinary" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const usize, *const *const u8, usize) -> FmiStatus,
    }
    "fmi3GetVersion", "fmi3FreeInstance", "fmi3ExitInitializationMode", "fmi3Terminate", "fmi3Reset",
    "fmi3GetFMUState", "fmi3SetFMUState", "fmi3FreeFMUState", "fmi3SerializedFMUStateSize",
    "fmi3SerializeFMUState", "fmi3DeserializeFMUState",
}

functions! {
    /// What FMI 3.0 has for co-simulation.
    Fmi3CoSimulationFunctions {
        instantiate: "fmi3InstantiateCoSimulation" as unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, bool, bool, bool, bool, *const u32, usize, *mut c_void, LogMessage, IntermediateUpdate) -> InstancePointer,
        do_step: "fmi3DoStep" as unsafe extern "C" fn(InstancePointer, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> FmiStatus,
    }
}

functions! {
    /// What FMI 2.0 has for model exchange.
    Fmi2ModelExchangeFunctions {
        set_time: "fmi2SetTime" as SetTimeFn,
        set_states: "fmi2SetContinuousStates" as SetStatesFn,
        get_states: "fmi2GetContinuousStates" as GetStatesFn,
        get_derivatives: "fmi2GetDerivatives" as GetStatesFn,
        get_event_indicators: "fmi2GetEventIndicators" as GetStatesFn,
        get_nominals: "fmi2GetNominalsOfContinuousStates" as GetStatesFn,
        enter_event_mode: "fmi2EnterEventMode" as ComponentFn,
        enter_continuous_time_mode: "fmi2EnterContinuousTimeMode" as ComponentFn,
        new_discrete_states: "fmi2NewDiscreteStates" as unsafe extern "C" fn(InstancePointer, *mut EventInfo) -> FmiStatus,
        completed_integrator_step: "fmi2CompletedIntegratorStep" as unsafe extern "C" fn(InstancePointer, c_int, *mut c_int, *mut c_int) -> FmiStatus,
    }
}

functions! {
    /// What FMI 3.0 has for model exchange.
    Fmi3ModelExchangeFunctions {
        instantiate: "fmi3InstantiateModelExchange" as unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, bool, bool, *mut c_void, LogMessage) -> InstancePointer,
        set_time: "fmi3SetTime" as SetTimeFn,
        set_states: "fmi3SetContinuousStates" as SetStatesFn,
        get_states: "fmi3GetContinuousStates" as GetStatesFn,
        get_derivatives: "fmi3GetContinuousStateDerivatives" as GetStatesFn,
        get_event_indicators: "fmi3GetEventIndicators" as GetStatesFn,
        get_nominals: "fmi3GetNominalsOfContinuousStates" as GetStatesFn,
        enter_event_mode: "fmi3EnterEventMode" as ComponentFn,
        enter_continuous_time_mode: "fmi3EnterContinuousTimeMode" as ComponentFn,
        update_discrete_states: "fmi3UpdateDiscreteStates" as UpdateDiscreteStatesFn,
        completed_integrator_step: "fmi3CompletedIntegratorStep" as unsafe extern "C" fn(InstancePointer, bool, *mut u8, *mut u8) -> FmiStatus,
    }
}

/// What the common functions and those of co-simulation of FMI 3.0 are besides, which a plain simulation does not call.
pub(super) const OTHER_SYMBOLS: &[&str] = &[
    "fmi3GetNumberOfVariableDependencies",
    "fmi3GetVariableDependencies",
    "fmi3GetDirectionalDerivative",
    "fmi3GetAdjointDerivative",
    "fmi3EnterConfigurationMode",
    "fmi3ExitConfigurationMode",
    "fmi3GetIntervalFraction",
    "fmi3GetShiftFraction",
    "fmi3SetIntervalDecimal",
    "fmi3SetIntervalFraction",
    "fmi3SetShiftDecimal",
    "fmi3SetShiftFraction",
    "fmi3EvaluateDiscreteStates",
    "fmi3GetOutputDerivatives",
];

functions! {
    /// What FMI 3.0 has for event mode; an FMU without that mode need not have it.
    EventFunctions {
        enter_event_mode: "fmi3EnterEventMode" as ComponentFn,
        enter_step_mode: "fmi3EnterStepMode" as ComponentFn,
        update_discrete_states: "fmi3UpdateDiscreteStates" as UpdateDiscreteStatesFn,
    }
}

functions! {
    /// What FMI 3.0 has for clocks; an FMU without clocks need not have it.
    ClockFunctions {
        get_clock: "fmi3GetClock" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *mut u8) -> FmiStatus,
        set_clock: "fmi3SetClock" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *const u8) -> FmiStatus,
        get_interval: "fmi3GetIntervalDecimal" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *mut f64, *mut c_int) -> FmiStatus,
        get_shift: "fmi3GetShiftDecimal" as unsafe extern "C" fn(InstancePointer, *const u32, usize, *mut f64) -> FmiStatus,
    }
}

/// The functions of one version.
pub(super) enum VersionFunctions {
    Fmi2(Box<Fmi2Functions>),
    Fmi3(Box<Fmi3Functions>),
}

/// The functions of one interface and version.
pub(super) enum InterfaceFunctions {
    CoSimulation2(Fmi2CoSimulationFunctions),
    CoSimulation3(Fmi3CoSimulationFunctions),
    ModelExchange2(Fmi2ModelExchangeFunctions),
    ModelExchange3(Fmi3ModelExchangeFunctions),
}

impl InterfaceFunctions {
    /// Finds those of an interface.
    ///
    /// # Errors
    /// At the first one that is not there.
    pub(super) fn new(
        finder: &SymbolLoader,
        version: FmiVersion,
        interface: FmiInterface,
    ) -> Result<Self, OpenError> {
        Ok(match (version, interface) {
            (FmiVersion::One | FmiVersion::Two, FmiInterface::CoSimulation) => {
                InterfaceFunctions::CoSimulation2(Fmi2CoSimulationFunctions::new(finder)?)
            }
            (FmiVersion::Three, FmiInterface::CoSimulation) => {
                InterfaceFunctions::CoSimulation3(Fmi3CoSimulationFunctions::new(finder)?)
            }
            (FmiVersion::One | FmiVersion::Two, FmiInterface::ModelExchange) => {
                InterfaceFunctions::ModelExchange2(Fmi2ModelExchangeFunctions::new(finder)?)
            }
            (FmiVersion::Three, FmiInterface::ModelExchange) => {
                InterfaceFunctions::ModelExchange3(Fmi3ModelExchangeFunctions::new(finder)?)
            }
        })
    }
}
