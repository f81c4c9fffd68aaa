//! Makes the FMUs of a run a second time, each in a process of its own, where nothing of the first time is left.

use diagnostics::Error;

use super::faulty::with_faults;
use super::isolated::{Host, IsolatedNode, Making};
use super::{Node, SourceNode, paced};
use crate::signal::Signal;
use crate::system::{Body, Isolation, System};

/// The second FMUs do what the first did, so a call that lasts longer than this does not return [s].
const PATIENCE: f64 = 60.0;

/// New instances of the FMUs of a system, beside its other nodes, which are taken out of `nodes`.
///
/// # Errors
/// When a process does not start or an FMU refuses something.
pub fn apart(
    system: &System,
    nodes: &mut [Box<dyn Node>],
    host: &Host,
) -> Result<Vec<Box<dyn Node>>, Error> {
    let times = (system.clock.start, system.announced_stop);
    let mut fmus = Vec::new();
    for plan in &system.nodes {
        let Body::Fmu { fmu, starts, inputs, outputs, isolation, .. } = &plan.body else {
            continue;
        };
        let isolation = isolation.clone().unwrap_or_else(Isolation::plain);
        let call_limit = isolation.call_limit.or(Some(PATIENCE));
        let isolation = Isolation { call_limit, ..isolation };
        let ports = (inputs.clone(), outputs.clone());
        let (name, starts, tolerance) = (&plan.name, starts.clone(), system.tolerance);
        let making = Making { fmu, name, log: false, ports, times, tolerance, starts };
        let node: Box<dyn Node> = Box::new(IsolatedNode::new(making, &isolation, host)?);
        fmus.push(paced(node, plan, system.clock));
    }
    let mut fmus = fmus.into_iter().peekable();
    let nodes = system.nodes.iter().zip(nodes).map(|(plan, node)| -> Box<dyn Node> {
        match fmus.next_if(|_| matches!(plan.body, Body::Fmu { .. })) {
            Some(fmu) => fmu,
            None => std::mem::replace(node, Box::new(SourceNode::new(Vec::<Signal>::new()))),
        }
    });
    let mut nodes: Vec<_> = nodes.collect();
    with_faults(system, &mut nodes, false);
    Ok(nodes)
}

/// Puts the nodes back that [`apart`] took out, and frees the others.
pub fn return_sources(system: &System, nodes: &mut [Box<dyn Node>], apart: Vec<Box<dyn Node>>) {
    for ((plan, place), node) in system.nodes.iter().zip(nodes).zip(apart) {
        if !matches!(plan.body, Body::Fmu { .. }) {
            *place = node;
        }
    }
}
