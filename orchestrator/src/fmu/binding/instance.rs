//! Runs one instance of an FMU: the calls of a simulation.

use std::ffi::{CStr, CString, c_char, c_int};
use std::ptr;
use std::sync::{Arc, PoisonError};

use super::{
    Call, CallbackFunctions, Component, Get, LAST_SUCCESSFUL_TIME, Library, Mailbox, OK, Set,
    Status, TERMINATED, calloc, free, trackside_logger,
};
use crate::node::{CallError, Message};

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
        // SAFETY: the arguments are what FMI 2.0 asks for; callbacks and mailbox outlive the instance.
        let component = unsafe {
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
        let instance =
            Instance { component, fatal: false, mailbox, _callbacks: callbacks, library };
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

    pub(super) fn check(&mut self, call: &'static str, status: Status) -> Result<(), CallError> {
        let name = match status {
            OK | WARNING => return Ok(()),
            DISCARD => "fmi2Discard".to_owned(),
            3 => "fmi2Error".to_owned(),
            FATAL => "fmi2Fatal".to_owned(),
            5 => "fmi2Pending, which is only for FMUs that run asynchronously".to_owned(),
            other => format!("{other}, which is no status"),
        };
        self.fatal |= status == FATAL;
        Err(self.failure(call, format!("returned {name}")))
    }

    /// `fmi2SetupExperiment` without tolerance.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn setup_experiment(&mut self, start: f64, stop: f64) -> Result<(), CallError> {
        let function = self.library.setup_experiment;
        // SAFETY: the component is alive, and nobody else calls it.
        let status = unsafe { function(self.component, 0, 0.0, start, 1, stop) };
        self.check("fmi2SetupExperiment", status)
    }

    /// `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn enter_initialization(&mut self) -> Result<(), CallError> {
        self.call("fmi2EnterInitializationMode", self.library.enter_initialization_mode)
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.call("fmi2ExitInitializationMode", self.library.exit_initialization_mode)
    }

    /// `fmi2Terminate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn terminate(&mut self) -> Result<(), CallError> {
        self.call("fmi2Terminate", self.library.terminate)
    }

    pub(super) fn call(&mut self, name: &'static str, function: Call) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody else calls it.
        let status = unsafe { function(self.component) };
        self.check(name, status)
    }

    /// `fmi2DoStep` from `time` to `time + step` [s].
    ///
    /// # Errors
    /// When the FMU does not come to the end of the step.
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody else calls it.
        let status = unsafe { (self.library.do_step)(self.component, time, step, 1) };
        if status != DISCARD {
            return self.check("fmi2DoStep", status);
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

    fn get<T>(
        &mut self,
        name: &'static str,
        function: Get<T>,
        references: &[u32],
        values: &mut [T],
    ) -> Result<(), CallError> {
        assert_eq!(references.len(), values.len(), "one value for each reference");
        if references.is_empty() {
            return Ok(());
        }
        // SAFETY: the component is alive, and the arrays have the length that is stated.
        let status = unsafe {
            function(self.component, references.as_ptr(), references.len(), values.as_mut_ptr())
        };
        self.check(name, status)
    }

    fn set<T>(
        &mut self,
        name: &'static str,
        function: Set<T>,
        references: &[u32],
        values: &[T],
    ) -> Result<(), CallError> {
        assert_eq!(references.len(), values.len(), "one value for each reference");
        if references.is_empty() {
            return Ok(());
        }
        // SAFETY: the component is alive, and the arrays have the length that is stated.
        let status = unsafe {
            function(self.component, references.as_ptr(), references.len(), values.as_ptr())
        };
        self.check(name, status)
    }

    /// `fmi2GetReal`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), CallError> {
        self.get("fmi2GetReal", self.library.get_real, references, values)
    }

    /// `fmi2GetInteger`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), CallError> {
        self.get("fmi2GetInteger", self.library.get_integer, references, values)
    }

    /// `fmi2GetBoolean`; any number but 0 is true.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), CallError> {
        self.get("fmi2GetBoolean", self.library.get_boolean, references, values)
    }

    /// `fmi2GetString` for one variable.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn get_string(&mut self, reference: u32) -> Result<String, CallError> {
        let mut text: [*const c_char; 1] = [ptr::null()];
        self.get("fmi2GetString", self.library.get_string, &[reference], &mut text)?;
        match text[0].is_null() {
            true => Ok(String::new()),
            // SAFETY: the FMU keeps the C string until it is called again.
            false => Ok(unsafe { CStr::from_ptr(text[0]) }.to_string_lossy().into_owned()),
        }
    }

    /// `fmi2SetReal`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), CallError> {
        self.set("fmi2SetReal", self.library.set_real, references, values)
    }

    /// `fmi2SetInteger`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), CallError> {
        self.set("fmi2SetInteger", self.library.set_integer, references, values)
    }

    /// `fmi2SetBoolean`, with 0 and 1.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Result<(), CallError> {
        self.set("fmi2SetBoolean", self.library.set_boolean, references, values)
    }

    /// `fmi2SetString` for one variable.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_string(&mut self, reference: u32, value: &str) -> Result<(), CallError> {
        let value = CString::new(value).unwrap_or_default();
        self.set("fmi2SetString", self.library.set_string, &[reference], &[value.as_ptr()])
    }
}

fn said(message: Option<&Message>) -> String {
    message.map(|message| format!("; it says: {}", message.text)).unwrap_or_default()
}

impl Drop for Instance {
    fn drop(&mut self) {
        if !self.component.is_null() && !self.fatal {
            // SAFETY: the component is alive and not used again.
            unsafe { (self.library.free_instance)(self.component) }
        }
    }
}
