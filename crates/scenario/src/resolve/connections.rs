//! Connects inputs to outputs: finds both ends, checks types and units, and attaches effects and faults.

use diagnostics::Error;

use super::nodes::{Port, UnplacedNode};
use super::port::{Side, find};
use super::{connection_units, types};
use crate::effect::{Chain, Context, stream_seed};
use crate::plan::{Accepts, Body, Clock, FaultPlan, InputChain};
use crate::words::{At, Connect, Fault, Scenario};

/// The connection of each input of each node; `None` without one.
pub(super) type Connections = Vec<Vec<Option<Connection>>>;

/// A connection whose values have no place in the row yet.
#[derive(Debug)]
pub(super) struct Connection {
    /// The node and its output that the value comes from.
    pub from: (usize, usize),
    /// Which end of the step the value is taken at.
    pub at: At,
    /// The way of a number; a text arrives unchanged.
    pub input_chain: Option<InputChain>,
}

/// Connects the unplaced as the scenario says.
pub(super) fn connect(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    clock: Clock,
    seed: u64,
) -> Result<Connections, Error> {
    let mut connections: Connections = unplaced
        .iter()
        .map(|unplaced_node| unplaced_node.inputs.iter().map(|_| None).collect())
        .collect();
    connection_units::judge_nodes(scenario, unplaced)?;
    for connect in &scenario.document.connect {
        let from @ (producer, output) = find(scenario, unplaced, &connect.from, Side::Output)?;
        let (consumer, input) = find(scenario, unplaced, &connect.to, Side::Input)?;
        let slot = &mut connections[consumer][input];
        if slot.is_some() {
            let message = format!("`{}` is connected twice", connect.to.get_ref());
            return Err(scenario.error(&connect.to, message));
        }
        let ports = (&unplaced[producer].outputs[output], &unplaced[consumer].inputs[input]);
        let at = at(scenario, connect, &unplaced[producer])?;
        let input_chain = match types::fit(scenario, connect, ports)? {
            Some(accepts) => Some(input_chain(scenario, connect, ports, (accepts, clock, seed))?),
            None => None,
        };
        *slot = Some(Connection { from, at, input_chain });
    }
    for fault in &scenario.document.fault {
        attach(scenario, unplaced, &mut connections, fault)?;
    }
    unconnected(scenario, unplaced, &connections)?;
    Ok(connections)
}

/// The way of a number to its input.
fn input_chain(
    scenario: &Scenario,
    connect: &Connect,
    ports: (&Port, &Port),
    (accepts, clock, seed): (Accepts, Clock, u64),
) -> Result<InputChain, Error> {
    let (factor, offset) = connection_units::convert(scenario, connect, ports)?;
    let context =
        Context { communication_step: clock.step, stream: stream_seed(seed, connect.to.get_ref()) };
    let effects: Vec<_> = connect.effects().into_iter().map(|(.., effect)| effect).collect();
    let effects =
        Chain::new(&effects, context).map_err(|message| scenario.error(&connect.to, message))?;
    Ok(InputChain { factor, offset, effects, faults: Vec::new(), accepts })
}

/// Which end of the step the value is taken at.
///
/// A source acts like the input file of any FMI tool: its value at a communication point holds for the step
/// that starts there. For an FMU's output the coupling algorithm decides.
fn at(scenario: &Scenario, connect: &Connect, producer: &UnplacedNode) -> Result<At, Error> {
    let rules = scenario.document.coupling.algorithm.rules();
    match (&connect.at, &producer.body) {
        (Some(at), _) if *at.get_ref() == At::End && !rules.allows_end => {
            let message = format!(
                "with {} coupling every value is taken at the start of the step",
                rules.name
            );
            Err(scenario
                .error(at, message)
                .help("leave `at` out, or choose the coupling `gauss_seidel`"))
        }
        (Some(at), _) => Ok(*at.get_ref()),
        (None, Body::Fmu { .. }) => Ok(rules.default_at),
        (None, _) => Ok(At::Start),
    }
}

fn attach(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    connections: &mut Connections,
    fault: &Fault,
) -> Result<(), Error> {
    let (node, input) = find(scenario, unplaced, &fault.input, Side::Input)?;
    let Some(connection) = &mut connections[node][input] else {
        let message = format!("nothing is connected to `{}`", fault.input.get_ref());
        return Err(scenario.error(&fault.input, message));
    };
    let Some(input_chain) = &mut connection.input_chain else {
        let message =
            format!("`{}` is a text, and faults act on numbers only", fault.input.get_ref());
        return Err(scenario.error(&fault.input, message));
    };
    let Ok([action]) = <[_; 1]>::try_from(fault.actions()) else {
        let kinds = Fault::KINDS.join("`, `");
        let message = format!("expected exactly one of `{kinds}`");
        return Err(scenario.error(&fault.input, message));
    };
    let until = fault.until.unwrap_or(f64::INFINITY);
    if fault.from.is_nan() || fault.from >= until {
        let message = format!("the fault begins at {} s and ends at {until} s", fault.from);
        return Err(scenario.error(&fault.input, message));
    }
    input_chain.faults.push(FaultPlan { from: fault.from, until, action });
    Ok(())
}

/// An input that nobody thought of keeps the FMU's start value for ever, which looks like a result:
/// the scenario has to say that it wants that.
fn unconnected(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    connections: &Connections,
) -> Result<(), Error> {
    for (unplaced_node, connections) in unplaced.iter().zip(connections) {
        let open =
            unplaced_node.inputs.iter().zip(connections).filter(|(port, link)| {
                link.is_none() && !unplaced_node.started.contains(&port.name)
            });
        let open: Vec<_> = open.map(|(port, _)| port).collect();
        if let Some(first) = open.first() {
            let names: Vec<_> = open.iter().map(|port| port.name.as_str()).collect();
            let (name, inputs) = (&unplaced_node.name, names.join("`, `"));
            let (first, value) = (&first.name, types::example(first));
            let message = format!(
                "nothing is connected to `{inputs}` of `{name}`, and there is no start value"
            );
            let error = scenario.source.error(unplaced_node.place.clone(), message, "this node");
            return Err(error.help(format!(
                "connect it: [[connect]] to = \"{name}.{first}\", or let it stay at a value: start = {{ \"{first}\" = {value} }}"
            )));
        }
    }
    Ok(())
}
