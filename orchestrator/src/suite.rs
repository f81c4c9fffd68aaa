//! Runs scenarios as tests: each in a process of its own, several at a time, a line for each.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use diagnostics::Error;
use quick_junit::{NonSuccessKind, TestCase, TestCaseStatus, TestSuite};
use rayon::prelude::*;
use scenario::Scenario;

use crate::package;

/// How a scenario ended as a test.
#[derive(Debug, Clone)]
pub struct TestResult {
    /// The scenario file.
    pub path: PathBuf,
    /// What became of it.
    pub outcome: ScenarioOutcome,
    /// How long it took.
    pub time: Duration,
}

/// What became of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScenarioOutcome {
    /// All its checks passed.
    Passed,
    /// It did not run, for this reason.
    Skipped(String),
    /// A check failed: the lines of the report.
    Failed(String),
    /// It is wrong, or an FMU failed or crashed: what the run said.
    Broken(String),
}

/// The scenario files that `paths` name: files as they are, folders with all `*.toml` in them.
///
/// # Errors
/// When a path does not exist, no file is found, or two have the same name.
pub fn find(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    for path in paths {
        let read = |error| Error::input(format!("cannot read {}: {error}", path.display()));
        if std::fs::metadata(path).map_err(read)?.is_dir() {
            let entries = std::fs::read_dir(path).map_err(read)?;
            let files = entries.flatten().map(|entry| entry.path());
            found.extend(files.filter(|file| file.extension().is_some_and(|end| end == "toml")));
        } else {
            found.push(path.clone());
        }
    }
    found.sort();
    found.dedup();
    match found.is_empty() {
        true => Err(Error::input("there is no scenario to test")),
        false => check_names(&found).map(|()| found),
    }
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
            let error = Error::input(format!("{one} and {other} would write to the same folder"));
            return Err(
                error.help("rename one of them, or run them one after the other with --out")
            );
        }
    }
    Ok(())
}

/// The first data file of the scenario that is not there, if any: data of others cannot be part of a
/// repository, and without it there is nothing to test.
#[must_use]
pub fn absent_data(scenario: &Scenario) -> Option<PathBuf> {
    let mut paths = scenario.data_files().map(|path| scenario.source.resolve(path));
    let absent = paths.find(|path| !path.exists());
    absent.or_else(|| scenario.validations.iter().find_map(absent_data))
}

/// Runs all scenarios, `jobs` at a time, each by the program `trackside` into a folder of its own below
/// `out`. `progress` follows the building of packages; `done` is called as each scenario ends.
///
/// # Errors
/// When the FMUs of the first scenario cannot be built.
pub fn run(
    program: &Path,
    paths: &[PathBuf],
    jobs: usize,
    out: &Path,
    progress: package::OnProgress,
    done: &(dyn Fn(&TestResult) + Sync),
) -> Result<Vec<TestResult>, Error> {
    // Built once beforehand, not by every process at the same time.
    for path in paths {
        if let Ok(scenario) = Scenario::read(path) {
            let _ = package::build(&scenario, progress);
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
    let pool = pool.map_err(|error| Error::input(format!("cannot start {jobs} jobs: {error}")))?;
    Ok(pool.install(|| {
        let run = |path: &PathBuf| {
            let result = test(program, path, out);
            done(&result);
            result
        };
        paths.par_iter().map(run).collect()
    }))
}

/// Runs one scenario as a test.
#[must_use]
pub fn test(program: &Path, path: &Path, out: &Path) -> TestResult {
    let begin = Instant::now();
    let outcome = outcome(program, path, out);
    TestResult { path: path.to_owned(), outcome, time: begin.elapsed() }
}

fn outcome(program: &Path, path: &Path, out: &Path) -> ScenarioOutcome {
    if let Ok(scenario) = Scenario::read(path)
        && let Some(absent) = absent_data(&scenario)
    {
        return ScenarioOutcome::Skipped(format!(
            "the data file {} is not there",
            absent.display()
        ));
    }
    let folder = out.join(path.file_stem().unwrap_or_default());
    let mut command = Command::new(program);
    command.arg("run").arg(path).arg("--out").arg(folder).stdin(Stdio::null());
    let output = match command.output() {
        Ok(output) => output,
        Err(error) => {
            return ScenarioOutcome::Broken(format!("cannot start {}: {error}", program.display()));
        }
    };
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end().to_owned();
    match output.status.code() {
        Some(0) => ScenarioOutcome::Passed,
        Some(1) => ScenarioOutcome::Failed(text(&output.stdout)),
        Some(_) => ScenarioOutcome::Broken(text(&output.stderr)),
        None => ScenarioOutcome::Broken(format!(
            "the process ended by a {}\n{}",
            output.status,
            text(&output.stderr)
        )),
    }
}

/// The results as JUnit XML.
///
/// # Errors
/// When the file cannot be written.
pub fn write_junit(results: &[TestResult], path: &Path) -> Result<(), Error> {
    let mut suite = TestSuite::new("scenarios");
    for result in results {
        let name = result.path.file_stem().unwrap_or_default().to_string_lossy();
        let failure = |kind, text: &str| {
            let mut status = TestCaseStatus::non_success(kind);
            let message = text.lines().rev().find(|line| !line.is_empty()).unwrap_or_default();
            status.set_message(message).set_description(text);
            status
        };
        let status = match &result.outcome {
            ScenarioOutcome::Passed => TestCaseStatus::success(),
            ScenarioOutcome::Skipped(reason) => {
                let mut status = TestCaseStatus::skipped();
                status.set_message(reason.as_str());
                status
            }
            ScenarioOutcome::Failed(text) => failure(NonSuccessKind::Failure, text),
            ScenarioOutcome::Broken(text) => failure(NonSuccessKind::Error, text),
        };
        let mut case = TestCase::new(name.as_ref(), status);
        case.set_classname("trackside").set_time(result.time);
        suite.add_test_case(case);
    }
    let mut report = quick_junit::Report::new("trackside");
    report.add_test_suite(suite);
    let text = report.to_string().map_err(|error| Error::output(path, error))?;
    std::fs::write(path, text).map_err(|error| Error::output(path, error))
}
