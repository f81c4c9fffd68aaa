//! `trackside sweep`: runs variants of a scenario on this machine, or in chunks on a cluster.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use diagnostics::{Error, escape_for_terminal};
use indicatif::{ProgressBar, ProgressStyle};
use orchestrator::sweep::{self, PlanOptions, SweepPlanFolder, SweepResult, VariantCounts};
use scenario::resolve::Overrides;

use super::guest_program_path;
use super::progress::BuildLine;
use super::run::parse_start_values;
use super::{current_program_path, print_text, print_to_stderr, replay, submit};

/// Arguments of `trackside sweep`.
#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct SweepArguments {
    #[command(subcommand)]
    step: Option<SweepCommand>,
    #[command(flatten)]
    here: LocalArguments,
}

/// The steps of a sweep on a cluster.
#[derive(Subcommand)]
enum SweepCommand {
    /// Write the plan of a sweep: its variants, and the scenario with all its files.
    Plan(PlanArguments),
    /// Run a chunk of a plan; exit code 0 when all of its variants are done, whatever came of them.
    Run(ChunkArguments),
    /// Put the results of all chunks of a plan together.
    Gather {
        /// The folder of the plan.
        plan: PathBuf,
    },
    /// Let Slurm, HyperQueue or processes of this machine run the chunks, follow them, and put their results together.
    Submit(SweepSubmitArguments),
    /// For sweeps: run variants for the program that started this one.
    #[command(hide = true)]
    Worker {
        /// The number of the process that started this one.
        host: u32,
    },
}

/// Arguments of a sweep on this machine.
#[derive(Args)]
struct LocalArguments {
    #[command(flatten)]
    planned: PlanArguments,
    /// Variants at a time [default: as many as this machine has cores].
    #[arg(long)]
    jobs: Option<usize>,
}

/// What a plan is made of.
#[derive(Args)]
struct PlanArguments {
    /// The scenario file, with [sweep]; for `submit` also the folder of a plan.
    #[arg(required = true)]
    scenario: Option<PathBuf>,
    /// The folder of the sweep [default: target/sweeps/SCENARIO].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Set something in all variants: a start value `plant.body.m=800`, a signal, a sensor effect, a fault, as for `trackside run`. What is
    /// set does not vary. May be repeated.
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// The seed of every random stream in all variants, instead of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Relative tolerance of the integration inside the FMUs, instead of the scenario's and the FMUs' own.
    #[arg(long, value_name = "RELATIVE")]
    tolerance: Option<f64>,
    /// Variants of a chunk, which is the unit of work on a cluster [default: at most 1000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    chunk_size: Option<u64>,
    /// Replace the results of another sweep in the folder.
    #[arg(long)]
    replace: bool,
}

/// A plan, or what to make it of, and how to submit it.
#[derive(Args)]
struct SweepSubmitArguments {
    #[command(flatten)]
    planned: PlanArguments,
    #[command(flatten)]
    how: submit::SubmitArguments,
}

/// A chunk of a plan.
#[derive(Args)]
struct ChunkArguments {
    /// The folder of the plan.
    plan: PathBuf,
    /// The chunk, from 0 on.
    #[arg(long)]
    chunk: u64,
    /// Variants at a time.
    #[arg(long, default_value_t = 1)]
    jobs: usize,
}

/// Runs the command.
///
/// # Errors
/// When the input is wrong, or a result cannot be written.
pub fn run_sweep_command(arguments: &SweepArguments) -> Result<u8, Error> {
    match &arguments.step {
        None => arguments.here.run_sweep(),
        Some(SweepCommand::Plan(planned)) => {
            let plan = planned.create_plan()?;
            print_text(&format!(
                "{} variants in {} chunks\n{}\n",
                plan.variant_count(),
                plan.chunk_count(),
                plan.folder.display()
            ));
            Ok(0)
        }
        Some(SweepCommand::Run(chunk)) => chunk.run_chunk(),
        Some(SweepCommand::Gather { plan }) => {
            let plan = SweepPlanFolder::open_of_any_program(plan)?;
            print_sweep_result(&sweep::gather_sweep_results(&plan, None)?)
        }
        Some(SweepCommand::Submit(submitted)) => {
            let plan = submitted.open_or_create_plan()?;
            fmu_import::catch_termination_signals();
            match submit::submit_and_follow_chunks(&plan, &submitted.how)? {
                true => print_sweep_result(&sweep::gather_sweep_results(&plan, None)?),
                false => Ok(0),
            }
        }
        Some(SweepCommand::Worker { host }) => {
            fmu_import::catch_termination_signals();
            sweep::serve_sweep_worker(*host, &guest_program_path()?).map(|()| 0)
        }
    }
}

impl PlanArguments {
    fn create_plan(&self) -> Result<SweepPlanFolder, Error> {
        let options = PlanOptions {
            out: self.out.clone(),
            overrides: Overrides {
                starts: parse_start_values(&self.set)?,
                seed: self.seed,
                tolerance: self.tolerance,
                ..Overrides::default()
            },
            chunk: self.chunk_size,
            replace: self.replace,
        };
        let Some(scenario) = &self.scenario else { return Err(Error::already_reported()) };
        let mut building = BuildLine::default();
        sweep::create_sweep_plan(scenario, &options, &current_program_path()?, &mut |progress| {
            building.show(&progress)
        })
    }
}

impl SweepSubmitArguments {
    /// The plan in a folder, or that of a scenario.
    fn open_or_create_plan(&self) -> Result<SweepPlanFolder, Error> {
        let Some(folder) = self.planned.scenario.as_ref().filter(|it| it.is_dir()) else {
            return self.planned.create_plan();
        };
        let PlanArguments { out, set, seed, tolerance, chunk_size, replace, .. } = &self.planned;
        let given = [
            ("--out", out.is_some()),
            ("--set", !set.is_empty()),
            ("--seed", seed.is_some()),
            ("--tolerance", tolerance.is_some()),
            ("--chunk-size", chunk_size.is_some()),
            ("--replace", *replace),
        ];
        if let Some((option, _)) = given.iter().find(|(_, given)| *given) {
            let folder = folder.display();
            return Err(Error::invalid_input(format!("{option}: {folder} is a plan, which is made already"))
                .with_help("name the scenario instead to make another plan"));
        }
        SweepPlanFolder::open(folder, &current_program_path()?)
    }
}

impl LocalArguments {
    fn run_sweep(&self) -> Result<u8, Error> {
        let mut plan = self.planned.create_plan()?;
        // Nothing is lost before: a signal then ends the program.
        fmu_import::catch_termination_signals();
        for warning in &plan.metadata.warnings {
            print_to_stderr(&format!("warning: {warning}"));
        }
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let all: Vec<u64> = (0..plan.chunk_count()).collect();
        let progress = SweepProgress::new(&plan);
        let program = guest_program_path()?;
        let jobs = self.jobs.unwrap_or(cores);
        let show = |counts: &VariantCounts| progress.show_counts(counts);
        let found = match plan.metadata.is_search {
            true => sweep::search_in_batches(&mut plan, jobs, &program, &show)
                .map(|found| (found.is_none(), found)),
            false => sweep::run_chunks(&plan, &all, jobs, &program, &show).map(|ended| (ended.stopped, None)),
        };
        progress.bar.finish_and_clear();
        let (stopped, found) = found?;
        if stopped {
            return report_interruption(&plan);
        }
        let gathered = sweep::gather_sweep_results(&plan, found)?;
        let code = print_sweep_result(&gathered)?;
        for variant in &gathered.recorded {
            if fmu_import::termination_signal().is_some() {
                return report_interruption(&plan);
            }
            replay::record_variant_once(&plan, *variant)?;
        }
        Ok(code)
    }
}

/// What is done is kept.
fn report_interruption(plan: &SweepPlanFolder) -> Result<u8, Error> {
    print_to_stderr(&format!(
        "the sweep ended before its end; what is done is in {}, and the same command goes on",
        plan.folder.display()
    ));
    Err(Error::Interrupted(fmu_import::termination_signal().unwrap_or_default()))
}

impl ChunkArguments {
    fn run_chunk(&self) -> Result<u8, Error> {
        let plan = SweepPlanFolder::open(&self.plan, &current_program_path()?)?;
        fmu_import::catch_termination_signals();
        if self.chunk >= plan.chunk_count() {
            let (found, last) = (self.chunk, plan.chunk_count().saturating_sub(1));
            let message = format!("--chunk: expected 0 to {last}, the chunks of the plan, found {found}");
            return Err(Error::invalid_input(message));
        }
        let program = guest_program_path()?;
        let ended = sweep::run_chunks(&plan, &[self.chunk], self.jobs, &program, &|_| {})?;
        if ended.stopped {
            return report_interruption(&plan);
        }
        let VariantCounts { done, passed, failed_to_run } = ended.counts;
        print_text(&format!(
            "chunk {}: {done} variants done, {passed} passed, {failed_to_run} did not come to their end\n",
            self.chunk
        ));
        Ok(0)
    }
}

/// Prints what came of a sweep.
fn print_sweep_result(gathered: &SweepResult) -> Result<u8, Error> {
    print_text(&describe_sweep_result(gathered));
    Ok(gathered.exit_code())
}

fn describe_sweep_result(gathered: &SweepResult) -> String {
    let SweepResult { variants, passed, failed, errors, title, folder, .. } = gathered;
    let mut text = format!("{title}\n");
    text += &match gathered.has_checks {
        true => {
            let all = gathered.pass_share >= 1.0;
            let wanted =
                if all { String::new() } else { format!(", {} % wanted", 100.0 * gathered.pass_share) };
            format!("  {passed} of {variants} variants passed: {:.1} %{wanted}\n", 100.0 * gathered.share)
        }
        false => format!("  {passed} of {variants} variants came to their end, no checks\n"),
    };
    if let Some(found) = &gathered.search {
        text += &format!("  {}\n", found.describe_result());
    }
    if *failed > 0 {
        text += &format!("  in {failed} a check failed\n");
    }
    if *errors > 0 {
        text += &format!("  {errors} did not come to their end\n");
    }
    for variant in &gathered.shown {
        text += &format!("  {}  trackside replay {}/{}\n", variant.why, folder.display(), variant.variant);
    }
    if !gathered.variant_lines.is_empty() {
        text += &format!("\n{}\n", gathered.variant_lines);
    }
    text + &format!("  {}\n  {}\n", folder.display(), folder.join("sweep.html").display())
}

/// In a pipe a line is written this often.
const PERIOD: Duration = Duration::from_secs(30);

/// Shows how far a sweep is.
struct SweepProgress {
    bar: ProgressBar,
    variants: u64,
    last_line: Mutex<Instant>,
}

impl SweepProgress {
    fn new(plan: &SweepPlanFolder) -> Self {
        use std::io::IsTerminal as _;
        let variants = plan.variant_count();
        let bar = match std::io::stderr().is_terminal() {
            false => ProgressBar::hidden(),
            true => {
                let form = "{prefix} {pos}/{len} {wide_bar} {msg} {eta:>4}";
                let style = ProgressStyle::with_template(form);
                let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
                ProgressBar::new(variants).with_style(style)
            }
        };
        bar.set_prefix(escape_for_terminal(&plan.metadata.scenario).into_owned());
        SweepProgress { bar, variants, last_line: Mutex::new(Instant::now()) }
    }

    fn show_counts(&self, counts: &VariantCounts) {
        let VariantCounts { done, passed, failed_to_run } = *counts;
        let share = 100.0 * passed as f64 / done.max(1) as f64;
        let errors = match failed_to_run {
            0 => String::new(),
            errors => format!(", {errors} did not come to their end"),
        };
        let message = format!("{share:.1} % pass{errors}");
        if self.bar.is_hidden() {
            let Ok(mut last_line) = self.last_line.try_lock() else { return };
            if last_line.elapsed() > PERIOD {
                *last_line = Instant::now();
                print_to_stderr(&format!("{done} of {} variants done, {message}", self.variants));
            }
            return;
        }
        self.bar.set_message(message);
        self.bar.set_position(done);
    }
}

/// The plan and the variant that a path such as `target/sweeps/lane_change/17` names, by its number or its name.
pub(super) fn variant_of(path: &Path) -> Result<(SweepPlanFolder, u64), Error> {
    let name = path.file_name().and_then(|name| name.to_str());
    let number = name.and_then(|name| name.parse().ok());
    if let (None, Some(name), Some(folder)) =
        (number, name, path.parent().filter(|it| it.join("plan.json").exists()))
    {
        let plan = SweepPlanFolder::open_of_any_program(folder)?;
        if let Some(variant) = plan.variant_of_name(name)? {
            return Ok((plan, variant));
        }
    }
    let Some((folder, variant)) = path.parent().zip(number) else {
        return Err(Error::invalid_input(format!(
            "expected the folder of a sweep and the number of a variant, such as target/sweeps/lane_change/17, found {}",
            path.display()
        )));
    };
    Ok((SweepPlanFolder::open_of_any_program(folder)?, variant))
}
