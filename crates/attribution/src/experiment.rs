//! Repeats runs, and runs that are made of A and some differences of B, and keeps count of what that costs.

use std::path::PathBuf;
use std::sync::{Arc, PoisonError};

use archive::TemporaryFolder;
use cosim::coupling;
use cosim::master::{self, RunProgress};
use cosim::node::{self, FmuProcessOptions, Node};
use cosim::system::{NodeBody, System};
use diagnostics::Error;
use scenario::plan::RunPlan;
use scenario::resolve::{FmuCache, IsolationPolicy};
use scenario::{BuildArtifacts, Scenario};
use serde::Serialize;

use crate::difference::{InputSwap, MixedInputs};
use crate::reference_outputs::show_reference_outputs;
use crate::run_inputs::RunInputs;
use crate::trajectory::{Trajectory, TrajectoryComparison};

/// Values of two runs that are compared may take this much memory [bytes].
const MEMORY: usize = 2 << 30;

/// How experiments are run.
pub struct ExperimentOptions<'a> {
    /// How FMUs get processes of their own; without it they run in this one.
    pub host: Option<FmuProcessOptions>,
    /// The most runs.
    pub most_runs: usize,
    /// Whether to go on: asked at each communication point.
    pub may_continue: &'a dyn Fn() -> Result<(), Error>,
}

/// A node, or the connection to an input, that differs by itself: all that it gets is as in A.
#[derive(Debug, Clone, Serialize)]
pub struct LocalDeviation {
    /// The node.
    pub node: String,
    /// The output, or the input whose connection it is.
    pub variable: String,
    /// Whether it is an input.
    pub input: bool,
    /// The first time [s].
    pub time: f64,
    /// The value in A.
    pub a: f64,
    /// That in B.
    pub b: f64,
}

/// A simulated run.
pub(crate) struct SimulatedRun {
    pub trajectory: Arc<Trajectory>,
    /// Why it did not come to its end.
    pub failure: Option<String>,
}

/// Runs experiments on the inputs of two runs.
pub(crate) struct ExperimentRunner<'a> {
    options: &'a ExperimentOptions<'a>,
    isolate: IsolationPolicy,
    cache: FmuCache,
    /// A folder with `a` and `b`, the kept files of both.
    folder: TemporaryFolder,
    /// The runs so far.
    pub runs: usize,
}

impl<'a> ExperimentRunner<'a> {
    pub fn new(
        options: &'a ExperimentOptions<'a>,
        isolate: IsolationPolicy,
        a: &RunInputs,
        b: &RunInputs,
    ) -> Result<Self, Error> {
        let failed = |error: std::io::Error| Error::invalid_input(format!("a temporary folder: {error}"));
        let folder = TemporaryFolder::new().map_err(failed)?;
        for (name, inputs) in [("a", a), ("b", b)] {
            let target = std::path::absolute(inputs.folder.folder_path()).map_err(failed)?;
            std::os::unix::fs::symlink(target, folder.folder_path().join(name)).map_err(failed)?;
        }
        Ok(ExperimentRunner { options, isolate, cache: FmuCache::new(), folder, runs: 0 })
    }

    /// The plan of a run as it was; `name` is `a` or `b`.
    pub fn plan(&mut self, inputs: &RunInputs, name: &str) -> Result<RunPlan, Error> {
        self.resolve(&MixedInputs::of_run(inputs, name), name)
    }

    fn resolve(&mut self, mixed: &MixedInputs, name: &str) -> Result<RunPlan, Error> {
        let text = toml::to_string(&mixed.table).map_err(|error| Error::invalid_input(error.to_string()))?;
        let path = PathBuf::from(format!("{name}.toml"));
        let scenario = Scenario::from_bundle(&path, text, self.folder.folder_path())?;
        let overrides = mixed.overrides.to_overrides(self.isolate);
        RunPlan::resolve_cached(
            &scenario,
            &BuildArtifacts::default(),
            &overrides,
            PathBuf::new(),
            &mut self.cache,
        )
    }

    /// Whether there may be one more run.
    pub fn has_budget(&self) -> bool {
        self.runs < self.options.most_runs
    }

    /// Runs A with these differences.
    pub fn run_with(&mut self, a: &RunInputs, swaps: &[&InputSwap]) -> Result<SimulatedRun, Error> {
        let mut plan = self.resolve(&MixedInputs::of_run(a, "a").with_swaps(swaps), "mixed")?;
        self.simulate(&mut plan.system)
    }

    /// Runs a system.
    ///
    /// # Errors
    /// When the values take too much memory, or somebody ends it; what an FMU does wrong ends the run.
    pub fn simulate(&mut self, system: &mut System) -> Result<SimulatedRun, Error> {
        let mut nodes = match self.instantiate(system)? {
            Ok(nodes) => nodes,
            Err(failure) => {
                return Ok(SimulatedRun { trajectory: Arc::default(), failure: Some(failure) });
            }
        };
        let (trajectory, failure) = self.step_to_end(system, &mut nodes)?;
        Ok(SimulatedRun { trajectory: Arc::new(trajectory), failure })
    }

    fn instantiate(&mut self, system: &mut System) -> Result<Result<Vec<Box<dyn Node>>, String>, Error> {
        self.runs += 1;
        let nodes = node::instantiate_nodes(system, self.options.host.as_ref());
        (self.options.may_continue)()?;
        Ok(nodes.map_err(|error| error.to_string()))
    }

    fn step_to_end(
        &mut self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
    ) -> Result<(Trajectory, Option<String>), Error> {
        let mut trajectory = Trajectory::with_columns(&system.columns);
        let size = trajectory.columns.len() * size_of::<f64>() * system.clock.steps as usize;
        if size > MEMORY {
            let message =
                format!("the values of one run take {} MB, more than {} MB", size >> 20, MEMORY >> 20);
            return Err(
                Error::invalid_input(message).with_help("a shorter run, or fewer outputs, can be compared")
            );
        }
        let mut coupling = coupling::create_coupling(system);
        let mut progress = RunProgress::default();
        let mut stopped = None;
        let mut on_tick =
            |_: u64| (self.options.may_continue)().inspect_err(|error| stopped = Some(error.to_string()));
        let ended = match nodes.is_empty() {
            true => Ok(()),
            false => {
                master::run(system, nodes, coupling.as_mut(), &mut trajectory, &mut progress, &mut on_tick)
            }
        };
        match (ended, stopped) {
            (Err(error), Some(_)) => Err(error),
            (ended, _) => Ok((trajectory, ended.err().map(|error| error.to_string()))),
        }
    }

    /// Runs the system of B while each node gets what it got in A: the nodes and connections that differ by themselves, in the order of
    /// time.
    pub fn local_deviations(
        &mut self,
        system: &mut System,
        reference: &Arc<Trajectory>,
    ) -> Result<Vec<LocalDeviation>, Error> {
        let Ok(mut nodes) = self.instantiate(system)? else { return Ok(Vec::new()) };
        let found = show_reference_outputs(system, &mut nodes, reference);
        let (trajectory, _) = self.step_to_end(system, &mut nodes)?;
        let mut deviations = Vec::new();
        for (plan, first) in system.nodes.iter().zip(found) {
            let is_connector = matches!(plan.body, NodeBody::Inlet | NodeBody::Outlet);
            let first = *first.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(first) = first.filter(|_| !is_connector) else { continue };
            let variable =
                plan.outputs.nth_index(first.output).map(|index| system.columns[index].variable.clone());
            deviations.push(LocalDeviation {
                node: plan.name.clone(),
                variable: variable.unwrap_or_default(),
                input: false,
                time: first.time,
                a: first.a,
                b: first.b,
            });
        }
        // The outputs are those of A here: inputs that differ do so by their connections.
        let order: Vec<_> = node_order(system);
        let comparison = TrajectoryComparison::new(reference, &trajectory, &order);
        let inputs = comparison.deviations.iter().filter(|it| it.signal.input);
        deviations.extend(inputs.map(|it| LocalDeviation {
            node: it.signal.node.clone(),
            variable: it.signal.variable.clone(),
            input: true,
            time: it.time,
            a: it.a,
            b: it.b,
        }));
        // A node whose connection differs gets something else, and differs for that.
        let inputs: Vec<_> =
            deviations.iter().filter(|it| it.input).map(|it| (it.node.clone(), it.time)).collect();
        deviations
            .retain(|it| it.input || inputs.iter().all(|(node, time)| *node != it.node || *time > it.time));
        deviations.sort_by(|a, b| a.time.total_cmp(&b.time));
        Ok(deviations)
    }
}

/// The names of the nodes in the order in which they step.
pub(crate) fn node_order(system: &System) -> Vec<String> {
    system.order.iter().map(|node| system.nodes[*node].name.clone()).collect()
}
