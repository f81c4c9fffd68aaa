//! Finds a plugin in a dynamic library and calls it: the program's side of the boundary.
#![allow(unsafe_code, reason = "a library is loaded, and its pointers become references here")]

use std::fmt;
use std::path::{Path, PathBuf};

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};

use crate::abi::{AnalysisFn, HostCallbacks, SYMBOL, Text, VERSION, Vtable};
use crate::analysis::{AnalysisRequest, AnalysisServices, NullAnalysisServices};
use crate::c_views::to_c_column;
use crate::error::{AnalysisError, ConfigError};
use crate::signal::InputSignal;

mod callbacks;
mod guard;

use callbacks::{CallState, diagram, done, file, progress, record, take_needs, take_schema};
use guard::CallGuard;

/// A signal that a loaded plugin accepts.
pub type OwnedInputSignal = InputSignal<String>;

/// Failure to load a plugin.
#[derive(Debug)]
#[non_exhaustive]
pub enum LoadError {
    /// The library does not load.
    Open(PathBuf, libloading::Error),
    /// The library exports no plugin.
    NoPlugin(PathBuf),
    /// The plugin was built for another version of the interface.
    Version {
        /// The library.
        path: PathBuf,
        /// The plugin's version.
        found: u32,
    },
    /// The plugin's table lacks a function.
    Incomplete(PathBuf, &'static str),
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Open(path, error) => {
                write!(f, "cannot load the plugin {}: {error}", path.display())
            }
            Self::NoPlugin(path) => {
                write!(f, "{} is no plugin: it exports no `trackside_plugin`", path.display())
            }
            Self::Version { path, found } => write!(
                f,
                "the plugin {} was built for version {found} of the plugin interface, this program has version {VERSION}: \
                 build it again with this program's crate `plugin`",
                path.display()
            ),
            Self::Incomplete(path, function) => {
                write!(f, "the plugin {} has no function `{function}`", path.display())
            }
        }
    }
}

impl std::error::Error for LoadError {}

/// A loaded plugin.
#[derive(Debug)]
pub struct Plugin {
    check: AnalysisFn,
    run: AnalysisFn,
    needs: Vec<OwnedInputSignal>,
    schema: Option<String>,
}

impl Plugin {
    /// Loads the library at `path`, for as long as the process lives.
    ///
    /// # Errors
    /// When it is no plugin for this version of the interface.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        // All that it needs from others is looked for now: what is missing would end the process at its first use.
        let how = RTLD_NOW | RTLD_LOCAL;
        // SAFETY: loading runs the library's initialisers, on behalf of the user who named it.
        let library = unsafe { Library::open(Some(path), how) };
        let library = library.map_err(|error| LoadError::Open(path.to_owned(), error))?;
        // SAFETY: a library that exports this name exports this function, in every version of the interface.
        let entry = unsafe { library.get::<unsafe extern "C" fn() -> *const Vtable>(SYMBOL) };
        let entry = entry.map_err(|_| LoadError::NoPlugin(path.to_owned()))?;
        // SAFETY: the same.
        let vtable = unsafe { entry() };
        // Never unloaded: threads that the plugin starts, such as those of a global pool, run its code until the
        // process ends. From here on its table is there as long as the process.
        std::mem::forget(library);
        if vtable.is_null() || !vtable.is_aligned() {
            return Err(LoadError::NoPlugin(path.to_owned()));
        }
        // SAFETY: every version's table begins with the version; nothing more may be read yet.
        let found = unsafe { vtable.cast::<u32>().read() };
        if found != VERSION {
            return Err(LoadError::Version { path: path.to_owned(), found });
        }
        // SAFETY: the table is of this version.
        Self::from_vtable(unsafe { *vtable }).map_err(|name| LoadError::Incomplete(path.to_owned(), name))
    }

    /// Calls what the table lists; the name of a function that is missing.
    fn from_vtable(vtable: Vtable) -> Result<Self, &'static str> {
        let check = vtable.check.ok_or("check")?;
        let run = vtable.run.ok_or("run")?;
        let list = vtable.needs.ok_or("needs")?;
        let needs = CallGuard::new(Vec::new());
        // SAFETY: the function hands the context back to `take_needs`, which expects this guard.
        unsafe { list(needs.context_pointer(), take_needs) };
        let schema = CallGuard::new(None);
        if let Some(describe) = vtable.schema {
            // SAFETY: the same, of `take_schema`.
            unsafe { describe(schema.context_pointer(), take_schema) };
        }
        let (needs, schema) = (needs.finish().0, schema.finish().0);
        Ok(Self { check, run, needs, schema })
    }

    /// The signals that it accepts.
    #[must_use]
    pub fn input_signals(&self) -> &[OwnedInputSignal] {
        &self.needs
    }

    /// The JSON schema of its configuration, if it has one.
    #[must_use]
    pub fn config_schema(&self) -> Option<&str> {
        self.schema.as_deref()
    }

    /// Lets the plugin judge a configuration with these signals, which need no samples.
    ///
    /// # Errors
    /// With the plugin's message, and the key that it blames.
    pub fn check_request(&self, request: &AnalysisRequest) -> Result<(), ConfigError> {
        match call_plugin(self.check, request, &mut NullAnalysisServices) {
            Ok(_) => Ok(()),
            Err(AnalysisError::Config(error)) => Err(error),
            Err(AnalysisError::Failed(message)) => Err(ConfigError::new(message)),
        }
    }

    /// Analyses.
    ///
    /// # Errors
    /// With the plugin's message; also when it panicked, and when it broke the rules of the boundary.
    ///
    /// # Panics
    /// When the host panics: after the plugin has returned.
    pub fn run(
        &self,
        request: &AnalysisRequest,
        host: &mut dyn AnalysisServices,
    ) -> Result<String, AnalysisError> {
        call_plugin(self.run, request, host)
    }
}

/// Calls a function of a plugin.
fn call_plugin(
    function: AnalysisFn,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Result<String, AnalysisError> {
    let state = CallGuard::new(CallState { host, outcome: None, breach: None });
    let context = state.context_pointer();
    let callbacks = HostCallbacks { context, progress, record, diagram, file, done };
    let columns: Vec<_> = request.signals.iter().map(to_c_column).collect();
    let config = Text::new(request.config);
    // SAFETY: everything lives until the call is over, and the callbacks expect this context.
    unsafe { function(config, columns.as_ptr(), columns.len(), &raw const callbacks) };
    let (CallState { outcome, breach, .. }, foreign_thread) = state.finish();
    let failed = |message: &str| Err(AnalysisError::Failed(message.to_owned()));
    match (breach, outcome) {
        _ if foreign_thread => failed("called the program back on a thread of its own"),
        (Some(breach), _) => failed(&breach),
        (None, Some(outcome)) => outcome,
        (None, None) => failed("returned without a result"),
    }
}

#[cfg(test)]
mod tests;
