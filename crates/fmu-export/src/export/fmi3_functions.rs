//! Exports the C functions of FMI 3.0, which pass their arguments on.

/// Defines the functions of FMI 3.0. Importers look for those of model exchange and scheduled execution too: they say that there is
/// neither.
#[doc(hidden)]
#[macro_export]
macro_rules! export_fmi3 {
    () => {
        #[allow(non_snake_case, missing_docs, clippy::missing_safety_doc, clippy::too_many_arguments)]
        mod fmi3 {
            use std::ffi::{c_char, c_void};

            use $crate::abi::{Component, FmuState, LogMessage, Status, ValueReference};
            use $crate::export::{self, Call, fmi3};

            use super::ExportedInstance as Instance;

            type References = *const ValueReference;

            $crate::c_functions! {
                fmi3SetDebugLogging(c: Component, on: bool, n: usize, categories: *const *const c_char)
                    => export::set_debug_logging::<Instance>(c, on.into(), n, categories);
                fmi3EnterInitializationMode(c: Component, has_tolerance: bool, tolerance: f64, start: f64, has_stop: bool, stop: f64)
                    => fmi3::enter_initialization::<Instance>(c, has_tolerance.then_some(tolerance), start, has_stop.then_some(stop));
                fmi3ExitInitializationMode(c: Component) => export::change_state::<Instance>(c, Call::ExitInitializationMode);
                fmi3Terminate(c: Component) => export::change_state::<Instance>(c, Call::Terminate);
                fmi3Reset(c: Component) => export::change_state::<Instance>(c, Call::Reset);
                fmi3DoStep(c: Component, time: f64, step: f64, _no_set_state_prior: bool, event: *mut bool, terminate: *mut bool, early: *mut bool, reached: *mut f64)
                    => fmi3::step::<Instance>(c, time, step, fmi3::StepOutputs { event, terminate, early, reached });
                fmi3GetFloat64(c: Component, r: References, n: usize, v: *mut f64, l: usize)
                    => fmi3::get::<Instance, f64>(c, r, n, v, l);
                fmi3GetInt32(c: Component, r: References, n: usize, v: *mut i32, l: usize)
                    => fmi3::get::<Instance, i32>(c, r, n, v, l);
                fmi3GetBoolean(c: Component, r: References, n: usize, v: *mut u8, l: usize)
                    => fmi3::get::<Instance, fmi3::ByteBoolean>(c, r, n, v.cast(), l);
                fmi3GetString(c: Component, r: References, n: usize, v: *mut *const c_char, l: usize)
                    => fmi3::get_string::<Instance>(c, r, n, v, l);
                fmi3SetFloat64(c: Component, r: References, n: usize, v: *const f64, l: usize)
                    => fmi3::set::<Instance, f64>(c, r, n, v, l);
                fmi3SetInt32(c: Component, r: References, n: usize, v: *const i32, l: usize)
                    => fmi3::set::<Instance, i32>(c, r, n, v, l);
                fmi3SetBoolean(c: Component, r: References, n: usize, v: *const u8, l: usize)
                    => fmi3::set::<Instance, fmi3::ByteBoolean>(c, r, n, v.cast(), l);
                fmi3SetString(c: Component, r: References, n: usize, v: *const *const c_char, l: usize)
                    => fmi3::set_string::<Instance>(c, r, n, v, l);
                fmi3GetFMUState(c: Component, s: *mut FmuState) => export::get_fmu_state::<Instance>(c, s);
                fmi3SetFMUState(c: Component, s: FmuState) => export::set_fmu_state::<Instance>(c, s);
                fmi3FreeFMUState(c: Component, s: *mut FmuState) => export::free_fmu_state::<Instance>(c, s);
                fmi3SerializedFMUStateSize(c: Component, s: FmuState, size: *mut usize)
                    => export::serialized_size::<Instance>(c, s, size);
                fmi3SerializeFMUState(c: Component, s: FmuState, bytes: *mut u8, n: usize)
                    => export::serialize::<Instance>(c, s, bytes, n);
                fmi3DeserializeFMUState(c: Component, bytes: *const u8, n: usize, s: *mut FmuState)
                    => export::deserialize::<Instance>(c, bytes, n, s);
                fmi3GetDirectionalDerivative(c: Component, unknown: References, n: usize, known: References, m: usize, seed: *const f64, seeds: usize, response: *mut f64, room: usize)
                    => fmi3::directional_derivative::<Instance>(c, unknown, n, known, m, seed, seeds, response, room);
                fmi3GetAdjointDerivative(c: Component, _u: References, _n: usize, _k: References, _m: usize, _s: *const f64, _ns: usize, _v: *mut f64, _nv: usize)
                    => export::unsupported::<Instance>(c, Call::GetDirectionalDerivative, "an adjoint derivative");
                fmi3GetOutputDerivatives(c: Component, _r: References, _n: usize, _order: *const i32, _v: *mut f64, _l: usize)
                    => export::unsupported::<Instance>(c, Call::GetRealOutputDerivatives, "an output derivative");
                fmi3GetNumberOfVariableDependencies(c: Component, _r: ValueReference, count: *mut usize)
                    => fmi3::reject_unsupported_call::<Instance>(c, count, "a list of dependencies");
                fmi3GetVariableDependencies(c: Component, _r: ValueReference, _e: *mut usize, _i: *mut ValueReference, _ei: *mut usize, _k: *mut i32, _n: usize)
                    => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "a list of dependencies");
                fmi3GetBinary(c: Component, r: References, n: usize, _s: *mut usize, _v: *mut *const u8, _l: usize)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, "Binary");
                fmi3SetBinary(c: Component, r: References, n: usize, _s: *const usize, _v: *const *const u8, _l: usize)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, "Binary");
                fmi3GetClock(c: Component, r: References, n: usize, _v: *mut bool)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, "Clock");
                fmi3SetClock(c: Component, r: References, n: usize, _v: *const bool)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, "Clock");
                fmi3GetIntervalDecimal(c: Component, r: References, n: usize, _v: *mut f64, _q: *mut i32)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, "Clock");
                fmi3GetIntervalFraction(c: Component, r: References, n: usize, _i: *mut u64, _o: *mut u64, _q: *mut i32)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, "Clock");
                fmi3GetShiftDecimal(c: Component, r: References, n: usize, _v: *mut f64)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, "Clock");
                fmi3GetShiftFraction(c: Component, r: References, n: usize, _i: *mut u64, _o: *mut u64)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, "Clock");
                fmi3SetIntervalDecimal(c: Component, r: References, n: usize, _v: *const f64)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, "Clock");
                fmi3SetIntervalFraction(c: Component, r: References, n: usize, _i: *const u64, _o: *const u64)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, "Clock");
                fmi3SetShiftDecimal(c: Component, r: References, n: usize, _v: *const f64)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, "Clock");
                fmi3SetShiftFraction(c: Component, r: References, n: usize, _i: *const u64, _o: *const u64)
                    => fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, "Clock");
                fmi3EnterConfigurationMode(c: Component) => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "configuration mode");
                fmi3ExitConfigurationMode(c: Component) => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "configuration mode");
                fmi3EnterEventMode(c: Component) => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "event mode");
                fmi3EnterStepMode(c: Component) => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "event mode");
                fmi3EvaluateDiscreteStates(c: Component) => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "event mode");
                fmi3UpdateDiscreteStates(c: Component, _again: *mut bool, _end: *mut bool, _nominals: *mut bool, _states: *mut bool, _defined: *mut bool, _next: *mut f64)
                    => fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "event mode");
            }

            $crate::absent_interfaces! {
                fmi3EnterContinuousTimeMode();
                fmi3CompletedIntegratorStep(_prior: bool, _event_mode: *mut bool, _end: *mut bool);
                fmi3SetTime(_time: f64);
                fmi3SetContinuousStates(_states: *const f64, _n: usize);
                fmi3GetContinuousStates(_states: *mut f64, _n: usize);
                fmi3GetContinuousStateDerivatives(_derivatives: *mut f64, _n: usize);
                fmi3GetEventIndicators(_indicators: *mut f64, _n: usize);
                fmi3GetNominalsOfContinuousStates(_nominals: *mut f64, _n: usize);
                fmi3GetNumberOfEventIndicators(_n: *mut usize);
                fmi3GetNumberOfContinuousStates(_n: *mut usize);
                fmi3ActivateModelPartition(_clock: ValueReference, _time: f64);
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3InstantiateModelExchange() -> Component {
                std::ptr::null_mut()
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3InstantiateScheduledExecution() -> Component {
                std::ptr::null_mut()
            }

            $crate::absent_types! {
                fmi3GetFloat32, fmi3SetFloat32: f32 as "Float32";
                fmi3GetInt8, fmi3SetInt8: i8 as "Int8";
                fmi3GetUInt8, fmi3SetUInt8: u8 as "UInt8";
                fmi3GetInt16, fmi3SetInt16: i16 as "Int16";
                fmi3GetUInt16, fmi3SetUInt16: u16 as "UInt16";
                fmi3GetUInt32, fmi3SetUInt32: u32 as "UInt32";
                fmi3GetInt64, fmi3SetInt64: i64 as "Int64";
                fmi3GetUInt64, fmi3SetUInt64: u64 as "UInt64";
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3GetVersion() -> *const c_char {
                c"3.0".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
                name: *const c_char,
                token: *const c_char,
                resources: *const c_char,
                _visible: bool,
                logging_on: bool,
                event_mode: bool,
                _early_return_allowed: bool,
                _intermediate_variables: References,
                intermediate: usize,
                environment: *mut c_void,
                log: Option<LogMessage>,
                _intermediate_update: *const c_void,
            ) -> Component {
                let options = fmi3::InstantiationOptions { logging_on, event_mode, intermediate };
                unsafe { fmi3::instantiate::<Instance>(name, token, resources, environment, log, options) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3FreeInstance(c: Component) {
                unsafe { export::free_instance::<Instance>(c) }
            }
        }
    };
}

/// Defines the functions of model exchange and scheduled execution.
#[doc(hidden)]
#[macro_export]
macro_rules! absent_interfaces {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {
        $(
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name(c: Component $(, $argument: $type)*) -> Status {
                unsafe { fmi3::reject_unsupported_call::<Instance>(c, std::ptr::null_mut(), "any interface but co-simulation") }
            }
        )*
    };
}

/// Defines the functions of types that no variable of a model has.
#[doc(hidden)]
#[macro_export]
macro_rules! absent_types {
    ($($get:ident, $set:ident: $type:ty as $name:literal;)*) => {
        $(
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $get(c: Component, r: References, n: usize, _v: *mut $type, _l: usize) -> Status {
                unsafe { fmi3::access_unsupported_type::<Instance>(c, Call::Get, r, n, $name) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $set(c: Component, r: References, n: usize, _v: *const $type, _l: usize) -> Status {
                unsafe { fmi3::access_unsupported_type::<Instance>(c, Call::Set, r, n, $name) }
            }
        )*
    };
}
