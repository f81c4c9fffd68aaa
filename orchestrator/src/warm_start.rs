//! Warm start: the FMUs of a run stay in memory at its last checkpoint, and several branches start from there in one process.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use cosim::checkpoint::NodeStates;
use cosim::clock::CommunicationClock;
use cosim::node::Node;
use cosim::system::{NodeBody, System, VariableGroups};
use diagnostics::{Error, ErrorCollector};
use scenario::Scenario;

use crate::checkpoint_file::RunCheckpoint;

/// A checkpoint in memory: the FMUs of a run and their states.
pub(crate) struct WarmStart {
    pub checkpoint: RunCheckpoint,
    pub states: Rc<NodeStates>,
    fmus: Vec<RetainedFmu>,
}

struct RetainedFmu {
    name: String,
    ports: UsedFmuVariables,
    /// None while a run has it.
    node: Option<Box<dyn Node>>,
}

/// The variables of an FMU that a system connects, records or checks.
#[derive(PartialEq)]
struct UsedFmuVariables {
    inputs: VariableGroups,
    outputs: VariableGroups,
}

/// The ports of a node, if it is an FMU.
fn used_fmu_variables(body: &NodeBody) -> Option<UsedFmuVariables> {
    match body {
        NodeBody::Fmu { inputs, outputs, .. } => {
            Some(UsedFmuVariables { inputs: inputs.clone(), outputs: outputs.clone() })
        }
        _ => None,
    }
}

impl WarmStart {
    /// Takes the FMUs out of the nodes of a run, with their states at its checkpoint.
    pub fn new(
        system: &System,
        nodes: &mut Vec<Box<dyn Node>>,
        checkpoint: RunCheckpoint,
        states: NodeStates,
    ) -> Self {
        let each = system.nodes.iter().zip(nodes.drain(..));
        let fmus = each.filter_map(|(plan, node)| {
            let ports = used_fmu_variables(&plan.body)?;
            Some(RetainedFmu { name: plan.name.clone(), ports, node: Some(node) })
        });
        WarmStart { fmus: fmus.collect(), states: Rc::new(states), checkpoint }
    }

    /// The FMUs that do not fit a system that is to start from here, a sentence for each.
    pub fn describe_misfits(&self, system: &System) -> Vec<String> {
        let misfit = |fmu: &RetainedFmu| {
            let name = &fmu.name;
            let plan = system.nodes.iter().find(|plan| plan.name == *name)?;
            match (&fmu.node, used_fmu_variables(&plan.body)?) {
                (None, _) => Some(format!("`{name}` went with a run that failed before")),
                (_, ports) => (ports != fmu.ports).then(|| format!(
                    "`{name}` hands over other variables there: record and check the same outputs in both scenarios"
                )),
            }
        };
        self.fmus.iter().filter_map(misfit).collect()
    }

    /// Puts the FMUs in the places of a system's nodes.
    pub fn lend_nodes(&mut self, system: &System, nodes: &mut [Box<dyn Node>]) {
        for (plan, slot) in system.nodes.iter().zip(nodes) {
            let fmu = self.fmus.iter_mut().find(|fmu| fmu.name == plan.name);
            if let Some(mut node) = fmu.and_then(|fmu| fmu.node.take()) {
                if let Some(faults) = node.as_fault_injection() {
                    faults.set_call_faults(&plan.faults, &system.clock);
                }
                *slot = node;
            }
        }
    }

    /// Takes the FMUs back for the next branch.
    pub fn take_back_nodes(&mut self, system: &System, nodes: &mut Vec<Box<dyn Node>>) {
        for (plan, node) in system.nodes.iter().zip(nodes.drain(..)) {
            if let Some(fmu) = self.fmus.iter_mut().find(|fmu| fmu.name == plan.name) {
                fmu.node = Some(node);
            }
        }
    }
}

/// The latest stop time of scenarios [s]: the FMUs of all of them are told it.
///
/// # Errors
/// When one cannot be read.
pub fn latest_stop(scenarios: &[PathBuf], variant: Option<&str>) -> Result<Option<f64>, Error> {
    let stop = |path: &PathBuf| {
        let scenario = Scenario::read_variant(Path::new(path), variant)?;
        // What is wrong with the times is told when it runs.
        Ok(scenario.document.time.as_ref().map(|time| {
            let start = time.start.as_ref().map_or(0.0, |start| *start.get_ref());
            let (step, stop) = (*time.step.get_ref(), *time.stop.get_ref());
            CommunicationClock { start, step, steps: ((stop - start) / step).round() as u64 }.announced_stop()
        }))
    };
    let stops = ErrorCollector::collect_all(scenarios.iter().map(stop))?;
    Ok(stops.into_iter().flatten().reduce(f64::max))
}
