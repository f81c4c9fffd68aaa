//! Connects inputs to outputs: finds both ends, checks types and units, and attaches effects and faults.

use diagnostics::{Error, closest};
use toml::Spanned;
use units::Unit;

use super::nodes::{Draft, Port};
use super::types;
use crate::effects::{Chain, stream_seed};
use crate::plan::{Accepts, Body, Clock, FaultKind, FaultPlan, Treatment};
use crate::words::{At, Connect, Fault, Scenario};

/// What each input of each node gets, `None` where nothing is connected.
pub(super) type Links = Vec<Vec<Option<Wire>>>;

/// A connection whose values have no place in the row yet.
#[derive(Debug)]
pub(super) struct Wire {
    /// The node and its output that the value comes from.
    pub from: (usize, usize),
    /// Which end of the step the value is taken at.
    pub at: At,
    /// What happens to a number on its way; a text arrives as it is.
    pub treatment: Option<Treatment>,
}

/// Connects the drafts as the scenario says.
pub(super) fn connect(
    scenario: &Scenario,
    drafts: &[Draft],
    clock: Clock,
    seed: u64,
    warnings: &mut Vec<String>,
) -> Result<Links, Error> {
    let mut links: Links =
        drafts.iter().map(|draft| draft.inputs.iter().map(|_| None).collect()).collect();
    for connect in &scenario.document.connect {
        let from @ (producer, output) = find(scenario, drafts, &connect.from, Side::Output)?;
        let (consumer, input) = find(scenario, drafts, &connect.to, Side::Input)?;
        let slot = &mut links[consumer][input];
        if slot.is_some() {
            let message = format!("`{}` is connected twice", connect.to.get_ref());
            return Err(scenario.error(&connect.to, message));
        }
        let ports = (&drafts[producer].outputs[output], &drafts[consumer].inputs[input]);
        let at = at(scenario, connect, &drafts[producer])?;
        let treatment = match types::fit(scenario, connect, ports)? {
            Some(accepts) => {
                Some(treatment(scenario, connect, ports, (accepts, clock, seed), warnings)?)
            }
            None => None,
        };
        *slot = Some(Wire { from, at, treatment });
    }
    for fault in &scenario.document.fault {
        attach(scenario, drafts, &mut links, fault)?;
    }
    unconnected(scenario, drafts, &links)?;
    Ok(links)
}

/// What happens to a number on its way to an input that accepts some.
fn treatment(
    scenario: &Scenario,
    connect: &Connect,
    ports: (&Port, &Port),
    (accepts, clock, seed): (Accepts, Clock, u64),
    warnings: &mut Vec<String>,
) -> Result<Treatment, Error> {
    let (factor, offset) = convert(scenario, connect, ports, warnings)?;
    let stream = stream_seed(seed, connect.to.get_ref());
    let effects = Chain::new(&connect.effects(), clock.step, stream)
        .map_err(|message| scenario.error(&connect.to, message))?;
    Ok(Treatment { factor, offset, effects, faults: Vec::new(), accepts })
}

/// Which end of the step the value is taken at.
///
/// A source acts like the input file of any FMI tool: its value at a communication point holds for the step
/// that starts there. For an FMU's output the coupling algorithm decides.
fn at(scenario: &Scenario, connect: &Connect, producer: &Draft) -> Result<At, Error> {
    let rules = scenario.document.coupling.algorithm.rules();
    match (&connect.at, &producer.body) {
        (Some(at), _) if *at.get_ref() == At::End && !rules.allows_end => {
            let message = format!(
                "with {} coupling every value is taken at the start of the step",
                rules.name
            );
            Err(scenario
                .error(at, message)
                .help("leave `at` out, or choose the sequential coupling"))
        }
        (Some(at), _) => Ok(*at.get_ref()),
        (None, Body::Fmu { .. }) => Ok(rules.default_at),
        (None, _) => Ok(At::Start),
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Input,
    Output,
}

/// The node and the port that a word names.
fn find(
    scenario: &Scenario,
    drafts: &[Draft],
    word: &Spanned<String>,
    side: Side,
) -> Result<(usize, usize), Error> {
    let full = word.get_ref();
    let Some((node, variable)) = full.split_once('.') else {
        return Err(scenario.error(word, format!("expected `node.variable`, found `{full}`")));
    };
    let Some(place) = drafts.iter().position(|draft| draft.name == node) else {
        let names: Vec<_> = drafts.iter().map(|draft| draft.name.as_str()).collect();
        let error = scenario.error(word, format!("no node is called `{node}`"));
        return Err(error.help(format!("there are: {}", names.join(", "))));
    };
    let draft = &drafts[place];
    let (ports, others, name) = match side {
        Side::Input => (&draft.inputs, &draft.outputs, "input"),
        Side::Output => (&draft.outputs, &draft.inputs, "output"),
    };
    if let Some(port) = ports.iter().position(|port| port.name == variable) {
        return Ok((place, port));
    }
    if others.iter().any(|port| port.name == variable) {
        return Err(scenario
            .error(word, format!("`{full}` is no {name} of `{node}`"))
            .help("`from` names an output, `to` an input"));
    }
    let names = ports.iter().map(|port| port.name.as_str());
    let help = match closest(variable, names.clone()) {
        Some(hint) => format!("did you mean `{node}.{hint}`?"),
        None => format!("its {name}s are: {}", names.collect::<Vec<_>>().join(", ")),
    };
    Err(scenario.error(word, format!("`{node}` has no {name} `{variable}`")).help(help))
}

/// The factor and the offset that turn the unit of `from` into that of `to`.
fn convert(
    scenario: &Scenario,
    connect: &Connect,
    (from, to): (&Port, &Port),
    warnings: &mut Vec<String>,
) -> Result<(f64, f64), Error> {
    let names = format!("`{}` to `{}`", connect.from.get_ref(), connect.to.get_ref());
    let (Some(from_name), Some(to_name)) = (&from.unit, &to.unit) else { return Ok((1.0, 0.0)) };
    match (&from.dimension, &to.dimension) {
        (Some(from), Some(to)) => Unit::conversion(from, to).ok_or_else(|| {
            let message =
                format!("cannot connect {names}: [{from_name}] is no unit of [{to_name}]");
            let help = format!("{} is not {}", from.dimension(), to.dimension());
            scenario.error(&connect.to, message).help(help)
        }),
        _ if from_name == to_name => Ok((1.0, 0.0)),
        _ => {
            warnings.push(format!("{names}: [{from_name}] and [{to_name}] cannot be compared, the value is handed over as it is"));
            Ok((1.0, 0.0))
        }
    }
}

fn attach(
    scenario: &Scenario,
    drafts: &[Draft],
    links: &mut Links,
    fault: &Fault,
) -> Result<(), Error> {
    let (node, input) = find(scenario, drafts, &fault.input, Side::Input)?;
    let Some(wire) = &mut links[node][input] else {
        let message = format!("nothing is connected to `{}`", fault.input.get_ref());
        return Err(scenario.error(&fault.input, message));
    };
    let Some(treatment) = &mut wire.treatment else {
        let message =
            format!("`{}` is a text, and faults act on numbers only", fault.input.get_ref());
        return Err(scenario.error(&fault.input, message));
    };
    let kinds = [
        fault.freeze.then_some(FaultKind::Freeze),
        fault.value.map(FaultKind::Value),
        fault.bias.map(FaultKind::Bias),
        fault.gain.map(FaultKind::Gain),
    ];
    let mut kinds = kinds.into_iter().flatten();
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let message = "a fault is one of `freeze = true`, `value`, `bias` and `gain`";
        return Err(scenario.error(&fault.input, message));
    };
    let until = fault.until.unwrap_or(f64::INFINITY);
    if fault.from.is_nan() || fault.from >= until {
        let message = format!("the fault begins at {} s and ends at {until} s", fault.from);
        return Err(scenario.error(&fault.input, message));
    }
    treatment.faults.push(FaultPlan { from: fault.from, until, kind, frozen: None });
    Ok(())
}

/// An input that nobody thought of keeps the FMU's start value for ever, which looks like a result:
/// the scenario has to say that it wants that.
fn unconnected(scenario: &Scenario, drafts: &[Draft], links: &Links) -> Result<(), Error> {
    for (draft, links) in drafts.iter().zip(links) {
        let open = draft
            .inputs
            .iter()
            .zip(links)
            .filter(|(port, link)| link.is_none() && !draft.started.contains(&port.name));
        let open: Vec<_> = open.map(|(port, _)| port).collect();
        if let Some(first) = open.first() {
            let names: Vec<_> = open.iter().map(|port| port.name.as_str()).collect();
            let (name, inputs) = (&draft.name, names.join("`, `"));
            let (first, value) = (&first.name, types::example(first));
            let message = format!(
                "nothing is connected to `{inputs}` of `{name}`, and there is no start value"
            );
            let error = scenario.source.error(draft.place.clone(), message, "this node");
            return Err(error.help(format!(
                "connect it: [[connect]] to = \"{name}.{first}\", or let it stay at a value: start = {{ \"{first}\" = {value} }}"
            )));
        }
    }
    Ok(())
}
