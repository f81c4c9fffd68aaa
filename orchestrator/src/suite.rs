//! Runs scenarios as tests: each in a process of its own, several at a time, a line for each.

mod cause;
pub mod creation;
mod history;
mod junit;
pub mod orphans;
mod page;
mod process;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use assessment::baseline::BaselineOutcome;
use assessment::check::CheckVerdict;
use diagnostics::{Error, ErrorCollector, ErrorRecord, signal_name};
use rayon::prelude::*;
use scenario::plan::REPORT;
use scenario::{Scenario, document, resolve};
use serde::Deserialize;

use crate::baseline_change::BaselineChange;
use crate::messages::{self, NodeMessage};
use crate::nearest_path::nearest_path;
use crate::package;
use crate::report::{AnalysisVerdict, DOUBTFUL_EXIT_CODE, RunVerdict};
pub use history::{OutcomeChange, OutcomeKind, SuiteHistory};
pub use junit::{check_junit, write_junit};
pub use page::{PAGE, SuitePageHeader, write_suite_page};
pub use process::error_record_line;
use process::{KillReason, ProcessOutcome};

/// The limit of a scenario that has none.
const LIMIT: Duration = Duration::from_secs(3600);
/// How lines of warnings begin.
const WARNING: &str = "warning: ";
/// A scenario that is larger has no title [bytes].
const LARGEST: u64 = 16 << 20;

/// The program `trackside`, which runs each scenario.
#[derive(Debug, Clone, Copy)]
pub struct TracksideProgram<'a> {
    /// Where it is.
    pub path: &'a Path,
    /// Arguments of `trackside run` besides the scenario and its folder.
    pub arguments: &'a [&'a str],
    /// Time that each scenario may take, instead of its own limit.
    pub limit: Option<Duration>,
}

/// How a scenario ended as a test.
#[derive(Debug, Clone)]
pub struct TestResult {
    /// The scenario file.
    pub path: PathBuf,
    /// What the scenario says that it is.
    pub title: Option<String>,
    /// What became of it.
    pub outcome: ScenarioOutcome,
    /// Why its run did not come to its end: the mistakes of the scenario, or the failure of an FMU; nothing where its process ended without
    /// a word.
    pub errors: Vec<ErrorRecord>,
    /// What became of its checks, and of those of its validations, as far as it came.
    pub checks: Vec<CheckResult>,
    /// A line for each warning of its run.
    pub warnings: Vec<String>,
    /// A line for each kind of warnings and errors of its nodes.
    pub messages: Vec<String>,
    /// Its comparisons with baselines.
    pub baselines: Vec<BaselineOutcome>,
    /// Lines about what the baselines that it wrote change.
    pub baseline_changes: Vec<String>,
    /// Whether its run left a report of its own.
    pub has_report: bool,
    /// How long it took.
    pub time: Duration,
}

/// What became of a check.
#[derive(Debug, Clone)]
pub struct CheckResult {
    /// The validation whose check it is; none for a check of the scenario itself.
    pub validation: Option<String>,
    /// Its verdict.
    pub verdict: CheckVerdict,
}

/// What became of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScenarioOutcome {
    /// All its checks passed.
    Passed,
    /// It came to its end and has no checks: nothing was judged. It counts as passed.
    NoChecks,
    /// It did not run, for this reason.
    Skipped(String),
    /// A check failed, or an analysis has another verdict than the expected one: a line for each.
    Failed(String),
    /// It is wrong, or an FMU failed or crashed: what the run said.
    Broken(String),
    /// A signal asked for the end before it was over, or before it began.
    Interrupted(String),
}

/// The scenario files that `paths` name: files as they are, folders with all `*.toml` in them.
///
/// # Errors
/// When a path does not exist, no file is found, or two have the same name.
pub fn find_scenario_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let missing = paths.iter().filter(|path| !path.exists());
    let errors = missing.map(|path| Err::<(), _>(missing_scenario_error(path, paths)));
    ErrorCollector::collect_all(errors)?;
    let mut found = Vec::new();
    for path in paths {
        let read = |error| Error::invalid_input(format!("cannot read {}: {error}", path.display()));
        if std::fs::metadata(path).map_err(read)?.is_dir() {
            let entries = std::fs::read_dir(path).map_err(read)?;
            let files = entries.flatten().map(|entry| entry.path());
            found.extend(files.filter(|file| file.extension().is_some_and(|end| end == "toml")));
        } else if document::is_fmu(path) {
            let path = path.display();
            let error = Error::invalid_input(format!("expected a scenario to test, found the FMU {path}"));
            return Err(error.with_help(format!(
                "`trackside conform {path}` judges an FMU; `trackside run {path} --save-scenario FILE` begins a scenario, which takes checks"
            )));
        } else {
            found.push(path.clone());
        }
    }
    found.sort();
    found.dedup();
    match found.is_empty() {
        true => Err(Error::invalid_input("there is no scenario to test")),
        false => check_names(&found).map(|()| found),
    }
}

/// About a path that is not there, with the nearest one that is: beside it, or in a folder that was named as well. Nothing runs then, as with
/// pytest and cargo: a suite that leaves out a misspelt scenario would pass without it.
fn missing_scenario_error(path: &Path, paths: &[PathBuf]) -> Error {
    let message = format!(
        "cannot read {}: there is no such scenario or folder, so no scenario was run",
        path.display()
    );
    let folders: Vec<_> = paths.iter().filter(|it| it.is_dir()).map(PathBuf::as_path).collect();
    let may_be_meant = |it: &Path| it.is_dir() || it.extension().is_some_and(|ending| ending == "toml");
    let help = match nearest_path(path, &folders, may_be_meant) {
        Some(nearest) => format!("did you mean `{}`?", nearest.display()),
        None => "name scenario files, or folders of them: trackside test FOLDER".to_owned(),
    };
    Error::invalid_input(message).with_help(help)
}

/// Makes sure that no two scenarios have the same name, which names the folder of their files.
///
/// # Errors
/// With both files.
pub fn check_names(paths: &[PathBuf]) -> Result<(), Error> {
    for (index, path) in paths.iter().enumerate() {
        let twin = paths[..index].iter().find(|other| other.file_stem() == path.file_stem());
        if let Some(twin) = twin {
            let (one, other) = (twin.display(), path.display());
            let error = Error::invalid_input(format!("{one} and {other} would write to the same folder"));
            return Err(error.with_help("rename one of them, or run them one after the other with --out"));
        }
    }
    Ok(())
}

/// The first data file of the scenario that is not there, if any: data of others cannot be part of a
/// repository, and without it there is nothing to test.
#[must_use]
pub fn missing_data_file(scenario: &Scenario) -> Option<PathBuf> {
    let mut paths = scenario.recorded_input_files().map(|path| scenario.source.resolve_path(path));
    let absent = paths.find(|path| !path.exists());
    absent.or_else(|| scenario.validations.iter().find_map(missing_data_file))
}

/// Runs all scenarios, `jobs` at a time, each by the program into a folder of its own below
/// `out`. `progress` follows the building of packages; `done` is called as each scenario ends.
///
/// # Errors
/// When the FMUs of the first scenario cannot be built.
pub fn run_scenario_tests(
    program: TracksideProgram,
    paths: &[PathBuf],
    jobs: usize,
    out: &Path,
    progress: package::OnProgress,
    done: &(dyn Fn(&TestResult) + Sync),
) -> Result<Vec<TestResult>, Error> {
    // Built once beforehand, not by every process at the same time.
    for path in paths {
        if let Ok(scenario) = Scenario::read(path) {
            let _ = package::build_scenario_packages(&scenario, progress);
        }
    }
    fmu_import::catch_termination_signals();
    orphans::become_subreaper();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
    let pool = pool.map_err(|error| Error::invalid_input(format!("cannot start {jobs} jobs: {error}")))?;
    Ok(pool.install(|| {
        let run = |path: &PathBuf| {
            let result = run_scenario_test(program, path, out);
            done(&result);
            result
        };
        paths.par_iter().map(run).collect()
    }))
}

/// Runs one scenario as a test.
#[must_use]
pub fn run_scenario_test(program: TracksideProgram, path: &Path, out: &Path) -> TestResult {
    let begin = Instant::now();
    let read = Scenario::read(path).ok();
    let title = read.as_ref().map_or_else(|| title_in_text(path), |scenario| scenario.document.title.clone());
    let run = match (fmu_import::termination_signal(), read.as_ref().and_then(skip_reason)) {
        (Some(signal), _) => ScenarioRun::without_process(ScenarioOutcome::Interrupted(format!(
            "not started: {}",
            signal_name(signal)
        ))),
        (None, Some(reason)) => ScenarioRun::without_process(ScenarioOutcome::Skipped(reason)),
        (None, None) => {
            let own = read.as_ref().and_then(|scenario| resolve::wall_clock_limit(scenario).ok().flatten());
            let limit = program.limit.or(own).unwrap_or(LIMIT);
            run_and_read_outcome(program, path, &out.join(path.file_stem().unwrap_or_default()), limit)
        }
    };
    let ScenarioRun { outcome, errors, report } = run;
    let has_report = report.is_some();
    let report = report.unwrap_or_default();
    // A run that did not pass writes no baseline.
    let changes = report.baseline_changes.iter().filter(|_| outcome == ScenarioOutcome::Passed);
    let baseline_changes = changes.flat_map(BaselineChange::lines).collect();
    TestResult {
        path: path.to_owned(),
        title: title.filter(|title| !title.is_empty()),
        outcome,
        errors,
        checks: report.check_results(),
        messages: report.message_lines(),
        baselines: report.baselines,
        baseline_changes,
        warnings: report.warnings,
        has_report,
        time: begin.elapsed(),
    }
}

/// The title in a file that is no scenario because of a mistake elsewhere in it.
fn title_in_text(path: &Path) -> Option<String> {
    let text = diagnostics::read_text_bounded(path, LARGEST).ok()?;
    Some(toml::from_str::<toml::Table>(&text).ok()?.get("title")?.as_str()?.to_owned())
}

/// Why a scenario is not run.
fn skip_reason(scenario: &Scenario) -> Option<String> {
    let absent = missing_data_file(scenario)?;
    Some(format!("the data file {} is not there", absent.display()))
}

/// What a process left.
struct ScenarioRun {
    outcome: ScenarioOutcome,
    errors: Vec<ErrorRecord>,
    report: Option<RunSummary>,
}

impl ScenarioRun {
    fn without_process(outcome: ScenarioOutcome) -> Self {
        ScenarioRun { outcome, errors: Vec::new(), report: None }
    }
}

/// What a run wrote for people, its warnings behind its errors.
fn warnings_last(text: &str) -> String {
    let (warnings, others): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with(WARNING));
    let others = others.join("\n");
    match (others.trim().is_empty(), warnings.is_empty()) {
        (false, false) => format!("{}\n{}", others.trim_end(), warnings.join("\n")),
        _ => text.to_owned(),
    }
}

fn run_and_read_outcome(
    program: TracksideProgram,
    path: &Path,
    folder: &Path,
    limit: Duration,
) -> ScenarioRun {
    let ProcessOutcome { status, kill_reason, stderr, errors, identity } =
        match process::run_scenario_process(program, path, folder, limit) {
            Ok(ended) => ended,
            Err(error) => {
                let what = format!("cannot run {}: {error}", program.path.display());
                return ScenarioRun::without_process(ScenarioOutcome::Broken(what));
            }
        };
    let stderr = warnings_last(&stderr);
    let report = RunSummary::read_from_folder(&identity, folder);
    let verdict = report.as_ref().map(|report| report.verdict);
    const DOUBTFUL: i32 = DOUBTFUL_EXIT_CODE as i32;
    let outcome = match (kill_reason, status.code(), verdict) {
        (Some(KillReason::Overdue), ..) => ScenarioOutcome::Broken(format!(
            "it did not end by itself after {} s, its time limit, and was killed\n{stderr}",
            limit.as_secs_f64()
        )),
        (Some(KillReason::StderrLimit), ..) => ScenarioOutcome::Broken(format!(
            "it was killed: it wrote more than {} MB to standard error\n{stderr}",
            process::STDERR_LIMIT >> 20
        )),
        // It may have come to its end in spite of a signal.
        (_, Some(0), Some(RunVerdict::Pass)) => ScenarioOutcome::Passed,
        (_, Some(0), Some(RunVerdict::NoChecks)) => ScenarioOutcome::NoChecks,
        (_, Some(1), Some(RunVerdict::Fail)) | (_, Some(DOUBTFUL), Some(RunVerdict::Doubtful)) => {
            ScenarioOutcome::Failed(report.as_ref().map(RunSummary::failure_lines).unwrap_or_default())
        }
        (Some(KillReason::Interrupted(signal)), ..) => {
            ScenarioOutcome::Interrupted(format!("ended early: {}", signal_name(signal)))
        }
        (None, Some(0 | 1), _) => ScenarioOutcome::Broken(format!(
            "the run ended with {status} and left no report of its own in {}\n{stderr}",
            folder.display()
        )),
        (None, Some(_), _) if stderr.is_empty() => {
            ScenarioOutcome::Broken(format!("the run ended with {status} and without a word"))
        }
        (None, Some(_), _) => ScenarioOutcome::Broken(stderr),
        (None, None, _) => ScenarioOutcome::Broken(format!("the process ended by a {status}\n{stderr}")),
    };
    ScenarioRun { outcome, errors, report }
}

/// What the report of a run says. Another run may have left one in the folder.
#[derive(Deserialize)]
struct RunSummary {
    identity: Option<String>,
    verdict: RunVerdict,
    checks: Vec<CheckVerdict>,
    validations: Vec<ValidationSummary>,
    #[serde(default)]
    analysis_verdicts: Vec<AnalysisVerdict>,
    #[serde(default)]
    baselines: Vec<BaselineOutcome>,
    #[serde(default)]
    baseline_changes: Vec<BaselineChange>,
    #[serde(default)]
    warnings: Vec<String>,
    #[serde(default)]
    messages: Vec<NodeMessage>,
}

impl Default for RunSummary {
    fn default() -> Self {
        RunSummary {
            identity: None,
            verdict: RunVerdict::Error,
            checks: Vec::new(),
            validations: Vec::new(),
            analysis_verdicts: Vec::new(),
            baselines: Vec::new(),
            baseline_changes: Vec::new(),
            warnings: Vec::new(),
            messages: Vec::new(),
        }
    }
}

#[derive(Deserialize)]
struct ValidationSummary {
    name: String,
    checks: Vec<CheckVerdict>,
    #[serde(default)]
    messages: Vec<NodeMessage>,
}

impl RunSummary {
    fn read_from_folder(identity: &str, folder: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(REPORT)).ok()?;
        let report: Self = serde_json::from_str(&text).ok()?;
        (report.identity.as_deref() == Some(identity)).then_some(report)
    }

    fn check_results(&self) -> Vec<CheckResult> {
        let own = self.checks.iter().map(|it| CheckResult { validation: None, verdict: it.clone() });
        let others = self.validations.iter().flat_map(|ValidationSummary { name, checks, .. }| {
            let checked =
                |it: &CheckVerdict| CheckResult { validation: Some(name.clone()), verdict: it.clone() };
            checks.iter().map(checked)
        });
        own.chain(others).collect()
    }

    /// A line for each check that failed, and for each analysis with another verdict than the expected one.
    fn failure_lines(&self) -> String {
        let surprises = self.analysis_verdicts.iter().filter_map(AnalysisVerdict::describe_surprise);
        let surprises = surprises.map(|it| format!("  FAILED  {it}"));
        failed_check_lines(&self.check_results()).chain(surprises).collect::<Vec<_>>().join("\n")
    }

    fn message_lines(&self) -> Vec<String> {
        let others = self.validations.iter().flat_map(|ValidationSummary { name, messages, .. }| {
            messages::warning_and_error_lines(messages).into_iter().map(move |line| format!("{name}: {line}"))
        });
        messages::warning_and_error_lines(&self.messages).into_iter().chain(others).collect()
    }
}

impl CheckResult {
    /// Its name, behind that of the validation.
    #[must_use]
    pub fn qualified_name(&self) -> String {
        let of = self.validation.iter().map(|name| format!("{name}: "));
        of.chain([self.verdict.name.clone()]).collect()
    }
}

/// A line for each check that failed, with its place.
fn failed_check_lines(checks: &[CheckResult]) -> impl Iterator<Item = String> {
    let failed = checks.iter().filter(|check| !check.verdict.passed);
    let line = |check: &CheckResult| {
        let CheckVerdict { that, file, line, reason, .. } = &check.verdict;
        let reason = reason.as_deref().unwrap_or_default();
        format!("  FAILED  {}  {that}  ({reason})  {}:{line}", check.qualified_name(), file.display())
    };
    failed.map(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_process_that_leaves_no_report_of_its_own_has_not_passed() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("a folder");
        let program = |text: &str| {
            let path = folder.path().join("program");
            std::fs::write(&path, format!("#!/bin/sh\nread identity\nmkdir -p \"$4\"\n{text}\n"))
                .expect("a file");
            std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).expect("a program");
            let program = TracksideProgram { path: &path, arguments: &[], limit: None };
            run_scenario_test(program, Path::new("case.toml"), folder.path())
        };
        let report = |identity: &str, verdict: &str| {
            format!(
                "echo '{{\"identity\": \"'{identity}'\", \"verdict\": \"{verdict}\", \"checks\": [], \"validations\": []}}' > \"$4/report.json\""
            )
        };
        let no_report = "left no report of its own";
        for (text, expected) in [
            (report("$identity", "pass"), None),
            (report("$identity", "no checks"), None),
            // The report that this left is there for the next ones.
            ("exit 0".to_owned(), Some(no_report)),
            (report("1", "pass"), Some(no_report)),
            (report("$identity", "fail"), Some(no_report)),
            (report("$identity", "pass") + "; exit 1", Some(no_report)),
            (report("$identity", "pass") + "; echo the disk is full >&2; exit 2", Some("the disk is full")),
            (report("$identity", "pass") + "; kill -9 $$", Some("signal")),
        ] {
            let outcome = program(&text).outcome;
            match (expected, &outcome) {
                (None, ScenarioOutcome::Passed | ScenarioOutcome::NoChecks) => {}
                (Some(says), ScenarioOutcome::Broken(what)) if what.contains(says) => {}
                _ => panic!("{text}: {outcome:?}"),
            }
        }
    }
}
