//! Makes `doStep` calls, and interprets early returns and discarded steps.

use super::functions::InterfaceFunctions;
use super::guarded_buffer::GuardedValue;
use super::instance::call_name;
use super::library::NO_CO_SIMULATION;
use super::{DISCARD, FmiStatus, Instance, InstancePointer, OK, WARNING};
use crate::{CallError, StepResult, StepStatus};

type DoStep3 =
    unsafe extern "C" fn(InstancePointer, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> FmiStatus;

/// Functions that step.
impl Instance {
    /// Steps from `time` to `time + step` [s].
    ///
    /// # Errors
    /// See [`Instance`]; a step that ends early is none.
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<StepStatus, CallError> {
        self.do_step_with_result(time, step).map(|(status, _)| status)
    }

    /// Steps from `time` to `time + step` [s], or up to an event on the way. After an event, an instance with events goes into event
    /// mode before it is stepped again.
    ///
    /// # Errors
    /// See [`Instance`]; also when the FMU cannot do a step of this length, or ends the simulation.
    pub fn advance(&mut self, time: f64, step: f64) -> Result<StepResult, CallError> {
        let version = self.description().version;
        let (status, advance) = self.do_step_with_result(time, step)?;
        status.into_result(version)?;
        Ok(advance)
    }

    fn do_step_with_result(&mut self, time: f64, step: f64) -> Result<(StepStatus, StepResult), CallError> {
        self.free_dropped_states()?;
        self.activity.set_time(time);
        let no_way_back = !(self.keeps_history || self.saved && self.states.has_live_states());
        match &self.library.interface {
            InterfaceFunctions::CoSimulation2(own) => {
                let function = own.do_step;
                // SAFETY: the component is alive, and nobody else calls it.
                let status = self.run_for_status(c"fmi2DoStep", |component| unsafe {
                    function(component, time, step, no_way_back.into())
                })?;
                let whole = StepResult { reached: time + step, event: false };
                self.step_status_fmi2(status, time, step).map(|status| (status, whole))
            }
            InterfaceFunctions::CoSimulation3(own) => {
                let function = own.do_step;
                self.do_step_fmi3(function, time, step, no_way_back)
            }
            InterfaceFunctions::ModelExchange2(_) | InterfaceFunctions::ModelExchange3(_) => {
                Err(CallError::new(super::named!(self.library, "fmi2DoStep", "fmi3DoStep"), NO_CO_SIMULATION))
            }
        }
    }

    /// Steps as [`do_step`](Self::do_step), for those who cannot repeat a step with another length: an early end is an error.
    ///
    /// # Errors
    /// See [`Instance`]; also when the step ends early.
    pub fn step(&mut self, time: f64, step: f64) -> Result<(), CallError> {
        let version = self.description().version;
        self.do_step(time, step)?.into_result(version)
    }

    /// What the status of `fmi2DoStep` says.
    #[inline(never)]
    pub(super) fn step_status_fmi2(
        &mut self,
        status: FmiStatus,
        time: f64,
        step: f64,
    ) -> Result<StepStatus, CallError> {
        match status {
            OK | WARNING => self.completed_step(time + step),
            DISCARD => self.discarded_step(time),
            _ => Err(self.status_error(c"fmi2DoStep", status)),
        }
    }

    fn completed_step(&self, time: f64) -> Result<StepStatus, CallError> {
        self.activity.set_time(time);
        Ok(StepStatus::Done)
    }

    fn do_step_fmi3(
        &mut self,
        function: DoStep3,
        time: f64,
        step: f64,
        no_way_back: bool,
    ) -> Result<(StepStatus, StepResult), CallError> {
        let call = c"fmi3DoStep";
        // NaN stands for an FMU that does not say how far it came.
        let [mut event, mut terminate, mut early] = [0; 3].map(GuardedValue::<u8>::new);
        let mut reached = GuardedValue::new(f64::NAN);
        // SAFETY: the component is alive, and there is room behind each of the four values.
        let status = self.run_for_status(call, |component| unsafe {
            function(
                component,
                time,
                step,
                no_way_back,
                event.value_pointer(),
                terminate.value_pointer(),
                early.value_pointer(),
                reached.value_pointer(),
            )
        })?;
        if ![&event, &terminate, &early].iter().all(|it| it.is_intact()) || !reached.is_intact() {
            return Err(self.overrun_error(call, 1));
        }
        let (event, terminate, early) = (event.get(), terminate.get(), early.get());
        let reached = reached.get();
        let said = || self.mailbox.last_message();
        let returned_early = early != 0 && self.may_return_early;
        let to = if returned_early && !reached.is_nan() { reached } else { time + step };
        let advance = StepResult { reached: to, event: event != 0 };
        let status = match status {
            OK | WARNING if terminate != 0 => {
                let reached = if reached.is_nan() { time + step } else { reached };
                Ok(StepStatus::Terminated { reached, what: "asks for the end".to_owned() + &said() })
            }
            OK | WARNING if early != 0 && !returned_early => {
                let what = "returned early, which it was not allowed to";
                Err(CallError::new(call_name(call), what.to_owned() + &said()))
            }
            OK | WARNING => self.completed_step(to),
            DISCARD => {
                let CallError { what, .. } = self.status_error(call, DISCARD);
                let reached = if reached.is_nan() { time } else { reached };
                Ok(StepStatus::Discarded { reached, what })
            }
            _ => Err(self.status_error(call, status)),
        };
        status.map(|status| (status, advance))
    }

    /// Why the step from `time` on was discarded. An FMU that says nothing about it is taken to stand where it stood.
    fn discarded_step(&mut self, time: f64) -> Result<StepStatus, CallError> {
        let CallError { what, .. } = self.status_error(c"fmi2DoStep", DISCARD);
        let ended = self.has_ended_simulation();
        let reached = self.last_successful_time();
        match (self.has_failed_fatally(), ended, reached) {
            (true, Err(error), _) | (true, _, Err(error)) => Err(error),
            (_, Ok(true), reached) => Ok(StepStatus::Terminated { reached: reached.unwrap_or(time), what }),
            (.., reached) => Ok(StepStatus::Discarded { reached: reached.unwrap_or(time), what }),
        }
    }
}
