//! `trackside replay`: runs a variant of a sweep again, with everything recorded.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use diagnostics::Error;
use orchestrator::sweep::{self, SweepPlanFolder};
use orchestrator::{ReplayOutput, RunContext, RunOptions};

use super::guest_program_path;
use super::run::{free_fmus, print_run_warnings};
use super::{print_text, print_to_stderr, progress, sweep as sweeps};

/// Arguments of `trackside replay`.
#[derive(Args)]
pub struct ReplayArguments {
    /// The variant: the folder of the sweep and its number, such as `target/sweeps/lane_change/17`, or its name.
    #[arg(value_name = "SWEEP/VARIANT")]
    variant: PathBuf,
    /// The folder for the files [default: variants/VARIANT in the folder of the sweep].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write run.csv too.
    #[arg(long)]
    csv: bool,
    /// Where the replay goes.
    #[arg(long, value_enum, default_value_t = ReplayFileArg::Save)]
    rerun: ReplayFileArg,
}

/// Whether a file for the Rerun viewer is written.
#[derive(Clone, Copy, ValueEnum)]
enum ReplayFileArg {
    /// To the file run.rrd.
    Save,
    /// Nowhere.
    Off,
}

/// Runs the variant, and says whether it gave what it gave in the sweep.
///
/// # Errors
/// When there is no such variant, or its run fails.
pub fn run_replay_command(arguments: &ReplayArguments) -> Result<u8, Error> {
    let (plan, variant) = sweeps::variant_of(&arguments.variant)?;
    let replay = match arguments.rerun {
        ReplayFileArg::Save => ReplayOutput::Save,
        ReplayFileArg::Off => ReplayOutput::Off,
    };
    let out = match &arguments.out {
        Some(out) => out.clone(),
        None => variant_run_folder(&plan, variant)?,
    };
    let options = RunOptions { replay, csv: arguments.csv, out: Some(out), ..RunOptions::default() };
    let code = rerun_variant(&plan, variant, options)?;
    sweep::renew_sweep_page(&plan)?;
    Ok(code)
}

/// Runs a variant of a sweep that is over, unless it was recorded before.
///
/// # Errors
/// When its run fails by the input.
pub(super) fn record_variant_once(plan: &SweepPlanFolder, variant: u64) -> Result<(), Error> {
    let out = variant_run_folder(plan, variant)?;
    if out.join(scenario::plan::REPORT).exists() {
        return Ok(());
    }
    match rerun_variant(plan, variant, RunOptions { out: Some(out), ..RunOptions::default() }) {
        // A variant that fails was chosen because it does.
        Err(error @ (Error::Input(_) | Error::Interrupted(_) | Error::Output { .. })) => Err(error),
        _ => Ok(()),
    }
}

fn variant_run_folder(plan: &SweepPlanFolder, variant: u64) -> Result<PathBuf, Error> {
    Ok(plan.folder.join("variants").join(plan.variant_folder_name(variant)?))
}

fn rerun_variant(plan: &SweepPlanFolder, variant: u64, options: RunOptions) -> Result<u8, Error> {
    let variant_overrides = plan.variant_overrides(variant)?;
    let overrides = plan.with_variant(&plan.common_overrides()?, &variant_overrides)?;
    let program = Some(guest_program_path()?);
    let name = plan.variant_name(variant)?;
    let label = Some(name.clone().unwrap_or_else(|| format!("variant {variant}")));
    let options = RunOptions { overrides, program, label, ..options };
    let named = name.map(|name| format!(" {name}")).unwrap_or_default();
    let texts = variant_overrides.iter().map(|it| format!("{}={}", it.name, it.value));
    print_to_stderr(&format!("variant {variant}{named}: {}", texts.collect::<Vec<_>>().join(" ")));
    let mut context = RunContext::default();
    let scenario: &Path = &plan.scenario_path();
    let run = progress::run_with_progress_bar(scenario, &options, &mut context, |_, _| {})?;
    print_run_warnings(&run.report);
    print_text(&run.report.terminal_lines());
    free_fmus(context);
    match sweep::differences_from_sweep_result(plan, variant, &run.report)? {
        None => print_to_stderr("the sweep has no result of this variant yet"),
        Some(found) if found.is_empty() => {
            print_text("  the same results as in the sweep, to the last bit\n")
        }
        Some(found) => print_to_stderr(&format!(
            "warning: the sweep had other results: {}; an FMU that depends on more than its inputs gives such differences",
            found.join(", ")
        )),
    }
    Ok(run.report.exit_code())
}
