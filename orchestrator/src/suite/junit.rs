//! Writes the results of tests as JUnit XML: a suite for each scenario, a case for each check.

use std::io::Read as _;
use std::path::Path;

use diagnostics::{Error, escape_for_terminal};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use super::cause::error_headline;
use super::{CheckResult, ScenarioOutcome, TestResult};

/// The case of a run without a check, or without a verdict.
const RUN: &str = "run";

/// What the case of a run without checks says. CI tools list skipped cases with their message, and show nothing of what a passed one
/// says; neither fails a pipeline.
const NO_CHECKS: &str = "no checks: the run came to its end, and nothing was judged";

/// What every file of this form has near its beginning.
const ROOT: &[u8] = b"<testsuites";
/// How far that is looked for [bytes].
const BEGINNING: u64 = 4096;

/// Makes sure that the results take nothing's place but that of other results.
///
/// # Errors
/// When there is another file at `path`.
pub fn check_junit(path: &Path) -> Result<(), Error> {
    let Ok(kind) = std::fs::metadata(path) else { return Ok(()) };
    let mut beginning = Vec::new();
    let read = |file: std::fs::File| file.take(BEGINNING).read_to_end(&mut beginning);
    let known = |bytes: &[u8]| bytes.is_empty() || bytes.windows(ROOT.len()).any(|it| it == ROOT);
    // A pipe or a device is no file that could be lost.
    let may = !kind.is_file() || std::fs::File::open(path).and_then(read).is_ok() && known(&beginning);
    if may && !kind.is_dir() {
        return Ok(());
    }
    let message = format!("--junit: {} is there, and it holds no JUnit results", path.display());
    Err(Error::invalid_input(message).with_help("name another file"))
}

/// The results as JUnit XML.
///
/// # Errors
/// When the file cannot be written.
pub fn write_junit(results: &[TestResult], path: &Path) -> Result<(), Error> {
    let mut report = Report::new("trackside");
    report.add_test_suites(results.iter().map(junit_suite));
    let text = report.to_string().map_err(|error| Error::output_failure(path, error))?;
    std::fs::write(path, text).map_err(|error| Error::output_failure(path, error))
}

fn junit_suite(result: &TestResult) -> TestSuite {
    let name = result.path.file_stem().unwrap_or_default().to_string_lossy();
    let name = escape_for_terminal(&name);
    let mut suite = TestSuite::new(name.as_ref());
    suite.set_time(result.time);
    let warnings = result.warnings.iter().chain(&result.messages);
    let warnings: String = warnings.map(|it| format!("warning: {it}\n")).collect();
    if !warnings.is_empty() {
        suite.set_system_out(escape_for_terminal(&warnings).as_ref());
    }
    let run_case = run_status(result).map(|status| {
        let place = result.errors.first().and_then(|error| error.place.as_ref());
        let mut case = match place {
            Some(place) => junit_test_case(RUN, status, Path::new(&place.file), place.line),
            None => junit_test_case(RUN, status, &result.path, 1),
        };
        case.set_time(result.time);
        case
    });
    let checks = result.checks.iter().map(check_case);
    suite.add_test_cases(run_case.into_iter().chain(checks).map(|mut case| {
        case.set_classname(name.as_ref());
        case
    }));
    suite
}

/// The status of the run as a test case; none when its checks say enough.
fn run_status(result: &TestResult) -> Option<TestCaseStatus> {
    match &result.outcome {
        ScenarioOutcome::Skipped(reason) => Some(skipped_test_status(reason)),
        ScenarioOutcome::NoChecks => Some(skipped_test_status(NO_CHECKS)),
        ScenarioOutcome::Broken(text) | ScenarioOutcome::Interrupted(text) => {
            let cause = result.failure_cause().map(|cause| cause.sentence);
            Some(failed_test_status(NonSuccessKind::Error, &cause.unwrap_or_else(|| text.clone()), text))
        }
        ScenarioOutcome::Failed(text) if result.checks.iter().all(|it| it.verdict.passed) => {
            Some(failed_test_status(NonSuccessKind::Failure, error_headline(text), text))
        }
        _ => result.checks.is_empty().then(TestCaseStatus::success),
    }
}

fn check_case(result: &CheckResult) -> TestCase {
    let verdict = &result.verdict;
    let status = match verdict.passed {
        true => TestCaseStatus::success(),
        false => {
            let reason = verdict.reason.as_deref().unwrap_or("it does not hold");
            failed_test_status(NonSuccessKind::Failure, reason, &format!("{}\n{reason}", verdict.that))
        }
    };
    junit_test_case(&result.qualified_name(), status, &verdict.file, verdict.line)
}

fn skipped_test_status(reason: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::skipped();
    status.set_message(escape_for_terminal(reason).as_ref());
    status
}

fn failed_test_status(kind: NonSuccessKind, message: &str, text: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::non_success(kind);
    status
        .set_message(escape_for_terminal(message).as_ref())
        .set_description(escape_for_terminal(text).as_ref());
    status
}

fn junit_test_case(name: &str, status: TestCaseStatus, file: &Path, line: usize) -> TestCase {
    let mut case = TestCase::new(escape_for_terminal(name).as_ref(), status);
    case.extra.insert("file".into(), escape_for_terminal(&file.display().to_string()).as_ref().into());
    case.extra.insert("line".into(), line.to_string().into());
    case
}
