//! The errors of the program, with places in files, remedies and exit codes.

use std::ops::Range;
use std::path::{Path, PathBuf};

use miette::{Diagnostic, LabeledSpan, SourceCode};

use crate::excerpt::SourceExcerpt;
use crate::text_file::TextFile;

/// Why a run could not be done, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Something that the user wrote is wrong: a scenario, a table, an argument.
    #[error("{0}")]
    Input(Box<InputError>),
    /// An FMU failed.
    #[error("{0}")]
    Component(Box<NodeFailure>),
    /// An analysis failed.
    #[error("analysis `{name}`: {what}")]
    Analysis {
        /// Its name in the scenario.
        name: String,
        /// Its message, or its misbehaviour.
        what: String,
    },
    /// A validation did not come to its end.
    #[error("validation `{name}`: {error}")]
    Validation {
        /// Its name in the scenario.
        name: String,
        /// Why.
        error: Box<Error>,
    },
    /// A result could not be written.
    #[error("{}: could not write: {what}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Message of the system.
        what: String,
    },
    /// The run lasted longer than it may, or a call of foreign code did.
    #[error("{0}")]
    Overdue(String),
    /// A signal asked the program to end.
    #[error("a signal ended the run: {}", signal_name(*.0))]
    Interrupted(u8),
    /// Several mistakes, in the order of the file. None at all when what is wrong was told already.
    #[error("{}", join_messages(.0))]
    Several(Vec<Error>),
}

/// A mistake in a file or an argument of the user, with its place.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct InputError {
    message: String,
    file: Option<SourceExcerpt>,
    labels: Vec<LabeledSpan>,
    help: Option<String>,
    /// The name that nothing has, when this is what is wrong.
    unknown: Option<String>,
}

/// A failure of a node: node, call, time.
#[derive(Debug, Clone, thiserror::Error)]
#[error("node `{node}`: {call}{} {what}", .time.map(|time| format!(" at t = {} s", rounded_time(time))).unwrap_or_default())]
pub struct NodeFailure {
    /// The node's name in the scenario.
    pub node: String,
    /// The call that failed, by the node's own name for it.
    pub call: String,
    /// Simulated time [s], once there is one.
    pub time: Option<f64>,
    /// Its status or message, and its log.
    pub what: String,
}

/// A time for people [s]: `k h` with the rounding error of the product left out.
#[must_use]
pub fn rounded_time(time: f64) -> f64 {
    (time * 1e9).round() / 1e9
}

impl Error {
    /// Something wrong that has no place in a file.
    #[must_use]
    pub fn invalid_input(message: impl Into<String>) -> Self {
        Error::Input(Box::new(InputError {
            message: message.into(),
            file: None,
            labels: Vec::new(),
            help: None,
            unknown: None,
        }))
    }

    /// Something wrong at `span` (bytes of the file), with `label` under the place. `lines` is the number of lines before that of the place.
    #[must_use]
    pub(crate) fn at_span(
        file: &TextFile,
        span: Range<usize>,
        lines: usize,
        message: impl Into<String>,
        label: &str,
    ) -> Self {
        let name = file.path.display().to_string();
        let (excerpt, span) = SourceExcerpt::new(name, &file.text, span, lines);
        let label = (!label.is_empty()).then(|| label.to_owned());
        Error::Input(Box::new(InputError {
            message: message.into(),
            file: Some(excerpt),
            labels: vec![LabeledSpan::new_with_span(label, span)],
            help: None,
            unknown: None,
        }))
    }

    /// What cannot be judged because of a mistake that is told elsewhere.
    #[must_use]
    pub fn already_reported() -> Self {
        Error::Several(Vec::new())
    }

    /// A failure of a node.
    #[must_use]
    pub fn node_failure(node: &str, call: &str, time: Option<f64>, what: impl Into<String>) -> Self {
        Error::Component(Box::new(NodeFailure {
            node: node.to_owned(),
            call: call.to_owned(),
            time,
            what: what.into(),
        }))
    }

    /// A failure of an analysis.
    #[must_use]
    pub fn analysis_failure(name: &str, what: impl Into<String>) -> Self {
        Error::Analysis { name: name.to_owned(), what: what.into() }
    }

    /// A result that could not be written.
    #[must_use]
    pub fn output_failure(path: &Path, what: impl std::fmt::Display) -> Self {
        Error::Output { path: path.to_owned(), what: what.to_string() }
    }

    /// Adds a remedy.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        if let Error::Input(input) = &mut self {
            input.help = Some(help.into());
        }
        self
    }

    /// Adds a remedy, if there is one.
    #[must_use]
    pub fn with_optional_help(self, hint: Option<String>) -> Self {
        match hint {
            Some(hint) => self.with_help(hint),
            None => self,
        }
    }

    /// Says which name nothing has, if this is what is wrong. [`ErrorCollector`](crate::ErrorCollector) leaves the error out when
    /// another one hides that name.
    #[must_use]
    pub fn with_unknown_name(mut self, name: impl Into<Option<String>>) -> Self {
        if let Error::Input(input) = &mut self {
            input.unknown = name.into();
        }
        self
    }

    /// The single mistakes, each as an error of its own.
    #[must_use]
    pub fn into_single_errors(self) -> Vec<Self> {
        match self {
            Error::Several(errors) => errors.into_iter().flat_map(Error::into_single_errors).collect(),
            Error::Validation { name, error } => {
                let of_it = |error| Error::Validation { name: name.clone(), error: Box::new(error) };
                error.into_single_errors().into_iter().map(of_it).collect()
            }
            error => vec![error],
        }
    }

    pub(crate) fn as_input(&self) -> Option<&InputError> {
        match self {
            Error::Input(input) => Some(input),
            Error::Validation { error, .. } => error.as_input(),
            _ => None,
        }
    }

    /// Whether a signal asked for the end.
    #[must_use]
    pub fn is_interruption(&self) -> bool {
        match self {
            Error::Interrupted(_) => true,
            Error::Validation { error, .. } => error.is_interruption(),
            _ => false,
        }
    }

    /// The exit code of the program: 2 for the user's matters, 3 for an FMU's or a plugin's, and what a shell reports of a program
    /// that a signal ended.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Input(_) | Error::Output { .. } => 2,
            Error::Component(_) | Error::Analysis { .. } | Error::Overdue(_) => 3,
            Error::Interrupted(signal) => 128 + signal,
            Error::Validation { error, .. } => error.exit_code(),
            Error::Several(errors) => errors.iter().map(Error::exit_code).max().unwrap_or(2),
        }
    }
}

impl InputError {
    pub(crate) fn source_excerpt(&self) -> Option<&SourceExcerpt> {
        self.file.as_ref()
    }

    /// The name of the file and the place in it [byte], if there is one.
    pub(crate) fn file_name_and_offset(&self) -> Option<(&str, usize)> {
        Some((self.file.as_ref()?.file_name(), self.labels.first()?.offset()))
    }

    /// Where it stands, if that is in a file: its name, line and column.
    pub(crate) fn file_line_and_column(&self) -> Option<(&str, [usize; 2])> {
        let file = self.file.as_ref()?;
        Some((file.file_name(), file.line_and_column(self.labels.first()?.offset())))
    }

    pub(crate) fn unknown_name(&self) -> Option<&str> {
        self.unknown.as_deref()
    }
}

/// The name of a signal that asks a program to end.
#[must_use]
pub fn signal_name(signal: u8) -> String {
    match signal {
        1 => "SIGHUP".to_owned(),
        2 => "SIGINT".to_owned(),
        15 => "SIGTERM".to_owned(),
        other => format!("signal {other}"),
    }
}

fn join_messages(errors: &[Error]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

impl Diagnostic for InputError {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.file.as_ref().map(|file| file as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.labels.iter().cloned()))
    }
}

/// What to do when a file may not grow any more.
const FILE_LIMIT: &str = "`ulimit -f` shows how large files of this shell may become, in blocks of 1024 bytes, and `ulimit -f unlimited` \
                          lifts the limit";

/// Whether the message of the system is that of EFBIG.
fn is_file_too_large(what: &str) -> bool {
    // On Linux and macOS.
    what.contains(&std::io::Error::from_raw_os_error(27).to_string())
}

impl Diagnostic for Error {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        match self {
            Error::Input(input) => input.help(),
            Error::Validation { error, .. } => Diagnostic::help(&**error),
            Error::Output { what, .. } if is_file_too_large(what) => Some(Box::new(FILE_LIMIT)),
            _ => None,
        }
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        match self {
            Error::Input(input) => input.source_code(),
            Error::Validation { error, .. } => error.source_code(),
            _ => None,
        }
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        match self {
            Error::Input(input) => input.labels(),
            Error::Validation { error, .. } => error.labels(),
            _ => None,
        }
    }
}
