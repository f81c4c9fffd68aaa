//! Loads an FMU's library and finds its functions.

use std::ffi::{CStr, c_int};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;

use super::absent_function::absent_function;
use super::call_monitor::{self, CallMonitor};
use super::fmi1::Fmi1Library;
use super::functions::{
    ClockFunctions, CommonFunctions, EventFunctions, Fmi2CoSimulationFunctions, Fmi2Functions,
    Fmi2ModelExchangeFunctions, Fmi3CoSimulationFunctions, Fmi3Functions, Fmi3ModelExchangeFunctions,
    GetTextFn, InterfaceFunctions, OTHER_SYMBOLS, SymbolLoader, VersionFunctions,
};
use super::handle::LibraryHandle;
use super::python_runtime::start_expected_python;
use super::windows::WindowsLibrary;
use crate::description::{FmiInterface, FmiVersion, FmuDescription};
use crate::linkage::{LibraryLinkage, describe_missing_libraries};
use crate::location::file_uri;
use crate::{CallError, Fmu, OpenError, wine};

unsafe extern "C" {
    /// Defined in `threads.c`: how many threads there are that FMUs started.
    fn trackside_threads_of_fmus() -> c_int;
}

/// Why a function of co-simulation is not called.
pub(super) const NO_CO_SIMULATION: &str = "is not called: the FMU is used for model exchange";

const LOADING: &CStr = c"loading its library";

/// A loaded library and the functions that this program calls.
pub struct FmuLibrary {
    pub(super) common: CommonFunctions,
    pub(super) own: VersionFunctions,
    pub(super) interface: InterfaceFunctions,
    /// The functions of FMI 1.0 that those above call, of a library of that version.
    pub(super) fmi1: Option<Fmi1Library>,
    /// Of FMI 3.0; an FMU without event mode may lack them.
    pub(super) events: Option<EventFunctions>,
    /// Of FMI 3.0; an FMU without clocks may lack them.
    pub(super) clocks: Option<ClockFunctions>,
    /// Unloaded after the last instance, and before its folder is removed.
    pub(super) handle: ManuallyDrop<LibraryHandle>,
    pub(super) fmu: Arc<Fmu>,
    activity: Arc<CallMonitor>,
}

impl std::fmt::Debug for FmuLibrary {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Library({})", self.fmu.path.display())
    }
}

impl FmuLibrary {
    pub(crate) fn load(fmu: Arc<Fmu>, path: &Path) -> Result<Self, OpenError> {
        let prefix = fmu.description.symbol_prefix();
        let lacks =
            |symbol| OpenError::Symbol { path: fmu.path.clone(), symbol: format!("{prefix}{symbol}") };
        if let Some(why) = fmu.clash_reason_with_archives().or_else(|| fmu.shadowed_library()) {
            let what = format!("{why}; it needs a process of its own");
            return Err(OpenError::Library { path: fmu.path.clone(), what });
        }
        // It stays there when loading fails half way, too.
        fmu.register_loaded();
        let activity = CallMonitor::new(&format!("the FMU {}", fmu.path.display()));
        call_monitor::install_crash_handler();
        let (library, changes) = activity.monitor_load_or_instantiate(LOADING, || open_library(&fmu, path));
        let library = library?;
        activity.register_libraries();
        changes.into_iter().for_each(|changes| activity.report_process_changes(changes, LOADING));
        let version = fmu.description.version;
        let interface = fmu.description.interface;
        // Functions that are not called need not be there: libraries of today leave those of other interfaces and capabilities out.
        let find = |symbol: &'static str| {
            let own =
                library.find_address(&format!("{prefix}{symbol}")).or_else(|| library.find_address(symbol));
            own.or_else(|| absent_function(symbol, &fmu.description))
        };
        let finder = SymbolLoader { find: &find, lacks: &lacks };
        let fmi1 = match version {
            FmiVersion::One => Some(Fmi1Library::new(&finder, interface)?),
            FmiVersion::Two | FmiVersion::Three => None,
        };
        let (common, own, functions) = match (&fmi1, version) {
            (Some(fmi1), _) => fmi1.adapted(),
            (None, FmiVersion::Three) => (
                CommonFunctions::new(&finder, version)?,
                VersionFunctions::Fmi3(Box::new(Fmi3Functions::new(&finder)?)),
                InterfaceFunctions::new(&finder, version, interface)?,
            ),
            (None, _) => (
                CommonFunctions::new(&finder, version)?,
                VersionFunctions::Fmi2(Box::new(Fmi2Functions::new(&finder)?)),
                InterfaceFunctions::new(&finder, version, interface)?,
            ),
        };
        let events = match (version, fmu.description.event_mode) {
            (FmiVersion::One | FmiVersion::Two, _) => None,
            (FmiVersion::Three, true) if interface == FmiInterface::CoSimulation => {
                Some(EventFunctions::new(&finder)?)
            }
            (FmiVersion::Three, _) => EventFunctions::new(&finder).ok(),
        };
        let clocks = if version == FmiVersion::Three { ClockFunctions::new(&finder).ok() } else { None };
        let handle = ManuallyDrop::new(library);
        Ok(FmuLibrary { common, own, interface: functions, fmi1, events, clocks, handle, fmu, activity })
    }

    /// The functions of FMI 2.0.
    ///
    /// # Errors
    /// When the FMU is of another version.
    #[inline]
    pub(super) fn fmi2_functions(&self, call: &'static str) -> Result<&Fmi2Functions, CallError> {
        match &self.own {
            VersionFunctions::Fmi2(functions) => Ok(functions),
            VersionFunctions::Fmi3(_) => Err(not_fmi2_error(call)),
        }
    }

    /// The functions of co-simulation of FMI 2.0.
    ///
    /// # Errors
    /// When the FMU is of another version, or used through another interface.
    #[inline]
    pub(super) fn fmi2_co_simulation(
        &self,
        call: &'static str,
    ) -> Result<&Fmi2CoSimulationFunctions, CallError> {
        match &self.interface {
            InterfaceFunctions::CoSimulation2(functions) => Ok(functions),
            InterfaceFunctions::ModelExchange2(_) => Err(CallError::new(call, NO_CO_SIMULATION)),
            _ => Err(not_fmi2_error(call)),
        }
    }

    /// The functions that the library at `path` lacks: those without which it does not load here, and the others.
    pub(crate) fn missing_functions(fmu: &Fmu, path: &Path) -> Result<[Vec<&'static str>; 2], OpenError> {
        let library = open_library(fmu, path)?;
        let version = fmu.description.version;
        let interface = fmu.description.interface;
        let events = match interface {
            FmiInterface::CoSimulation if fmu.description.event_mode => EventFunctions::SYMBOLS,
            _ => &[],
        };
        let mut missing = missing_interface_symbols(&library, &fmu.description);
        missing.extend(missing_symbols(&library, "", events));
        let others: &[&[_]] = match version {
            FmiVersion::One | FmiVersion::Two => &[],
            FmiVersion::Three => &[EventFunctions::SYMBOLS, ClockFunctions::SYMBOLS, OTHER_SYMBOLS],
        };
        let others = others.iter().flat_map(|symbols| missing_symbols(&library, "", symbols));
        let others = others.filter(|symbol| !missing.contains(symbol)).collect();
        Ok([missing, others])
    }

    /// The FMU that it is the library of.
    #[must_use]
    pub fn fmu(&self) -> &Fmu {
        &self.fmu
    }

    /// What the FMU says about itself.
    #[must_use]
    #[inline]
    pub fn description(&self) -> &FmuDescription {
        &self.fmu.description
    }

    /// Whether an instance of the FMU returned the status fatal, after which none can be made or called.
    #[must_use]
    #[inline]
    pub fn has_failed_fatally(&self) -> bool {
        self.fmu.lost.load(SeqCst)
    }

    /// Whether threads may run in it after all instances are freed: those of its runtime, or one that an FMU of this process started.
    fn may_have_threads(&self) -> bool {
        // SAFETY: the function reads a number that is written as a whole.
        self.fmu.library_linkage().leaves_threads() || unsafe { trackside_threads_of_fmus() } > 0
    }

    /// The unpacked `resources` folder, as its version wants it: a URI, or a path that ends with a separator, which is empty
    /// without such a folder. FMI 1.0 wants the URI of the whole archive.
    pub(super) fn resources_location(&self) -> String {
        let folder = self.fmu.resources_folder();
        let is_windows = matches!(*self.handle, LibraryHandle::Windows(_));
        match self.fmu.description.version {
            FmiVersion::One => file_uri(self.fmu.folder.description_folder()),
            FmiVersion::Two if is_windows => file_uri(&folder).replacen("file:///", "file:///Z:/", 1),
            FmiVersion::Two => file_uri(&folder),
            FmiVersion::Three if !folder.is_dir() => String::new(),
            FmiVersion::Three if is_windows => format!("{}\\", wine::windows_path(&folder)),
            FmiVersion::Three => format!("{}/", folder.display()),
        }
    }

    /// Notes that an instance returned the status fatal: all instances of the FMU are lost with it.
    pub(super) fn mark_as_failed_fatally(&self) {
        self.fmu.lost.store(true, SeqCst);
    }

    /// The name of a function in the version and the interface of the FMU.
    pub(super) fn own_call_name(&self, call: &'static CStr) -> &'static CStr {
        match self.fmi1 {
            Some(_) => self.description().fmi1_name(call),
            None => call,
        }
    }

    /// What `fmiGetVersion`, `fmi2GetVersion` or `fmi3GetVersion` says.
    #[must_use]
    pub fn reported_fmi_version(&self) -> String {
        self.handle.run_without_instance(|| call_text_function(self.common.get_version))
    }

    /// What `fmiGetTypesPlatform`, `fmiGetModelTypesPlatform` or `fmi2GetTypesPlatform` says; nothing for FMI 3.0, which has no such function.
    #[must_use]
    pub fn types_platform(&self) -> String {
        match &self.own {
            VersionFunctions::Fmi2(functions) => {
                self.handle.run_without_instance(|| call_text_function(functions.get_types_platform))
            }
            VersionFunctions::Fmi3(_) => String::new(),
        }
    }
}

#[cold]
fn not_fmi2_error(call: &'static str) -> CallError {
    CallError::new(call, "is not called: the FMU is one of FMI 3.0")
}

impl Drop for FmuLibrary {
    fn drop(&mut self) {
        // What was not freed may go on running, and so may threads of the FMU.
        if !self.has_failed_fatally() && !self.may_have_threads() {
            let _ = self.activity.monitor_load_or_instantiate(c"unloading its library", || {
                // SAFETY: nobody uses the library after this, since all instances are gone.
                unsafe { ManuallyDrop::drop(&mut self.handle) };
            });
            call_monitor::forget_unloaded_libraries();
            // Symbols that a process has once keep their library there.
            let stays = self.fmu.library_path().is_ok_and(|path| is_loaded(&path));
            // The modules of a script stay with their Python.
            if !stays && !self.fmu.library_linkage().calls_python {
                self.fmu.unregister_loaded();
            }
        }
    }
}

fn call_text_function(function: GetTextFn) -> String {
    // SAFETY: the function takes nothing and returns a C string that the library owns.
    let found = unsafe { function() };
    match found.is_null() {
        true => String::new(),
        // SAFETY: as above.
        false => unsafe { CStr::from_ptr(found) }.to_string_lossy().into_owned(),
    }
}

fn open_library(fmu: &Fmu, path: &Path) -> Result<LibraryHandle, OpenError> {
    if wine::is_windows_library(path) {
        let loaded = WindowsLibrary::load(path);
        let failed = |what| OpenError::Library { path: fmu.path.clone(), what };
        return loaded.map(LibraryHandle::Windows).map_err(failed);
    }
    // An FMU's runtime may install handlers of its own while it is loaded: they must come before ours.
    call_monitor::install_crash_handler();
    let linkage = fmu.library_linkage();
    let failed = |error| OpenError::Library {
        path: fmu.path.clone(),
        what: load_failure_reason(&error, fmu, &linkage),
    };
    start_expected_python(fmu).map_err(|what| OpenError::Library { path: fmu.path.clone(), what })?;
    // The library itself keeps those that it needs.
    let mut first = Vec::new();
    for path in &linkage.first {
        // SAFETY: loading runs the library's initialisers; an FMU is code that the user asked to run.
        first.push(unsafe { load_with_dependencies(path) }.map_err(failed)?);
    }
    // SAFETY: as above.
    unsafe { load_with_dependencies(path) }.map(LibraryHandle::Native).map_err(failed)
}

/// Loads a library with all that it needs from others: what is missing would end the process at its first use.
///
/// # Safety
/// Loading runs the library's initialisers.
#[cfg(unix)]
unsafe fn load_with_dependencies(path: &Path) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: as for this function.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map(Into::into)
}

#[cfg(not(unix))]
use libloading::Library::new as load;

/// Whether a library is loaded: by its path, or by its name.
#[cfg(unix)]
pub(crate) fn is_loaded(path: &Path) -> bool {
    use libloading::os::unix::{Library, RTLD_LAZY};
    /// Of dlfcn.h: nothing is loaded.
    const RTLD_NOLOAD: c_int = 4;
    // SAFETY: what is loaded has run its initialisers.
    unsafe { Library::open(Some(path), RTLD_LAZY | RTLD_NOLOAD) }.is_ok()
}

#[cfg(not(unix))]
pub(crate) fn is_loaded(_: &Path) -> bool {
    false
}

/// The functions that the library lacks of those of a version and an interface.
fn missing_interface_symbols(library: &LibraryHandle, about: &FmuDescription) -> Vec<&'static str> {
    let (version, interface) = (about.version, about.interface);
    let prefix = about.symbol_prefix();
    let common = match version {
        FmiVersion::One => Fmi1Library::COMMON_SYMBOLS,
        FmiVersion::Two => Fmi2Functions::SYMBOLS,
        FmiVersion::Three => Fmi3Functions::SYMBOLS,
    };
    let own = match (version, interface) {
        (FmiVersion::One, interface) => Fmi1Library::interface_symbols(interface),
        (FmiVersion::Two, FmiInterface::CoSimulation) => Fmi2CoSimulationFunctions::SYMBOLS,
        (FmiVersion::Three, FmiInterface::CoSimulation) => Fmi3CoSimulationFunctions::SYMBOLS,
        (FmiVersion::Two, FmiInterface::ModelExchange) => Fmi2ModelExchangeFunctions::SYMBOLS,
        (FmiVersion::Three, FmiInterface::ModelExchange) => Fmi3ModelExchangeFunctions::SYMBOLS,
    };
    [common, own].into_iter().flat_map(|symbols| missing_symbols(library, &prefix, symbols)).collect()
}

fn missing_symbols(
    library: &LibraryHandle,
    prefix: &str,
    symbols: &'static [&'static str],
) -> Vec<&'static str> {
    let lacks =
        |symbol: &&&str| !library.has_function(&format!("{prefix}{symbol}")) && !library.has_function(symbol);
    symbols.iter().filter(lacks).copied().collect()
}

/// The loader's own words, which `libloading` keeps as the source of its error, and what to do about them.
fn load_failure_reason(error: &libloading::Error, fmu: &Fmu, linkage: &LibraryLinkage) -> String {
    let inner = std::error::Error::source(error);
    let what = inner.map_or_else(|| error.to_string(), ToString::to_string);
    if what.contains("failed to map segment") {
        let folder = fmu.folder.description_folder().display();
        return format!(
            "{what}; the temporary folder {folder} may be on a disk that is mounted with `noexec`: name another folder in the environment variable TMPDIR"
        );
    }
    if let Some((name, path)) = linkage.mismatched.iter().find(|(name, _)| what.contains(name.as_str())) {
        let inside = path.strip_prefix(fmu.folder.description_folder()).unwrap_or(path).display();
        return format!(
            "{what}; `{name}` lies in the archive as {inside}, but has no DT_SONAME of that name, so it is found only by the path: \
             `patchelf --set-rpath '$ORIGIN'` of the library that needs it, or `patchelf --set-soname {name}` of that one, \
             or LD_LIBRARY_PATH with a folder that it is unpacked to"
        );
    }
    if what.contains("cannot open shared object file")
        && let Some(missing) = describe_missing_libraries(&linkage.missing, fmu.folder.description_folder())
    {
        return format!("{what}; {missing}");
    }
    what
}
