//! Takes a finished run as right: its recording becomes its baselines, or the scenario gets the tubes that hold it.

use std::path::{Path, PathBuf};

use assessment::baseline::BaselineOutcome;
use assessment::check::CheckVerdict;
use diagnostics::{Error, ErrorCollector};
use fmu_import::sha256_hex;
use recording::{CsvSink, Recording, Sink as _};
use scenario::plan::REPORT;
use serde::Deserialize;

use super::{FORCE, foreign_recording, replace_baseline};
use crate::baseline_change::BaselineChange;
use crate::report::{FileHash, RunVerdict};
use crate::tube_lines;

/// A run that came to its end, by its report.
#[derive(Debug)]
pub struct FinishedRun {
    folder: PathBuf,
    report: FinishedReport,
}

#[derive(Debug, Deserialize)]
struct FinishedReport {
    verdict: RunVerdict,
    checks: Vec<CheckVerdict>,
    validations: Vec<FinishedValidation>,
    #[serde(default)]
    baselines: Vec<BaselineOutcome>,
    #[serde(default)]
    sources: Vec<FileHash>,
}

#[derive(Debug, Deserialize)]
struct FinishedValidation {
    name: String,
    verdict: RunVerdict,
}

/// A scenario file that got tubes.
#[derive(Debug)]
pub struct TubeEdit {
    /// The file.
    pub file: PathBuf,
    /// The baseline.
    pub baseline: String,
    /// The signals that have a tube which holds them.
    pub written: usize,
    /// The signals that no tube holds.
    pub unheld: Vec<String>,
}

impl FinishedRun {
    /// Reads the report of the run in a folder, or beside a file of it.
    ///
    /// # Errors
    /// When there is no such report, or the run was compared with no baseline.
    pub fn read(run: &Path) -> Result<Self, Error> {
        let beside = || run.parent().unwrap_or(Path::new("")).to_owned();
        let folder = if run.is_file() { beside() } else { run.to_owned() };
        let path = folder.join(REPORT);
        let wrong = |what: String| {
            let error = Error::invalid_input(format!("expected the folder of a finished run, found {what}"));
            error.with_help("`trackside run SCENARIO --out FOLDER` leaves one")
        };
        let text = std::fs::read_to_string(&path)
            .map_err(|error| wrong(format!("{} without {REPORT} ({error})", folder.display())))?;
        let report: FinishedReport = serde_json::from_str(&text)
            .map_err(|error| wrong(format!("{}, which is none of a run ({error})", path.display())))?;
        if report.baselines.is_empty() {
            let message = format!("the run in {} was compared with no baseline", folder.display());
            let error = Error::invalid_input(message);
            return Err(error.with_help("`trackside run SCENARIO --bless` writes the first one"));
        }
        Ok(FinishedRun { folder, report })
    }

    /// Why the run is no baseline: a check that is none of a baseline failed, or it did not come to its end.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        let FinishedReport { verdict, checks, validations, baselines, .. } = &self.report;
        if !matches!(verdict, RunVerdict::Pass | RunVerdict::Fail | RunVerdict::Doubtful) {
            return Some("the run did not come to its end".to_owned());
        }
        let is_baseline = |check: &&CheckVerdict| baselines.iter().any(|it| it.name == check.name);
        let check = checks.iter().find(|check| !check.passed && !is_baseline(check));
        let validation = validations.iter().find(|it| !it.verdict.is_success());
        check
            .map(|check| format!("the check `{}` failed", check.name))
            .or_else(|| validation.map(|it| format!("the validation `{}` did not pass", it.name)))
    }

    /// What its recording changes in each of its baselines.
    #[must_use]
    pub fn changes(&self) -> Vec<BaselineChange> {
        self.report.baselines.iter().cloned().map(BaselineChange::from_comparison).collect()
    }

    /// Writes its recording to the places of its baselines, and returns these.
    ///
    /// # Errors
    /// When the recording is damaged or cut off, or a baseline is not where it was, or is another file and nobody forces it, or cannot be
    /// written.
    pub fn write_baselines(&self, force: bool) -> Result<Vec<&Path>, Error> {
        let recording = Recording::open(&self.folder)?;
        if recording.cut {
            let path = recording.path().display();
            return Err(Error::invalid_input(format!("{path} was cut off: it is no baseline")));
        }
        let mut baselines = self.report.baselines.iter().filter(|_| !force);
        if let Some(message) = baselines.find_map(|it| foreign_recording(&it.recording)) {
            return Err(Error::invalid_input(message).with_help(FORCE));
        }
        let written = self.report.baselines.iter().map(|BaselineOutcome { recording: path, .. }| {
            if !path.exists() {
                return Err(moved_file_error(path));
            }
            if path.extension().is_some_and(|it| it == "csv") {
                let mut sink = CsvSink::create(&recording.header, path)?;
                recording.replay_into(&mut sink)?;
                sink.finish("", true)?;
                attribution::save_baseline_inputs(&self.folder, path)?;
            } else {
                replace_baseline(recording.path(), path)?;
            }
            Ok(path.as_path())
        });
        written.collect()
    }

    /// Writes the tubes that hold this run into the files of its scenario.
    ///
    /// # Errors
    /// When a file is another one than when the run was made, or cannot be read, edited or written. Nothing is written then.
    pub fn write_tubes(&self) -> Result<Vec<TubeEdit>, Error> {
        let left = self.report.baselines.iter().filter(|it| it.signals.iter().any(|signal| !signal.passed));
        let (mut texts, mut edits) = (Vec::<(PathBuf, String)>::new(), Vec::new());
        let mut mistakes = ErrorCollector::default();
        for outcome in left {
            mistakes.ok_or_record(self.edit_baseline(outcome, &mut texts, &mut edits));
        }
        mistakes.into_result()?;
        for (file, text) in texts {
            std::fs::write(&file, text).map_err(|error| Error::output_failure(&file, error))?;
        }
        Ok(edits)
    }

    /// Edits the text of the file that has a baseline.
    fn edit_baseline(
        &self,
        outcome: &BaselineOutcome,
        texts: &mut Vec<(PathBuf, String)>,
        edits: &mut Vec<TubeEdit>,
    ) -> Result<(), Error> {
        let check = self.report.checks.iter().find(|check| check.name == outcome.name);
        let file = check.map(|check| check.file.clone()).unwrap_or_default();
        let at = match texts.iter().position(|(path, _)| *path == file) {
            Some(at) => at,
            None => {
                texts.push((file.clone(), self.unchanged_source(&file)?));
                texts.len() - 1
            }
        };
        let edited = tube_lines::with_required_tubes(&texts[at].1, outcome)
            .map_err(|what| Error::invalid_input(format!("{}: {what}", file.display())))?;
        let unheld = outcome.signals.iter().filter(|it| !it.passed && it.tube.is_none());
        let unheld = unheld.map(|it| it.signal.clone()).collect();
        let written = edited.1;
        texts[at].1 = edited.0;
        edits.push(TubeEdit { file, baseline: outcome.name.clone(), written, unheld });
        Ok(())
    }

    /// The text of a file of the scenario, as the run read it.
    fn unchanged_source(&self, file: &Path) -> Result<String, Error> {
        let text = std::fs::read_to_string(file).map_err(|_| moved_file_error(file))?;
        let known = self.report.sources.iter().find(|source| source.path == file);
        match known {
            Some(source) if source.sha256 == sha256_hex(text.as_bytes()) => Ok(text),
            _ => {
                let message = format!("{} is another one than when the run was made", file.display());
                Err(Error::invalid_input(message).with_help("run the scenario again"))
            }
        }
    }
}

fn moved_file_error(path: &Path) -> Error {
    let message = format!("expected {}, which the run has read, found no such file", path.display());
    Error::invalid_input(message).with_help("call this from the folder that the run was started in")
}
