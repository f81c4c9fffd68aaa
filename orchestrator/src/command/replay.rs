//! `trackside replay`: runs a variant of a sweep again, with everything recorded.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;
use orchestrator::sweep::{self, Plan};
use orchestrator::{Replay, RunContext, RunOptions};

use super::run::{free, program_of_guests, warn};
use super::{print, progress, sweep as sweeps, tell};

/// Arguments of `trackside replay`.
#[derive(Args)]
pub struct Arguments {
    /// The variant: the folder of the sweep and its number, such as `target/sweeps/lane_change/17`.
    #[arg(value_name = "SWEEP/VARIANT")]
    variant: PathBuf,
    /// The folder for the files [default: variants/VARIANT in the folder of the sweep].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write run.csv too.
    #[arg(long)]
    csv: bool,
    /// Write no file for the Rerun viewer.
    #[arg(long)]
    no_rerun: bool,
}

/// Runs the variant, and says whether it gave what it gave in the sweep.
///
/// # Errors
/// When there is no such variant, or its run fails.
pub fn run(arguments: &Arguments) -> Result<u8, Error> {
    let (plan, variant) = sweeps::variant_of(&arguments.variant)?;
    let replay = if arguments.no_rerun { Replay::Off } else { Replay::Save };
    let out = arguments.out.clone().unwrap_or_else(|| folder(&plan, variant));
    let options =
        RunOptions { replay, csv: arguments.csv, out: Some(out), ..RunOptions::default() };
    run_variant(&plan, variant, options)
}

/// Runs a variant of a sweep that is over, unless it was recorded before.
///
/// # Errors
/// When its run fails by the input.
pub(super) fn record(plan: &Plan, variant: u64) -> Result<(), Error> {
    let out = folder(plan, variant);
    if out.join(scenario::plan::REPORT).exists() {
        return Ok(());
    }
    match run_variant(plan, variant, RunOptions { out: Some(out), ..RunOptions::default() }) {
        // A variant that fails was chosen because it does.
        Err(error @ (Error::Input(_) | Error::Interrupted(_) | Error::Output { .. })) => Err(error),
        _ => Ok(()),
    }
}

fn folder(plan: &Plan, variant: u64) -> PathBuf {
    plan.folder.join("variants").join(variant.to_string())
}

fn run_variant(plan: &Plan, variant: u64, options: RunOptions) -> Result<u8, Error> {
    let variant_overrides = plan.overrides_of(variant)?;
    let overrides = plan.with_variant(&plan.overrides()?, &variant_overrides)?;
    let program = Some(program_of_guests()?);
    let options = RunOptions { overrides, program, ..options };
    let texts = variant_overrides.iter().map(|it| format!("{}={}", it.name, it.value));
    tell(&format!("variant {variant}: {}", texts.collect::<Vec<_>>().join(" ")));
    let mut context = RunContext::default();
    let scenario: &Path = &plan.scenario_file();
    let run = progress::run(scenario, &options, &mut context, |_, _| {})?;
    warn(&run.report);
    print(&run.report.lines());
    free(context);
    match sweep::differences(plan, variant, &run.report)? {
        None => tell("the sweep has no result of this variant yet"),
        Some(found) if found.is_empty() => {
            print("  the same results as in the sweep, to the last bit\n")
        }
        Some(found) => tell(&format!(
            "warning: the sweep had other results: {}; an FMU that depends on more than its inputs gives such differences",
            found.join(", ")
        )),
    }
    Ok(run.report.exit_code())
}
