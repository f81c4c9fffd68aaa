//! Keeps the FMUs of a run in memory at a checkpoint: several ends go on from there in one process.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use cosim::checkpoint::States;
use cosim::clock::Clock;
use cosim::node::Node;
use cosim::system::{Body, System, VariableGroups};
use diagnostics::{Error, Mistakes};
use scenario::Scenario;

use crate::checkpoint_file::RunCheckpoint;

/// The FMUs of a run with their states at a checkpoint.
pub(crate) struct Held {
    pub checkpoint: RunCheckpoint,
    pub states: Rc<States>,
    fmus: Vec<HeldFmu>,
}

struct HeldFmu {
    name: String,
    /// Inputs and outputs that it hands over.
    ports: (VariableGroups, VariableGroups),
    /// None while a run has it.
    node: Option<Box<dyn Node>>,
}

/// The ports of a node, if it is an FMU.
fn ports(body: &Body) -> Option<(VariableGroups, VariableGroups)> {
    match body {
        Body::Fmu { inputs, outputs, .. } => Some((inputs.clone(), outputs.clone())),
        _ => None,
    }
}

impl Held {
    /// Keeps the FMUs among the nodes of a run and their states at its checkpoint, and takes them out of `nodes`.
    pub fn keep(
        system: &System,
        nodes: &mut Vec<Box<dyn Node>>,
        (checkpoint, states): (RunCheckpoint, States),
    ) -> Self {
        let each = system.nodes.iter().zip(nodes.drain(..));
        let fmus = each.filter_map(|(plan, node)| {
            let (name, ports) = (plan.name.clone(), ports(&plan.body)?);
            Some(HeldFmu { name, ports, node: Some(node) })
        });
        Held { fmus: fmus.collect(), states: Rc::new(states), checkpoint }
    }

    /// What of the FMUs does not fit a system that is to go on with them.
    pub fn misfits(&self, system: &System) -> Vec<String> {
        let misfit = |held: &HeldFmu| {
            let name = &held.name;
            let plan = system.nodes.iter().find(|plan| plan.name == *name)?;
            match (&held.node, ports(&plan.body)?) {
                (None, _) => Some(format!("`{name}` went with a run that failed before")),
                (_, ports) => (ports != held.ports).then(|| format!(
                    "`{name}` hands over other variables there: record and check the same outputs in both scenarios"
                )),
            }
        };
        self.fmus.iter().filter_map(misfit).collect()
    }

    /// Puts the FMUs in the places of a system's nodes.
    pub fn move_in(&mut self, system: &System, nodes: &mut [Box<dyn Node>]) {
        for (plan, place) in system.nodes.iter().zip(nodes) {
            let held = self.fmus.iter_mut().find(|held| held.name == plan.name);
            if let Some(mut node) = held.and_then(|held| held.node.take()) {
                if let Some(faults) = node.faults() {
                    faults.set_call_faults(&plan.faults, &system.clock);
                }
                *place = node;
            }
        }
    }

    /// Takes the FMUs back for the next end.
    pub fn move_out(&mut self, system: &System, nodes: &mut Vec<Box<dyn Node>>) {
        for (plan, node) in system.nodes.iter().zip(nodes.drain(..)) {
            if let Some(held) = self.fmus.iter_mut().find(|held| held.name == plan.name) {
                held.node = Some(node);
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
            Clock { start, step, steps: ((stop - start) / step).round() as u64 }.announced_stop()
        }))
    };
    let stops = Mistakes::all(scenarios.iter().map(stop))?;
    Ok(stops.into_iter().flatten().reduce(f64::max))
}
