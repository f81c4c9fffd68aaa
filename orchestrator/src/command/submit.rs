//! `trackside sweep submit`: lets Slurm, HyperQueue or processes of this machine run the chunks of a plan.

use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use diagnostics::{Error, escape_for_terminal};
use indicatif::{ProgressBar, ProgressStyle};
use orchestrator::sweep::{self, ChunkProgress, EngineKind, FollowOutcome, SubmitOptions, SweepPlanFolder};

use super::{current_program_path, print_text, print_to_stderr};

/// How to submit the chunks of a plan.
#[derive(Args)]
pub struct SubmitArguments {
    /// Who runs the chunks.
    #[arg(long)]
    engine: EngineArg,
    /// Chunks at a time [default: as many as the engine likes; with local, as many as this machine has cores].
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Return when the chunks are submitted. The same command without it follows them and puts their results together.
    #[arg(long)]
    detach: bool,
    /// Options for sbatch or hq submit, such as --partition=NAME.
    #[arg(last = true, value_name = "ENGINE OPTIONS")]
    options: Vec<String>,
}

/// An engine by its name.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum EngineArg {
    /// A job array of Slurm.
    Slurm,
    /// A task array of HyperQueue.
    Hyperqueue,
    /// Processes of this machine.
    Local,
}

/// Submits the chunks of a plan and follows them; says whether all are done.
///
/// # Errors
/// When the engine refuses, chunks fail, or somebody ends this program.
pub fn submit_and_follow_chunks(plan: &SweepPlanFolder, how: &SubmitArguments) -> Result<bool, Error> {
    let engine = match how.engine {
        EngineArg::Slurm => EngineKind::Slurm,
        EngineArg::Hyperqueue => EngineKind::HyperQueue,
        EngineArg::Local => EngineKind::Local,
    };
    let (jobs, detach, options) = (how.jobs, how.detach, how.options.clone());
    let options = SubmitOptions { engine, jobs, detach, options };
    let mut line = ChunkProgressDisplay::new(plan);
    let followed =
        sweep::submit_and_follow(plan, &options, &current_program_path()?, &mut |it| line.show_progress(it));
    line.bar.finish_and_clear();
    let folder = plan.folder.display();
    match followed? {
        FollowOutcome::Done => return Ok(true),
        FollowOutcome::Detached => {
            print_text(&format!(
                "{}\n{folder}\nthe same command without --detach follows them\n",
                progress_line(&line.last)
            ));
            return Ok(false);
        }
        FollowOutcome::Left => print_to_stderr(&format!(
            "{}; the tasks go on, and the same command follows them again: {folder}",
            progress_line(&line.last)
        )),
        FollowOutcome::Stopped => print_to_stderr(&format!(
            "{}; what is done is in {folder}, and the same command goes on",
            progress_line(&line.last)
        )),
    }
    Err(Error::Interrupted(fmu_import::termination_signal().unwrap_or_default()))
}

fn progress_line(progress: &ChunkProgress) -> String {
    let ChunkProgress { chunks, done, running, waiting, lost, .. } = progress;
    let lost = match lost {
        0 => String::new(),
        lost => format!(", {lost} submitted again"),
    };
    format!("{done} of {chunks} chunks done, {running} running, {waiting} waiting{lost}")
}

/// In a pipe a line is written this often.
const PERIOD: Duration = Duration::from_secs(30);

/// Shows how far the chunks are.
struct ChunkProgressDisplay {
    bar: ProgressBar,
    last: ChunkProgress,
    last_line: Option<Instant>,
}

impl ChunkProgressDisplay {
    fn new(plan: &SweepPlanFolder) -> Self {
        use std::io::IsTerminal as _;
        let bar = match std::io::stderr().is_terminal() {
            false => ProgressBar::hidden(),
            true => {
                let style = ProgressStyle::with_template("{prefix} {wide_bar} {msg}");
                let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
                ProgressBar::new(plan.chunk_count()).with_style(style)
            }
        };
        bar.set_prefix(escape_for_terminal(&plan.metadata.scenario).into_owned());
        ChunkProgressDisplay { bar, last: ChunkProgress::default(), last_line: None }
    }

    fn show_progress(&mut self, progress: &ChunkProgress) {
        if let Some(why) = progress.silent.as_ref().filter(|_| progress.silent != self.last.silent) {
            self.bar.suspend(|| print_to_stderr(&format!("warning: the engine does not do it now: {why}")));
        }
        if !self.bar.is_hidden() {
            self.bar.set_position(progress.done as u64);
            self.bar.set_message(progress_line(progress));
        } else if self.last_line.is_none_or(|last_line| last_line.elapsed() > PERIOD) {
            self.last_line = Some(Instant::now());
            print_to_stderr(&progress_line(progress));
        }
        self.last = progress.clone();
    }
}
