//! Makes the calls of event mode and of clocks (FMI 3.0, section 4.2).

use std::slice;
use std::sync::Arc;

use super::functions::{ClockFunctions, EventFunctions, InterfaceFunctions};
use super::guarded_buffer::GuardedValue;
use super::instantiation::InstantiationModes;
use super::phase::InstancePhase;
use super::{FmuLibrary, Instance};
use crate::{CallError, DiscreteStatesUpdate, FmiVersion, IntervalQualifier};

/// The end of a simulation at a time [s] that the FMU wants.
pub(super) fn end_request(call: &'static str, time: f64) -> CallError {
    CallError { terminated: Some(time), ..CallError::new(call, "asks for the end") }
}

impl Instance {
    /// Makes an instance that uses event mode, whether the FMU has it or not, and ends no step early: for those who look whether
    /// an FMU without event mode refuses.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn with_event_mode(library: Arc<FmuLibrary>, name: &str) -> Result<Self, CallError> {
        let guid = library.description().guid.clone();
        Self::instantiate(
            library,
            name,
            &guid,
            false,
            InstantiationModes { event_mode: true, early_return: false },
        )
        .map_err(|(error, _)| error)
    }

    /// Whether it was made with event mode. It is in event mode after its initialisation.
    #[must_use]
    pub fn uses_event_mode(&self) -> bool {
        self.events
    }

    fn event_functions(&self, call: &'static str) -> Result<EventFunctions, CallError> {
        self.library.events.ok_or_else(|| self.missing_functions_error(call, "event mode"))
    }

    fn clock_functions(&self, call: &'static str) -> Result<ClockFunctions, CallError> {
        self.library.clocks.ok_or_else(|| self.missing_functions_error(call, "clocks"))
    }

    fn missing_functions_error(&self, call: &'static str, what: &str) -> CallError {
        let why = match self.description().version {
            version @ (FmiVersion::One | FmiVersion::Two) => {
                format!("is not called: the FMU is one of FMI {version}")
            }
            FmiVersion::Three => format!("is not called: the library lacks functions of {what}"),
        };
        CallError::new(call, why)
    }

    /// `fmi3EnterEventMode` or `fmi2EnterEventMode`, after a step.
    ///
    /// # Errors
    /// See [`Instance`]; also for co-simulation of FMI 2.0, and when the library lacks functions of event mode.
    pub fn enter_event_mode(&mut self) -> Result<(), CallError> {
        let (call, function) = match &self.library.interface {
            InterfaceFunctions::ModelExchange2(own) => (c"fmi2EnterEventMode", own.enter_event_mode),
            InterfaceFunctions::ModelExchange3(own) => (c"fmi3EnterEventMode", own.enter_event_mode),
            _ => (c"fmi3EnterEventMode", self.event_functions("fmi3EnterEventMode")?.enter_event_mode),
        };
        self.call_without_arguments(call, function)?;
        self.phase = InstancePhase::Event;
        Ok(())
    }

    /// `fmi3EnterStepMode`, after the event.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks functions of event mode.
    pub fn enter_step_mode(&mut self) -> Result<(), CallError> {
        let function = self.event_functions("fmi3EnterStepMode")?.enter_step_mode;
        self.call_without_arguments(c"fmi3EnterStepMode", function)?;
        self.phase = InstancePhase::Step;
        Ok(())
    }

    /// `fmi3UpdateDiscreteStates` or `fmi2NewDiscreteStates` at a time [s].
    ///
    /// # Errors
    /// See [`Instance`]; also for co-simulation of FMI 2.0, when the library lacks functions of event mode, and when the FMU ends the simulation.
    pub fn update_discrete_states(&mut self, time: f64) -> Result<DiscreteStatesUpdate, CallError> {
        let call = "fmi3UpdateDiscreteStates";
        let function = match &self.library.interface {
            InterfaceFunctions::ModelExchange2(_) => return self.new_discrete_states(time),
            InterfaceFunctions::ModelExchange3(own) => own.update_discrete_states,
            _ => self.event_functions(call)?.update_discrete_states,
        };
        let [mut again, mut terminate, mut nominals, mut values, mut known] =
            [0; 5].map(GuardedValue::<u8>::new);
        let mut next = GuardedValue::new(f64::NAN);
        // SAFETY: the component is alive, and there is room behind each of the six values.
        self.run_checked(c"fmi3UpdateDiscreteStates", |component| unsafe {
            function(
                component,
                again.value_pointer(),
                terminate.value_pointer(),
                nominals.value_pointer(),
                values.value_pointer(),
                known.value_pointer(),
                next.value_pointer(),
            )
        })?;
        let all = [&again, &terminate, &nominals, &values, &known];
        if !all.iter().all(|it| it.is_intact()) || !next.is_intact() {
            return Err(self.overrun_error(c"fmi3UpdateDiscreteStates", 1));
        }
        if terminate.get() != 0 {
            return Err(end_request(call, time));
        }
        let next = Some(next.get()).filter(|next| known.get() != 0 && next.is_finite());
        Ok(DiscreteStatesUpdate {
            discrete_states_need_update: again.get() != 0,
            nominals_changed: nominals.get() != 0,
            states_changed: values.get() != 0,
            next_event_time: next,
        })
    }

    /// `fmi3SetClock`: these clocks tick now, in event mode.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks functions of clocks.
    pub fn activate_clocks(&mut self, references: &[u32]) -> Result<(), CallError> {
        if references.is_empty() {
            return Ok(());
        }
        let function = self.clock_functions("fmi3SetClock")?.set_clock;
        let values = vec![1_u8; references.len()];
        // SAFETY: the component is alive, and both arrays have the length that is stated.
        self.run_checked(c"fmi3SetClock", |c| unsafe {
            function(c, references.as_ptr(), references.len(), values.as_ptr())
        })
    }

    /// Those of these clocks that tick now: `fmi3GetClock`, in event mode.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks functions of clocks.
    pub fn active_clocks(&mut self, references: &[u32]) -> Result<Vec<u32>, CallError> {
        if references.is_empty() {
            return Ok(Vec::new());
        }
        let function = self.clock_functions("fmi3GetClock")?.get_clock;
        let mut values = vec![0_u8; references.len()];
        // SAFETY: the component is alive, and both arrays have the length that is stated.
        self.fill_array(c"fmi3GetClock", &mut values, |c, values| unsafe {
            function(c, references.as_ptr(), references.len(), values)
        })?;
        let active = references.iter().zip(values).filter(|(_, value)| *value != 0);
        Ok(active.map(|(reference, _)| *reference).collect())
    }

    /// `fmi3GetIntervalDecimal` of one clock: the time between two ticks [s], and whether that changed.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks functions of clocks.
    pub fn clock_interval(&mut self, reference: u32) -> Result<(f64, IntervalQualifier), CallError> {
        let function = self.clock_functions("fmi3GetIntervalDecimal")?.get_interval;
        let (mut seconds, mut change) = (f64::NAN, 0);
        // SAFETY: the component is alive, and each array has one element.
        let (to, qualifier) = (slice::from_mut(&mut seconds), slice::from_mut(&mut change));
        self.fill_two_arrays(c"fmi3GetIntervalDecimal", to, qualifier, |c, seconds, change| unsafe {
            function(c, &raw const reference, 1, seconds, change)
        })?;
        let change = match change {
            0 => IntervalQualifier::Unknown,
            1 => IntervalQualifier::Same,
            _ => IntervalQualifier::Changed,
        };
        Ok((seconds, change))
    }

    /// `fmi3GetShiftDecimal` of one clock: the time before its first tick [s].
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks functions of clocks.
    pub fn clock_shift(&mut self, reference: u32) -> Result<f64, CallError> {
        let function = self.clock_functions("fmi3GetShiftDecimal")?.get_shift;
        let mut seconds = 0.0;
        // SAFETY: the component is alive, and each array has one element.
        let found = slice::from_mut(&mut seconds);
        self.fill_array(c"fmi3GetShiftDecimal", found, |c, seconds| unsafe {
            function(c, &raw const reference, 1, seconds)
        })?;
        Ok(seconds)
    }
}
