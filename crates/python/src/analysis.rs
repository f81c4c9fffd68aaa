//! Runs an analysis script in a Python process: its requested signals, its request, its messages.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::error::ScriptError;
use crate::interpreter::PythonInterpreter;
use crate::process::PythonProcess;
use crate::{ANALYSIS_SERVER, MODEL_SERVER};

/// How long a script may take to load.
const PATIENCE: Duration = Duration::from_secs(120);
/// How often somebody is asked whether the analysis goes on.
const PERIOD: Duration = Duration::from_millis(100);

/// The number of the question, and those of answers that others follow.
const ANALYSE: u8 = 1;
const PROGRESS: u8 = 3;
const RECORD: u8 = 4;

/// The words before the command of an interpreter, such as those of a sandbox where it may write to the folder; none without one.
pub type ScriptEntrance<'a> = &'a dyn Fn(&PythonInterpreter, &Path) -> std::io::Result<Vec<OsString>>;

/// A script that waits for its signals.
#[derive(Debug)]
pub struct AnalysisScript {
    process: PythonProcess,
    /// The units of the signals that it takes; nothing when it takes any.
    requested_units: Option<BTreeMap<String, String>>,
    folder: TempDir,
}

/// A signal for a script. Columns that are one slice are handed over once.
#[derive(Debug, Clone, Copy)]
pub struct SignalColumn<'a> {
    /// The script's name for it.
    pub name: &'a str,
    /// Its unit.
    pub unit: &'a str,
    /// Times [s].
    pub time: &'a [f64],
    /// Values.
    pub values: &'a [f64],
}

/// Signals that a script derived, over the same times.
#[derive(Debug, Clone, PartialEq)]
pub struct DerivedSignals {
    /// Their group.
    pub group: String,
    /// Times [s].
    pub time: Vec<f64>,
    /// Names, units and values.
    pub columns: Vec<(String, String, Vec<f64>)>,
}

/// What a script tells while it works.
#[derive(Debug, Clone, PartialEq)]
pub enum ScriptMessage {
    /// The share that is done, and what comes next; nothing new after a while.
    Progress(Option<(f64, String)>),
    /// Signals for the recording.
    Signals(DerivedSignals),
    /// A line that it printed.
    Printed(String),
}

impl AnalysisScript {
    /// Loads the script at `path`.
    ///
    /// # Errors
    /// With the exception, when it does not load; when the entrance fails.
    pub fn load_script(path: &Path, entrance: ScriptEntrance) -> Result<Self, ScriptError> {
        let interpreter = PythonInterpreter::choose_interpreter(None);
        let folder = tempfile::tempdir();
        let folder = folder.map_err(|error| ScriptError::Ended(format!("no temporary folder: {error}")))?;
        let server = folder.path().join("analysis.py");
        for (path, text) in [(&server, ANALYSIS_SERVER), (&folder.path().join("fmu.py"), MODEL_SERVER)] {
            std::fs::write(path, text)
                .map_err(|error| ScriptError::Ended(format!("{}: {error}", path.display())))?;
        }
        let entrance = entrance(&interpreter, folder.path())
            .map_err(|error| ScriptError::Ended(format!("its process does not start: {error}")))?;
        let mut process =
            PythonProcess::start(&interpreter, &entrance, [server.as_os_str(), path.as_os_str()])?;
        let answer = process.wait_for_answer(PATIENCE)?;
        let requested_units = serde_json::from_slice(answer).unwrap_or_default();
        Ok(AnalysisScript { process, requested_units, folder })
    }

    /// The units of the signals that it takes, by their names; nothing when it takes any.
    #[must_use]
    pub fn requested_units(&self) -> Option<&BTreeMap<String, String>> {
        self.requested_units.as_ref()
    }

    /// Analyses: hands over columns and a configuration, and gives the result. `take` gets what the script tells, and says whether it
    /// goes on. Its files are in the folder of [`output_folder`](Self::output_folder).
    ///
    /// # Errors
    /// With the exception of the script; when its process ends, or `take` ends it.
    pub fn run_analysis(
        &mut self,
        columns: &[SignalColumn],
        config: &Value,
        take: &mut dyn FnMut(ScriptMessage) -> bool,
    ) -> Result<Value, ScriptError> {
        let question = self
            .write_request(columns, config)
            .map_err(|error| ScriptError::Ended(format!("the signals cannot be handed over: {error}")))?;
        self.process.send_request(ANALYSE, &[question.to_string().as_bytes()])?;
        loop {
            let received = self.process.receive_answer(PERIOD);
            for line in self.process.take_lines() {
                take(ScriptMessage::Printed(line));
            }
            let goes_on = match received? {
                None => take(ScriptMessage::Progress(None)),
                Some(PROGRESS) => {
                    let told = serde_json::from_slice(self.process.answer_contents()).ok();
                    self.process.discard_answer();
                    take(ScriptMessage::Progress(told))
                }
                Some(RECORD) => {
                    let derived = parse_derived_signals(self.process.answer_contents());
                    self.process.discard_answer();
                    derived.is_none_or(|derived| take(ScriptMessage::Signals(derived)))
                }
                Some(_) => {
                    return serde_json::from_slice(self.process.answer_contents()).map_err(|error| {
                        ScriptError::Ended(format!(
                            "expected a result in JSON, found something else: {error}"
                        ))
                    });
                }
            };
            if !goes_on {
                return Err(self.process.abort_with_location("it was told to end"));
            }
        }
    }

    /// The folder with the files that the script wrote for the run.
    #[must_use]
    pub fn output_folder(&self) -> PathBuf {
        self.folder.path().join("files")
    }

    /// Writes the columns into a file, and says where in it they are: begin and length, in numbers.
    fn write_request(&self, columns: &[SignalColumn], config: &Value) -> std::io::Result<Value> {
        std::fs::create_dir_all(self.output_folder())?;
        let path = self.folder.path().join("columns");
        let mut file = std::io::BufWriter::new(std::fs::File::create(&path)?);
        let mut length = 0;
        let mut put = |column: &[f64]| {
            for value in column {
                file.write_all(&value.to_le_bytes())?;
            }
            length += column.len();
            std::io::Result::Ok(json!([length - column.len(), column.len()]))
        };
        let mut times: Vec<(&[f64], Value)> = Vec::new();
        let mut signals = Vec::new();
        for SignalColumn { name, unit, time, values } in columns {
            let known = times.iter().position(|(known, _)| std::ptr::eq(*known, *time));
            let place = match known {
                Some(place) => place,
                None => {
                    times.push((time, put(time)?));
                    times.len() - 1
                }
            };
            signals.push(json!({ "name": name, "unit": unit, "time": place, "values": put(values)? }));
        }
        file.flush()?;
        let times: Vec<_> = times.into_iter().map(|(_, place)| place).collect();
        Ok(json!({
            "data": path, "folder": self.output_folder(), "config": config, "times": times, "signals": signals,
        }))
    }
}

/// Reads derived signals: a length, a head in JSON, and all columns behind each other.
fn parse_derived_signals(bytes: &[u8]) -> Option<DerivedSignals> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (head, body) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    let (group, names, rows): (String, Vec<(String, String)>, usize) = serde_json::from_slice(head).ok()?;
    let (numbers, _) = body.as_chunks();
    let mut numbers = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes));
    let mut column = || numbers.by_ref().take(rows).collect::<Vec<_>>();
    let time = column();
    let columns = names.into_iter().map(|(name, unit)| (name, unit, column())).collect();
    Some(DerivedSignals { group, time, columns })
}
