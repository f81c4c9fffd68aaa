//! Makes the calls of an FMU's library for Windows in a process under Wine.
//!
//! The functions that a table of `functions.rs` gets are ours: each writes its arguments into memory that both processes share, gives the
//! turn to the other one and waits until it comes back. An instance pointer points at a record of ours.

mod call;
mod forwarding;
mod memory;
mod process;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use self::process::WindowsProcess;
use super::FmiStatus;
use super::functions::{Fmi2CoSimulationFunctions, OTHER_SYMBOLS};
use crate::wine::{WindowsBits, WineSetup, describe_load_error, windows_path};

pub use self::process::cancel_wine_calls_when;

/// The status of a call whose process is gone, which no FMU returns.
pub(super) const LOST: FmiStatus = FmiStatus::MIN + 1;
/// The program under Wine says that what a call gave has no room.
const TOO_LARGE: FmiStatus = 0x10000;

/// A library that is loaded under Wine.
#[derive(Debug)]
pub(super) struct WindowsLibrary {
    process: Arc<WindowsProcess>,
    /// What it runs in.
    _setup: WineSetup,
    /// The functions that it has.
    functions: BTreeSet<&'static str>,
}

impl WindowsLibrary {
    /// Loads the library at `path` in a new process.
    ///
    /// # Errors
    /// In a sentence, when Wine is not there or does not start, or the library does not load.
    pub fn load(path: &Path) -> Result<Self, String> {
        let setup = WineSetup::prepare(WindowsBits::of_library(path))?;
        let process = WindowsProcess::start(&setup)?;
        let folder = path.parent().unwrap_or(Path::new("/"));
        // Those that nobody calls are looked for, too.
        let symbols = [forwarding::SYMBOLS, Fmi2CoSimulationFunctions::SYMBOLS, OTHER_SYMBOLS].concat();
        let loaded = process.load(&windows_path(path), &windows_path(folder), &symbols);
        let there = loaded.map_err(|error| match error {
            Some(error) => describe_load_error(error, path, &setup),
            None => format!("it {}", process.end().unwrap_or("has a path that is too long for Windows")),
        })?;
        let functions = symbols.into_iter().zip(there).filter(|it| it.1).map(|it| it.0).collect();
        Ok(WindowsLibrary { process: Arc::new(process), _setup: setup, functions })
    }

    /// The address of the function that forwards calls of this name, if the library has it.
    pub fn find_function(&self, symbol: &str) -> Option<*const ()> {
        forwarding::find_forwarder(symbol).filter(|_| self.has_function(symbol))
    }

    pub fn has_function(&self, symbol: &str) -> bool {
        self.functions.contains(symbol)
    }

    /// Runs calls of functions that take no instance.
    pub fn run_without_instance<T>(&self, body: impl FnOnce() -> T) -> T {
        forwarding::with_current_process(&self.process, body)
    }

    /// How its process ended, once it has.
    pub fn process_end(&self) -> Option<&str> {
        self.process.end()
    }
}
