//! Runs one instance of an FMU: the calls of a simulation.

use std::ffi::{CStr, CString, c_int};
use std::ptr;
use std::sync::{Arc, PoisonError};

use super::activity::Activity;
use super::{
    Call, CallbackFunctions, Component, LAST_SUCCESSFUL_TIME, Library, Mailbox, OK, Status,
    TERMINATED, calloc, free, trackside_logger,
};
use crate::{CallError, Message};

const WARNING: Status = 1;
const DISCARD: Status = 2;
const FATAL: Status = 4;
const CO_SIMULATION: c_int = 1;

/// An instance of an FMU.
#[derive(Debug)]
pub struct Instance {
    pub(super) component: Component,
    /// After `fmi2Fatal` nothing may be called any more, not even to free the instance.
    fatal: bool,
    mailbox: Box<Mailbox>,
    activity: Arc<Activity>,
    _callbacks: Box<CallbackFunctionsHolder>,
    pub(super) library: Arc<Library>,
}

/// Keeps the callbacks at their address.
struct CallbackFunctionsHolder(CallbackFunctions);

impl std::fmt::Debug for CallbackFunctionsHolder {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "CallbackFunctions({:?})", self.0.environment)
    }
}

impl Instance {
    /// Makes an instance called `name`, which logs all it has to say when `logging` is set.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn new(library: Arc<Library>, name: &str, logging: bool) -> Result<Self, CallError> {
        let guid = library.fmu.description.guid.clone();
        Self::with_guid(library, name, &guid, logging).map_err(|(error, _)| error)
    }

    /// Makes an instance with this GUID; a refusal comes with what was logged.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn with_guid(
        library: Arc<Library>,
        name: &str,
        guid: &str,
        logging: bool,
    ) -> Result<Self, (CallError, Vec<Message>)> {
        let mailbox = Box::new(Mailbox::default());
        let callbacks = Box::new(CallbackFunctionsHolder(CallbackFunctions {
            logger: trackside_logger,
            allocate_memory: calloc,
            free_memory: free,
            step_finished: None,
            environment: ptr::from_ref(&*mailbox).cast_mut().cast(),
        }));
        let text = |text: &str| CString::new(text).unwrap_or_default();
        let (name, guid, resources) = (text(name), text(guid), text(&library.fmu.resources()));
        let activity = Activity::new(name.clone());
        // SAFETY: the arguments are what FMI 2.0 asks for; callbacks and mailbox outlive the instance.
        let instantiate = || unsafe {
            (library.instantiate)(
                name.as_ptr(),
                CO_SIMULATION,
                guid.as_ptr(),
                resources.as_ptr(),
                &raw const callbacks.0,
                0,
                logging.into(),
            )
        };
        let component = activity.during(c"fmi2Instantiate", instantiate);
        let instance =
            Instance { component, fatal: false, mailbox, activity, _callbacks: callbacks, library };
        if component.is_null() {
            let messages = instance.messages();
            let what = "returned no instance".to_owned() + &said(messages.last());
            let error = CallError { call: "fmi2Instantiate", what, terminated: None };
            return Err((error, messages));
        }
        Ok(instance)
    }

    /// Takes the messages that were logged since the last time.
    pub fn messages(&self) -> Vec<Message> {
        std::mem::take(&mut self.mailbox.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn failure(&self, call: &'static str, what: String) -> CallError {
        let mailbox = self.mailbox.lock().unwrap_or_else(PoisonError::into_inner);
        CallError { call, what: what + &said(mailbox.last()), terminated: None }
    }

    /// Whether the instance returned `fmi2Fatal`, after which it must not be called.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.fatal
    }

    /// Calls a function that takes the component, and judges its status.
    pub(super) fn run(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(Component) -> Status,
    ) -> Result<(), CallError> {
        let status = self.activity.during(call, || body(self.component));
        self.check(call, status)
    }

    fn check(&mut self, call: &'static CStr, status: Status) -> Result<(), CallError> {
        let name = match status {
            OK | WARNING => return Ok(()),
            DISCARD => "fmi2Discard".to_owned(),
            3 => "fmi2Error".to_owned(),
            FATAL => "fmi2Fatal".to_owned(),
            5 => "fmi2Pending, which is only for FMUs that run asynchronously".to_owned(),
            other => format!("{other}, which is no status"),
        };
        self.fatal |= status == FATAL;
        Err(self.failure(call.to_str().unwrap_or_default(), format!("returned {name}")))
    }

    /// `fmi2SetupExperiment` without tolerance.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn setup_experiment(&mut self, start: f64, stop: f64) -> Result<(), CallError> {
        let function = self.library.setup_experiment;
        self.activity.at(start);
        // SAFETY: the component is alive, and nobody else calls it.
        self.run(c"fmi2SetupExperiment", |c| unsafe { function(c, 0, 0.0, start, 1, stop) })
    }

    /// `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn enter_initialization(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2EnterInitializationMode", self.library.enter_initialization_mode)
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2ExitInitializationMode", self.library.exit_initialization_mode)
    }

    /// `fmi2Terminate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn terminate(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2Terminate", self.library.terminate)
    }

    pub(super) fn call(&mut self, name: &'static CStr, function: Call) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody else calls it.
        self.run(name, |component| unsafe { function(component) })
    }

    /// `fmi2DoStep` from `time` to `time + step` [s].
    ///
    /// # Errors
    /// When the FMU does not come to the end of the step.
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<(), CallError> {
        self.activity.at(time);
        let function = self.library.do_step;
        // SAFETY: the component is alive, and nobody else calls it.
        let step_it = || unsafe { function(self.component, time, step, 1) };
        let status = self.activity.during(c"fmi2DoStep", step_it);
        if status != DISCARD {
            self.check(c"fmi2DoStep", status)?;
            self.activity.at(time + step);
            return Ok(());
        }
        let mut error = self.failure("fmi2DoStep", "returned fmi2Discard".to_owned());
        let (mut ended, mut reached) = (0, time);
        // SAFETY: both functions may be called after a discarded step, and write one value.
        unsafe {
            if (self.library.get_boolean_status)(self.component, TERMINATED, &raw mut ended) == OK
                && ended != 0
            {
                (self.library.get_real_status)(
                    self.component,
                    LAST_SUCCESSFUL_TIME,
                    &raw mut reached,
                );
                error.terminated = Some(reached);
            }
        }
        Err(error)
    }
}

fn said(message: Option<&Message>) -> String {
    message.map(|message| format!("; it says: {}", message.text)).unwrap_or_default()
}

impl Drop for Instance {
    fn drop(&mut self) {
        if !self.component.is_null() && !self.fatal {
            // SAFETY: the component is alive and not used again.
            let free = || unsafe { (self.library.free_instance)(self.component) };
            self.activity.during(c"fmi2FreeInstance", free);
        }
    }
}
