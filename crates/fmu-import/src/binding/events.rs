//! Leads an instance of FMI 3.0 through event mode (FMI 3.0, section 4.2).

use super::functions::Events;
use super::Instance;
use crate::{CallError, Updated};

impl Instance {
    /// Whether it was made with event mode. It is in event mode after its initialisation.
    #[must_use]
    pub fn has_events(&self) -> bool {
        self.events
    }

    fn event_functions(&self, call: &'static str) -> Result<Events, CallError> {
        let functions = self.library.events.filter(|_| self.events);
        functions.ok_or_else(|| CallError::new(call, "is not called: event mode is not used"))
    }

    /// `fmi3EnterEventMode`, after a step.
    ///
    /// # Errors
    /// See [`Instance`]; also without events.
    pub fn enter_event_mode(&mut self) -> Result<(), CallError> {
        let function = self.event_functions("fmi3EnterEventMode")?.enter_event_mode;
        self.call(c"fmi3EnterEventMode", function)
    }

    /// `fmi3EnterStepMode`, after the event.
    ///
    /// # Errors
    /// See [`Instance`]; also without events.
    pub fn enter_step_mode(&mut self) -> Result<(), CallError> {
        let function = self.event_functions("fmi3EnterStepMode")?.enter_step_mode;
        self.call(c"fmi3EnterStepMode", function)
    }

    /// `fmi3UpdateDiscreteStates` at a time [s].
    ///
    /// # Errors
    /// See [`Instance`]; also without events, and when the FMU ends the simulation.
    pub fn update_discrete_states(&mut self, time: f64) -> Result<Updated, CallError> {
        let call = "fmi3UpdateDiscreteStates";
        let function = self.event_functions(call)?.update_discrete_states;
        let (mut again, mut terminate, mut nominals, mut values, mut known) = (0, 0, 0, 0, 0);
        let mut next = f64::NAN;
        // SAFETY: the component is alive, and each of the six values is written at most.
        self.run(c"fmi3UpdateDiscreteStates", |component| unsafe {
            function(
                component,
                &raw mut again,
                &raw mut terminate,
                &raw mut nominals,
                &raw mut values,
                &raw mut known,
                &raw mut next,
            )
        })?;
        if terminate != 0 {
            let what = "asks for the end".to_owned();
            return Err(CallError { call, what, terminated: Some(time) });
        }
        let next = Some(next).filter(|next| known != 0 && next.is_finite());
        Ok(Updated { again: again != 0, next })
    }
}
