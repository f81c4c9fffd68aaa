//! Runs variants in a process of its own, for the process that started this one.

use std::path::{Path, PathBuf};
use std::time::Duration;

use diagnostics::Error;
use isolation::{Channel, Packet};
use scenario::Built;
use scenario::resolve::{self, Opened, Overrides};
use serde::{Deserialize, Serialize};

use super::plan::Plan;
use super::settings::Setting;
use super::trial::Reuse;
use super::variant::{Bench, Outcome};

/// What the host asks.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Question {
    /// To open a plan.
    Open(PathBuf),
    /// To run a variant with these values.
    Run(Vec<Setting>),
    /// To end.
    Leave,
}

/// What it is told.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Answer {
    /// The plan is open, and what its scenario takes at most for a run [s], or why it is not.
    Opened(Result<f64, String>),
    /// What came of the variant, and whether instances of FMUs are used again.
    Ran(Box<Outcome>, bool),
}

/// The limit of a variant whose scenario has none.
const LIMIT: Duration = Duration::from_secs(3600);

/// Serves `host`, the number of the process that started this one, until it asks this one to leave.
///
/// # Errors
/// When this process has no such host, or that has ended.
pub fn serve(host: u32, program: &Path) -> Result<(), Error> {
    let wrong = |what: String| Error::input(format!("this is for workers of a sweep: {what}"));
    let (channel, _) = isolation::become_guest(host).map_err(|error| wrong(error.to_string()))?;
    fmu_import::ignore_termination_signals();
    let look = || match isolation::has_host(host) {
        true => Ok(()),
        false => Err(wrong("the host has ended".to_owned())),
    };
    let (mut talk, mut worker) = (Packet::default(), None);
    loop {
        channel.receive(&mut talk, look)?;
        let question = postcard::from_bytes::<Question>(&talk.bytes);
        match question.map_err(|error| wrong(error.to_string()))? {
            Question::Leave => {
                fmu_import::set_final_exit_code(Some(0));
                drop(worker);
                return Ok(());
            }
            Question::Open(folder) => {
                let opened = Worker::open(&folder, program);
                let limit = opened.as_ref().map(|it| it.bench.limit.as_secs_f64());
                let limit = limit.map_err(ToString::to_string);
                worker = opened.ok();
                tell(&channel, &Answer::Opened(limit), look)?;
            }
            Question::Run(settings) => {
                let Some(worker) = &mut worker else { return Err(wrong("no plan".to_owned())) };
                let (outcome, again) = worker.run(&settings);
                tell(&channel, &Answer::Ran(Box::new(outcome), again), look)?;
            }
        }
    }
}

fn tell(
    channel: &Channel,
    answer: &Answer,
    look: impl FnMut() -> Result<(), Error>,
) -> Result<(), Error> {
    let bytes = postcard::to_stdvec(answer).map_err(|error| Error::input(error.to_string()))?;
    channel.send(&[], &bytes, look)
}

/// What a worker has.
struct Worker {
    plan: Plan,
    overrides: Overrides,
    bench: Bench,
    reuse: Reuse,
    /// For files of analyses; removed with the worker.
    _scratch: archive::Folder,
}

impl Worker {
    fn open(folder: &Path, program: &Path) -> Result<Self, Error> {
        let plan = Plan::look_at(folder)?;
        let scratch = archive::Folder::new().map_err(|error| Error::input(error.to_string()))?;
        let scenario = plan.scenario()?;
        let limit = resolve::limit(&scenario)?.unwrap_or(LIMIT);
        let bench = Bench {
            scenario,
            built: Built::default(),
            opened: Opened::default(),
            folder: scratch.path().join("run"),
            program: program.to_owned(),
            limit,
        };
        let overrides = plan.overrides()?;
        Ok(Worker { plan, overrides, bench, reuse: Reuse::Unknown, _scratch: scratch })
    }

    fn run(&mut self, settings: &[Setting]) -> (Outcome, bool) {
        let outcome = match self.plan.with(&self.overrides, settings) {
            Ok(overrides) => self.reuse.run(&mut self.bench, &overrides),
            Err(error) => Outcome::failed(&error),
        };
        (outcome, matches!(self.reuse, Reuse::Proven(_)))
    }
}
