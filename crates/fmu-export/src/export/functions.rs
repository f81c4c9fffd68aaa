//! Exports the C functions of FMI 2.0, which pass their arguments on.

/// Exports a model as a co-simulation library of FMI 2.0 and FMI 3.0: the C functions of both, and the one by which a packer
/// asks the library for its descriptions.
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        $crate::export_instance!($crate::Instance<$model>);

        #[doc(hidden)]
        #[allow(missing_docs, clippy::missing_safety_doc)]
        mod describe {
            use std::ffi::c_void;

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmu_export_describe(
                context: *mut c_void,
                take: unsafe extern "C" fn(*mut c_void, u32, *const u8, usize),
            ) {
                unsafe { $crate::export::pass_model_texts::<super::ExportedModel>(context, take) }
            }
        }

        type ExportedModel = $model;
    };
}

/// Exports instances of any kind, which implement [`CoSimulation`](crate::CoSimulation): the C functions of FMI 2.0 and FMI 3.0. The
/// description is that of who packs the library.
#[macro_export]
macro_rules! export_instance {
    ($instance:ty) => {
        type ExportedInstance = $instance;

        $crate::export_fmi3!();

        #[allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]
        mod fmi2 {
            use std::ffi::{c_char, c_int};

            use $crate::abi::{Boolean, CallbackFunctions, Component, FmuState, Status, ValueReference};
            use $crate::export::{self, Call, FmiBoolean};

            use super::ExportedInstance as Instance;

            $crate::c_functions! {
                fmi2SetDebugLogging(c: Component, on: Boolean, n: usize, categories: *const *const c_char)
                    => export::set_debug_logging::<Instance>(c, on, n, categories);
                fmi2SetupExperiment(c: Component, has_tolerance: Boolean, tolerance: f64, start: f64, has_stop: Boolean, stop: f64)
                    => export::setup_experiment::<Instance>(c, (has_tolerance != 0).then_some(tolerance), start, (has_stop != 0).then_some(stop));
                fmi2EnterInitializationMode(c: Component)
                    => export::change_state::<Instance>(c, Call::EnterInitializationMode);
                fmi2ExitInitializationMode(c: Component)
                    => export::change_state::<Instance>(c, Call::ExitInitializationMode);
                fmi2Terminate(c: Component) => export::change_state::<Instance>(c, Call::Terminate);
                fmi2Reset(c: Component) => export::change_state::<Instance>(c, Call::Reset);
                fmi2CancelStep(c: Component) => export::change_state::<Instance>(c, Call::CancelStep);
                fmi2DoStep(c: Component, time: f64, step: f64, _no_set_state_prior: Boolean)
                    => export::do_step::<Instance>(c, time, step);
                fmi2GetReal(c: Component, r: *const ValueReference, n: usize, v: *mut f64)
                    => export::get::<Instance, f64>(c, r, n, v);
                fmi2GetInteger(c: Component, r: *const ValueReference, n: usize, v: *mut c_int)
                    => export::get::<Instance, c_int>(c, r, n, v);
                fmi2GetBoolean(c: Component, r: *const ValueReference, n: usize, v: *mut Boolean)
                    => export::get::<Instance, FmiBoolean>(c, r, n, v.cast());
                fmi2GetString(c: Component, r: *const ValueReference, n: usize, v: *mut *const c_char)
                    => export::get_string::<Instance>(c, r, n, v);
                fmi2SetReal(c: Component, r: *const ValueReference, n: usize, v: *const f64)
                    => export::set::<Instance, f64>(c, r, n, v);
                fmi2SetInteger(c: Component, r: *const ValueReference, n: usize, v: *const c_int)
                    => export::set::<Instance, c_int>(c, r, n, v);
                fmi2SetBoolean(c: Component, r: *const ValueReference, n: usize, v: *const Boolean)
                    => export::set::<Instance, FmiBoolean>(c, r, n, v.cast());
                fmi2SetString(c: Component, r: *const ValueReference, n: usize, v: *const *const c_char)
                    => export::set_string::<Instance>(c, r, n, v);
                fmi2GetFMUstate(c: Component, s: *mut FmuState) => export::get_fmu_state::<Instance>(c, s);
                fmi2SetFMUstate(c: Component, s: FmuState) => export::set_fmu_state::<Instance>(c, s);
                fmi2FreeFMUstate(c: Component, s: *mut FmuState) => export::free_fmu_state::<Instance>(c, s);
                fmi2SerializedFMUstateSize(c: Component, s: FmuState, size: *mut usize)
                    => export::serialized_size::<Instance>(c, s, size);
                fmi2SerializeFMUstate(c: Component, s: FmuState, bytes: *mut u8, n: usize)
                    => export::serialize::<Instance>(c, s, bytes, n);
                fmi2DeSerializeFMUstate(c: Component, bytes: *const u8, n: usize, s: *mut FmuState)
                    => export::deserialize::<Instance>(c, bytes, n, s);
                fmi2GetDirectionalDerivative(c: Component, unknown: *const ValueReference, n: usize, known: *const ValueReference, m: usize, dv_known: *const f64, dv_unknown: *mut f64)
                    => export::directional_derivative::<Instance>(c, unknown, n, known, m, dv_known, dv_unknown);
                fmi2SetRealInputDerivatives(c: Component, r: *const ValueReference, n: usize, order: *const c_int, v: *const f64)
                    => export::set_input_derivatives::<Instance>(c, r, n, order, v);
                fmi2GetRealOutputDerivatives(c: Component, _r: *const ValueReference, _n: usize, _order: *const c_int, _v: *mut f64)
                    => export::unsupported::<Instance>(c, Call::GetRealOutputDerivatives, "an output derivative");
                fmi2GetStatus(c: Component, kind: c_int, v: *mut Status)
                    => export::get_status::<Instance, Status>(c, kind, v, |lifecycle, kind| (kind == 0).then(|| lifecycle.last_step()));
                fmi2GetRealStatus(c: Component, kind: c_int, v: *mut f64)
                    => export::get_status::<Instance, f64>(c, kind, v, |lifecycle, kind| (kind == 2).then_some(lifecycle.now));
                fmi2GetIntegerStatus(c: Component, kind: c_int, v: *mut c_int)
                    => export::get_status::<Instance, c_int>(c, kind, v, |_, _| None);
                fmi2GetBooleanStatus(c: Component, kind: c_int, v: *mut Boolean)
                    => export::get_status::<Instance, Boolean>(c, kind, v, |lifecycle, kind| (kind == 3).then(|| lifecycle.terminated.into()));
                fmi2GetStringStatus(c: Component, kind: c_int, v: *mut *const c_char)
                    => export::get_status::<Instance, *const c_char>(c, kind, v, |_, _| None);
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
                resources: *const c_char,
                functions: *const CallbackFunctions,
                _visible: Boolean,
                logging_on: Boolean,
            ) -> Component {
                unsafe { export::instantiate::<Instance>(name, kind, guid, resources, functions, logging_on) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
                unsafe { export::free_instance::<Instance>(c) }
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
