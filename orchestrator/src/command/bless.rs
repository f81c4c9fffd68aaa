//! `trackside bless`: takes a finished run as right, by new baselines or by tubes that hold it.

use std::path::PathBuf;

use clap::Args;
use diagnostics::Error;
use orchestrator::baseline::bless::{FinishedRun, TubeEdit};
use orchestrator::baseline_change::BaselineChange;
use orchestrator::tube_lines;

use super::{print_text, print_to_stderr};

/// Arguments of `trackside bless`.
#[derive(Args)]
pub struct BlessArguments {
    /// The folder of the run.
    run: PathBuf,
    /// Leave the baselines as they are, and write tubes that hold the run into the scenario file: for each signal that left its tube the
    /// smallest one of two digits.
    #[arg(long)]
    tube: bool,
    /// Replace baselines that are not as --bless wrote them, too.
    #[arg(long, conflicts_with = "tube")]
    force: bool,
}

/// Writes the baselines of a run, or the tubes, and prints what changes; exit code 1 when the run cannot be taken as right.
///
/// # Errors
/// When there is no such run, or a file cannot be written.
pub fn run_bless_command(arguments: &BlessArguments) -> Result<u8, Error> {
    let run = FinishedRun::read(&arguments.run)?;
    if arguments.tube { write_tubes(&run) } else { write_baselines(&run, arguments.force) }
}

fn write_baselines(run: &FinishedRun, force: bool) -> Result<u8, Error> {
    if let Some(reason) = run.refusal() {
        print_to_stderr(&format!("the baselines were not written: {reason}"));
        return Ok(1);
    }
    let changes = run.changes();
    let written = run.write_baselines(force)?;
    changes.iter().flat_map(BaselineChange::lines).for_each(|line| print_text(&format!("{line}\n")));
    for path in written {
        print_text(&format!("wrote the baseline {}\n", path.display()));
    }
    Ok(0)
}

fn write_tubes(run: &FinishedRun) -> Result<u8, Error> {
    let comparisons = run.changes();
    let comparisons = comparisons.iter().filter_map(|change| change.comparison.as_ref());
    let lines: String = comparisons.filter_map(tube_lines::tube_toml).collect();
    if lines.is_empty() {
        print_text("all signals stay in their tubes: there is nothing to write\n");
        return Ok(0);
    }
    print_text(&lines);
    let edits = run.write_tubes()?;
    for TubeEdit { file, baseline, written, .. } in edits.iter().filter(|edit| edit.written > 0) {
        let tubes = if *written == 1 { "1 tube".to_owned() } else { format!("{written} tubes") };
        print_text(&format!("wrote {tubes} of the baseline `{baseline}` into {}\n", file.display()));
    }
    // A run that no tube holds fails again.
    Ok(u8::from(edits.is_empty() || edits.iter().any(|edit| !edit.unheld.is_empty())))
}
