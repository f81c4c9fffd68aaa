//! Runs one instance of an FMU: the calls of a simulation.

use std::ffi::{CStr, c_int};
use std::ptr;
use std::sync::Arc;

use super::call_monitor::CallMonitor;
use super::functions::VersionFunctions;
use super::guarded_buffer::GuardedBuffer;
use super::instantiation::{self, Callbacks, Modes};
use super::mailbox::Mailbox;
use super::messages_while_freed;
use super::phase::Phase;
use super::process_state::{StepCounter, describe_changes};
use super::saved_states::FmuStates;
use super::{
    Call, Component, DISCARD, ERROR, FATAL, Library, OK, PENDING, Status, WARNING, c_text, named,
};
use crate::{CallError, Description, Message, Type};

/// What an instance is told of the simulation before it is initialised.
#[derive(Debug, Clone, Copy, Default)]
struct Experiment {
    start: f64,
    stop: Option<f64>,
    tolerance: Option<f64>,
}

/// An instance of an FMU. Dropping it frees it, with the states that it saved.
///
/// # Errors
/// Each call fails when the FMU returns a status that is neither OK nor a warning; the error says what the FMU logged
/// last. After the status fatal each call fails without being made, also of other instances of the FMU and not even to free them.
///
/// # Panics
/// Functions that take references and values panic unless there are as many of the one as of the other. Without references
/// nothing is called.
#[derive(Debug)]
pub struct Instance {
    component: Component,
    pub(super) states: Arc<FmuStates>,
    /// Whether a state was ever saved. Each step asks, and this costs less than a look at them.
    pub(super) saved: bool,
    pub(super) keeps_history: bool,
    pub(super) mailbox: Mailbox,
    pub(super) activity: Arc<CallMonitor>,
    experiment: Experiment,
    pub(super) phase: Phase,
    /// Whether it was made with event mode.
    pub(super) events: bool,
    /// Whether it may end a step early.
    pub(super) may_return_early: bool,
    /// Whether calls of one step go on, see `visit.rs`.
    pub(super) in_batch: bool,
    pub(super) steps: StepCounter,
    /// Memory for values that the FMU fills in.
    pub(super) guarded_buffer: GuardedBuffer,
    /// Memory for integers on their way.
    pub(super) integers: Vec<c_int>,
    /// Kept for FMUs of FMI 2.0.
    _callbacks: Option<Callbacks>,
    pub(super) library: Arc<Library>,
}

// SAFETY: FMI lets an importer call an instance on any of its threads, one call at a time; `&mut self` sees to the latter.
unsafe impl Send for Instance {}

impl Instance {
    /// Makes an instance called `name`, which logs all it has to say when `logging` is set.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn new(library: Arc<Library>, name: &str, logging: bool) -> Result<Self, CallError> {
        let guid = library.description().guid.clone();
        Self::with_guid(library, name, &guid, logging).map_err(|(error, _)| error)
    }

    /// Makes an instance that uses event mode and ends steps early, if the FMU can: its caller handles events, see
    /// [`advance`](Self::advance). One that refuses what its description declares is made without, and a message says so.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn with_events(
        library: Arc<Library>,
        name: &str,
        logging: bool,
    ) -> Result<Self, CallError> {
        let about = library.description();
        let (guid, modes) = (
            about.guid.clone(),
            Modes { event_mode: about.event_mode, early_return: about.may_return_early() },
        );
        // Clocks tick in event mode only.
        let clocked = about.variables.iter().any(|it| it.kind == Type::Clock);
        let made = Self::make(Arc::clone(&library), name, &guid, logging, modes);
        let refused = match made {
            Err((error, _)) if modes != Modes::default() && !clocked => error,
            made => return made.map_err(|(error, _)| error),
        };
        let plain = Self::make(library, name, &guid, logging, Modes::default());
        let instance = plain.map_err(|_| refused)?;
        let without = "it refuses event mode and early return, which its description declares (hasEventMode, mightReturnEarlyFromDoStep): it runs without";
        instance.mailbox.warn(std::iter::once(without.to_owned()));
        Ok(instance)
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
        Self::make(library, name, guid, logging, Modes::default())
    }

    /// Makes an instance.
    pub(super) fn make(
        library: Arc<Library>,
        name: &str,
        guid: &str,
        logging: bool,
        modes: Modes,
    ) -> Result<Self, (CallError, Vec<Message>)> {
        let call = named!(library, c"fmi2Instantiate", c"fmi3InstantiateCoSimulation");
        let text = |text| c_text(self::name(call), text).map_err(|error| (error, Vec::new()));
        let texts = [text(name)?, text(guid)?, text(&library.fmu.resources())?];
        if library.is_lost() {
            return Err((lost(&library, call), Vec::new()));
        }
        let activity = CallMonitor::new(&format!("node `{name}`"));
        let mailbox = Mailbox::new(Arc::clone(&activity), logging);
        let callbacks = match library.own {
            VersionFunctions::Fmi2(_) => Some(Callbacks::new(Arc::clone(&library), &mailbox)),
            VersionFunctions::Fmi3(_) => None,
        };
        let (component, changes) = activity.run_rare(call, || {
            mailbox.during(|| match (&library.own, &callbacks) {
                (VersionFunctions::Fmi2(own), Some(callbacks)) => {
                    instantiation::instantiate_2(own, &texts, callbacks, logging)
                }
                (VersionFunctions::Fmi3(own), _) => {
                    instantiation::instantiate_3(own, &texts, &mailbox, logging, modes)
                }
                _ => ptr::null_mut(),
            })
        });
        if let Some(changes) = changes {
            mailbox.warn(describe_changes(changes, call));
        }
        if component.is_null() {
            let what = format!("returned no instance{}", mailbox.last_message());
            return Err((CallError::new(self::name(call), what), mailbox.take()));
        }
        Ok(Instance {
            component,
            states: Arc::default(),
            saved: false,
            keeps_history: false,
            mailbox,
            activity,
            experiment: Experiment::default(),
            phase: Phase::default(),
            events: modes.event_mode,
            may_return_early: modes.early_return,
            in_batch: false,
            steps: StepCounter::default(),
            guarded_buffer: GuardedBuffer::default(),
            integers: Vec::new(),
            _callbacks: callbacks,
            library,
        })
    }

    /// What the FMU says about itself.
    #[must_use]
    #[inline]
    pub fn description(&self) -> &Description {
        self.library.description()
    }

    /// Whether its steps may end early, at events or for other reasons.
    #[must_use]
    #[inline]
    pub fn may_return_early(&self) -> bool {
        self.may_return_early
    }

    /// Whether there are messages to take that came for the first time, or any of an instance that logs all it has to say.
    #[inline]
    #[must_use]
    pub fn has_messages(&self) -> bool {
        self.mailbox.has_some()
    }

    /// Takes the messages that were logged since the last time. Unless the instance logs all it has to say, it gives the first one of each
    /// kind, see [`MessageKind`](crate::MessageKind), and how often the kind came again: see [`Message::again`].
    pub fn messages(&self) -> Vec<Message> {
        self.mailbox.take()
    }

    /// Whether this or another instance of the FMU returned the status fatal, after which none is called.
    #[must_use]
    #[inline]
    pub fn is_lost(&self) -> bool {
        self.library.is_lost()
    }

    /// Calls a function that takes the component, and judges its status.
    #[inline]
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
    #[inline]
    pub(super) fn run_for_status(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(Component) -> Status,
    ) -> Result<Status, CallError> {
        if !self.in_batch {
            return self.run_alone(call, body);
        }
        self.activity.begin_call(call);
        let status = body(self.component);
        if status != OK {
            self.note_status(call, status);
        }
        Ok(status)
    }

    /// Calls a function with all that a call has around it.
    #[inline(never)]
    fn run_alone(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(Component) -> Status,
    ) -> Result<Status, CallError> {
        if self.is_lost() {
            return Err(lost(&self.library, call));
        }
        let (status, changes) =
            self.activity.during(call, || self.mailbox.during(|| body(self.component)));
        if let Some(changes) = changes {
            self.mailbox.warn(describe_changes(changes, call));
        }
        if status != OK {
            self.note_status(call, status);
        }
        Ok(status)
    }

    #[cold]
    fn note_status(&mut self, call: &'static CStr, status: Status) {
        if status == WARNING {
            let warning = named!(self.library, "fmi2Warning", "fmi3Warning");
            self.mailbox.note_warning_status(&format!("{} returned {warning}", name(call)));
        }
        if status < ERROR {
            return;
        }
        self.phase = Phase::Failed(name(call));
        if status == FATAL {
            self.library.lose();
            // The next call is asked whether it may be made.
            self.in_batch = false;
        }
    }

    fn meaning(&self, status: Status) -> String {
        let version = named!(self.library, 2, 3);
        match status {
            DISCARD => format!("fmi{version}Discard"),
            ERROR => format!("fmi{version}Error"),
            FATAL => format!("fmi{version}Fatal"),
            PENDING if version == 2 => {
                "fmi2Pending, which is only for FMUs that run asynchronously".to_owned()
            }
            other => format!("{other}, which is no status"),
        }
    }

    #[cold]
    pub(super) fn failure(&self, call: &'static CStr, status: Status) -> CallError {
        CallError::new(
            name(call),
            format!("returned {}{}", self.meaning(status), self.mailbox.last_message()),
        )
    }

    /// Says that the simulation goes over `start..stop` [s]; the FMU keeps its own tolerance [-] unless there is one. This is
    /// `fmi2SetupExperiment`; an FMU of FMI 3.0 hears it when its initialisation begins.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn setup_experiment(
        &mut self,
        start: f64,
        stop: impl Into<Option<f64>>,
        tolerance: Option<f64>,
    ) -> Result<(), CallError> {
        let stop = stop.into();
        self.experiment = Experiment { start, stop, tolerance };
        self.activity.set_time(start);
        let VersionFunctions::Fmi2(own) = &self.library.own else { return Ok(()) };
        let function = own.setup_experiment;
        let (defined, tolerance) = (tolerance.is_some().into(), tolerance.unwrap_or(0.0));
        let (stops, stop) = (stop.is_some().into(), stop.unwrap_or(0.0));
        // SAFETY: the component is alive, and nobody else calls it.
        self.run(c"fmi2SetupExperiment", |c| unsafe {
            function(c, defined, tolerance, start, stops, stop)
        })
    }

    /// Begins the initialisation.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn enter_initialization(&mut self) -> Result<(), CallError> {
        let Experiment { start, stop, tolerance } = self.experiment;
        let entered = match &self.library.own {
            VersionFunctions::Fmi2(own) => {
                let function = own.enter_initialization_mode;
                self.call(c"fmi2EnterInitializationMode", function)
            }
            VersionFunctions::Fmi3(own) => {
                let function = own.enter_initialization_mode;
                let known = (tolerance.is_some(), stop.is_some());
                let (tolerance, stop) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
                // SAFETY: the component is alive, and nobody else calls it.
                self.run(c"fmi3EnterInitializationMode", |c| unsafe {
                    function(c, known.0, tolerance, start, known.1, stop)
                })
            }
        };
        entered.map(|()| self.phase = Phase::Initialization)
    }

    /// Ends the initialisation.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn exit_initialization(&mut self) -> Result<(), CallError> {
        let call =
            named!(self.library, c"fmi2ExitInitializationMode", c"fmi3ExitInitializationMode");
        self.call(call, self.library.common.exit_initialization_mode)?;
        self.phase = if self.events { Phase::Event } else { Phase::Step };
        Ok(())
    }

    /// Ends the simulation.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn terminate(&mut self) -> Result<(), CallError> {
        let call = named!(self.library, c"fmi2Terminate", c"fmi3Terminate");
        self.call(call, self.library.common.terminate)?;
        self.phase = Phase::Terminated;
        Ok(())
    }

    pub(super) fn call(&mut self, name: &'static CStr, function: Call) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody else calls it.
        self.run(name, |component| unsafe { function(component) })
    }
}

pub(super) fn name(call: &'static CStr) -> &'static str {
    call.to_str().unwrap_or_default()
}

fn lost(library: &Library, call: &'static CStr) -> CallError {
    let fatal = named!(library, "fmi2Fatal", "fmi3Fatal");
    let what = format!("is not called: after {fatal} no function of the FMU may be called");
    CallError::new(name(call), what)
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.free_all_states();
        if !self.is_lost() {
            // SAFETY: the component is alive and not used again.
            let free = || unsafe { (self.library.common.free_instance)(self.component) };
            let call = named!(self.library, c"fmi2FreeInstance", c"fmi3FreeInstance");
            self.mailbox.take();
            let _ = self.activity.during(call, || self.mailbox.during(free));
            messages_while_freed::keep(
                &self.activity.owner().to_string_lossy(),
                name(call),
                self.mailbox.take(),
            );
        }
    }
}
