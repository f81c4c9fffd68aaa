//! Loads an FMU's library and finds its functions.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;

use super::{Call, Component, Get, Instantiate, Set, Status, activity};
use crate::description::Description;
use crate::{Fmu, OpenError};

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

type Text = unsafe extern "C" fn() -> *const c_char;
/// `fmi2FMUstate`.
type State = *mut c_void;

/// A loaded library and the functions that this program calls.
pub struct Library {
    pub(super) instantiate: Instantiate,
    pub(super) free_instance: unsafe extern "C" fn(Component),
    pub(super) get_version: Text,
    pub(super) get_types_platform: Text,
    pub(super) set_debug_logging:
        unsafe extern "C" fn(Component, c_int, usize, *const *const c_char) -> Status,
    pub(super) setup_experiment:
        unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> Status,
    pub(super) enter_initialization_mode: Call,
    pub(super) exit_initialization_mode: Call,
    pub(super) terminate: Call,
    pub(super) reset: Call,
    pub(super) get_real: Get<f64>,
    pub(super) get_integer: Get<c_int>,
    pub(super) get_boolean: Get<c_int>,
    pub(super) get_string: Get<*const c_char>,
    pub(super) set_real: Set<f64>,
    pub(super) set_integer: Set<c_int>,
    pub(super) set_boolean: Set<c_int>,
    pub(super) set_string: Set<*const c_char>,
    pub(super) get_state: unsafe extern "C" fn(Component, *mut State) -> Status,
    pub(super) set_state: unsafe extern "C" fn(Component, State) -> Status,
    pub(super) free_state: unsafe extern "C" fn(Component, *mut State) -> Status,
    pub(super) serialised_size: unsafe extern "C" fn(Component, State, *mut usize) -> Status,
    pub(super) serialise: unsafe extern "C" fn(Component, State, *mut u8, usize) -> Status,
    pub(super) deserialise: unsafe extern "C" fn(Component, *const u8, usize, *mut State) -> Status,
    pub(super) directional_derivative: unsafe extern "C" fn(
        Component,
        *const u32,
        usize,
        *const u32,
        usize,
        *const f64,
        *mut f64,
    ) -> Status,
    pub(super) set_input_derivatives:
        unsafe extern "C" fn(Component, *const u32, usize, *const c_int, *const f64) -> Status,
    pub(super) get_output_derivatives:
        unsafe extern "C" fn(Component, *const u32, usize, *const c_int, *mut f64) -> Status,
    pub(super) do_step: unsafe extern "C" fn(Component, f64, f64, c_int) -> Status,
    pub(super) cancel_step: Call,
    pub(super) get_status: unsafe extern "C" fn(Component, c_int, *mut c_int) -> Status,
    pub(super) get_real_status: unsafe extern "C" fn(Component, c_int, *mut f64) -> Status,
    pub(super) get_boolean_status: unsafe extern "C" fn(Component, c_int, *mut c_int) -> Status,
    /// Unloaded after the last instance, and before its folder is removed.
    handle: ManuallyDrop<libloading::Library>,
    pub(super) fmu: Arc<Fmu>,
}

impl std::fmt::Debug for Library {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Library({})", self.fmu.path.display())
    }
}

impl Library {
    pub(crate) fn load(fmu: Arc<Fmu>, path: &Path) -> Result<Self, OpenError> {
        let archive = || fmu.path.clone();
        let library = open(&fmu, path)?;
        if let Some(symbol) = absent(&library).next() {
            return Err(OpenError::Symbol { path: archive(), symbol });
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
            get_version: function!("fmi2GetVersion"),
            get_types_platform: function!("fmi2GetTypesPlatform"),
            set_debug_logging: function!("fmi2SetDebugLogging"),
            setup_experiment: function!("fmi2SetupExperiment"),
            enter_initialization_mode: function!("fmi2EnterInitializationMode"),
            exit_initialization_mode: function!("fmi2ExitInitializationMode"),
            terminate: function!("fmi2Terminate"),
            reset: function!("fmi2Reset"),
            get_real: function!("fmi2GetReal"),
            get_integer: function!("fmi2GetInteger"),
            get_boolean: function!("fmi2GetBoolean"),
            get_string: function!("fmi2GetString"),
            set_real: function!("fmi2SetReal"),
            set_integer: function!("fmi2SetInteger"),
            set_boolean: function!("fmi2SetBoolean"),
            set_string: function!("fmi2SetString"),
            get_state: function!("fmi2GetFMUstate"),
            set_state: function!("fmi2SetFMUstate"),
            free_state: function!("fmi2FreeFMUstate"),
            serialised_size: function!("fmi2SerializedFMUstateSize"),
            serialise: function!("fmi2SerializeFMUstate"),
            deserialise: function!("fmi2DeSerializeFMUstate"),
            directional_derivative: function!("fmi2GetDirectionalDerivative"),
            set_input_derivatives: function!("fmi2SetRealInputDerivatives"),
            get_output_derivatives: function!("fmi2GetRealOutputDerivatives"),
            do_step: function!("fmi2DoStep"),
            cancel_step: function!("fmi2CancelStep"),
            get_status: function!("fmi2GetStatus"),
            get_real_status: function!("fmi2GetRealStatus"),
            get_boolean_status: function!("fmi2GetBooleanStatus"),
            handle: ManuallyDrop::new(library),
            fmu,
        })
    }

    /// The functions that the library at `path` lacks.
    pub(crate) fn missing(fmu: &Fmu, path: &Path) -> Result<Vec<&'static str>, OpenError> {
        open(fmu, path).map(|library| absent(&library).collect())
    }

    /// What the FMU says about itself.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.fmu.description
    }

    /// Whether an instance of the FMU returned `fmi2Fatal`, after which none can be made or called.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.fmu.lost.load(SeqCst)
    }

    /// Notes that an instance returned `fmi2Fatal`: all instances of the FMU are lost with it.
    pub(super) fn lose(&self) {
        self.fmu.lost.store(true, SeqCst);
    }

    /// What `fmi2GetVersion` says.
    #[must_use]
    pub fn version(&self) -> String {
        text(self.get_version)
    }

    /// What `fmi2GetTypesPlatform` says.
    #[must_use]
    pub fn types_platform(&self) -> String {
        text(self.get_types_platform)
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        // What was not freed may go on running: threads of the FMU, for example.
        if !self.is_lost() {
            // SAFETY: nobody uses the library after this, since all instances are gone.
            unsafe { ManuallyDrop::drop(&mut self.handle) };
        }
    }
}

fn text(function: Text) -> String {
    // SAFETY: the function takes nothing and returns a C string that the library owns.
    let found = unsafe { function() };
    match found.is_null() {
        true => String::new(),
        // SAFETY: as above.
        false => unsafe { CStr::from_ptr(found) }.to_string_lossy().into_owned(),
    }
}

fn open(fmu: &Fmu, path: &Path) -> Result<libloading::Library, OpenError> {
    // An FMU's runtime may install handlers of its own while it is loaded: they must come before ours.
    activity::watch_crashes();
    // SAFETY: loading runs the library's initialisers; an FMU is code that the user asked to run.
    unsafe { libloading::Library::new(path) }
        .map_err(|error| OpenError::Library { path: fmu.path.clone(), what: reason(&error) })
}

fn absent(library: &libloading::Library) -> impl Iterator<Item = &'static str> {
    // SAFETY: the address is looked at, not called.
    SYMBOLS.into_iter().filter(|symbol| unsafe { library.get::<*const ()>(*symbol) }.is_err())
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
