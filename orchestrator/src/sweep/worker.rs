//! The worker process of a sweep: it runs variants for the process that started it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use diagnostics::Error;
use isolation::{ChannelPacket, ProcessChannel};
use scenario::BuildArtifacts;
use scenario::resolve::{self, FmuCache, Override, Overrides};
use serde::{Deserialize, Serialize};

use super::instance_reuse::InstanceReuse;
use super::plan::SweepPlanFolder;
use super::variant::{VariantOutcome, VariantRunner};

/// A request of the host.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum WorkerRequest {
    /// To open a plan.
    Open(PathBuf),
    /// To run a variant with these values.
    Run(Vec<Override>),
    /// To end.
    Leave,
}

/// The response of the worker.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum WorkerResponse {
    /// The plan is open, and what its scenario takes at most for a run [s], or why it is not.
    Opened(Result<f64, String>),
    /// What came of the variant, and whether instances of FMUs are used again.
    Ran(Box<VariantOutcome>, bool),
}

/// The limit of a variant whose scenario has none.
const LIMIT: Duration = Duration::from_secs(3600);

/// Serves `host`, the number of the process that started this one, until it asks this one to leave.
///
/// # Errors
/// When this process has no such host, or that has ended.
pub fn serve_sweep_worker(host: u32, program: &Path) -> Result<(), Error> {
    let wrong = |what: String| Error::invalid_input(format!("this is for workers of a sweep: {what}"));
    let (channel, _) = isolation::connect_to_host_process(host).map_err(|error| wrong(error.to_string()))?;
    fmu_import::ignore_termination_signals();
    let check_host = || match isolation::is_host_alive(host) {
        true => Ok(()),
        false => Err(wrong("the host has ended".to_owned())),
    };
    let (mut talk, mut worker) = (ChannelPacket::default(), None);
    loop {
        channel.receive(&mut talk, check_host)?;
        let request = postcard::from_bytes::<WorkerRequest>(&talk.bytes);
        match request.map_err(|error| wrong(error.to_string()))? {
            WorkerRequest::Leave => {
                fmu_import::set_final_exit_code(Some(0));
                drop(worker);
                return Ok(());
            }
            WorkerRequest::Open(folder) => {
                let opened = SweepWorker::open(&folder, program);
                let limit = opened.as_ref().map(|it| it.runner.limit.as_secs_f64());
                let limit = limit.map_err(ToString::to_string);
                worker = opened.ok();
                send_response(&channel, &WorkerResponse::Opened(limit), check_host)?;
            }
            WorkerRequest::Run(overrides) => {
                let Some(worker) = &mut worker else { return Err(wrong("no plan".to_owned())) };
                let outcome = Box::new(worker.run_variant(&overrides));
                let reused = matches!(worker.reuse, InstanceReuse::Verified(_));
                send_response(&channel, &WorkerResponse::Ran(outcome, reused), check_host)?;
            }
        }
    }
}

fn send_response(
    channel: &ProcessChannel,
    response: &WorkerResponse,
    check_host: impl FnMut() -> Result<(), Error>,
) -> Result<(), Error> {
    let bytes = postcard::to_stdvec(response).map_err(|error| Error::invalid_input(error.to_string()))?;
    channel.send(&[], &bytes, check_host)
}

/// A worker with its plan, and what it keeps from one variant to the next.
struct SweepWorker {
    plan: SweepPlanFolder,
    overrides: Overrides,
    runner: VariantRunner,
    reuse: InstanceReuse,
    /// For files of analyses; removed with the worker.
    _scratch: archive::TemporaryFolder,
}

impl SweepWorker {
    fn open(folder: &Path, program: &Path) -> Result<Self, Error> {
        let plan = SweepPlanFolder::open_of_any_program(folder)?;
        let scratch =
            archive::TemporaryFolder::new().map_err(|error| Error::invalid_input(error.to_string()))?;
        let scenario = plan.read_scenario()?;
        let limit = resolve::wall_clock_limit(&scenario)?.unwrap_or(LIMIT);
        let runner = VariantRunner {
            scenario,
            built: BuildArtifacts::default(),
            cache: FmuCache::default(),
            folder: scratch.folder_path().join("run"),
            program: program.to_owned(),
            limit,
        };
        let overrides = plan.common_overrides()?;
        Ok(SweepWorker { plan, overrides, runner, reuse: InstanceReuse::Untested, _scratch: scratch })
    }

    fn run_variant(&mut self, variant: &[Override]) -> VariantOutcome {
        match self.plan.with_variant(&self.overrides, variant) {
            Ok(overrides) => self.reuse.run_variant(&mut self.runner, &overrides),
            Err(error) => VariantOutcome::from_error(&error),
        }
    }
}

#[cfg(test)]
mod tests {
    use scenario::resolve::OverrideValue;

    use super::*;

    #[test]
    fn values_reach_the_worker_as_they_are() {
        let values = [
            OverrideValue::Number { value: 1.0 / 3.0, unit: Some("kN".to_owned()) },
            OverrideValue::Number { value: f64::MIN_POSITIVE, unit: None },
            OverrideValue::Integer(i64::MIN),
            OverrideValue::Boolean(false),
            OverrideValue::Typed("wet".to_owned()),
            OverrideValue::TextOf("front.tir".into()),
        ];
        let overrides: Vec<_> = values.iter().map(|value| Override::new("plant.x", value.clone())).collect();
        let bytes = postcard::to_stdvec(&WorkerRequest::Run(overrides)).expect("it is written");
        match postcard::from_bytes(&bytes).expect("it is read") {
            WorkerRequest::Run(read) => {
                assert!(read.iter().all(|it| it.name == "plant.x"));
                assert!(read.into_iter().map(|it| it.value).eq(values));
            }
            other => panic!("{other:?}"),
        }
    }
}
