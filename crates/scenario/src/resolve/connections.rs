//! Resolves `[[connect]]`: finds both ends, checks types, and builds the input chain of effects and faults.

use std::collections::HashSet;

use cosim::assembly::ConnectionDefinition;
use cosim::effect::{EffectContext, stream_seed};
use cosim::quantity::InputUnit;
use cosim::system::{AcceptedValues, InputChain, InputFault, NodeBody};
use diagnostics::{Error, ErrorCollector, Spanned};
use fmu_import::description::FmiType;

use super::connection_units::UnitConversions;
use super::lookup::{PortRef, PortSide, find_port};
use super::node_draft::NodeDraft;
use super::ports::Port;
use super::{RunSettings, coupling, manoeuvres, types};
use crate::document::{Connect, Fault, Scenario, StepBoundary, UnconnectedInputs};

/// The connection of each input of each node; `None` without one.
pub(super) type InputConnections = Vec<Vec<Option<ConnectionDefinition>>>;

/// Connects the unplaced as the scenario says.
pub(super) fn connect_nodes(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    connects: &[Connect],
    conversions: &UnitConversions,
    run: RunSettings,
    mistakes: &mut ErrorCollector,
) -> InputConnections {
    let none = |node: &NodeDraft| node.inputs.iter().map(|_| None).collect();
    let mut connections: InputConnections = nodes.iter().map(none).collect();
    let mut connected = HashSet::new();
    for (connect, conversion) in connects.iter().zip(conversions) {
        if !connected.insert(connect.to.get_ref()) {
            let message = format!("`{}` is connected twice", connect.to.get_ref());
            mistakes.push(scenario.error_at(&connect.to, message));
            continue;
        }
        let from = mistakes.ok_or_record(find_port(scenario, nodes, &connect.from, PortSide::Output));
        let to = find_port(scenario, nodes, &connect.to, PortSide::Input);
        let Some(to) = mistakes.ok_or_record(to) else { continue };
        // An input whose connection is wrong has no column that a check could name.
        let connection = from
            .ok_or_else(Error::already_reported)
            .and_then(|from| build_connection(scenario, nodes, connect, from, to, *conversion, run));
        connections[to.node][to.port] = mistakes.ok_or_record_named(connect.to.get_ref(), connection);
    }
    for fault in &scenario.document.fault {
        // Those of nodes have their turn when the nodes have their columns.
        if let (Some(input), None) = (&fault.input, &fault.node) {
            mistakes.ok_or_record(attach_fault(scenario, nodes, &mut connections, fault, input));
        }
    }
    for node in nodes.iter().filter(|node| !node.is_connector()) {
        mistakes.ok_or_record(check_unconnected_inputs(scenario, &connected, node));
    }
    connections
}

/// A connection between two ends; `conversion` is factor and offset between their units.
fn build_connection(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    connect: &Connect,
    from: PortRef,
    to: PortRef,
    conversion: Option<(f64, f64)>,
    run: RunSettings,
) -> Result<ConnectionDefinition, Error> {
    let (producer, receiver) = (&nodes[from.node], &nodes[to.node]);
    let (output, input) = (&producer.outputs[from.port], &receiver.inputs[to.port]);
    let at = exchange_point(scenario, connect, producer, receiver);
    let input_chain = types::check_port_types(scenario, connect, output, input).and_then(|accepts| {
        accepts.map(|it| input_chain(scenario, connect, input, conversion, it, run)).transpose()
    });
    let (at, input_chain) = ErrorCollector::collect_both(at, input_chain)?;
    let extrapolation = coupling::input_extrapolation(scenario, connect, at, output, input, &receiver.body)?;
    Ok(ConnectionDefinition { node: from.node, output: from.port, at, input_chain, extrapolation })
}

/// The way of a number to its input.
fn input_chain(
    scenario: &Scenario,
    connect: &Connect,
    input: &Port,
    conversion: Option<(f64, f64)>,
    accepts: AcceptedValues,
    run: RunSettings,
) -> Result<InputChain, Error> {
    let stages = || {
        let communication_step = run.clock.ok_or_else(Error::already_reported)?.step;
        let stream = stream_seed(run.seed, connect.to.get_ref());
        let context = EffectContext { communication_step, stream, input: input.input_unit() };
        ErrorCollector::collect_all(connect.effects().into_iter().map(|(_, span, effect)| {
            effect.build_stage(&context).map_err(|message| scenario.source.error_at(span, message, ""))
        }))
    };
    let conversion = conversion.ok_or_else(Error::already_reported);
    let ((factor, offset), stages) = ErrorCollector::collect_both(conversion, stages())?;
    let map = connect.transform.as_ref().map(|it| it.get_ref().map.clone()).unwrap_or_default();
    Ok(InputChain { factor, offset, map, effects: stages.into(), faults: Vec::new(), accepts })
}

/// Which end of the step the value is taken at.
///
/// A source acts like the input file of any FMI tool: its value at a communication point holds for the step
/// that starts there. For an FMU's output the coupling algorithm decides.
fn exchange_point(
    scenario: &Scenario,
    connect: &Connect,
    producer: &NodeDraft,
    receiver: &NodeDraft,
) -> Result<StepBoundary, Error> {
    let rules = scenario.document.coupling.algorithm.properties();
    // On this side a connector has the value of the moment: the other side decides.
    if matches!(producer.body, NodeBody::Inlet) || matches!(receiver.body, NodeBody::Outlet) {
        let Some(at) = &connect.at else { return Ok(StepBoundary::End) };
        let (connector, other) = match producer.body {
            NodeBody::Inlet => (&connect.from, "to"),
            _ => (&connect.to, "from"),
        };
        let connector = connector.get_ref();
        let message = format!("`{connector}` hands on its value without a step in between");
        let help = format!("write `at` on the connection {other} `{connector}`");
        return Err(scenario.error_at(at, message).with_help(help));
    }
    match (&connect.at, &producer.body) {
        (Some(at), _) if *at.get_ref() == StepBoundary::End && !rules.allows_end => {
            let message =
                format!("with {} coupling every value is taken at the start of the step", rules.name);
            Err(scenario
                .error_at(at, message)
                .with_help("leave `at` out, or choose the coupling `gauss_seidel`"))
        }
        (Some(at), _) => Ok(*at.get_ref()),
        (None, NodeBody::Fmu { .. } | NodeBody::Outlet) => Ok(rules.default_at),
        (None, _) => Ok(StepBoundary::Start),
    }
}

fn attach_fault(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    connections: &mut InputConnections,
    fault: &Fault,
    input: &Spanned<String>,
) -> Result<(), Error> {
    let port = find_port(scenario, nodes, input, PortSide::Input);
    let unit = port.as_ref().map_or(InputUnit::default(), |it| nodes[it.node].inputs[it.port].input_unit());
    let action = input_fault_action(scenario, fault, input, unit);
    let chain = port.and_then(|it| faulted_input_chain(scenario, &mut connections[it.node][it.port], input));
    let (chain, action) = ErrorCollector::collect_both(chain, action)?;
    chain.faults.push(action);
    Ok(())
}

/// The way of the number that a fault acts on.
fn faulted_input_chain<'c>(
    scenario: &Scenario,
    connection: &'c mut Option<ConnectionDefinition>,
    word: &Spanned<String>,
) -> Result<&'c mut InputChain, Error> {
    let input = word.get_ref();
    let Some(connection) = connection else {
        let message = format!("nothing is connected to `{input}`");
        let help = format!(
            "a fault changes the value of a connection: lead a signal to it, [[connect]] to = \"{input}\""
        );
        return Err(scenario.error_at(word, message).with_help(help).with_unknown_name(input.clone()));
    };
    connection.input_chain.as_mut().ok_or_else(|| {
        let message = format!("`{input}` is a text, and faults act on numbers only");
        scenario.error_at(word, message)
    })
}

/// The action of a fault, and its time.
fn input_fault_action(
    scenario: &Scenario,
    fault: &Fault,
    input: &Spanned<String>,
    unit: InputUnit,
) -> Result<InputFault, Error> {
    let actions =
        fault.actions(unit).map_err(|(span, message)| scenario.source.error_at(span, message, ""))?;
    let Ok([action]) = <[_; 1]>::try_from(actions) else {
        let kinds = Fault::KINDS.join("`, `");
        let message = format!("expected exactly one of `{kinds}`");
        return Err(scenario.error_at(input, message));
    };
    let [from, until] = fault_window(scenario, fault)?;
    Ok(InputFault { from, until, action })
}

/// The first communication point of a fault and the first one after it [s].
pub(super) fn fault_window(scenario: &Scenario, fault: &Fault) -> Result<[f64; 2], Error> {
    let (from, until) = (*fault.from.get_ref(), fault.until.unwrap_or(f64::INFINITY));
    if from.is_nan() || from >= until {
        let message = format!("the fault begins at {from} s and ends at {until} s");
        return Err(scenario.error_at(&fault.from, message));
    }
    Ok([from, until])
}

/// An input that nobody thought of keeps the FMU's start value for ever, which looks like a result:
/// the scenario has to say that it wants that.
fn check_unconnected_inputs(
    scenario: &Scenario,
    connected: &HashSet<&String>,
    node: &NodeDraft,
) -> Result<(), Error> {
    // What a driver does not find at its car is told there.
    if manoeuvres::is_driver_with_car(scenario, &node.name) {
        return Ok(());
    }
    let open = unconnected_inputs(connected, node);
    let Some(first) = open.first().filter(|_| !keeps_start(scenario, node)) else { return Ok(()) };
    let names: Vec<_> = open.iter().map(|port| port.name.as_str()).collect();
    let (name, inputs) = (&node.name, names.join("`, `"));
    let (first, value) = (&first.name, types::example_start_value(first));
    let message = format!("nothing is connected to `{inputs}` of `{name}`, and there is no start value");
    let error = scenario.source.error_at(node.span.clone(), message, "this node");
    Err(error.with_help(format!(
        "connect it: [[connect]] to = \"{name}.{first}\", or let it stay at a value: start = {{ \"{first}\" = {value} }}; with `unconnected = \"start\"` all of them keep the start values of the FMU's description"
    )))
}

/// The inputs without a connection and a start value.
fn unconnected_inputs<'a>(connected: &HashSet<&String>, node: &'a NodeDraft) -> Vec<&'a Port> {
    let started_inputs: HashSet<_> = node.started_inputs.iter().collect();
    let is_open = |port: &&Port| {
        let name = format!("{}.{}", node.name, port.name);
        let is_connected = connected.contains(&name);
        // A clock without a connection never ticks.
        let may_stay = port.kind == FmiType::Clock || port.optional || port.tunable;
        !is_connected && !started_inputs.contains(&port.name) && !may_stay
    };
    node.inputs.iter().filter(is_open).collect()
}

fn keeps_start(scenario: &Scenario, node: &NodeDraft) -> bool {
    let mut words = scenario.document.fmu.iter();
    words.any(|fmu| *fmu.name.get_ref() == node.name && fmu.unconnected == Some(UnconnectedInputs::Start))
}

/// For each FMU that keeps the start values of its description, the inputs that do, with their values.
pub(super) fn start_value_notes<'a>(
    scenario: &'a Scenario,
    connects: &'a [Connect],
    nodes: &'a [NodeDraft],
) -> impl Iterator<Item = String> + 'a {
    let connected: HashSet<_> = connects.iter().map(|connect| connect.to.get_ref()).collect();
    let of = move |node: &NodeDraft| {
        let NodeBody::Fmu { fmu, .. } = &node.body else { return None };
        let start = |port: &&Port| {
            let variable = &fmu.description.variables[fmu.description.find_variable(&port.name)?];
            Some(format!("`{}` = {}", port.name, variable.start.as_deref().unwrap_or("nothing")))
        };
        let starts: Vec<_> = unconnected_inputs(&connected, node).iter().filter_map(start).collect();
        (!starts.is_empty()).then(|| {
            format!("`{}` keeps the start values of its description: {}", node.name, starts.join(", "))
        })
    };
    nodes.iter().filter(|node| keeps_start(scenario, node)).filter_map(of)
}
