//! An analysis of what a run recorded, by columns.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use isolation::Sandbox;
use manoeuvre::Manoeuvre;
use plugin::Plugin;
use python::ScriptError;
use python::analysis::AnalysisScript;
use recording::table::TimeSeriesTable;
use recording::{AllVariables, NumberIndex};

use crate::document::ExpectedResult;

/// An analysis, ready to run.
#[derive(Debug)]
pub struct AnalysisPlan {
    /// Its name.
    pub name: String,
    /// Who does it.
    pub analyser: Analyser,
    /// The library or script that it was loaded from.
    pub library: PathBuf,
    /// The sandbox of the process of a script; none where it has none.
    pub sandbox: Option<Sandbox>,
    /// Its configuration in TOML.
    pub config: String,
    /// The signals that it gets.
    pub wired: Vec<WiredSignal>,
    /// The file that some of them are in.
    pub log: Option<TimeSeriesTable>,
    /// The verdict on its own result that is right, where the scenario says one.
    pub expect: Option<ExpectedResult>,
}

impl AnalysisPlan {
    /// Starts the script again, when it was used.
    ///
    /// # Errors
    /// When it does not load.
    pub fn load_script_again(&self) -> Result<AnalysisScript, ScriptError> {
        load_script_in_sandbox(&self.library, self.sandbox.as_ref())
    }
}

/// What may be behind a failure of a script that it does not have elsewhere.
pub const SANDBOX_HINT: &str =
    "it is in a sandbox: with `isolate = true`, `may_read` adds files that it may read";

/// Loads a script in a process of its own, in a sandbox where it can read its interpreter, too, if there is one.
///
/// # Errors
/// When it does not load.
pub(crate) fn load_script_in_sandbox(
    path: &Path,
    sandbox: Option<&Sandbox>,
) -> Result<AnalysisScript, ScriptError> {
    AnalysisScript::load_script(path, &|interpreter, folder| {
        let Some(sandbox) = sandbox else { return Ok(Vec::new()) };
        let mut sandbox = sandbox.clone();
        sandbox.read.extend(interpreter.code_folders());
        sandbox.write.push(folder.to_owned());
        isolation::sandbox_entrance(&sandbox)
    })
}

/// Who does an analysis.
#[derive(Debug)]
pub enum Analyser {
    /// A plugin in this process.
    Plugin(Plugin),
    /// A script in a process of its own, until it is used.
    Python(Mutex<Option<AnalysisScript>>),
    /// The manoeuvre that was driven: the signals are what the driver commanded and measured, in the order of
    /// [`Manoeuvre::test_log`].
    Manoeuvre(Arc<Manoeuvre>),
}

/// A signal of an analysis.
#[derive(Debug)]
pub struct WiredSignal {
    /// The name that the plugin knows it by.
    pub name: String,
    /// The unit that it is handed over in.
    pub unit: String,
    /// Its origin.
    pub origin: SignalOrigin,
    /// Gain and unit conversion: what the values are multiplied by.
    pub factor: f64,
    /// Offset and unit conversion: what is added after that.
    pub offset: f64,
}

/// The origin of a signal of an analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalOrigin {
    /// A number in the rows of the run.
    Run(NumberIndex<AllVariables>),
    /// A column of the analysis' file.
    Log(usize),
}
