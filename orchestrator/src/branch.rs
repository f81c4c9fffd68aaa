//! Keeps the FMUs of a run in memory at a checkpoint: several ends go on from there in one process.

use std::path::{Path, PathBuf};

use cosim::checkpoint::{Checkpoint, States};
use cosim::node::{Node, NodeState};
use diagnostics::{Error, Mistakes};
use scenario::Scenario;
use scenario::plan::{Body, Clock, Ports, System};

/// The FMUs of a run with their states at a checkpoint.
pub(crate) struct Held {
    pub checkpoint: Checkpoint,
    /// The run that it comes from.
    pub place: String,
    fmus: Vec<HeldFmu>,
}

struct HeldFmu {
    name: String,
    /// Inputs and outputs that it hands over.
    ports: (Ports, Ports),
    node: Option<Box<dyn Node>>,
    state: Option<NodeState>,
}

/// The ports of a node, if it is an FMU.
fn ports(body: &Body) -> Option<(Ports, Ports)> {
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
        (checkpoint, states): (Checkpoint, States),
    ) -> Self {
        let each = system.nodes.iter().zip(nodes.drain(..)).zip(states);
        let fmus = each.filter_map(|((plan, node), state)| {
            let (name, ports) = (plan.name.clone(), ports(&plan.body)?);
            Some(HeldFmu { name, ports, node: Some(node), state })
        });
        let fmus = fmus.collect();
        Held { place: checkpoint.scenario.clone(), checkpoint, fmus }
    }

    /// The states in the order of the nodes of a system, and what does not fit. The states are taken out until they are given back.
    pub fn lend(&mut self, system: &System) -> (States, Vec<String>) {
        let mut misfits = Vec::new();
        let mut states = Vec::new();
        for plan in &system.nodes {
            let held = self.fmus.iter_mut().find(|held| held.name == plan.name);
            let (Some(ports), Some(held)) = (ports(&plan.body), held) else {
                states.push(None);
                continue;
            };
            if ports != held.ports {
                misfits.push(format!(
                    "`{}` hands over other variables there: record and check the same outputs in both scenarios",
                    plan.name
                ));
            }
            states.push(held.state.take());
        }
        (states, misfits)
    }

    /// Puts the FMUs in the places of a system's nodes.
    pub fn move_in(&mut self, system: &System, nodes: &mut [Box<dyn Node>]) {
        for (plan, place) in system.nodes.iter().zip(nodes) {
            let held = self.fmus.iter_mut().find(|held| held.name == plan.name);
            if let Some(mut node) = held.and_then(|held| held.node.take()) {
                node.take_faults(&plan.faults, &system.clock);
                *place = node;
            }
        }
    }

    /// Takes FMUs and states back for the next end.
    pub fn move_out(
        &mut self,
        system: &System,
        nodes: &mut Vec<Box<dyn Node>>,
        states: Option<States>,
    ) {
        let states = states.unwrap_or_default().into_iter().chain(std::iter::repeat_with(|| None));
        for ((plan, node), state) in system.nodes.iter().zip(nodes.drain(..)).zip(states) {
            if let Some(held) = self.fmus.iter_mut().find(|held| held.name == plan.name) {
                (held.node, held.state) = (Some(node), state);
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
