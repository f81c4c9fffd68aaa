//! Counts what the loop of a run allocates: nothing in a step, so twice as many steps allocate as often. Its allocator needs a program of
//! its own.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use allocation_counter::{AllocationInfo, measure};
use assessment::check::RunChecks;
use cosim::master::{self, RunProgress};
use cosim::node;
use diagnostics::Error;
use libtest_mimic::{Arguments, Trial};
use orchestrator::package;
use recording::overview::RunOverview;
use recording::{AllVariables, RecordedSelection, RecordedVariables, Row, RunEvent, Sink, SinkNotice};
use scenario::plan::RunPlan;
use scenario::resolve::Overrides;
use scenario::{BuildArtifacts, Scenario};

fn main() -> ExitCode {
    let test = || {
        twice_as_many_steps_allocate_as_often();
        Ok(())
    };
    let trial = Trial::test("twice_as_many_steps_allocate_as_often", test);
    libtest_mimic::run(&Arguments::from_args(), vec![trial]).exit_code()
}

/// What takes rows in a run, without a thread: the checks, the choice of what is recorded, and the overview of it.
struct Rows {
    checks: RunChecks,
    recorded: RecordedSelection,
    row: Row<RecordedVariables>,
    overview: RunOverview,
}

impl Sink<AllVariables> for Rows {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        self.recorded.copy_recorded_values(row, &mut self.row);
        self.overview.push_row(tick, time, &self.row)?;
        self.checks.push_row(tick, time, row)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        self.checks.push_event(event)
    }

    fn take_notices(&mut self) -> Vec<SinkNotice> {
        self.checks.take_notices()
    }
}

/// What so many steps of a scenario with three FMUs, noise and checks allocate.
fn allocated(scenario: &Scenario, built: &BuildArtifacts, steps: u64) -> AllocationInfo {
    let mut plan =
        RunPlan::resolve(scenario, built, &Overrides::default(), PathBuf::new()).expect("a sound scenario");
    (plan.system.clock.steps, plan.system.announced_stop) = (steps, None);
    plan.restrict_outputs();
    let mut nodes = node::instantiate_nodes(&mut plan.system, None).expect("the FMUs load");
    let mut checks = std::mem::take(&mut plan.checks);
    // The end of a check is an event, which has a text: all of them go on.
    checks.iter_mut().for_each(|check| check.during[1] = f64::MAX);
    let mut rows = Rows {
        checks: RunChecks::new(checks, plan.system.clock.step),
        recorded: plan.recorded.clone(),
        row: Row::default(),
        overview: RunOverview::new(&plan.header, plan.header.view.pose.clone()),
    };
    let (mut coupling, mut progress) =
        (cosim::coupling::create_coupling(&plan.system), RunProgress::default());
    let counted = measure(|| {
        let mut tick = |_| Ok(());
        master::run(&mut plan.system, &mut nodes, coupling.as_mut(), &mut rows, &mut progress, &mut tick)
            .expect("the run comes to its end");
    });
    assert_eq!(progress.steps, steps);
    counted
}

fn twice_as_many_steps_allocate_as_often() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/double_lane_change.toml");
    let scenario = Scenario::read(&path).expect("a scenario");
    let built = package::build_scenario_packages(&scenario, &mut |_| {}).expect("the FMUs are built");
    // The picture of a check grows up to 600 samples.
    let [once, twice] = [4_000, 8_000].map(|steps| allocated(&scenario, &built, steps));
    assert!(once.count_total > 0, "the beginning allocates");
    assert_eq!(twice.count_total, once.count_total, "{once:?} {twice:?}");
    assert_eq!(twice.bytes_max, once.bytes_max, "memory stays as it is: {once:?} {twice:?}");
}
