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

use self::call::{GUARD, RemoteCall};
use self::process::WindowsProcess;
use super::functions::{Fmi2CoSimulationFunctions, OTHER_SYMBOLS};
use super::{FmiStatus, OK};
use crate::wine::{WindowsBits, WineSetup, describe_load_error, windows_path};

pub use self::process::cancel_wine_calls_when;

/// The row that loads the library.
const LOAD: usize = 0x10000;
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
        let loaded = load_library(&process, &windows_path(path), &windows_path(folder), &symbols);
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

/// Loads the library at `path`, as Windows names it, with functions by their rows; whether it has each of them.
///
/// # Errors
/// With the error of Windows; nothing when the process is gone.
fn load_library(
    process: &WindowsProcess,
    path: &str,
    folder: &str,
    symbols: &[&str],
) -> Result<Vec<bool>, Option<u64>> {
    let text = |text: &str| [text.as_bytes(), &[0]].concat();
    let names: Vec<u8> = symbols.iter().flat_map(|symbol| text(symbol)).chain([0]).collect();
    let mut there = vec![0_u8; symbols.len() + GUARD];
    let call = RemoteCall::new(process).bytes(&text(path)).bytes(&text(folder)).bytes(&names);
    // SAFETY: there is room for the guard behind the flags.
    let mut call = unsafe { call.output(there.as_mut_ptr(), symbols.len()) };
    match (call.run(LOAD), call.result()) {
        (OK, 0) => Ok(there.iter().take(symbols.len()).map(|flag| *flag != 0).collect()),
        (OK, error) => Err(Some(error)),
        _ => Err(None),
    }
}
