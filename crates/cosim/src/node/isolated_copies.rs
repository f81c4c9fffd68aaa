//! Makes the FMUs of a run a second time, each in a process of its own, where nothing of the first time is left.

use diagnostics::Error;

use super::fault_injection::with_call_faults;
use super::isolated::{FmuProcessOptions, IsolatedNode};
use super::{ExperimentSetup, InstanceSettings, Node, SourceNode, wrap_sub_stepping};
use crate::signal::Signal;
use crate::system::{FmuIsolation, NodeBody, System};

/// The second FMUs do what the first did, so a call that lasts longer than this does not return [s].
const PATIENCE: f64 = 60.0;

/// New instances of the FMUs of a system, beside its other nodes, which are taken out of `nodes`.
///
/// # Errors
/// When a process does not start or an FMU refuses something.
pub fn isolated_copies(
    system: &System,
    nodes: &mut [Box<dyn Node>],
    host: &FmuProcessOptions,
) -> Result<Vec<Box<dyn Node>>, Error> {
    let experiment = ExperimentSetup {
        start: system.clock.start,
        stop: system.announced_stop,
        tolerance: system.tolerance,
        absolute_tolerance: None,
    };
    let mut fmus = Vec::new();
    for plan in &system.nodes {
        let NodeBody::Fmu { fmu, starts, inputs, outputs, isolation, tolerance, .. } = &plan.body else {
            continue;
        };
        let isolation = isolation.clone().unwrap_or_else(FmuIsolation::process_only);
        let call_limit = isolation.call_limit.or(Some(PATIENCE));
        let isolation = FmuIsolation { call_limit, ..isolation };
        let settings = InstanceSettings {
            fmu,
            name: &plan.name,
            log: false,
            inputs: inputs.clone(),
            outputs: outputs.clone(),
            experiment: experiment.with_tolerance(*tolerance),
            starts: starts.clone(),
        };
        let node: Box<dyn Node> = Box::new(IsolatedNode::new(settings, &isolation, host)?);
        fmus.push(wrap_sub_stepping(node, plan, system.clock));
    }
    let mut fmus = fmus.into_iter().peekable();
    let nodes = system.nodes.iter().zip(nodes).map(|(plan, node)| -> Box<dyn Node> {
        match fmus.next_if(|_| matches!(plan.body, NodeBody::Fmu { .. })) {
            Some(fmu) => fmu,
            None => std::mem::replace(node, Box::new(SourceNode::new(Vec::<Signal>::new()))),
        }
    });
    let mut nodes: Vec<_> = nodes.collect();
    with_call_faults(system, &mut nodes, false);
    Ok(nodes)
}

/// Puts the nodes back that [`isolated_copies`] took out, and frees the others.
pub fn return_sources(system: &System, nodes: &mut [Box<dyn Node>], copies: Vec<Box<dyn Node>>) {
    for ((plan, place), node) in system.nodes.iter().zip(nodes).zip(copies) {
        if !matches!(plan.body, NodeBody::Fmu { .. }) {
            *place = node;
        }
    }
}
