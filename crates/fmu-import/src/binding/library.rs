//! Loads an FMU's library and finds its functions.

use std::ffi::CStr;
use std::mem::ManuallyDrop;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;

use super::activity::{self, Activity};
use super::functions::{BESIDES, Clocks, Common, Events, Finder, Own, Text, Three, Two};
use crate::description::{Description, Version};
use crate::{CallError, Fmu, OpenError};

const LOADING: &CStr = c"loading its library";

/// A loaded library and the functions that this program calls.
pub struct Library {
    pub(super) common: Common,
    pub(super) own: Own,
    /// Of FMI 3.0; an FMU without event mode may lack them.
    pub(super) events: Option<Events>,
    /// Of FMI 3.0; an FMU without clocks may lack them.
    pub(super) clocks: Option<Clocks>,
    /// Unloaded after the last instance, and before its folder is removed.
    pub(super) handle: ManuallyDrop<libloading::Library>,
    pub(super) fmu: Arc<Fmu>,
    activity: Arc<Activity>,
}

impl std::fmt::Debug for Library {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Library({})", self.fmu.path.display())
    }
}

impl Library {
    pub(crate) fn load(fmu: Arc<Fmu>, path: &Path) -> Result<Self, OpenError> {
        let lacks = |symbol| OpenError::Symbol { path: fmu.path.clone(), symbol };
        let activity = Activity::new(&format!("the FMU {}", fmu.path.display()));
        activity::watch_crashes();
        let (library, changes) = activity.during_rare(LOADING, || open(&fmu, path));
        let library = library?;
        activity.own_libraries();
        changes.into_iter().for_each(|changes| activity.tell(changes, LOADING));
        let version = fmu.description.version;
        // Names of FMI 3.0 that are not called need not be there: libraries of today leave those of other interfaces out.
        if let (Version::Two, Some(symbol)) = (version, absent(&library, version).next()) {
            return Err(lacks(symbol));
        }
        let finder = Finder { library: &library, lacks: &lacks };
        let common = Common::new(&finder, version)?;
        let own = match version {
            Version::Two => Own::Two(Box::new(Two::new(&finder)?)),
            Version::Three => Own::Three(Box::new(Three::new(&finder)?)),
        };
        let events = match (version, fmu.description.event_mode) {
            (Version::Two, _) => None,
            (Version::Three, true) => Some(Events::new(&finder)?),
            (Version::Three, false) => Events::new(&finder).ok(),
        };
        let clocks = if version == Version::Three { Clocks::new(&finder).ok() } else { None };
        let handle = ManuallyDrop::new(library);
        Ok(Library { common, own, events, clocks, handle, fmu, activity })
    }

    /// The functions of FMI 2.0.
    ///
    /// # Errors
    /// When the FMU is of another version.
    #[inline]
    pub(super) fn two(&self, call: &'static str) -> Result<&Two, CallError> {
        match &self.own {
            Own::Two(functions) => Ok(functions),
            Own::Three(_) => Err(not_two(call)),
        }
    }

    /// The functions that the library at `path` lacks: those without which it does not load here, and the others.
    pub(crate) fn missing(fmu: &Fmu, path: &Path) -> Result<[Vec<&'static str>; 2], OpenError> {
        let library = open(fmu, path)?;
        let version = fmu.description.version;
        let events = if fmu.description.event_mode { Events::SYMBOLS } else { &[] };
        let missing: Vec<_> = absent(&library, version).chain(lacking(&library, events)).collect();
        let others: &[&[_]] = match version {
            Version::Two => &[],
            Version::Three => &[Events::SYMBOLS, Clocks::SYMBOLS, BESIDES],
        };
        let others = others.iter().flat_map(|symbols| lacking(&library, symbols));
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
    pub fn description(&self) -> &Description {
        &self.fmu.description
    }

    /// Whether an instance of the FMU returned the status fatal, after which none can be made or called.
    #[must_use]
    #[inline]
    pub fn is_lost(&self) -> bool {
        self.fmu.lost.load(SeqCst)
    }

    /// Notes that an instance returned the status fatal: all instances of the FMU are lost with it.
    pub(super) fn lose(&self) {
        self.fmu.lost.store(true, SeqCst);
    }

    /// What `fmi2GetVersion` or `fmi3GetVersion` says.
    #[must_use]
    pub fn version(&self) -> String {
        text(self.common.get_version)
    }

    /// What `fmi2GetTypesPlatform` says; nothing for FMI 3.0, which has no such function.
    #[must_use]
    pub fn types_platform(&self) -> String {
        match &self.own {
            Own::Two(functions) => text(functions.get_types_platform),
            Own::Three(_) => String::new(),
        }
    }
}

#[cold]
fn not_two(call: &'static str) -> CallError {
    CallError::new(call, "is not called: the FMU is one of FMI 3.0")
}

impl Drop for Library {
    fn drop(&mut self) {
        // What was not freed may go on running: threads of the FMU, for example.
        if !self.is_lost() {
            let _ = self.activity.during_rare(c"unloading its library", || {
                // SAFETY: nobody uses the library after this, since all instances are gone.
                unsafe { ManuallyDrop::drop(&mut self.handle) };
            });
            activity::forget_libraries();
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
    unsafe { load(path) }
        .map_err(|error| OpenError::Library { path: fmu.path.clone(), what: reason(&error) })
}

/// Loads a library with all that it needs from others: what is missing would end the process at its first use.
///
/// # Safety
/// Loading runs the library's initialisers.
#[cfg(unix)]
unsafe fn load(path: &Path) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: as for this function.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map(Into::into)
}

#[cfg(not(unix))]
use libloading::Library::new as load;

fn absent(library: &libloading::Library, version: Version) -> impl Iterator<Item = &'static str> {
    let symbols = match version {
        Version::Two => Two::SYMBOLS,
        Version::Three => Three::SYMBOLS,
    };
    lacking(library, symbols)
}

fn lacking(
    library: &libloading::Library,
    symbols: &'static [&'static str],
) -> impl Iterator<Item = &'static str> {
    // SAFETY: the address is looked at, not called.
    symbols.iter().copied().filter(|symbol| unsafe { library.get::<*const ()>(*symbol) }.is_err())
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
