//! The interface to an engine: it takes arrays of tasks, and reports which of them wait and which run.

use std::collections::HashMap;
use std::ffi::OsStr;
use std::process::{Command, Stdio};

use diagnostics::{Error, escape_for_terminal};

use super::submission::TaskArraySubmission;

/// The state of a task that has not ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TaskState {
    Waiting,
    Running,
}

/// The tasks that have not ended, by the number of the submission and by their place in it.
pub(super) type UnfinishedTasks = HashMap<(u32, usize), TaskState>;

/// Why a command of an engine failed.
#[derive(Debug)]
pub(super) enum EngineCommandError {
    /// Its program is not there.
    Missing(&'static str),
    /// It failed with this message.
    Failed(String),
}

/// A program that runs tasks, on this machine or on others.
pub(super) trait TaskEngine {
    /// How many tasks an array may have.
    fn max_array_size(&mut self) -> usize;

    /// Starts the tasks of a submission.
    fn submit_tasks(&mut self, submission: &TaskArraySubmission) -> Result<(), EngineCommandError>;

    /// Which tasks of these submissions have not ended.
    fn unfinished_tasks(
        &mut self,
        submissions: &[TaskArraySubmission],
    ) -> Result<UnfinishedTasks, EngineCommandError>;

    /// Ends the tasks of these submissions.
    fn cancel_tasks(&mut self, submissions: &[TaskArraySubmission]);

    /// Whether its tasks go on when this program ends.
    fn outlives_program(&self) -> bool {
        true
    }

    /// What to do when it is not there.
    fn missing_engine_advice(&self) -> &'static str;
}

/// Runs a command of an engine, and returns its standard output.
pub(super) fn run_command<A: AsRef<OsStr>>(
    program: &'static str,
    arguments: impl IntoIterator<Item = A>,
) -> Result<String, EngineCommandError> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => EngineCommandError::Missing(program),
        _ => EngineCommandError::Failed(format!("{program} does not start: {error}")),
    })?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if output.status.success() {
        return Ok(text(&output.stdout));
    }
    let message = [text(&output.stderr), text(&output.stdout)];
    let message = message.into_iter().find(|message| !message.is_empty());
    Err(EngineCommandError::Failed(
        message.unwrap_or_else(|| format!("{program} ended with {}", output.status)),
    ))
}

impl EngineCommandError {
    /// In words.
    pub fn describe(&self) -> String {
        match self {
            EngineCommandError::Missing(program) => {
                format!("the program {program} is not on the path")
            }
            EngineCommandError::Failed(message) => escape_for_terminal(message).into_owned(),
        }
    }

    /// The error of a sweep that cannot go on because of it.
    pub fn to_sweep_error(&self, remedy: &str) -> Error {
        Error::invalid_input(format!("the chunks cannot be submitted: {}", self.describe())).with_help(remedy)
    }
}
