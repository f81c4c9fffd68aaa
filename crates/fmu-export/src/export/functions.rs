//! Names the C functions of a library and passes their arguments on.

/// Exports a model as a co-simulation library of FMI 2.0 and FMI 3.0: the C functions of both, and the one by which a packer
/// asks the library for its descriptions.
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        type ExportedModel = $model;

        $crate::export_fmi3!();

        #[allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]
        mod fmi2 {
            use std::ffi::{c_char, c_int, c_void};

            use $crate::abi::{Boolean, CallbackFunctions, Component, FmuState, Status, ValueReference};
            use $crate::export::{self, Call, LastStep, FmiBoolean};

            use super::ExportedModel as Model;

            $crate::c_functions! {
                fmi2SetDebugLogging(c: Component, on: Boolean, n: usize, categories: *const *const c_char)
                    => export::set_debug_logging::<Model>(c, on, n, categories);
                fmi2SetupExperiment(c: Component, _has_tolerance: Boolean, _tolerance: f64, start: f64, has_stop: Boolean, stop: f64)
                    => export::setup_experiment::<Model>(c, start, has_stop, stop);
                fmi2EnterInitializationMode(c: Component)
                    => export::proceed::<Model>(c, Call::EnterInitializationMode);
                fmi2ExitInitializationMode(c: Component)
                    => export::proceed::<Model>(c, Call::ExitInitializationMode);
                fmi2Terminate(c: Component) => export::proceed::<Model>(c, Call::Terminate);
                fmi2Reset(c: Component) => export::proceed::<Model>(c, Call::Reset);
                fmi2CancelStep(c: Component) => export::proceed::<Model>(c, Call::CancelStep);
                fmi2DoStep(c: Component, time: f64, step: f64, _no_set_state_prior: Boolean)
                    => export::do_step::<Model>(c, time, step);
                fmi2GetReal(c: Component, r: *const ValueReference, n: usize, v: *mut f64)
                    => export::get::<Model, f64>(c, r, n, v);
                fmi2GetInteger(c: Component, r: *const ValueReference, n: usize, v: *mut c_int)
                    => export::get::<Model, c_int>(c, r, n, v);
                fmi2GetBoolean(c: Component, r: *const ValueReference, n: usize, v: *mut Boolean)
                    => export::get::<Model, FmiBoolean>(c, r, n, v.cast());
                fmi2GetString(c: Component, r: *const ValueReference, n: usize, v: *mut *const c_char)
                    => export::get_string::<Model>(c, r, n, v);
                fmi2SetReal(c: Component, r: *const ValueReference, n: usize, v: *const f64)
                    => export::set::<Model, f64>(c, r, n, v);
                fmi2SetInteger(c: Component, r: *const ValueReference, n: usize, v: *const c_int)
                    => export::set::<Model, c_int>(c, r, n, v);
                fmi2SetBoolean(c: Component, r: *const ValueReference, n: usize, v: *const Boolean)
                    => export::set::<Model, FmiBoolean>(c, r, n, v.cast());
                fmi2SetString(c: Component, r: *const ValueReference, n: usize, v: *const *const c_char)
                    => export::set_string::<Model>(c, r, n, v);
                fmi2GetFMUstate(c: Component, s: *mut FmuState) => export::get_fmu_state::<Model>(c, s);
                fmi2SetFMUstate(c: Component, s: FmuState) => export::set_fmu_state::<Model>(c, s);
                fmi2FreeFMUstate(c: Component, s: *mut FmuState) => export::free_fmu_state::<Model>(c, s);
                fmi2SerializedFMUstateSize(c: Component, s: FmuState, size: *mut usize)
                    => export::serialized_size::<Model>(c, s, size);
                fmi2SerializeFMUstate(c: Component, s: FmuState, bytes: *mut u8, n: usize)
                    => export::serialize::<Model>(c, s, bytes, n);
                fmi2DeSerializeFMUstate(c: Component, bytes: *const u8, n: usize, s: *mut FmuState)
                    => export::deserialize::<Model>(c, bytes, n, s);
                fmi2GetDirectionalDerivative(c: Component, unknown: *const ValueReference, n: usize, known: *const ValueReference, m: usize, dv_known: *const f64, dv_unknown: *mut f64)
                    => export::directional_derivative::<Model>(c, (unknown, n), (known, m), dv_known, dv_unknown);
                fmi2SetRealInputDerivatives(c: Component, r: *const ValueReference, n: usize, order: *const c_int, v: *const f64)
                    => export::set_input_derivatives::<Model>(c, r, n, order, v);
                fmi2GetRealOutputDerivatives(c: Component, _r: *const ValueReference, _n: usize, _order: *const c_int, _v: *mut f64)
                    => export::unsupported::<Model>(c, Call::GetRealOutputDerivatives, "an output derivative");
                fmi2GetStatus(c: Component, kind: c_int, v: *mut Status)
                    => export::get_status::<Model, Status>(c, kind, v, |last, kind| (kind == 0).then(|| last.status()));
                fmi2GetRealStatus(c: Component, kind: c_int, v: *mut f64)
                    => export::get_status::<Model, f64>(c, kind, v, |last, kind| (kind == 2).then(|| last.last_successful_time()));
                fmi2GetIntegerStatus(c: Component, kind: c_int, v: *mut c_int)
                    => export::get_status::<Model, c_int>(c, kind, v, |_, _| None);
                fmi2GetBooleanStatus(c: Component, kind: c_int, v: *mut Boolean)
                    => export::get_status::<Model, Boolean>(c, kind, v, |last, kind| (kind == 3).then(|| last.terminated().into()));
                fmi2GetStringStatus(c: Component, kind: c_int, v: *mut *const c_char)
                    => export::get_status::<Model, *const c_char>(c, kind, v, |_, _| None);
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
                c"default".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> *const c_char {
                c"2.0".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2Instantiate(
                name: *const c_char,
                kind: c_int,
                guid: *const c_char,
                _resources: *const c_char,
                functions: *const CallbackFunctions,
                _visible: Boolean,
                logging_on: Boolean,
            ) -> Component {
                unsafe { export::instantiate::<Model>(name, kind, guid, functions, logging_on) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
                unsafe { export::free_instance::<Model>(c) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmu_export_describe(
                context: *mut c_void,
                take: unsafe extern "C" fn(*mut c_void, u32, *const u8, usize),
            ) {
                unsafe { export::describe::<Model>(context, take) }
            }
        }
    };
}

/// Defines C functions that return an `fmi2Status`.
#[doc(hidden)]
#[macro_export]
macro_rules! c_functions {
    ($($name:ident($($argument:ident: $type:ty),*) => $body:expr;)*) => {
        $(
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name($($argument: $type),*) -> Status {
                unsafe { $body }
            }
        )*
    };
}
