//! `trackside sweep submit`: lets Slurm, HyperQueue or processes of this machine run the chunks of a plan.

use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use diagnostics::{Error, shown};
use indicatif::{ProgressBar, ProgressStyle};
use orchestrator::sweep::{self, EngineKind, Followed, Plan, SubmitOptions, Watched};

use super::{print, tell, this_program};

/// How to submit.
#[derive(Args)]
pub struct How {
    /// Who runs the chunks.
    #[arg(long)]
    engine: Engine,
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
enum Engine {
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
pub fn run(plan: &Plan, how: &How) -> Result<bool, Error> {
    let engine = match how.engine {
        Engine::Slurm => EngineKind::Slurm,
        Engine::Hyperqueue => EngineKind::HyperQueue,
        Engine::Local => EngineKind::Local,
    };
    let (jobs, detach, options) = (how.jobs, how.detach, how.options.clone());
    let options = SubmitOptions { engine, jobs, detach, options };
    let mut line = Line::new(plan);
    let followed = sweep::submit(plan, &options, &this_program()?, &mut |it| line.show(it));
    line.bar.finish_and_clear();
    let folder = plan.folder.display();
    match followed? {
        Followed::Done => return Ok(true),
        Followed::Detached => {
            print(&format!(
                "{}\n{folder}\nthe same command without --detach follows them\n",
                words(&line.last)
            ));
            return Ok(false);
        }
        Followed::Left => tell(&format!(
            "{}; the tasks go on, and the same command follows them again: {folder}",
            words(&line.last)
        )),
        Followed::Stopped => tell(&format!(
            "{}; what is done is in {folder}, and the same command goes on",
            words(&line.last)
        )),
    }
    Err(Error::Interrupted(fmu_import::termination_signal().unwrap_or_default()))
}

fn words(watched: &Watched) -> String {
    let Watched { chunks, done, running, waiting, lost, .. } = watched;
    let lost = match lost {
        0 => String::new(),
        lost => format!(", {lost} submitted again"),
    };
    format!("{done} of {chunks} chunks done, {running} running, {waiting} waiting{lost}")
}

/// In a pipe a line is written this often.
const PERIOD: Duration = Duration::from_secs(30);

/// Shows how far the chunks are.
struct Line {
    bar: ProgressBar,
    last: Watched,
    told: Option<Instant>,
}

impl Line {
    fn new(plan: &Plan) -> Self {
        use std::io::IsTerminal as _;
        let bar = match std::io::stderr().is_terminal() {
            false => ProgressBar::hidden(),
            true => {
                let style = ProgressStyle::with_template("{prefix} {wide_bar} {msg}");
                let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
                ProgressBar::new(plan.chunks()).with_style(style)
            }
        };
        bar.set_prefix(shown(&plan.about.scenario).into_owned());
        Line { bar, last: Watched::default(), told: None }
    }

    fn show(&mut self, watched: &Watched) {
        if let Some(why) = watched.silent.as_ref().filter(|_| watched.silent != self.last.silent) {
            self.bar.suspend(|| tell(&format!("warning: the engine does not do it now: {why}")));
        }
        if !self.bar.is_hidden() {
            self.bar.set_position(watched.done as u64);
            self.bar.set_message(words(watched));
        } else if self.told.is_none_or(|told| told.elapsed() > PERIOD) {
            self.told = Some(Instant::now());
            tell(&words(watched));
        }
        self.last = watched.clone();
    }
}
