//! Parses the command line, calls the library, prints what it says, and picks the exit code.
#![forbid(unsafe_code)]

use std::io::{IsTerminal as _, Write as _};
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};
use diagnostics::Error;
use fmu_conformance::{self as conform, JudgeError};
use fmu_import::Fmu;
use indicatif::{ProgressBar, ProgressStyle};
use orchestrator::package::Workspace;
use orchestrator::suite::{self, Outcome, TestResult};
use orchestrator::{News, Options, Replay};
use scenario::BuildRequest;
use scenario::resolve::{StartOverride, StartOverrides};

/// The packages whose FMUs make the closed loop.
const FMUS: [&str; 3] = ["plant-fmu", "controller", "estimator"];

/// Co-simulation of vehicle dynamics: runs scenarios of FMUs, records them and judges them.
#[derive(Parser)]
#[command(name = "trackside", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run scenarios; exit code 0 when all checks pass, 1 when one fails, 2 when the input is wrong, 3
    /// when an FMU fails.
    Run(RunArgs),
    /// Run scenarios as tests, several at a time, a line for each.
    Test(TestArgs),
    /// Build FMU packages of the workspace and pack them.
    Pack {
        /// The packages [default: plant-fmu controller estimator].
        packages: Vec<String>,
        /// Pack an example instead, of the given packages or of any. May be repeated.
        #[arg(long, value_name = "NAME")]
        example: Vec<String>,
        /// The folder for the archives.
        #[arg(long, default_value = "target/fmu")]
        out: PathBuf,
    },
    /// Show what an FMU says about itself.
    Inspect {
        /// The archive.
        fmu: PathBuf,
        /// Print JSON instead of lines.
        #[arg(long)]
        json: bool,
    },
    /// Judge an FMU by the rules of FMI 2.0, a line for each; exit code 0 when it breaks none, 1 when it
    /// breaks one, 2 when it cannot be opened.
    Conform(ConformArgs),
    /// Open a run in the Rerun viewer, or two runs over each other.
    View {
        /// The folder of the run, or a recording.
        run: PathBuf,
        /// Another run to compare it with: its folder, or its run.mcap.
        other: Option<PathBuf>,
        /// Write the comparison to this file, and open nothing.
        #[arg(long, value_name = "FILE.rrd", requires = "other")]
        save: Option<PathBuf>,
    },
    /// Make a valid recording of what a killed run left of one.
    Recover {
        /// The recording that was not finished.
        broken: PathBuf,
        /// The new file [default: BROKEN with `.recovered.mcap`].
        #[arg(long)]
        out: Option<PathBuf>,
    },
}

#[derive(Args)]
struct ConformArgs {
    /// The archive.
    fmu: PathBuf,
    /// Print JSON instead of lines.
    #[arg(long)]
    json: bool,
    /// How long each rule may take [s].
    #[arg(long, hide = true, value_name = "SECONDS")]
    limit: Option<f64>,
    /// Judge by this rule in this process, for the process that judges by all.
    #[arg(long, hide = true, requires = "trail")]
    rule: Option<String>,
    /// Where that process looks for what was found.
    #[arg(long, hide = true, requires = "rule")]
    trail: Option<PathBuf>,
}

#[derive(Args)]
struct RunArgs {
    /// The scenario files.
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    /// The folder for the files; for several scenarios, each gets a folder of its name in it
    /// [default: target/runs/<scenario name>].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write run.csv too.
    #[arg(long)]
    csv: bool,
    /// Set a start value: `plant.body.m=800`, or `@FILE` for a TOML file of them. May be repeated.
    #[arg(long, value_name = "NODE.VARIABLE=VALUE")]
    set: Vec<String>,
    /// The seed of every random stream, instead of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Where the replay goes.
    #[arg(long, value_enum, default_value_t = ReplayArg::Save)]
    rerun: ReplayArg,
    /// The viewer's address for `--rerun connect`.
    #[arg(long, value_name = "URL", default_value = "rerun+http://127.0.0.1:9876/proxy")]
    viewer: String,
    /// The address of this machine where `--rerun serve` waits for viewers; `0.0.0.0` is all of them.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    bind: IpAddr,
    /// Run this many times as fast as the clock, 1 when there is no number.
    #[arg(long, num_args = 0..=1, default_missing_value = "1", value_name = "FACTOR")]
    realtime: Option<f64>,
    /// Tell of a call of an FMU that has gone on for so long [s].
    #[arg(long, value_name = "SECONDS", default_value = "10")]
    patience: f64,
}

#[derive(Clone, Copy, ValueEnum)]
enum ReplayArg {
    /// To the file run.rrd.
    Save,
    /// To a viewer that is open.
    Connect,
    /// To viewers that connect to this program.
    Serve,
    /// Nowhere.
    Off,
}

#[derive(Args)]
struct TestArgs {
    /// Scenario files, or folders of them.
    #[arg(default_values = ["scenarios"])]
    paths: Vec<PathBuf>,
    /// How many run at a time; one for each core unless it is given.
    #[arg(long)]
    jobs: Option<std::num::NonZeroUsize>,
    /// Write the results as JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
}

fn main() -> ExitCode {
    let command = Cli::parse().command;
    let result = match command {
        Command::Run(args) => run(&args),
        Command::Test(args) => test(&args),
        Command::Pack { packages, example, out } => pack(&packages, &example, &out),
        Command::Inspect { fmu, json } => inspect(&fmu, json),
        Command::Conform(args) => conform(&args),
        Command::View { run, other: None, .. } => view(&run),
        Command::View { run, other: Some(other), save } => compare(&run, &other, save.as_deref()),
        Command::Recover { broken, out } => recover(&broken, out),
    };
    ExitCode::from(result.unwrap_or_else(tell))
}

/// Prints an error and gives its exit code.
fn tell(error: Error) -> u8 {
    let code = error.exit_code();
    eprintln!("{:?}", miette::Report::new(error));
    code
}

/// Prints to standard output; a reader that has gone away is no reason to panic.
fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn run(args: &RunArgs) -> Result<u8, Error> {
    let starts = starts(&args.set)?;
    let overrides = StartOverrides { starts, seed: args.seed, ..StartOverrides::default() };
    if let Some(factor) = args.realtime.filter(|factor| !(*factor > 0.0 && factor.is_finite())) {
        return Err(Error::input(format!("--realtime: expected a factor above 0, found {factor}")));
    }
    suite::check_names(&args.scenarios)?;
    // The progress bar holds the line that the cursor is on.
    let patience = Duration::try_from_secs_f64(args.patience)
        .map_err(|error| Error::input(format!("--patience: {error}")))?;
    fmu_import::watch(patience, |what| eprintln!("\n{what}"));
    let mut worst = 0;
    for path in &args.scenarios {
        let out = args.out.as_ref().map(|out| match args.scenarios.len() {
            1 => out.clone(),
            _ => out.join(path.file_stem().unwrap_or_default()),
        });
        let options = Options {
            out,
            csv: args.csv,
            overrides: overrides.clone(),
            replay: match args.rerun {
                ReplayArg::Save => Replay::Save,
                ReplayArg::Connect => Replay::Connect(args.viewer.clone()),
                ReplayArg::Serve => Replay::Serve(args.bind),
                ReplayArg::Off => Replay::Off,
            },
            realtime: args.realtime,
        };
        worst = worst.max(run_one(path, &options));
    }
    Ok(worst)
}

fn run_one(path: &Path, options: &Options) -> u8 {
    let bar = progress_bar(path);
    let outcome = orchestrator::run(path, options, &mut |news| match news {
        News::Serving(url) => {
            let all = matches!(&options.replay, Replay::Serve(address) if address.is_unspecified());
            let more = if all { " (elsewhere with this machine's name)" } else { "" };
            bar.suspend(|| eprintln!("viewers can connect: rerun --connect {url}{more}"))
        }
        // A redraw costs more than a step, and nobody sees more than a hundred of them.
        News::Steps(step, steps) if step % (steps / 100 + 1) == 0 => {
            bar.set_length(steps);
            bar.set_position(step);
        }
        News::Steps(..) => {}
        News::Analysis(name, share, what) => {
            bar.set_length(1000);
            bar.set_position((share * 1e3) as u64);
            bar.set_message(format!("{name}: {what}"));
        }
        News::Validation(name) => bar.set_message(name.to_owned()),
    });
    bar.finish_and_clear();
    let run = match outcome {
        Ok(run) => run,
        Err(error) => return tell(error),
    };
    for warning in &run.report.warnings {
        eprintln!("warning: {warning}");
    }
    print(&run.report.lines());
    if matches!(options.replay, Replay::Serve(_)) {
        eprintln!("still serving; Ctrl-C ends it");
        loop {
            std::thread::park();
        }
    }
    run.report.exit_code()
}

/// A bar on a terminal, nothing in a pipe.
fn progress_bar(path: &Path) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} % {eta:>4}");
    let bar =
        ProgressBar::new(1).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_message(path.file_stem().unwrap_or_default().to_string_lossy().into_owned());
    bar.tick();
    bar
}

/// Start values of `--set`.
fn starts(set: &[String]) -> Result<Vec<StartOverride>, Error> {
    let mut starts = Vec::new();
    for entry in set {
        let given = StartOverride::parse(entry, |file| file.into());
        starts.extend(given.map_err(|message| Error::input(format!("--set: {message}")))?);
    }
    Ok(starts)
}

fn test(args: &TestArgs) -> Result<u8, Error> {
    let paths = suite::find(&args.paths)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.map_or(cores, usize::from);
    let program = this_program()?;
    let terminal = Mutex::new(());
    let done = |result: &TestResult| {
        let _one_at_a_time = terminal.lock();
        print(&test_line(result));
    };
    let results = suite::run(&program, &paths, jobs, Path::new("target/runs"), &done)?;
    if let Some(path) = &args.junit {
        suite::write_junit(&results, path)?;
    }
    let count = |wanted: fn(&Outcome) -> bool| {
        results.iter().filter(|result| wanted(&result.outcome)).count()
    };
    let (failed, broken) = (
        count(|outcome| matches!(outcome, Outcome::Failed(_))),
        count(|outcome| matches!(outcome, Outcome::Broken(_))),
    );
    print(&format!(
        "{} passed, {} failed, {} skipped\n",
        count(|outcome| *outcome == Outcome::Passed),
        failed + broken,
        count(|outcome| matches!(outcome, Outcome::Skipped(_))),
    ));
    Ok(u8::from(failed + broken > 0))
}

fn test_line(result: &TestResult) -> String {
    let (path, seconds) = (result.path.display(), result.time.as_secs_f64());
    let (word, text) = match &result.outcome {
        Outcome::Passed => ("ok", String::new()),
        Outcome::Skipped(reason) => ("skipped", format!("  ({reason})")),
        Outcome::Failed(text) | Outcome::Broken(text) => ("FAILED", format!("\n{text}")),
    };
    format!("{word:<8} {path}  {seconds:.1} s{text}\n")
}

fn pack(packages: &[String], examples: &[String], out: &Path) -> Result<u8, Error> {
    let archives = Workspace::around(Path::new("."))
        .and_then(|workspace| {
            let library =
                |package: &str| BuildRequest { package: package.to_owned(), example: None };
            let products = match (examples, packages) {
                ([], []) => FMUS.map(library).to_vec(),
                ([], packages) => packages.iter().map(|package| library(package)).collect(),
                (examples, packages) => examples
                    .iter()
                    .map(|example| workspace.example(packages, example))
                    .collect::<Result<_, _>>()?,
            };
            workspace.pack(&products, Some(out))
        })
        .map_err(|error| Error::input(error.to_string()))?;
    for archive in archives.values() {
        print(&format!("{}\n", archive.display()));
    }
    Ok(0)
}

fn inspect(path: &Path, json: bool) -> Result<u8, Error> {
    let fmu = Fmu::open(path).map_err(|error| Error::input(error.to_string()))?;
    print(&match json {
        true => format!("{:#}\n", orchestrator::inspect::json(&fmu)),
        false => orchestrator::inspect::lines(&fmu),
    });
    Ok(0)
}

fn conform(args: &ConformArgs) -> Result<u8, Error> {
    let limit = match args.limit.map(Duration::try_from_secs_f64) {
        Some(limit) => limit.map_err(|error| Error::input(format!("--limit: {error}")))?,
        None => conform::TIME_LIMIT,
    };
    if let (Some(rule), Some(trail)) = (&args.rule, &args.trail) {
        let judged = conform::run_one(&args.fmu, rule, trail, limit);
        return judged.map(|()| 0).map_err(not_judged);
    }
    let findings = conform::run(&this_program()?, &args.fmu, limit).map_err(not_judged)?;
    print(&match args.json {
        true => format!("{:#}\n", serde_json::json!(findings)),
        false => conform::lines(&findings),
    });
    Ok(u8::from(findings.iter().any(|finding| finding.outcome == conform::Outcome::Fail)))
}

fn not_judged(error: JudgeError) -> Error {
    match error {
        JudgeError::Trail { path, source } => Error::output(&path, source),
        error => Error::input(error.to_string()),
    }
}

#[cfg(feature = "rerun")]
fn view(run: &Path) -> Result<u8, Error> {
    replay::viewer::view(run).map(|()| 0)
}

#[cfg(not(feature = "rerun"))]
fn view(_run: &Path) -> Result<u8, Error> {
    Err(without_rerun())
}

#[cfg(feature = "rerun")]
fn compare(a: &Path, b: &Path, save: Option<&Path>) -> Result<u8, Error> {
    let mut note = |note: &str| eprintln!("note: {note}");
    replay::viewer::compare(a, b, save, &mut note)?;
    if let Some(path) = save {
        print(&format!("{}\n", path.display()));
    }
    Ok(0)
}

#[cfg(not(feature = "rerun"))]
fn compare(_a: &Path, _b: &Path, _save: Option<&Path>) -> Result<u8, Error> {
    Err(without_rerun())
}

#[cfg(not(feature = "rerun"))]
fn without_rerun() -> Error {
    Error::input("this program was built without the feature `rerun`")
}

fn recover(broken: &Path, out: Option<PathBuf>) -> Result<u8, Error> {
    let into = out.unwrap_or_else(|| broken.with_extension("recovered.mcap"));
    if into == broken {
        return Err(Error::input("--out: expected another file than the broken one"));
    }
    let found = recording::recover::recover(broken, &into)?;
    let (messages, channels, seconds) = (found.messages, found.channels, found.seconds);
    let end = match found.lost {
        Some(reason) => format!("up to where it is broken: {reason}"),
        None => "it was complete".to_owned(),
    };
    print(&format!(
        "{}: {messages} messages of {channels} channels, {seconds:.3} s, {end}\n",
        into.display()
    ));
    Ok(0)
}

fn this_program() -> Result<PathBuf, Error> {
    std::env::current_exe()
        .map_err(|error| Error::input(format!("cannot find this program: {error}")))
}
