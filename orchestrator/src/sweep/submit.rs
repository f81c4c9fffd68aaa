//! Submits the chunks of a plan to an engine, follows them, and submits lost ones again.

mod engine;
mod follow;
mod hyperqueue;
mod local;
mod slurm;
mod submission;

use std::fs::File;
use std::path::Path;

use diagnostics::Error;

use self::engine::TaskEngine;
use self::follow::ChunkFollower;
pub use self::follow::{ChunkProgress, FollowOutcome};
use self::submission::TaskArraySubmissions;
use super::plan::SweepPlanFolder;

/// Who runs the chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineKind {
    /// Slurm, by `sbatch`.
    Slurm,
    /// HyperQueue, by `hq`.
    HyperQueue,
    /// Processes of this machine.
    Local,
}

/// How to submit.
#[derive(Debug, Clone)]
pub struct SubmitOptions {
    /// Who runs the chunks.
    pub engine: EngineKind,
    /// Chunks at a time.
    pub jobs: Option<usize>,
    /// Whether to return when they are submitted.
    pub detach: bool,
    /// Options for the command that submits.
    pub options: Vec<String>,
}

/// Submits the chunks of a plan that are not done, and follows them to their end. `program` is what the tasks run; `show` gets how far they
/// are, again and again.
///
/// # Errors
/// When the engine refuses, a task fails for a reason that stays, or a chunk failed three times.
pub fn submit_and_follow(
    plan: &SweepPlanFolder,
    options: &SubmitOptions,
    program: &Path,
    show: &mut dyn FnMut(&ChunkProgress),
) -> Result<FollowOutcome, Error> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let given = options.options.clone();
    let (engine, name, task): (Box<dyn TaskEngine>, _, _) = match options.engine {
        EngineKind::Slurm => {
            (Box::new(slurm::SlurmEngine { jobs: options.jobs, options: given }), "slurm", slurm::TASK)
        }
        EngineKind::HyperQueue => {
            (Box::new(hyperqueue::HyperQueueEngine { submit_options: given }), "hyperqueue", hyperqueue::TASK)
        }
        EngineKind::Local => {
            let jobs = options.jobs.unwrap_or(cores);
            (Box::new(local::LocalProcessEngine::new(jobs)), "local", local::TASK)
        }
    };
    options.check_for_engine(engine.outlives_program())?;
    let submissions = TaskArraySubmissions::open(plan, name, task, program)?;
    let alone = submissions.try_lock();
    if !engine.outlives_program() && alone.is_none() {
        let folder = plan.folder.display();
        let message = format!("another trackside sweep submit runs the chunks of {folder} here");
        return Err(Error::invalid_input(message).with_help("wait for its end, or end it"));
    }
    let mut follow = ChunkFollower::new(plan, engine, submissions)?;
    let followed = follow.follow_and_submit_chunks(options.detach, show);
    drop::<Option<File>>(alone);
    followed
}

impl SubmitOptions {
    fn check_for_engine(&self, outlives_program: bool) -> Result<(), Error> {
        if self.detach && !outlives_program {
            let message = "--detach: the chunks of --engine local run in this program only";
            return Err(Error::invalid_input(message).with_help("leave --detach out, or name another engine"));
        }
        if !self.options.is_empty() && self.engine == EngineKind::Local {
            let message = format!("--engine local takes no options, found {}", self.options.join(" "));
            return Err(Error::invalid_input(message).with_help("leave out what follows `--`"));
        }
        if self.jobs.is_some() && self.engine == EngineKind::HyperQueue {
            return Err(Error::invalid_input(
                "--jobs: HyperQueue runs as many tasks as its workers have cores for",
            )
            .with_help("leave --jobs out; hq worker start --cpus N gives a worker fewer cores"));
        }
        Ok(())
    }
}
