//! Fills the tables of FMI 2.0 with functions that call an instance of FMI 1.0.

use std::ffi::{CStr, c_char, c_int};
use std::ptr;
use std::time::Duration;

use super::super::absent_function;
use super::super::functions::{
    CallbackFunctions, CommonFunctions, EventInfo, Fmi2CoSimulationFunctions, Fmi2Functions,
    Fmi2ModelExchangeFunctions, References,
};
use super::super::guarded_buffer::{AnyBitPattern, GuardedValue};
use super::super::{DISCARD, ERROR, FmiStatus, InstancePointer, OK, PENDING, is_success};
use super::functions::{EventInfo1, Fmi1ModelFunctions, Fmi1SlaveFunctions};
use super::values;
use super::{ExperimentSetup, Fmi1Instance, Fmi1Interface, components};

/// `fmiDoStepStatus` of `fmiStatusKind`.
const DO_STEP_STATUS: c_int = 0;
/// How long to wait until a step that goes on by itself is asked about again.
const PAUSE: Duration = Duration::from_micros(100);

pub(super) const COMMON: CommonFunctions = CommonFunctions {
    free_instance,
    get_version: no_text,
    exit_initialization_mode: do_nothing,
    terminate,
    reset,
    // FMI 1.0 has nothing for these; the description does not claim it, so nobody calls them.
    get_state: absent_function::exchange_state,
    set_state: absent_function::set_state,
    free_state: absent_function::exchange_state,
    serialised_size: absent_function::serialised_size,
    serialise: absent_function::serialise,
    deserialise: absent_function::deserialise,
};

pub(super) const OWN: Fmi2Functions = Fmi2Functions {
    get_types_platform: no_text,
    set_debug_logging,
    instantiate,
    setup_experiment,
    enter_initialization_mode,
    get_real: values::get_real,
    get_integer: values::get_integer,
    get_boolean: values::get_boolean,
    get_string: values::get_string,
    set_real: values::set_real,
    set_integer: values::set_integer,
    set_boolean: values::set_boolean,
    set_string: values::set_string,
    directional_derivative: absent_function::directional_derivative,
};

pub(super) const SLAVE: Fmi2CoSimulationFunctions = Fmi2CoSimulationFunctions {
    set_input_derivatives,
    get_output_derivatives,
    do_step,
    cancel_step,
    get_status,
    get_real_status,
    get_boolean_status,
};

pub(super) const MODEL: Fmi2ModelExchangeFunctions = Fmi2ModelExchangeFunctions {
    set_time,
    set_states,
    get_states,
    get_derivatives,
    get_event_indicators,
    get_nominals,
    // FMI 1.0 has no modes: an event is an update.
    enter_event_mode: do_nothing,
    enter_continuous_time_mode: do_nothing,
    new_discrete_states,
    completed_integrator_step,
};

impl AnyBitPattern for EventInfo1 {}

const NO_EVENT: EventInfo1 = EventInfo1 {
    iteration_converged: 0,
    state_value_references_changed: 0,
    state_values_changed: 0,
    terminate_simulation: 0,
    upcoming_time_event: 0,
    next_event_time: f64::NAN,
};

impl From<EventInfo1> for EventInfo {
    fn from(found: EventInfo1) -> Self {
        // States that are other variables now have other values and nominal values.
        let others = found.state_value_references_changed != 0;
        EventInfo {
            new_discrete_states_needed: (found.iteration_converged == 0).into(),
            terminate_simulation: (found.terminate_simulation != 0).into(),
            nominals_of_continuous_states_changed: others.into(),
            values_of_continuous_states_changed: (others || found.state_values_changed != 0).into(),
            next_event_time_defined: (found.upcoming_time_event != 0).into(),
            next_event_time: found.next_event_time,
        }
    }
}

impl Fmi1Instance {
    /// Makes a call of co-simulation.
    #[inline]
    fn call_slave(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(&Fmi1SlaveFunctions, InstancePointer) -> FmiStatus,
    ) -> FmiStatus {
        let Fmi1Interface::Slave(own) = &self.library.interface else { return ERROR };
        self.monitor.begin_call(call);
        body(own, self.component)
    }

    /// Makes a call of model exchange.
    #[inline]
    fn call_model(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(&Fmi1ModelFunctions, InstancePointer) -> FmiStatus,
    ) -> FmiStatus {
        let Fmi1Interface::Model(own) = &self.library.interface else { return ERROR };
        self.monitor.begin_call(call);
        body(own, self.component)
    }
}

/// Defines functions with the instance of FMI 1.0 in place of the pointer to it.
macro_rules! adapt {
    ($(fn $name:ident($it:ident $(, $argument:ident: $type:ty)*) $body:block)*) => {
        $(
            unsafe extern "C" fn $name(c: InstancePointer $(, $argument: $type)*) -> FmiStatus {
                // SAFETY: the caller hands over an instance that is alive, and arrays of the length that is stated.
                unsafe {
                    let $it = Fmi1Instance::borrow_from(c);
                    $body
                }
            }
        )*
    };
}

adapt! {
    fn do_nothing(_it) { OK }

    fn terminate(it) {
        match it.library.interface {
            Fmi1Interface::Slave(_) => it.call_slave(c"fmiTerminateSlave", |own, c| (own.terminate)(c)),
            Fmi1Interface::Model(_) => it.call_model(c"fmiTerminate", |own, c| (own.terminate)(c)),
        }
    }

    fn reset(it) {
        it.last_step = None;
        it.call_slave(c"fmiResetSlave", |own, c| (own.reset)(c))
    }

    fn set_debug_logging(it, on: c_int, _count: usize, _categories: *const *const c_char) {
        it.monitor.begin_call(c"fmiSetDebugLogging");
        (it.library.common.set_debug_logging)(it.component, u8::from(on != 0))
    }

    fn setup_experiment(it, controlled: c_int, tolerance: f64, start: f64, stops: c_int, stop: f64) {
        it.experiment = ExperimentSetup {
            start,
            stop: (stops != 0).then_some(stop),
            tolerance: (controlled != 0).then_some(tolerance),
        };
        match it.library.interface {
            Fmi1Interface::Slave(_) => OK,
            Fmi1Interface::Model(_) => it.call_model(c"fmiSetTime", |own, c| (own.set_time)(c, start)),
        }
    }

    fn enter_initialization_mode(it) {
        let ExperimentSetup { start, stop, tolerance } = it.experiment;
        if let Fmi1Interface::Slave(_) = it.library.interface {
            let (stops, stop) = (u8::from(stop.is_some()), stop.unwrap_or(0.0));
            return it.call_slave(c"fmiInitializeSlave", |own, c| (own.initialize)(c, start, stops, stop));
        }
        let (controlled, tolerance) = (u8::from(tolerance.is_some()), tolerance.unwrap_or(0.0));
        let mut info = GuardedValue::new(NO_EVENT);
        let status = it.call_model(c"fmiInitialize", |own, c| {
            (own.initialize)(c, controlled, tolerance, info.value_pointer())
        });
        it.first_event = Some(info.get());
        status
    }

    fn set_input_derivatives(it, references: *const u32, count: usize, orders: *const c_int, values: *const f64) {
        let Fmi1Interface::Slave(own) = it.library.interface else { return ERROR };
        it.monitor.begin_call(c"fmiSetRealInputDerivatives");
        it.set_derivatives(own.set_input_derivatives, References { first: references, count }, orders, values)
    }

    fn get_output_derivatives(it, references: *const u32, count: usize, orders: *const c_int, values: *mut f64) {
        let Fmi1Interface::Slave(own) = it.library.interface else { return ERROR };
        it.monitor.begin_call(c"fmiGetRealOutputDerivatives");
        it.get_derivatives(own.get_output_derivatives, References { first: references, count }, orders, values)
    }

    fn do_step(it, time: f64, step: f64, _no_way_back: c_int) {
        // A step from where the last one began repeats it with another length.
        let is_new = u8::from(it.last_step.replace(time) != Some(time));
        let mut status = it.call_slave(c"fmiDoStep", |own, c| (own.do_step)(c, time, step, is_new));
        while status == PENDING {
            std::thread::sleep(PAUSE);
            // The watchdog goes on to see the step.
            let Fmi1Interface::Slave(own) = &it.library.interface else { return ERROR };
            let mut found = GuardedValue::new(PENDING);
            let asked = (own.get_status)(it.component, DO_STEP_STATUS, found.value_pointer());
            status = if is_success(asked) { found.get() } else { asked.max(DISCARD) };
        }
        status
    }

    fn cancel_step(it) {
        it.call_slave(c"fmiCancelStep", |own, c| (own.cancel_step)(c))
    }

    fn get_status(it, kind: c_int, value: *mut c_int) {
        it.call_slave(c"fmiGetStatus", |own, c| (own.get_status)(c, kind, value))
    }

    fn get_real_status(it, kind: c_int, value: *mut f64) {
        it.call_slave(c"fmiGetRealStatus", |own, c| (own.get_real_status)(c, kind, value))
    }

    // FMI 1.0 has no status that says whether the simulation ended.
    fn get_boolean_status(_it, _kind: c_int, value: *mut c_int) {
        value.write(0);
        OK
    }

    fn set_time(it, time: f64) {
        it.call_model(c"fmiSetTime", |own, c| (own.set_time)(c, time))
    }

    fn set_states(it, states: *const f64, count: usize) {
        it.call_model(c"fmiSetContinuousStates", |own, c| (own.set_states)(c, states, count))
    }

    fn get_states(it, states: *mut f64, count: usize) {
        it.call_model(c"fmiGetContinuousStates", |own, c| (own.get_states)(c, states, count))
    }

    fn get_derivatives(it, derivatives: *mut f64, count: usize) {
        it.call_model(c"fmiGetDerivatives", |own, c| (own.get_derivatives)(c, derivatives, count))
    }

    fn get_event_indicators(it, indicators: *mut f64, count: usize) {
        it.call_model(c"fmiGetEventIndicators", |own, c| (own.get_event_indicators)(c, indicators, count))
    }

    fn get_nominals(it, nominals: *mut f64, count: usize) {
        it.call_model(c"fmiGetNominalContinuousStates", |own, c| (own.get_nominals)(c, nominals, count))
    }

    // The structure of FMI 2.0 is larger than that of FMI 1.0, which the library writes in its place first.
    fn new_discrete_states(it, info: *mut EventInfo) {
        if let Some(first) = it.first_event.take() {
            info.write(first.into());
            return OK;
        }
        let found = info.cast::<EventInfo1>();
        found.write(NO_EVENT);
        let until_converged = 0;
        let status = it.call_model(c"fmiEventUpdate", |own, c| (own.event_update)(c, until_converged, found));
        let found = found.read();
        info.write(found.into());
        status
    }

    // The library writes one character where the caller has room for an integer.
    fn completed_integrator_step(it, _no_way_back: c_int, event: *mut c_int, end: *mut c_int) {
        event.write(0);
        end.write(0);
        it.call_model(c"fmiCompletedIntegratorStep", |own, c| {
            (own.completed_integrator_step)(c, event.cast())
        })
    }
}

unsafe extern "C" fn free_instance(c: InstancePointer) {
    // SAFETY: the caller hands over an instance that is not used again; it comes from a box.
    unsafe {
        let it = Box::from_raw(c.cast::<Fmi1Instance>());
        match it.library.interface {
            Fmi1Interface::Slave(own) => {
                it.monitor.begin_call(c"fmiFreeSlaveInstance");
                (own.free_instance)(it.component);
            }
            Fmi1Interface::Model(own) => {
                it.monitor.begin_call(c"fmiFreeModelInstance");
                (own.free_instance)(it.component);
            }
        }
        components().remove(&it.component.addr());
    }
}

/// Instances are made by [`Fmi1Library::instantiate`](super::Fmi1Library::instantiate), which knows the functions of the library.
unsafe extern "C" fn instantiate(
    _name: *const c_char,
    _kind: c_int,
    _guid: *const c_char,
    _resources: *const c_char,
    _callbacks: *const CallbackFunctions,
    _visible: c_int,
    _logging: c_int,
) -> InstancePointer {
    ptr::null_mut()
}

unsafe extern "C" fn no_text() -> *const c_char {
    ptr::null()
}
