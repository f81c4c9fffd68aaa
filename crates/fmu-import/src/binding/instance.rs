//! Runs one instance of an FMU: the calls of a simulation.

use std::ffi::{CStr, c_int};
use std::ptr::NonNull;
use std::sync::Arc;

use super::activity::Activity;
use super::mailbox::Mailbox;
use super::state::States;
use super::{
    Call, CallbackFunctions, Component, DISCARD, ERROR, FATAL, Library, OK, PENDING, Status,
    WARNING, c_text, calloc, free, trackside_logger,
};
use crate::{CallError, Description, Message, StepStatus};

const CO_SIMULATION: c_int = 1;

/// An instance of an FMU. Dropping it frees it, with the states that it saved.
///
/// # Errors
/// Each call fails when the FMU returns a status that is neither `fmi2OK` nor `fmi2Warning`; the error says what the FMU logged
/// last. After `fmi2Fatal` each call fails without being made, also of other instances of the FMU and not even to free them.
///
/// # Panics
/// Functions that take references and values panic unless there are as many of the one as of the other. Without references
/// nothing is called.
#[derive(Debug)]
pub struct Instance {
    component: Component,
    pub(super) states: Arc<States>,
    pub(super) keeps_history: bool,
    mailbox: Mailbox,
    activity: Arc<Activity>,
    _callbacks: Callbacks,
    pub(super) library: Arc<Library>,
}

/// The callbacks at an address that the FMU may keep as long as the instance lives.
struct Callbacks {
    address: NonNull<CallbackFunctions>,
    library: Arc<Library>,
}

impl Callbacks {
    fn new(library: Arc<Library>, mailbox: &Mailbox) -> Self {
        let functions = Box::new(CallbackFunctions {
            logger: trackside_logger,
            allocate_memory: calloc,
            free_memory: free,
            step_finished: None,
            environment: mailbox.environment(),
        });
        Callbacks { address: NonNull::from(Box::leak(functions)), library }
    }
}

impl std::fmt::Debug for Callbacks {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Callbacks({:?})", self.address)
    }
}

impl Drop for Callbacks {
    fn drop(&mut self) {
        // An instance that cannot be freed may go on using its callbacks.
        if !self.library.is_lost() {
            // SAFETY: the address comes from a box, and the instance that knew it has been freed.
            drop(unsafe { Box::from_raw(self.address.as_ptr()) });
        }
    }
}

impl Instance {
    /// Makes an instance called `name`, which logs all it has to say when `logging` is set.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn new(library: Arc<Library>, name: &str, logging: bool) -> Result<Self, CallError> {
        let guid = library.description().guid.clone();
        Self::with_guid(library, name, &guid, logging).map_err(|(error, _)| error)
    }

    /// Makes an instance with this GUID; an error comes with what was logged.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn with_guid(
        library: Arc<Library>,
        name: &str,
        guid: &str,
        logging: bool,
    ) -> Result<Self, (CallError, Vec<Message>)> {
        let text = |text| c_text("fmi2Instantiate", text).map_err(|error| (error, Vec::new()));
        let (name, guid, resources) = (text(name)?, text(guid)?, text(&library.fmu.resources())?);
        if library.is_lost() {
            return Err((lost(c"fmi2Instantiate"), Vec::new()));
        }
        let mailbox = Mailbox::new();
        let callbacks = Callbacks::new(Arc::clone(&library), &mailbox);
        let activity = Activity::new(name.clone());
        // SAFETY: the arguments are what FMI 2.0 asks for; the callbacks outlive the instance.
        let instantiate = || unsafe {
            (library.instantiate)(
                name.as_ptr(),
                CO_SIMULATION,
                guid.as_ptr(),
                resources.as_ptr(),
                callbacks.address.as_ptr(),
                0,
                logging.into(),
            )
        };
        let component = activity.during(c"fmi2Instantiate", || mailbox.during(instantiate));
        if component.is_null() {
            let what = format!("returned no instance{}", mailbox.said());
            return Err((CallError::new("fmi2Instantiate", what), mailbox.take()));
        }
        Ok(Instance {
            component,
            states: Arc::default(),
            keeps_history: false,
            mailbox,
            activity,
            _callbacks: callbacks,
            library,
        })
    }

    /// What the FMU says about itself.
    #[must_use]
    pub fn description(&self) -> &Description {
        self.library.description()
    }

    /// Takes the messages that were logged since the last time.
    pub fn messages(&self) -> Vec<Message> {
        self.mailbox.take()
    }

    /// Whether this or another instance of the FMU returned `fmi2Fatal`, after which none is called.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.library.is_lost()
    }

    /// Calls a function that takes the component, and judges its status.
    pub(super) fn run(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(Component) -> Status,
    ) -> Result<(), CallError> {
        match self.run_for_status(call, body)? {
            OK | WARNING => Ok(()),
            status => Err(self.failure(call, status)),
        }
    }

    /// Calls a function that takes the component, unless that is forbidden.
    fn run_for_status(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(Component) -> Status,
    ) -> Result<Status, CallError> {
        if self.is_lost() {
            return Err(lost(call));
        }
        let status = self.activity.during(call, || self.mailbox.during(|| body(self.component)));
        if status == FATAL {
            self.library.lose();
        }
        Ok(status)
    }

    fn failure(&self, call: &'static CStr, status: Status) -> CallError {
        CallError::new(name(call), format!("returned {}{}", meaning(status), self.mailbox.said()))
    }

    /// `fmi2SetupExperiment` over `start..stop` [s]; the FMU keeps its own tolerance [-] unless there is one.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn setup_experiment(
        &mut self,
        start: f64,
        stop: f64,
        tolerance: Option<f64>,
    ) -> Result<(), CallError> {
        let function = self.library.setup_experiment;
        let (defined, tolerance) = (tolerance.is_some().into(), tolerance.unwrap_or(0.0));
        self.activity.at(start);
        // SAFETY: the component is alive, and nobody else calls it.
        self.run(c"fmi2SetupExperiment", |c| unsafe {
            function(c, defined, tolerance, start, 1, stop)
        })
    }

    /// `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn enter_initialization(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2EnterInitializationMode", self.library.enter_initialization_mode)
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2ExitInitializationMode", self.library.exit_initialization_mode)
    }

    /// `fmi2Terminate`.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn terminate(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2Terminate", self.library.terminate)
    }

    pub(super) fn call(&mut self, name: &'static CStr, function: Call) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody else calls it.
        self.run(name, |component| unsafe { function(component) })
    }

    /// Steps from `time` to `time + step` [s].
    ///
    /// # Errors
    /// See [`Instance`]; a step that ends early is none.
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<StepStatus, CallError> {
        self.free_dropped_states()?;
        self.activity.at(time);
        let function = self.library.do_step;
        let no_way_back = c_int::from(!self.keeps_history && !self.states.any());
        // SAFETY: the component is alive, and nobody else calls it.
        let status = self.run_for_status(c"fmi2DoStep", |component| unsafe {
            function(component, time, step, no_way_back)
        })?;
        match status {
            OK | WARNING => {
                self.activity.at(time + step);
                Ok(StepStatus::Done)
            }
            DISCARD => self.early_end(time),
            _ => Err(self.failure(c"fmi2DoStep", status)),
        }
    }

    /// Why the step from `time` on was discarded. An FMU that says nothing about it is taken to stand where it stood.
    fn early_end(&mut self, time: f64) -> Result<StepStatus, CallError> {
        let CallError { what, .. } = self.failure(c"fmi2DoStep", DISCARD);
        let ended = self.ended();
        let reached = self.last_successful_time();
        match (self.is_lost(), ended, reached) {
            (true, Err(error), _) | (true, _, Err(error)) => Err(error),
            (_, Ok(true), reached) => {
                Ok(StepStatus::Terminated { reached: reached.unwrap_or(time), what })
            }
            (.., reached) => Ok(StepStatus::Discarded { reached: reached.unwrap_or(time), what }),
        }
    }
}

fn name(call: &'static CStr) -> &'static str {
    call.to_str().unwrap_or_default()
}

fn lost(call: &'static CStr) -> CallError {
    let what = "is not called: after fmi2Fatal no function of the FMU may be called";
    CallError::new(name(call), what)
}

fn meaning(status: Status) -> String {
    match status {
        DISCARD => "fmi2Discard".to_owned(),
        ERROR => "fmi2Error".to_owned(),
        FATAL => "fmi2Fatal".to_owned(),
        PENDING => "fmi2Pending, which is only for FMUs that run asynchronously".to_owned(),
        other => format!("{other}, which is no status"),
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.free_all_states();
        if !self.is_lost() {
            // SAFETY: the component is alive and not used again.
            let free = || unsafe { (self.library.free_instance)(self.component) };
            self.activity.during(c"fmi2FreeInstance", || self.mailbox.during(free));
        }
    }
}
