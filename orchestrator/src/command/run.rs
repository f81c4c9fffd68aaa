//! `trackside run`: runs scenarios, shows their progress, and prints their reports.

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use cosim::system::Algorithm;
use diagnostics::{Error, ErrorCollector, escape_for_terminal};
use indicatif::ProgressBar;
use orchestrator::baseline_change::BaselineChange;
use orchestrator::examples::missing_scenario_help;
use orchestrator::report::{DOUBTFUL_EXIT_CODE, RunReport};
use orchestrator::{ProgressEvent, ReplayOutput, RunContext, RunOptions, WarmStartRole, suite};
use scenario::resolve::{IsolationPolicy, Override, Overrides};

use super::{
    guest_program_path, print_raw_to_stderr, print_single_errors, print_text, print_to_stderr, progress,
    standalone, supervised, why,
};

/// Arguments of `trackside run`.
#[derive(Args)]
pub struct RunArguments {
    /// The scenario files; systems of SSP; or FMUs, each of which runs by itself with the experiment of its description.
    #[arg(required = true)]
    scenarios: Vec<PathBuf>,
    /// The folder for the files; for several scenarios, each gets a folder of its name in it
    /// [default: target/runs/SCENARIO; with --resume target/runs/SCENARIO_resumed].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write run.csv too.
    #[arg(long)]
    csv: bool,
    /// Write run.parquet too, a table for pandas, polars, DuckDB and MATLAB.
    #[arg(long)]
    parquet: bool,
    /// Write run.mf4 too, a measurement file of ASAM MDF 4 for tools such as CANape, asammdf and MATLAB.
    #[arg(long)]
    mf4: bool,
    /// Write run.ld too, a log for MoTeC i2.
    #[arg(long)]
    ld: bool,
    /// Write the baselines of the scenarios from these runs, if they pass, instead of a comparison.
    #[arg(long)]
    bless: bool,
    /// With --bless: replace baselines that are not as --bless wrote them, too.
    #[arg(long, requires = "bless")]
    force: bool,
    /// Set a start value `plant.body.m=800` (or `"plant.start.v_x=100 km/h"`), a signal `driver.delta=3`, a key of its shape
    /// `driver.delta.step.after=3`, a sensor effect `estimator.a_y.noise.std=0.1`, or a fault
    /// `estimator.a_y.fault.value=0`. `@FILE` is a TOML file of values. May be repeated.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Of a system of SSP with several descriptions, take this one: its file or its name.
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Of one FMU, write the scenario that it runs by itself with, as a beginning for one of your own.
    #[arg(long, value_name = "FILE")]
    save_scenario: Option<PathBuf>,
    /// The coupling algorithm, instead of that of the scenario or system.
    #[arg(long, value_enum, value_name = "ALGORITHM")]
    coupling: Option<CouplingArg>,
    /// Relative tolerance of the integration inside the FMUs, instead of the scenario's and the FMUs' own.
    #[arg(long, value_name = "RELATIVE")]
    tolerance: Option<f64>,
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
    /// Report a call of an FMU that lasts longer than this [s].
    #[arg(long, value_name = "SECONDS", default_value = "10")]
    patience: f64,
    /// End the run with exit code 3 when it is not over after this time, instead of the scenario's limit [s].
    #[arg(long, value_name = "SECONDS")]
    limit: Option<f64>,
    /// Run FMUs in processes of their own, where the scenario does not say it: all, with scripts of analyses in sandboxes, or those of `path` only.
    #[arg(long, value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "all", value_name = "WHICH")]
    isolate: Option<IsolateArg>,
    /// Run scripts and plugins that come in an archive of SSP: their code may do what you may.
    #[arg(long)]
    trust: bool,
    /// Write all that the run knows at these times [s] into `checkpoint_TIME.state`, so that others go on from there: `2.5,4`. May be
    /// repeated. A time between two communication points counts as the later one.
    #[arg(long, value_name = "TIME", value_delimiter = ',')]
    checkpoint: Vec<f64>,
    /// Go on from this checkpoint, perhaps with other tunable parameters, signals, effects, faults, checks, and another stop time.
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// After the scenario, run this one from the only --checkpoint of the scenario on, in the same process and with the same FMUs. May be
    /// repeated. With --out each gets a folder of its name in that one.
    #[arg(long, value_name = "SCENARIO", conflicts_with = "resume")]
    branch: Vec<PathBuf>,
    /// For `trackside test`: end with the program that holds standard input, whose first line is the identity of the run.
    #[arg(long, hide = true)]
    supervised: bool,
}

/// FMUs that run in processes of their own.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum IsolateArg {
    /// All.
    All,
    /// Those of `path`: nobody here built them.
    Foreign,
    /// None.
    None,
}

impl IsolateArg {
    fn isolation_policy(self) -> IsolationPolicy {
        match self {
            IsolateArg::All => IsolationPolicy::Everything,
            IsolateArg::Foreign => IsolationPolicy::Foreign,
            IsolateArg::None => IsolationPolicy::Nothing,
        }
    }

    /// The argument of `trackside run`.
    pub(super) fn argument_value(self) -> &'static str {
        match self {
            IsolateArg::All => "--isolate=all",
            IsolateArg::Foreign => "--isolate=foreign",
            IsolateArg::None => "--isolate=none",
        }
    }
}

/// A coupling algorithm.
#[derive(Clone, Copy, ValueEnum)]
#[value(rename_all = "snake_case")]
enum CouplingArg {
    /// The nodes step one after the other, each with the new values of those before it.
    GaussSeidel,
    /// All nodes take the values of the start of the step.
    Jacobi,
    /// The nodes of a loop repeat the step until their values fit.
    Iterate,
}

impl CouplingArg {
    fn coupling_algorithm(self) -> Algorithm {
        match self {
            CouplingArg::GaussSeidel => Algorithm::GaussSeidel,
            CouplingArg::Jacobi => Algorithm::Jacobi,
            CouplingArg::Iterate => Algorithm::Iterate,
        }
    }
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

/// Runs the scenarios one after the other; the worst exit code counts.
///
/// # Errors
/// When an argument is wrong.
pub fn run_scenarios(arguments: &RunArguments) -> Result<u8, Error> {
    let mut options = arguments.run_options()?;
    let scenarios = arguments.scenario_files()?;
    suite::check_names(&scenarios)?;
    if let Some(file) = &arguments.save_scenario {
        standalone::save_fmu_scenario(file, &scenarios, &options.overrides)?;
    }
    if !arguments.branch.is_empty() {
        options.latest_stop = orchestrator::latest_stop(&scenarios, arguments.variant.as_deref())?;
    }
    let patience = Duration::try_from_secs_f64(arguments.patience)
        .map_err(|error| Error::invalid_input(format!("--patience: {error}")))?;
    // The progress bar holds the line that the cursor is on.
    fmu_import::start_watchdog(patience, |what| print_to_stderr(&format!("\n{what}")));
    (options.program, options.patience) = (Some(guest_program_path()?), Some(patience));
    if arguments.supervised {
        options.identity = Some(supervised::read_identity_and_watch_stdin()?);
    }
    // Branches share the nodes of the first run; each other run has a context of its own.
    let (mut worst, mut shared) = (0, None);
    for (place, path) in scenarios.iter().enumerate() {
        let rest = &scenarios[place + 1..];
        let options = arguments.scenario_run_options(path, place, &options);
        let mut context = shared.take().unwrap_or_default();
        worst = std::cmp::max_by_key(worst, run_one(path, &options, &mut context), exit_code_severity);
        // Without the checkpoint of the warm-up no branch can start.
        let no_warm_start = options.role == WarmStartRole::WarmUp && !context.has_warm_start();
        let end = fmu_import::termination_signal().is_some() || rest.is_empty() || no_warm_start;
        // All is told: what an FMU does when it is freed cannot change it any more.
        fmu_import::set_final_exit_code(end.then_some(worst));
        match arguments.branch.is_empty() || end {
            true => free_fmus(context),
            false => shared = Some(context),
        }
        if end {
            rest.iter().for_each(|path| print_to_stderr(&format!("not run: {}", path.display())));
            break;
        }
    }
    Ok(worst)
}

/// Frees the FMUs of a run, and prints their messages of that time.
pub(super) fn free_fmus(context: RunContext) {
    drop(context);
    fmu_import::messages_while_freed().iter().for_each(|it| print_to_stderr(&format!("warning: {it}")));
}

/// A time of the command line.
///
/// # Errors
/// When it is no positive number, with the name of the argument.
pub(super) fn parse_positive_seconds(argument: &str, value: Option<f64>) -> Result<Option<Duration>, Error> {
    let time = |value: f64| match Duration::try_from_secs_f64(value) {
        Ok(time) if !time.is_zero() => Ok(time),
        _ => Err(Error::invalid_input(format!("{argument}: expected a time above 0 s, found {value} s"))),
    };
    value.map(time).transpose()
}

impl RunArguments {
    fn run_options(&self) -> Result<RunOptions, Error> {
        let positive = |factor: &f64| *factor > 0.0 && factor.is_finite();
        if let Some(factor) = self.realtime.filter(|factor| !positive(factor)) {
            let message = format!("--realtime: expected a factor above 0, found {factor}");
            return Err(Error::invalid_input(message));
        }
        let starts = parse_start_values(&self.set)?;
        Ok(RunOptions {
            out: None,
            csv: self.csv,
            parquet: self.parquet,
            mf4: self.mf4,
            ld: self.ld,
            bless: self.bless,
            force: self.force,
            label: None,
            variant: self.variant.clone(),
            overrides: Overrides {
                starts,
                seed: self.seed,
                tolerance: self.tolerance,
                coupling: self.coupling.map(CouplingArg::coupling_algorithm),
                isolate: self.isolate.map(IsolateArg::isolation_policy).unwrap_or_default(),
                trust: self.trust,
                ..Overrides::default()
            },
            replay: match self.rerun {
                ReplayArg::Save => ReplayOutput::Save,
                ReplayArg::Connect => ReplayOutput::Connect(self.viewer.clone()),
                ReplayArg::Serve => ReplayOutput::Serve(self.bind),
                ReplayArg::Off => ReplayOutput::Off,
            },
            limit: parse_positive_seconds("--limit", self.limit)?,
            identity: None,
            realtime: self.realtime,
            program: None,
            checkpoints: self.checkpoint.clone(),
            resume: self.resume.clone(),
            role: WarmStartRole::Standalone,
            latest_stop: None,
            patience: None,
        })
    }

    /// The scenario files in the order in which they run.
    fn scenario_files(&self) -> Result<Vec<PathBuf>, Error> {
        if self.bless && (self.resume.is_some() || !self.branch.is_empty()) {
            let message = "--bless: a run that goes on from a checkpoint has no beginning for a baseline";
            return Err(Error::invalid_input(message));
        }
        if !self.branch.is_empty() && (self.scenarios.len(), self.checkpoint.len()) != (1, 1) {
            let (scenarios, checkpoints) = (self.scenarios.len(), self.checkpoint.len());
            let message = format!(
                "--branch: expected one scenario and one --checkpoint that all branches go on from, found {scenarios} and {checkpoints}"
            );
            return Err(Error::invalid_input(message));
        }
        Ok(self.scenarios.iter().chain(&self.branch).cloned().collect())
    }

    /// The options of the scenario at this place.
    fn scenario_run_options(&self, path: &Path, place: usize, options: &RunOptions) -> RunOptions {
        let role = match (self.branch.is_empty(), place) {
            (true, _) => WarmStartRole::Standalone,
            (false, 0) => WarmStartRole::WarmUp,
            (false, place) => WarmStartRole::Branch { last: place == self.branch.len() },
        };
        let checkpoints = match role {
            WarmStartRole::Branch { .. } => Vec::new(),
            _ => options.checkpoints.clone(),
        };
        RunOptions { out: self.scenario_output_folder(path, role), role, checkpoints, ..options.clone() }
    }

    /// The folder of a scenario's files, if the user named one.
    fn scenario_output_folder(&self, scenario: &Path, role: WarmStartRole) -> Option<PathBuf> {
        let name = scenario.file_stem().unwrap_or_default();
        let Some(out) = self.out.as_ref() else {
            let resumed = format!("{}_resumed", name.to_string_lossy());
            return self.resume.is_some().then(|| Path::new("target/runs").join(resumed));
        };
        Some(match (self.scenarios.len(), role) {
            (1, WarmStartRole::Standalone | WarmStartRole::WarmUp) => out.clone(),
            _ => out.join(name),
        })
    }
}

/// Start values of `--set`.
pub(super) fn parse_start_values(set: &[String]) -> Result<Vec<Override>, Error> {
    let starts = set.iter().map(|entry| {
        let parsed = Override::parse(entry, |file| file.into());
        parsed.map_err(|message| Error::invalid_input(format!("--set: {message}")))
    });
    Ok(ErrorCollector::collect_all(starts)?.into_iter().flatten().collect())
}

/// Tells the warnings of a run.
pub(super) fn print_run_warnings(report: &RunReport) {
    report.warning_lines().iter().for_each(|warning| print_to_stderr(&format!("warning: {warning}")));
}

fn run_one(path: &Path, options: &RunOptions, context: &mut RunContext) -> u8 {
    let outcome = progress::run_with_progress_bar(path, options, context, |event, bar| {
        show_progress_event(event, bar, options)
    });
    let run = match outcome {
        Ok(run) => run,
        Err(error) => {
            let help = if path.exists() { None } else { missing_scenario_help(path) };
            let code = error.exit_code();
            let errors = error.with_optional_help(help).into_single_errors();
            print_single_errors(&errors);
            // For the program that runs this test, which tells it by its identity from what FMUs write.
            if let Some(identity) = &options.identity {
                print_raw_to_stderr(&suite::error_record_line(identity, &errors));
            }
            return code;
        }
    };
    print_run_warnings(&run.report);
    print_text(&run.report.terminal_lines());
    // In a test, the program that runs it asks.
    if options.identity.is_none() {
        let lines = why::explain_failed_baselines(&run.report.folder, &run.report.baselines);
        lines.iter().for_each(|line| print_text(&format!("  {line}\n")));
    }
    if matches!(options.replay, ReplayOutput::Serve(_)) {
        print_to_stderr("still serving; Ctrl-C ends it");
        while fmu_import::termination_signal().is_none() {
            std::thread::sleep(NAP);
        }
    }
    run.report.exit_code()
}

/// The order of exit codes by how bad they are: a result that is not to be trusted comes before a check that fails.
fn exit_code_severity(code: &u8) -> u16 {
    if *code == DOUBTFUL_EXIT_CODE { 1 } else { 2 * u16::from(*code) }
}

/// A program that only waits looks this often whether it has to end.
const NAP: Duration = Duration::from_millis(100);

fn show_progress_event(event: &ProgressEvent, bar: &ProgressBar, options: &RunOptions) {
    match event {
        ProgressEvent::Building(_) => {}
        ProgressEvent::Serving(url) => {
            let all = matches!(&options.replay, ReplayOutput::Serve(address) if address.is_unspecified());
            let more = if all { " (elsewhere with this machine's name)" } else { "" };
            bar.suspend(|| print_to_stderr(&format!("viewers can connect: rerun --connect {url}{more}")));
        }
        ProgressEvent::Steps(step, steps) => {
            bar.set_length(*steps);
            bar.set_position(*step);
        }
        ProgressEvent::Analysis(name, share, what) => {
            bar.set_length(1000);
            bar.set_position((share * 1e3) as u64);
            bar.set_message(escape_for_terminal(&format!("{name}: {what}")).into_owned());
        }
        ProgressEvent::Validation(name) => bar.set_message(escape_for_terminal(name).into_owned()),
        ProgressEvent::Blessing(changes) => bar.suspend(|| {
            changes.iter().flat_map(BaselineChange::lines).for_each(|line| print_text(&format!("{line}\n")));
        }),
        ProgressEvent::Failed(report) => bar.suspend(|| print_run_warnings(report)),
    }
}
