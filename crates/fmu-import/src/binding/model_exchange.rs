//! Makes the calls of model exchange (FMI 2.0, section 3.2; FMI 3.0, section 3.2).

use std::ffi::CStr;

use super::events::end_request;
use super::functions::{EventInfo, InterfaceFunctions};
use super::guarded_buffer::{AnyBitPattern, GuardedValue};
use super::instance::call_name;
use super::phase::InstancePhase;
use super::{DISCARD, FmiStatus, Instance, InstancePointer, OK, WARNING};
use crate::{CallError, CompletedStep, DiscreteStatesUpdate, RealInputs, StorageType};

impl AnyBitPattern for EventInfo {}

/// A function of model exchange by its name and address in the version of an instance.
macro_rules! function {
    ($instance:expr, $two:literal, $three:literal, $member:ident) => {
        match &$instance.library.interface {
            InterfaceFunctions::ModelExchange2(own) => Ok(($two, own.$member)),
            InterfaceFunctions::ModelExchange3(own) => Ok(($three, own.$member)),
            _ => Err(no_model_exchange(super::named!($instance.library, $two, $three))),
        }
    };
}

#[cold]
fn no_model_exchange(call: &'static CStr) -> CallError {
    CallError::new(call_name(call), "is not called: the FMU is used for co-simulation")
}

/// Functions of FMUs for model exchange.
///
/// # Errors
/// See [`Instance`]; also for co-simulation. An error that is [`discarded`](CallError::discarded) says that the FMU cannot be evaluated there.
impl Instance {
    /// The end of a call that the FMU may discard.
    fn check_evaluation(&self, call: &'static CStr, status: FmiStatus) -> Result<(), CallError> {
        match status {
            OK | WARNING => Ok(()),
            DISCARD => Err(CallError { discarded: true, ..self.status_error(call, status) }),
            _ => Err(self.status_error(call, status)),
        }
    }

    /// Calls a function that fills an array, and that the FMU may discard.
    fn fill_states(
        &mut self,
        call: &'static CStr,
        values: &mut [f64],
        function: unsafe extern "C" fn(InstancePointer, *mut f64, usize) -> FmiStatus,
    ) -> Result<(), CallError> {
        if values.is_empty() {
            return Ok(());
        }
        let (count, mut discarded) = (values.len(), false);
        // SAFETY: the component is alive, and the array has the length that is stated.
        let filled = self.fill_array(call, values, |component, values| unsafe {
            let status = function(component, values, count);
            discarded = status == DISCARD;
            status
        });
        filled.map_err(|error| CallError { discarded, ..error })
    }

    /// `fmi2SetTime`, `fmi3SetTime`: the time that the FMU is evaluated at from now on [s].
    pub fn set_time(&mut self, time: f64) -> Result<(), CallError> {
        let (call, function) = function!(self, c"fmi2SetTime", c"fmi3SetTime", set_time)?;
        self.activity.set_time(time);
        // SAFETY: the component is alive, and nobody else calls it.
        let status = self.run_for_status(call, |component| unsafe { function(component, time) })?;
        self.check_evaluation(call, status)
    }

    /// `fmi2SetContinuousStates`, `fmi3SetContinuousStates`. Nothing is called without states.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), CallError> {
        let (call, function) =
            function!(self, c"fmi2SetContinuousStates", c"fmi3SetContinuousStates", set_states)?;
        if states.is_empty() {
            return Ok(());
        }
        // SAFETY: the component is alive, and the array has the length that is stated.
        let status = self.run_for_status(call, |component| unsafe {
            function(component, states.as_ptr(), states.len())
        })?;
        self.check_evaluation(call, status)
    }

    /// `fmi2GetContinuousStates`, `fmi3GetContinuousStates`.
    pub fn get_continuous_states(&mut self, states: &mut [f64]) -> Result<(), CallError> {
        let (call, function) =
            function!(self, c"fmi2GetContinuousStates", c"fmi3GetContinuousStates", get_states)?;
        self.fill_states(call, states, function)
    }

    /// `fmi2GetNominalsOfContinuousStates`, `fmi3GetNominalsOfContinuousStates`.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), CallError> {
        let (call, function) = function!(
            self,
            c"fmi2GetNominalsOfContinuousStates",
            c"fmi3GetNominalsOfContinuousStates",
            get_nominals
        )?;
        self.fill_states(call, nominals, function)
    }

    /// `fmi2GetDerivatives`, `fmi3GetContinuousStateDerivatives`.
    pub fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), CallError> {
        let (call, function) =
            function!(self, c"fmi2GetDerivatives", c"fmi3GetContinuousStateDerivatives", get_derivatives)?;
        self.fill_states(call, derivatives, function)
    }

    /// `fmi2GetEventIndicators`, `fmi3GetEventIndicators`.
    pub fn get_event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), CallError> {
        let (call, function) =
            function!(self, c"fmi2GetEventIndicators", c"fmi3GetEventIndicators", get_event_indicators)?;
        self.fill_states(call, indicators, function)
    }

    /// Gives the FMU a time [s], real inputs and the continuous states: it is evaluated there from now on.
    pub fn set_point(&mut self, time: f64, inputs: RealInputs, states: &[f64]) -> Result<(), CallError> {
        self.set_time(time)?;
        self.set_continuous_states(states)?;
        self.set_numbers(StorageType::Float64, inputs.references, inputs.values)
    }

    /// `fmi2EnterContinuousTimeMode`, `fmi3EnterContinuousTimeMode`, after the event.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), CallError> {
        let (call, function) = function!(
            self,
            c"fmi2EnterContinuousTimeMode",
            c"fmi3EnterContinuousTimeMode",
            enter_continuous_time_mode
        )?;
        self.call_without_arguments(call, function)?;
        self.phase = InstancePhase::ContinuousTime;
        Ok(())
    }

    /// `fmi2CompletedIntegratorStep`, `fmi3CompletedIntegratorStep`: the solution goes on from the point that was set, at a time [s].
    /// Nothing is called where the FMU does not want to hear of it.
    ///
    /// # Errors
    /// See [`Instance`]; also for co-simulation, and when the FMU ends the simulation.
    pub fn completed_integrator_step(&mut self, time: f64) -> Result<CompletedStep, CallError> {
        self.free_dropped_states()?;
        if !self.description().equations.needs_completed_step {
            return Ok(CompletedStep { event: false });
        }
        let no_way_back = !(self.keeps_history || self.saved && self.states.has_live_states());
        let (call, event, end) = match &self.library.interface {
            InterfaceFunctions::ModelExchange2(own) => {
                let (call, function) = (c"fmi2CompletedIntegratorStep", own.completed_integrator_step);
                let [mut event, mut end] = [0; 2].map(GuardedValue::<i32>::new);
                // SAFETY: the component is alive, and there is room behind both values.
                self.run_checked(call, |c| unsafe {
                    function(c, no_way_back.into(), event.value_pointer(), end.value_pointer())
                })?;
                if !event.is_intact() || !end.is_intact() {
                    return Err(self.overrun_error(call, 1));
                }
                (call, event.get() != 0, end.get() != 0)
            }
            InterfaceFunctions::ModelExchange3(own) => {
                let (call, function) = (c"fmi3CompletedIntegratorStep", own.completed_integrator_step);
                let [mut event, mut end] = [0; 2].map(GuardedValue::<u8>::new);
                // SAFETY: as above.
                self.run_checked(call, |c| unsafe {
                    function(c, no_way_back, event.value_pointer(), end.value_pointer())
                })?;
                if !event.is_intact() || !end.is_intact() {
                    return Err(self.overrun_error(call, 1));
                }
                (call, event.get() != 0, end.get() != 0)
            }
            _ => return Err(no_model_exchange(c"fmi2CompletedIntegratorStep")),
        };
        match end {
            true => Err(end_request(call_name(self.library.own_call_name(call)), time)),
            false => Ok(CompletedStep { event }),
        }
    }

    /// `fmi2NewDiscreteStates` at a time [s].
    pub(super) fn new_discrete_states(&mut self, time: f64) -> Result<DiscreteStatesUpdate, CallError> {
        let call = c"fmi2NewDiscreteStates";
        let InterfaceFunctions::ModelExchange2(own) = &self.library.interface else {
            return Err(no_model_exchange(call));
        };
        let function = own.new_discrete_states;
        let mut info = GuardedValue::new(EventInfo {
            new_discrete_states_needed: 0,
            terminate_simulation: 0,
            nominals_of_continuous_states_changed: 0,
            values_of_continuous_states_changed: 0,
            next_event_time_defined: 0,
            next_event_time: f64::NAN,
        });
        // SAFETY: the component is alive, and there is room behind the value.
        self.run_checked(call, |component| unsafe { function(component, info.value_pointer()) })?;
        if !info.is_intact() {
            return Err(self.overrun_error(call, 1));
        }
        let info = info.get();
        if info.terminate_simulation != 0 {
            return Err(end_request(call_name(self.library.own_call_name(call)), time));
        }
        let next = Some(info.next_event_time);
        Ok(DiscreteStatesUpdate {
            discrete_states_need_update: info.new_discrete_states_needed != 0,
            nominals_changed: info.nominals_of_continuous_states_changed != 0,
            states_changed: info.values_of_continuous_states_changed != 0,
            next_event_time: next.filter(|next| info.next_event_time_defined != 0 && next.is_finite()),
        })
    }
}
