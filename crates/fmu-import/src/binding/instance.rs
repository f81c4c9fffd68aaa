//! Runs one instance of an FMU: the calls of a simulation.

use std::ffi::{CStr, c_int};
use std::sync::Arc;

use super::call_monitor::CallMonitor;
use super::functions::{InterfaceFunctions, VersionFunctions};
use super::guarded_buffer::GuardedBuffer;
use super::instantiation::{self, Fmi2Callbacks, InstantiationModes};
use super::interrupted_call::InterruptedCall;
use super::mailbox::MessageMailbox;
use super::messages_while_freed;
use super::phase::InstancePhase;
use super::process_state::{StepCounter, describe_changes};
use super::python_runtime::missing_module_advice;
use super::saved_states::SavedStateRegistry;
use super::{
    ComponentFn, DISCARD, ERROR, FATAL, FmiStatus, FmuLibrary, InstancePointer, OK, PENDING, WARNING, named,
    to_c_string,
};
use crate::{CallError, FmiInterface, FmiType, FmiVersion, FmuDescription, FmuMessage};

/// What an instance is told of the simulation before it is initialised.
#[derive(Debug, Clone, Copy, Default)]
struct ExperimentSettings {
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
// In this order, what each step needs lies together.
#[repr(C)]
pub struct Instance {
    pub(super) component: InstancePointer,
    pub(super) library: Arc<FmuLibrary>,
    pub(super) activity: Arc<CallMonitor>,
    pub(super) mailbox: MessageMailbox,
    /// Memory for values that the FMU fills in.
    pub(super) guarded_buffer: GuardedBuffer,
    pub(super) steps: StepCounter,
    /// Whether a state was ever saved. Each step asks, and this costs less than a look at them.
    pub(super) saved: bool,
    pub(super) keeps_history: bool,
    /// Whether calls of one step go on, see `batch.rs`.
    pub(super) in_batch: bool,
    /// The call after which the rest of a step waits.
    pub(super) interrupted: Option<InterruptedCall>,
    /// Whether it was made with event mode.
    pub(super) events: bool,
    /// Whether it may end a step early.
    pub(super) may_return_early: bool,
    pub(super) states: Arc<SavedStateRegistry>,
    experiment: ExperimentSettings,
    pub(super) phase: InstancePhase,
    /// Memory for integers on their way.
    pub(super) integers: Vec<c_int>,
    /// Kept for FMUs of FMI 2.0.
    _callbacks: Option<Fmi2Callbacks>,
}

// SAFETY: FMI lets an importer call an instance on any of its threads, one call at a time; `&mut self` sees to the latter.
unsafe impl Send for Instance {}

impl Instance {
    /// Makes an instance called `name`, which logs all it has to say when `logging` is set.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn new(library: Arc<FmuLibrary>, name: &str, logging: bool) -> Result<Self, CallError> {
        let guid = library.description().guid.clone();
        Self::with_guid(library, name, &guid, logging).map_err(|(error, _)| error)
    }

    /// Makes an instance that uses event mode and ends steps early, if the FMU can: its caller handles events, see
    /// [`advance`](Self::advance). One that refuses what its description declares is made without, and a message says so.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn with_events(library: Arc<FmuLibrary>, name: &str, logging: bool) -> Result<Self, CallError> {
        let about = library.description();
        let (guid, modes) = (
            about.guid.clone(),
            InstantiationModes { event_mode: about.event_mode, early_return: about.may_return_early() },
        );
        // Clocks tick in event mode only, and model exchange is never without it.
        let clocked = about.variables.iter().any(|it| it.kind == FmiType::Clock);
        let optional = modes != InstantiationModes::default()
            && !clocked
            && about.interface == FmiInterface::CoSimulation;
        let made = Self::instantiate(Arc::clone(&library), name, &guid, logging, modes);
        let refused = match made {
            Err((error, _)) if optional => error,
            made => return made.map_err(|(error, _)| error),
        };
        let plain = Self::instantiate(library, name, &guid, logging, InstantiationModes::default());
        let instance = plain.map_err(|_| refused)?;
        let without = "it refuses event mode and early return, which its description declares (hasEventMode, mightReturnEarlyFromDoStep): it runs without";
        instance.mailbox.add_warnings(std::iter::once(without.to_owned()));
        Ok(instance)
    }

    /// Makes an instance with this GUID; an error comes with what was logged.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn with_guid(
        library: Arc<FmuLibrary>,
        name: &str,
        guid: &str,
        logging: bool,
    ) -> Result<Self, (CallError, Vec<FmuMessage>)> {
        Self::instantiate(library, name, guid, logging, InstantiationModes::default())
    }

    /// Makes an instance.
    pub(super) fn instantiate(
        library: Arc<FmuLibrary>,
        name: &str,
        guid: &str,
        logging: bool,
        modes: InstantiationModes,
    ) -> Result<Self, (CallError, Vec<FmuMessage>)> {
        let call = match (&library.interface, library.description().version) {
            (_, FmiVersion::One | FmiVersion::Two) => library.own_call_name(c"fmi2Instantiate"),
            (InterfaceFunctions::ModelExchange3(_), _) => c"fmi3InstantiateModelExchange",
            _ => c"fmi3InstantiateCoSimulation",
        };
        let text = |text| to_c_string(self::call_name(call), text).map_err(|error| (error, Vec::new()));
        let texts = [text(name)?, text(guid)?, text(&library.resources_location())?];
        if library.has_failed_fatally() {
            return Err((fatal_status_error(&library, call), Vec::new()));
        }
        let activity = CallMonitor::new(&format!("node `{name}`"));
        let mailbox = MessageMailbox::new(Arc::clone(&activity), logging);
        let callbacks = match library.own {
            VersionFunctions::Fmi2(_) if library.fmi1.is_none() => {
                Some(Fmi2Callbacks::new(Arc::clone(&library), &mailbox))
            }
            _ => None,
        };
        let (component, changes) = activity.monitor_load_or_instantiate(call, || {
            let make = || match (&library.fmi1, &library.own, &callbacks) {
                (Some(fmi1), ..) => {
                    fmi1.instantiate(library.description(), &texts, &mailbox, &activity, logging)
                }
                (None, VersionFunctions::Fmi2(own), Some(callbacks)) => {
                    let interface = library.description().interface;
                    instantiation::instantiate_fmi2(own, &texts, callbacks, logging, interface)
                }
                _ => instantiation::instantiate_fmi3(&library.interface, &texts, &mailbox, logging, modes),
            };
            mailbox.receive_during_call(|| library.handle.run_without_instance(make))
        });
        // Before the sentences of this program come.
        let said = mailbox.last_message();
        if let Some(changes) = changes {
            mailbox.add_warnings(describe_changes(changes, call));
        }
        if component.is_null() {
            if let Some(end) = library.handle.process_end() {
                let error = CallError::new(self::call_name(call), format!("{end}{said}"));
                return Err((error, mailbox.take_messages()));
            }
            let advice = missing_module_advice(&said, &library.fmu).unwrap_or_default();
            let advice = advice + &library.description().fmi1.tool_advice();
            let what = format!("returned no instance{said}{advice}");
            return Err((CallError::new(self::call_name(call), what), mailbox.take_messages()));
        }
        Ok(Instance {
            component,
            states: Arc::default(),
            saved: false,
            keeps_history: false,
            mailbox,
            activity,
            experiment: ExperimentSettings::default(),
            phase: InstancePhase::default(),
            events: modes.event_mode,
            may_return_early: modes.early_return,
            in_batch: false,
            interrupted: None,
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
    pub fn description(&self) -> &FmuDescription {
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
        self.mailbox.has_new_messages()
    }

    /// Takes the messages that were logged since the last time. Unless the instance logs all it has to say, it gives the first one of each
    /// kind, see [`MessageKind`](crate::MessageKind), and how often the kind came again: see [`FmuMessage::again`].
    pub fn take_messages(&self) -> Vec<FmuMessage> {
        self.mailbox.take_messages()
    }

    /// Whether this or another instance of the FMU returned the status fatal, after which none is called.
    #[must_use]
    #[inline]
    pub fn has_failed_fatally(&self) -> bool {
        self.library.has_failed_fatally()
    }

    /// Calls a function that takes the component, and judges its status.
    #[inline]
    pub(super) fn run_checked(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(InstancePointer) -> FmiStatus,
    ) -> Result<(), CallError> {
        match self.run_for_status(call, body)? {
            OK | WARNING => Ok(()),
            status => Err(self.status_error(call, status)),
        }
    }

    /// Calls a function that takes the component, unless that is forbidden.
    #[inline]
    pub(super) fn run_for_status(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(InstancePointer) -> FmiStatus,
    ) -> Result<FmiStatus, CallError> {
        if !self.in_batch {
            return self.run_monitored(call, body);
        }
        self.activity.begin_call(call);
        let status = body(self.component);
        if status != OK {
            self.record_status(call, status);
        }
        Ok(status)
    }

    /// Calls a function with all that a call has around it.
    #[inline(never)]
    fn run_monitored(
        &mut self,
        call: &'static CStr,
        body: impl FnOnce(InstancePointer) -> FmiStatus,
    ) -> Result<FmiStatus, CallError> {
        if self.has_failed_fatally() {
            return Err(fatal_status_error(&self.library, call));
        }
        let call = self.library.own_call_name(call);
        let (status, changes) =
            self.activity.monitor_call(call, || self.mailbox.receive_during_call(|| body(self.component)));
        if let Some(changes) = changes {
            self.mailbox.add_warnings(describe_changes(changes, call));
        }
        if status != OK {
            self.record_status(call, status);
        }
        Ok(status)
    }

    #[cold]
    pub(super) fn record_status(&mut self, call: &'static CStr, status: FmiStatus) {
        let call = self.library.own_call_name(call);
        if status == WARNING {
            let warning = named!(self.library, "fmi2Warning", "fmi3Warning");
            self.mailbox.record_warning_status(&format!("{} returned {warning}", call_name(call)));
        }
        if status < ERROR {
            return;
        }
        self.phase = InstancePhase::Failed(call_name(call));
        if status == FATAL || self.library.handle.process_end().is_some() {
            self.library.mark_as_failed_fatally();
            // The next call is asked whether it may be made.
            self.in_batch = false;
        }
    }

    fn describe_status(&self, status: FmiStatus) -> String {
        let word = match status {
            DISCARD => named!(self.library, "fmi2Discard", "fmi3Discard"),
            ERROR => named!(self.library, "fmi2Error", "fmi3Error"),
            FATAL => named!(self.library, "fmi2Fatal", "fmi3Fatal"),
            PENDING if self.description().version != FmiVersion::Three => {
                let pending = named!(self.library, "fmi2Pending", "");
                return format!("{pending}, which is only for FMUs that run asynchronously");
            }
            other => return format!("{other}, which is no status"),
        };
        word.to_owned()
    }

    #[cold]
    pub(super) fn status_error(&self, call: &'static CStr, status: FmiStatus) -> CallError {
        if let Some(end) = self.library.handle.process_end() {
            return CallError::new(call_name(call), format!("{end}{}", self.mailbox.last_message()));
        }
        CallError::new(
            call_name(self.library.own_call_name(call)),
            format!("returned {}{}", self.describe_status(status), self.mailbox.last_message()),
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
        self.experiment = ExperimentSettings { start, stop, tolerance };
        self.activity.set_time(start);
        let VersionFunctions::Fmi2(own) = &self.library.own else { return Ok(()) };
        let function = own.setup_experiment;
        let (defined, tolerance) = (tolerance.is_some().into(), tolerance.unwrap_or(0.0));
        let (stops, stop) = (stop.is_some().into(), stop.unwrap_or(0.0));
        // SAFETY: the component is alive, and nobody else calls it.
        self.run_checked(c"fmi2SetupExperiment", |c| unsafe {
            function(c, defined, tolerance, start, stops, stop)
        })
    }

    /// Begins the initialisation.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn enter_initialization(&mut self) -> Result<(), CallError> {
        let ExperimentSettings { start, stop, tolerance } = self.experiment;
        let entered = match &self.library.own {
            VersionFunctions::Fmi2(own) => {
                let function = own.enter_initialization_mode;
                self.call_without_arguments(c"fmi2EnterInitializationMode", function)
            }
            VersionFunctions::Fmi3(own) => {
                let function = own.enter_initialization_mode;
                let known = (tolerance.is_some(), stop.is_some());
                let (tolerance, stop) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
                // SAFETY: the component is alive, and nobody else calls it.
                self.run_checked(c"fmi3EnterInitializationMode", |c| unsafe {
                    function(c, known.0, tolerance, start, known.1, stop)
                })
            }
        };
        entered.map(|()| self.phase = InstancePhase::Initialization)
    }

    /// Ends the initialisation.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn exit_initialization(&mut self) -> Result<(), CallError> {
        let call = named!(self.library, c"fmi2ExitInitializationMode", c"fmi3ExitInitializationMode");
        self.call_without_arguments(call, self.library.common.exit_initialization_mode)?;
        self.phase = if self.events { InstancePhase::Event } else { InstancePhase::Step };
        Ok(())
    }

    /// Ends the simulation.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn terminate(&mut self) -> Result<(), CallError> {
        let call = named!(self.library, c"fmi2Terminate", c"fmi3Terminate");
        self.call_without_arguments(call, self.library.common.terminate)?;
        self.phase = InstancePhase::Terminated;
        Ok(())
    }

    pub(super) fn call_without_arguments(
        &mut self,
        name: &'static CStr,
        function: ComponentFn,
    ) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody else calls it.
        self.run_checked(name, |component| unsafe { function(component) })
    }
}

pub(super) fn call_name(call: &'static CStr) -> &'static str {
    call.to_str().unwrap_or_default()
}

fn fatal_status_error(library: &FmuLibrary, call: &'static CStr) -> CallError {
    if let Some(end) = library.handle.process_end() {
        return CallError::new(call_name(call), format!("is not called: an earlier call of the FMU {end}"));
    }
    let fatal = named!(library, "fmi2Fatal", "fmi3Fatal");
    let what = format!("is not called: after {fatal} no function of the FMU may be called");
    CallError::new(call_name(library.own_call_name(call)), what)
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.free_all_states();
        if !self.has_failed_fatally() {
            // SAFETY: the component is alive and not used again.
            let free = || unsafe { (self.library.common.free_instance)(self.component) };
            let call = named!(self.library, c"fmi2FreeInstance", c"fmi3FreeInstance");
            self.mailbox.take_messages();
            let _ = self.activity.monitor_call(call, || self.mailbox.receive_during_call(free));
            messages_while_freed::store_messages_while_freed(
                &self.activity.owner_name().to_string_lossy(),
                call_name(call),
                self.mailbox.take_messages(),
            );
        }
    }
}
