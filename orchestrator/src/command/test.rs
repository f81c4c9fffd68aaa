//! `trackside test`: runs scenarios as tests and prints a line for each.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::Args;
use diagnostics::{Error, shell_word};
use orchestrator::package::BuildProgress;
use orchestrator::suite::{
    self, ScenarioOutcome, SuiteHistory, SuitePageHeader, TestResult, TracksideProgram,
};

use super::progress::BuildLine;
use super::run::{IsolateArg, parse_positive_seconds};
use super::{current_program_path, print_text, why};

/// Arguments of `trackside test`.
#[derive(Args)]
pub struct TestArguments {
    /// Scenario files, or folders of them.
    #[arg(default_values = ["scenarios"])]
    paths: Vec<PathBuf>,
    /// How many run at a time; one for each core unless it is given.
    #[arg(long)]
    jobs: Option<std::num::NonZeroUsize>,
    /// Write the baselines of the scenarios from these runs, if they pass, instead of a comparison.
    #[arg(long)]
    bless: bool,
    /// With --bless: replace baselines that are not as --bless wrote them, too.
    #[arg(long, requires = "bless")]
    force: bool,
    /// End each scenario that is not over after this time, instead of its own limit or an hour [s].
    #[arg(long, value_name = "SECONDS")]
    limit: Option<f64>,
    /// Run FMUs in processes of their own, where the scenario does not say it: those of `path`, or all, or none.
    #[arg(long, value_enum, value_name = "WHICH", default_value_t = IsolateArg::Foreign)]
    isolate: IsolateArg,
    /// Explain each failed baseline: which difference from the blessed run is the cause.
    #[arg(long)]
    why: bool,
    /// Write the results as JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
}

/// Runs the scenarios as tests; exit code 1 when one fails.
///
/// # Errors
/// When there is no scenario, or the JUnit file cannot be written.
pub fn run_test_command(arguments: &TestArguments) -> Result<u8, Error> {
    arguments.junit.as_deref().map_or(Ok(()), suite::check_junit)?;
    let paths = suite::find_scenario_files(&arguments.paths)?;
    let limit = parse_positive_seconds("--limit", arguments.limit)?;
    let TestArguments { jobs, bless, force, isolate, .. } = *arguments;
    let why = arguments.why;
    run_suite(
        &paths,
        &SuiteRun { jobs, bless, force, limit, isolate, why, junit: arguments.junit.as_deref() },
    )
}

/// How a suite runs.
pub(super) struct SuiteRun<'a> {
    /// How many at a time; one for each core unless it is given.
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Whether the runs become baselines.
    pub bless: bool,
    /// Whether they may replace files that are not as a run wrote them.
    pub force: bool,
    /// Time that each scenario may take, instead of its own limit.
    pub limit: Option<Duration>,
    pub isolate: IsolateArg,
    /// Whether failed baselines are explained.
    pub why: bool,
    /// The file of JUnit XML.
    pub junit: Option<&'a Path>,
}

impl Default for SuiteRun<'_> {
    fn default() -> Self {
        SuiteRun {
            jobs: None,
            bless: false,
            force: false,
            limit: None,
            isolate: IsolateArg::Foreign,
            why: false,
            junit: None,
        }
    }
}

/// Runs scenarios as tests, prints a line for each, and returns the exit code.
pub(super) fn run_suite(paths: &[PathBuf], how: &SuiteRun) -> Result<u8, Error> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = how.jobs.map_or(cores, usize::from);
    let path = current_program_path()?;
    let mut more = vec![how.isolate.argument_value()];
    more.extend(how.bless.then_some("--bless"));
    more.extend(how.force.then_some("--force"));
    let limit = how.limit;
    let program = TracksideProgram { path: &path, arguments: &more, limit };
    let mut building = BuildLine::default();
    let mut progress = |progress: BuildProgress| building.show(&progress);
    let (terminal, out) = (Mutex::new(()), Path::new("target/runs"));
    let done = |result: &TestResult| {
        let reasons = match how.why {
            true => {
                let folder = out.join(result.path.file_stem().unwrap_or_default());
                why::explain_failed_baselines(&folder, &result.baselines)
            }
            false => Vec::new(),
        };
        let reasons: String = reasons.iter().map(|line| format!("  {line}\n")).collect();
        let _one_at_a_time = terminal.lock();
        print_text(&(test_line(result) + &reasons));
    };
    let (begin, history) = (Instant::now(), SuiteHistory::read(out));
    let results = suite::run_scenario_tests(program, paths, jobs, out, &mut progress, &done)?;
    let about = SuitePageHeader {
        command: repeat_command(paths),
        time: begin.elapsed(),
        jobs: jobs.min(paths.len()),
        junit: how.junit.map(|path| path.display().to_string()),
    };
    let page = write_page_and_history(&about, &results, history, out)?;
    if let Some(path) = how.junit {
        suite::write_junit(&results, path)?;
    }
    let count =
        |is: fn(&ScenarioOutcome) -> bool| results.iter().filter(|result| is(&result.outcome)).count();
    let (failed, broken) = (
        count(|outcome| matches!(outcome, ScenarioOutcome::Failed(_))),
        count(|outcome| matches!(outcome, ScenarioOutcome::Broken(_))),
    );
    let interrupted = match count(|outcome| matches!(outcome, ScenarioOutcome::Interrupted(_))) {
        0 => String::new(),
        interrupted => format!(", {interrupted} not run to the end"),
    };
    let without_checks = count(|outcome| *outcome == ScenarioOutcome::NoChecks);
    let no_checks = match without_checks {
        0 => String::new(),
        without_checks => format!(" ({without_checks} without checks)"),
    };
    print_text(&format!(
        "{} passed{no_checks}, {} failed, {} skipped{interrupted}\n",
        count(|outcome| *outcome == ScenarioOutcome::Passed) + without_checks,
        failed + broken,
        count(|outcome| matches!(outcome, ScenarioOutcome::Skipped(_))),
    ));
    print_text(&page);
    Ok(match fmu_import::termination_signal() {
        Some(signal) => Error::Interrupted(signal).exit_code(),
        None => u8::from(failed + broken > 0),
    })
}

/// The command that runs the suite again: this one, or that for the folder of scenarios which another command made.
fn repeat_command(paths: &[PathBuf]) -> String {
    let words: Vec<_> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    let here = std::env::current_dir().unwrap_or_default();
    match words.first().is_some_and(|word| word == "test") {
        true => {
            let words = words.iter().map(|word| shell_word(relative_to(word, &here)).into_owned());
            std::iter::once("trackside".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
        }
        false => {
            let folder = paths.first().and_then(|path| path.parent()).unwrap_or(Path::new("scenarios"));
            format!("trackside test {}", folder.display())
        }
    }
}

/// A path as it is seen from a folder that it is in, so that the command serves in any copy of it; any other word as it is.
fn relative_to<'a>(word: &'a str, folder: &Path) -> &'a str {
    let inside = Path::new(word).strip_prefix(folder).ok().filter(|_| Path::new(word).is_absolute());
    match inside.and_then(Path::to_str) {
        Some("") => ".",
        Some(inside) => inside,
        None => word,
    }
}

/// Lines of what changed that appear on the terminal.
const MOST_CHANGES: usize = 10;

/// Writes the page and what the next run compares with; returns what changed since the last one, and where the page is.
fn write_page_and_history(
    about: &SuitePageHeader,
    results: &[TestResult],
    history: SuiteHistory,
    out: &Path,
) -> Result<String, Error> {
    std::fs::create_dir_all(out).map_err(|error| Error::output_failure(out, error))?;
    suite::write_suite_page(about, results, &history, out)?;
    let changes = history.changes(results);
    let known: Vec<_> = changes.iter().filter(|it| it.before.is_some()).collect();
    history.store(results, out)?;
    let mut text: String = known
        .iter()
        .take(MOST_CHANGES)
        .map(|it| format!("  since the last run: {} {}\n", it.path, it.sentence()))
        .collect();
    if known.len() > MOST_CHANGES {
        text += &format!("  and {} more changes\n", known.len() - MOST_CHANGES);
    }
    Ok(text + &format!("  {}\n", out.join(suite::PAGE).display()))
}

fn test_line(result: &TestResult) -> String {
    let (path, seconds) = (result.path.display(), result.time.as_secs_f64());
    let (word, text) = match &result.outcome {
        ScenarioOutcome::Passed => ("ok", String::new()),
        ScenarioOutcome::NoChecks => ("ok", "  (no checks)".to_owned()),
        ScenarioOutcome::Skipped(reason) => ("skipped", format!("  ({reason})")),
        ScenarioOutcome::Failed(text) | ScenarioOutcome::Broken(text) => ("FAILED", format!("\n{text}")),
        ScenarioOutcome::Interrupted(what) => ("stopped", format!("  ({what})")),
    };
    // What the run wrote has its warnings already.
    let told = |it: &&String| text.lines().any(|line| line.strip_prefix("warning: ") == Some(it.as_str()));
    let messages = result.messages.iter().filter(|it| !told(it));
    let messages: String = messages.map(|it| format!("  warning: {it}\n")).collect();
    let changes: String = result.baseline_changes.iter().map(|it| format!("  {it}\n")).collect();
    format!("{word:<8} {path}  {seconds:.1} s{text}\n{messages}{changes}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_that_of_any_copy_of_the_folder() {
        let from = |word| relative_to(word, Path::new("/home/me/car"));
        assert_eq!(from("/home/me/car/suite"), "suite");
        assert_eq!(from("/home/me/car"), ".");
        assert_eq!(from("/home/me/carts"), "/home/me/carts");
        assert_eq!(from("--jobs"), "--jobs");
    }
}
