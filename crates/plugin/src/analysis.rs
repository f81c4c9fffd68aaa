//! Defines the two sides of an analysis: the author's part, and the program's services to it.

use serde::de::DeserializeOwned;

use crate::config::from_toml;
use crate::diagram::Diagram;
use crate::error::{AnalysisError, ConfigError};
use crate::signal::{InputSignal, Signal};

/// The task of an analysis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnalysisRequest<'a> {
    /// Its configuration, TOML.
    pub config: &'a str,
    /// Its signals.
    pub signals: Vec<Signal<'a>>,
}

impl<'a> AnalysisRequest<'a> {
    /// The signal of this name.
    #[must_use]
    pub fn find_signal(&self, name: &str) -> Option<Signal<'a>> {
        self.signals.iter().find(|signal| signal.name == name).copied()
    }

    /// Reads the configuration.
    ///
    /// # Errors
    /// With the key, and serde's message about it.
    pub fn read_config<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        from_toml(self.config)
    }
}

/// The program, as an analysis sees it.
pub trait AnalysisServices {
    /// Reports the share of the work that is done, 0 to 1, and the next task. `false` asks the analysis to give up.
    fn report_progress(&mut self, share: f64, task: &str) -> bool;

    /// Adds signals to the recording, under the name of the group. They have equal lengths and the times of the first. Recordings
    /// begin at 0 s: earlier rows are left out. A group with `X` and `Y` in m and `psi` in rad is also drawn as a second body in the
    /// replay of a scenario with a `[view]` pose.
    fn record_signals(&mut self, group: &str, signals: &[Signal]);

    /// Adds a diagram to the replay. Those of one group are shown together, the first one largest.
    fn add_diagram(&mut self, group: &str, diagram: &Diagram);

    /// Writes a text file into the folder of the report. The name has no folder in it.
    fn write_file(&mut self, name: &str, text: &str);
}

/// A host that ignores everything, for tests.
#[derive(Clone, Copy, Debug, Default)]
pub struct NullAnalysisServices;

impl AnalysisServices for NullAnalysisServices {
    fn report_progress(&mut self, _share: f64, _task: &str) -> bool {
        true
    }
    fn record_signals(&mut self, _group: &str, _signals: &[Signal]) {}
    fn add_diagram(&mut self, _group: &str, _diagram: &Diagram) {}
    fn write_file(&mut self, _name: &str, _text: &str) {}
}

/// An analysis of signals.
///
/// The program may call it from several threads at a time. It keeps the library of a plugin loaded until it ends:
/// threads that an analysis starts may outlive the call.
pub trait Analysis {
    /// The signals that it accepts.
    const INPUTS: &'static [InputSignal];

    /// Judges the configuration and the choice of signals, which have no samples yet. The program asks before
    /// anything runs, and points at the key of the error in the user's file.
    ///
    /// # Errors
    /// With what was expected, what was found and what to do.
    fn check_request(_request: &AnalysisRequest) -> Result<(), ConfigError> {
        Ok(())
    }

    /// Analyses, and gives the result as JSON.
    ///
    /// # Errors
    /// With the reason; the program then counts the analysis as failed.
    fn run(request: &AnalysisRequest, host: &mut dyn AnalysisServices) -> Result<String, AnalysisError>;

    /// The JSON schema of the configuration, if there is one. The program uses it for suggestions and references.
    #[must_use]
    fn config_schema() -> Option<String> {
        None
    }
}
