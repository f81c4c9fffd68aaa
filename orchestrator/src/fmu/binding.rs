//! Calls an FMU's library: the one file of this program where foreign code runs.
//!
//! Statuses come in as plain integers, since a foreign library may return anything; the callbacks live
//! as long as the instance, since a library may keep the pointer to them; and an instance has one owner.
#![expect(unsafe_code, reason = "calling a C library")]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::ptr;
use std::sync::{Arc, Mutex, PoisonError};

use super::{Fmu, OpenError};
use crate::node::{CallError, Message};

type Component = *mut c_void;
type Status = c_int;
type Call = unsafe extern "C" fn(Component) -> Status;
type Get<T> = unsafe extern "C" fn(Component, *const u32, usize, *mut T) -> Status;
type Set<T> = unsafe extern "C" fn(Component, *const u32, usize, *const T) -> Status;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const CallbackFunctions,
    c_int,
    c_int,
) -> Component;

const OK: Status = 0;
const WARNING: Status = 1;
const DISCARD: Status = 2;
const FATAL: Status = 4;
const CO_SIMULATION: c_int = 1;
/// `fmi2LastSuccessfulTime` and `fmi2Terminated` of `fmi2StatusKind`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

/// All functions that FMI 2.0 asks of a co-simulation library.
const SYMBOLS: [&str; 34] = [
    "fmi2GetTypesPlatform",
    "fmi2GetVersion",
    "fmi2SetDebugLogging",
    "fmi2Instantiate",
    "fmi2FreeInstance",
    "fmi2SetupExperiment",
    "fmi2EnterInitializationMode",
    "fmi2ExitInitializationMode",
    "fmi2Terminate",
    "fmi2Reset",
    "fmi2GetReal",
    "fmi2GetInteger",
    "fmi2GetBoolean",
    "fmi2GetString",
    "fmi2SetReal",
    "fmi2SetInteger",
    "fmi2SetBoolean",
    "fmi2SetString",
    "fmi2GetFMUstate",
    "fmi2SetFMUstate",
    "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize",
    "fmi2SerializeFMUstate",
    "fmi2DeSerializeFMUstate",
    "fmi2GetDirectionalDerivative",
    "fmi2SetRealInputDerivatives",
    "fmi2GetRealOutputDerivatives",
    "fmi2DoStep",
    "fmi2CancelStep",
    "fmi2GetStatus",
    "fmi2GetRealStatus",
    "fmi2GetIntegerStatus",
    "fmi2GetBooleanStatus",
    "fmi2GetStringStatus",
];

#[repr(C)]
struct CallbackFunctions {
    logger:
        unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...),
    allocate_memory: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free_memory: unsafe extern "C" fn(*mut c_void),
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

unsafe extern "C" {
    /// Defined in `logger.c`.
    fn trackside_logger(
        environment: *mut c_void,
        instance: *const c_char,
        status: c_int,
        category: *const c_char,
        format: *const c_char,
        ...
    );
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(pointer: *mut c_void);
}

/// Where an instance's messages wait; an FMU may log from a thread of its own.
type Mailbox = Mutex<Vec<Message>>;

/// # Safety
/// Called by `logger.c` with the environment of an instance and C strings.
#[unsafe(no_mangle)]
unsafe extern "C" fn trackside_take_log(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
) {
    let string = |pointer: *const c_char| match pointer.is_null() {
        true => String::new(),
        // SAFETY: the FMU and `logger.c` hand over C strings.
        false => unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned(),
    };
    // SAFETY: the environment is the mailbox of a living instance.
    if let Some(mailbox) = unsafe { environment.cast::<Mailbox>().as_ref() } {
        let message = Message { status, category: string(category), text: string(text) };
        mailbox.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}

/// The loader's own words, which `libloading` keeps as the source of its error.
fn reason(error: &libloading::Error) -> String {
    let inner = std::error::Error::source(error);
    let what = inner.map_or_else(|| error.to_string(), ToString::to_string);
    if what.contains("undefined symbol: Py") || what.contains("undefined symbol: _Py") {
        return what
            + "; it expects Python in the process: set LD_PRELOAD to the path of libpython3";
    }
    what
}

/// A loaded library and the functions that a run calls.
pub struct Library {
    instantiate: Instantiate,
    free_instance: unsafe extern "C" fn(Component),
    setup_experiment: unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> Status,
    enter_initialization_mode: Call,
    exit_initialization_mode: Call,
    terminate: Call,
    get_real: Get<f64>,
    get_integer: Get<c_int>,
    get_boolean: Get<c_int>,
    set_real: Set<f64>,
    set_integer: Set<c_int>,
    set_boolean: Set<c_int>,
    set_string: Set<*const c_char>,
    do_step: unsafe extern "C" fn(Component, f64, f64, c_int) -> Status,
    get_real_status: unsafe extern "C" fn(Component, c_int, *mut f64) -> Status,
    get_boolean_status: unsafe extern "C" fn(Component, c_int, *mut c_int) -> Status,
    /// Unloaded after the last instance, and before its folder is removed.
    _library: libloading::Library,
    fmu: Arc<Fmu>,
}

impl std::fmt::Debug for Library {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Library({})", self.fmu.path.display())
    }
}

impl Library {
    pub(super) fn load(fmu: Arc<Fmu>, path: &Path) -> Result<Self, OpenError> {
        let archive = || fmu.path.clone();
        // SAFETY: loading runs the library's initialisers; an FMU is code that the user asked to run.
        let library = unsafe { libloading::Library::new(path) }
            .map_err(|error| OpenError::Library { path: archive(), what: reason(&error) })?;
        for symbol in SYMBOLS {
            // SAFETY: the address is looked at, not called.
            if unsafe { library.get::<*const ()>(symbol) }.is_err() {
                return Err(OpenError::Symbol { path: archive(), symbol });
            }
        }
        macro_rules! function {
            ($symbol:literal) => {
                // SAFETY: FMI 2.0 gives the function of this name the type of the member.
                *unsafe { library.get($symbol) }
                    .map_err(|_| OpenError::Symbol { path: archive(), symbol: $symbol })?
            };
        }
        Ok(Library {
            instantiate: function!("fmi2Instantiate"),
            free_instance: function!("fmi2FreeInstance"),
            setup_experiment: function!("fmi2SetupExperiment"),
            enter_initialization_mode: function!("fmi2EnterInitializationMode"),
            exit_initialization_mode: function!("fmi2ExitInitializationMode"),
            terminate: function!("fmi2Terminate"),
            get_real: function!("fmi2GetReal"),
            get_integer: function!("fmi2GetInteger"),
            get_boolean: function!("fmi2GetBoolean"),
            set_real: function!("fmi2SetReal"),
            set_integer: function!("fmi2SetInteger"),
            set_boolean: function!("fmi2SetBoolean"),
            set_string: function!("fmi2SetString"),
            do_step: function!("fmi2DoStep"),
            get_real_status: function!("fmi2GetRealStatus"),
            get_boolean_status: function!("fmi2GetBooleanStatus"),
            _library: library,
            fmu,
        })
    }
}

/// An instance of an FMU.
#[derive(Debug)]
pub struct Instance {
    component: Component,
    /// After `fmi2Fatal` nothing may be called any more, not even to free the instance.
    fatal: bool,
    mailbox: Box<Mailbox>,
    _callbacks: Box<CallbackFunctionsHolder>,
    library: Arc<Library>,
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
        let mailbox = Box::new(Mailbox::default());
        let callbacks = Box::new(CallbackFunctionsHolder(CallbackFunctions {
            logger: trackside_logger,
            allocate_memory: calloc,
            free_memory: free,
            step_finished: None,
            environment: ptr::from_ref(&*mailbox).cast_mut().cast(),
        }));
        let description = &library.fmu.description;
        let text = |text: &str| CString::new(text).unwrap_or_default();
        let (name, guid, resources) =
            (text(name), text(&description.guid), text(&library.fmu.resources()));
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
            return Err(instance.failure("fmi2Instantiate", "returned no instance".to_owned()));
        }
        Ok(instance)
    }

    /// Takes the messages that were logged since the last time.
    pub fn messages(&self) -> Vec<Message> {
        std::mem::take(&mut self.mailbox.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn failure(&self, call: &'static str, what: String) -> CallError {
        let mailbox = self.mailbox.lock().unwrap_or_else(PoisonError::into_inner);
        let last = mailbox.last();
        let said = last.map(|message| format!("; it says: {}", message.text)).unwrap_or_default();
        CallError { call, what: what + &said, terminated: None }
    }

    fn check(&mut self, call: &'static str, status: Status) -> Result<(), CallError> {
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

    /// `fmi2SetupExperiment` without tolerance, then `fmi2EnterInitializationMode`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn enter_initialization(&mut self, start: f64, stop: f64) -> Result<(), CallError> {
        let library = Arc::clone(&self.library);
        // SAFETY: the component is alive, and nobody else calls it.
        let status = unsafe { (library.setup_experiment)(self.component, 0, 0.0, start, 1, stop) };
        self.check("fmi2SetupExperiment", status)?;
        self.call("fmi2EnterInitializationMode", library.enter_initialization_mode)
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

    fn call(&mut self, name: &'static str, function: Call) -> Result<(), CallError> {
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

impl Drop for Instance {
    fn drop(&mut self) {
        if !self.component.is_null() && !self.fatal {
            // SAFETY: the component is alive and not used again.
            unsafe { (self.library.free_instance)(self.component) }
        }
    }
}
