//! Connects inputs to outputs: finds both ends, checks types and units, and attaches effects and faults.

use std::collections::HashSet;

use cosim::assembly::Connection;
use cosim::clock::Clock;
use cosim::effect::{Context, stream_seed};
use cosim::system::{AcceptedValues, Body, InputChain, InputFault};
use diagnostics::{Error, Mistakes, Spanned};
use fmu_import::description::Type;

use super::connection_units::Conversions;
use super::nodes::UnplacedNode;
use super::port::{Side, find};
use super::ports::Port;
use super::{coupling, manoeuvres, types};
use crate::words::{At, Connect, Fault, Scenario, Unconnected};

/// The connection of each input of each node; `None` without one.
pub(super) type Connections = Vec<Vec<Option<Connection>>>;

/// Connects the unplaced as the scenario says.
pub(super) fn connect(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    (all, conversions): (&[Connect], &Conversions),
    timed: (Option<Clock>, u64),
    mistakes: &mut Mistakes,
) -> Connections {
    let none = |node: &UnplacedNode| node.inputs.iter().map(|_| None).collect();
    let mut connections: Connections = unplaced.iter().map(none).collect();
    let mut connected = HashSet::new();
    for (index, connect) in all.iter().enumerate() {
        if !connected.insert(connect.to.get_ref()) {
            let message = format!("`{}` is connected twice", connect.to.get_ref());
            mistakes.push(scenario.error(&connect.to, message));
            continue;
        }
        let from = find(scenario, unplaced, &connect.from, Side::Output);
        let from = mistakes.take(from).ok_or_else(Error::follow_up);
        let to = find(scenario, unplaced, &connect.to, Side::Input);
        let Some(to) = mistakes.take(to) else { continue };
        // An input whose connection is wrong has no column that a check could name.
        let units = conversions[index];
        let made =
            from.and_then(|from| connection(scenario, unplaced, (connect, from, to), units, timed));
        connections[to.0][to.1] = mistakes.take_named(connect.to.get_ref(), made);
    }
    for fault in &scenario.document.fault {
        // Those of nodes have their turn when the nodes have their places.
        if let (Some(input), None) = (&fault.input, &fault.node) {
            mistakes.take(attach(scenario, unplaced, &mut connections, (fault, input)));
        }
    }
    for node in unplaced.iter().filter(|node| !node.is_connector()) {
        mistakes.take(unconnected(scenario, &connected, node));
    }
    connections
}

/// A connection between two ends.
fn connection(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    (connect, from, to): (&Connect, (usize, usize), (usize, usize)),
    units: Option<(f64, f64)>,
    timed: (Option<Clock>, u64),
) -> Result<Connection, Error> {
    let ports = (&unplaced[from.0].outputs[from.1], &unplaced[to.0].inputs[to.1]);
    let at = at(scenario, connect, (&unplaced[from.0], &unplaced[to.0]));
    let input_chain = types::fit(scenario, connect, ports).and_then(|accepts| {
        let chain = |accepts| input_chain(scenario, connect, units, (accepts, timed));
        accepts.map(chain).transpose()
    });
    let (at, input_chain) = Mistakes::both(at, input_chain)?;
    let receiver = &unplaced[to.0].body;
    let extrapolation = coupling::extrapolation(scenario, connect, at, ports, receiver)?;
    Ok(Connection { node: from.0, output: from.1, at, input_chain, extrapolation })
}

/// The way of a number to its input.
fn input_chain(
    scenario: &Scenario,
    connect: &Connect,
    units: Option<(f64, f64)>,
    (accepts, (clock, seed)): (AcceptedValues, (Option<Clock>, u64)),
) -> Result<InputChain, Error> {
    let stages = || {
        let communication_step = clock.ok_or_else(Error::follow_up)?.step;
        let stream = stream_seed(seed, connect.to.get_ref());
        let context = Context { communication_step, stream };
        Mistakes::all(connect.effects().into_iter().map(|(_, place, effect)| {
            effect.stage(&context).map_err(|message| scenario.source.error(place, message, ""))
        }))
    };
    let converted = units.ok_or_else(Error::follow_up);
    let ((factor, offset), stages) = Mistakes::both(converted, stages())?;
    let map = connect.transform.as_ref().map(|it| it.get_ref().map.clone()).unwrap_or_default();
    Ok(InputChain { factor, offset, map, effects: stages.into(), faults: Vec::new(), accepts })
}

/// Which end of the step the value is taken at.
///
/// A source acts like the input file of any FMI tool: its value at a communication point holds for the step
/// that starts there. For an FMU's output the coupling algorithm decides.
fn at(
    scenario: &Scenario,
    connect: &Connect,
    (producer, receiver): (&UnplacedNode, &UnplacedNode),
) -> Result<At, Error> {
    let rules = scenario.document.coupling.algorithm.rules();
    // On this side a connector has the value of the moment: the other side decides.
    if matches!(producer.body, Body::Inlet) || matches!(receiver.body, Body::Outlet) {
        let Some(at) = &connect.at else { return Ok(At::End) };
        let (connector, other) = match producer.body {
            Body::Inlet => (&connect.from, "to"),
            _ => (&connect.to, "from"),
        };
        let connector = connector.get_ref();
        let message = format!("`{connector}` hands on its value without a step in between");
        let help = format!("write `at` on the connection {other} `{connector}`");
        return Err(scenario.error(at, message).help(help));
    }
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
        (None, Body::Fmu { .. } | Body::Outlet) => Ok(rules.default_at),
        (None, _) => Ok(At::Start),
    }
}

fn attach(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    connections: &mut Connections,
    (fault, input): (&Fault, &Spanned<String>),
) -> Result<(), Error> {
    let action = action(scenario, (fault, input));
    let chain = find(scenario, unplaced, input, Side::Input)
        .and_then(|(node, port)| chain(scenario, &mut connections[node][port], input));
    let (chain, action) = Mistakes::both(chain, action)?;
    chain.faults.push(action);
    Ok(())
}

/// The way of the number that a fault acts on.
fn chain<'c>(
    scenario: &Scenario,
    connection: &'c mut Option<Connection>,
    word: &Spanned<String>,
) -> Result<&'c mut InputChain, Error> {
    let input = word.get_ref();
    let Some(connection) = connection else {
        let message = format!("nothing is connected to `{input}`");
        let help = format!(
            "a fault changes the value of a connection: lead a signal to it, [[connect]] to = \"{input}\""
        );
        return Err(scenario.error(word, message).help(help).about_unknown(input.clone()));
    };
    connection.input_chain.as_mut().ok_or_else(|| {
        let message = format!("`{input}` is a text, and faults act on numbers only");
        scenario.error(word, message)
    })
}

/// The action of a fault, and its time.
fn action(
    scenario: &Scenario,
    (fault, input): (&Fault, &Spanned<String>),
) -> Result<InputFault, Error> {
    let Ok([action]) = <[_; 1]>::try_from(fault.actions()) else {
        let kinds = Fault::KINDS.join("`, `");
        let message = format!("expected exactly one of `{kinds}`");
        return Err(scenario.error(input, message));
    };
    let [from, until] = window(scenario, fault)?;
    Ok(InputFault { from, until, action })
}

/// The first communication point of a fault and the first one after it [s].
pub(super) fn window(scenario: &Scenario, fault: &Fault) -> Result<[f64; 2], Error> {
    let (from, until) = (*fault.from.get_ref(), fault.until.unwrap_or(f64::INFINITY));
    if from.is_nan() || from >= until {
        let message = format!("the fault begins at {from} s and ends at {until} s");
        return Err(scenario.error(&fault.from, message));
    }
    Ok([from, until])
}

/// An input that nobody thought of keeps the FMU's start value for ever, which looks like a result:
/// the scenario has to say that it wants that.
fn unconnected(
    scenario: &Scenario,
    connected: &HashSet<&String>,
    node: &UnplacedNode,
) -> Result<(), Error> {
    // What a driver does not find at its car is told there.
    if manoeuvres::has_car(scenario, &node.name) {
        return Ok(());
    }
    let open = open(connected, node);
    let Some(first) = open.first().filter(|_| !keeps_start(scenario, node)) else { return Ok(()) };
    let names: Vec<_> = open.iter().map(|port| port.name.as_str()).collect();
    let (name, inputs) = (&node.name, names.join("`, `"));
    let (first, value) = (&first.name, types::example(first));
    let message =
        format!("nothing is connected to `{inputs}` of `{name}`, and there is no start value");
    let error = scenario.source.error(node.place.clone(), message, "this node");
    Err(error.help(format!(
        "connect it: [[connect]] to = \"{name}.{first}\", or let it stay at a value: start = {{ \"{first}\" = {value} }}; with `unconnected = \"start\"` all of them keep the start values of the FMU's description"
    )))
}

/// The inputs without a connection and a start value.
fn open<'a>(connected: &HashSet<&String>, node: &'a UnplacedNode) -> Vec<&'a Port> {
    let started: HashSet<_> = node.started.iter().collect();
    let is_open = |port: &&Port| {
        let name = format!("{}.{}", node.name, port.name);
        let is_connected = connected.contains(&name);
        // A clock without a connection never ticks.
        let may_stay = port.kind == Type::Clock || port.optional || port.tunable;
        !is_connected && !started.contains(&port.name) && !may_stay
    };
    node.inputs.iter().filter(is_open).collect()
}

fn keeps_start(scenario: &Scenario, node: &UnplacedNode) -> bool {
    let mut words = scenario.document.fmu.iter();
    words.any(|fmu| *fmu.name.get_ref() == node.name && fmu.unconnected == Some(Unconnected::Start))
}

/// For each FMU that keeps the start values of its description, the inputs that do, with their values.
pub(super) fn kept<'a>(
    scenario: &'a Scenario,
    connects: &'a [Connect],
    nodes: &'a [UnplacedNode],
) -> impl Iterator<Item = String> + 'a {
    let connected: HashSet<_> = connects.iter().map(|connect| connect.to.get_ref()).collect();
    let of = move |node: &UnplacedNode| {
        let Body::Fmu { fmu, .. } = &node.body else { return None };
        let start = |port: &&Port| {
            let variable = &fmu.description.variables[fmu.description.find(&port.name)?];
            Some(format!("`{}` = {}", port.name, variable.start.as_deref().unwrap_or("nothing")))
        };
        let starts: Vec<_> = open(&connected, node).iter().filter_map(start).collect();
        (!starts.is_empty()).then(|| {
            format!(
                "`{}` keeps the start values of its description: {}",
                node.name,
                starts.join(", ")
            )
        })
    };
    nodes.iter().filter(|node| keeps_start(scenario, node)).filter_map(of)
}
