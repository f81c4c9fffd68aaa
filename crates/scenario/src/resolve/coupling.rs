//! Resolves `[coupling]`, the steps of FMUs and the extrapolation of inputs.

use cosim::clock::CommunicationClock;
use cosim::system::{
    BondPlan, CouplingPlan, LoopIteration, NodeBody, NodePlan, StepDivision, StepRatio, TearConnection,
};
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use recording::{AllVariables, Columns};

use super::ports::Port;
use crate::document::{
    Algorithm, Bond, Connect, ErrorEstimate, ExtrapolationOrder, OnDiscard, Scenario, StepBoundary,
};

/// The extrapolation of an input within a step. With `iterate`, a continuous input of an FMU has one, unless sensor effects make samples of it.
pub(super) fn input_extrapolation(
    scenario: &Scenario,
    connect: &Connect,
    at: StepBoundary,
    from: &Port,
    to: &Port,
    receiver: &NodeBody,
) -> Result<Option<ExtrapolationOrder>, Error> {
    let takes = to.continuous && matches!(receiver, NodeBody::Fmu { .. });
    let Some(word) = &connect.extrapolate else {
        let iterates = scenario.document.coupling.algorithm == Algorithm::Iterate;
        let even = iterates && at == StepBoundary::End && takes && from.continuous;
        return Ok((even && connect.effects().is_empty()).then_some(ExtrapolationOrder::Linear));
    };
    if let Some((key, ..)) = connect.effects().first() {
        let message = format!("`{key}` makes samples of the value, which hold until the next one");
        return Err(scenario.error_at(word, message).with_help("leave `extrapolate` out"));
    }
    match takes {
        true => Ok(Some(*word.get_ref())),
        false => {
            let message = format!("`{}` is no continuous input of an FMU", connect.to.get_ref());
            Err(scenario.error_at(word, message).with_help("leave `extrapolate` out: it holds its value"))
        }
    }
}

/// Gives the nodes the steps that the scenario has for them.
fn step_ratios(
    scenario: &Scenario,
    nodes: &mut [NodePlan],
    clock: Option<CommunicationClock>,
    mistakes: &mut ErrorCollector,
) {
    for fmu in &scenario.document.fmu {
        let (Some(word), Some(clock)) = (&fmu.step, clock) else { continue };
        let ratio = mistakes.ok_or_record(step_ratio(scenario, word, clock)).flatten();
        if let Some(node) = nodes.iter_mut().find(|node| node.name == *fmu.name.get_ref()) {
            node.step_ratio = ratio;
        }
    }
}

/// The step of a node beside the communication step; none if it is the same.
fn step_ratio(
    scenario: &Scenario,
    word: &Spanned<f64>,
    clock: CommunicationClock,
) -> Result<Option<StepRatio>, Error> {
    let (own, step) = (*word.get_ref(), clock.step);
    let whole = |ratio: f64| {
        let times = ratio.round();
        ((ratio - times).abs() <= 1e-9 * ratio && (1.0..=1e6).contains(&times)).then_some(times as u64)
    };
    if !(own > 0.0 && own.is_finite()) {
        return Err(scenario.error_at(word, format!("expected a step above 0 s, found {own} s")));
    }
    let ratio = match (whole(step / own), whole(own / step)) {
        (Some(1), _) => return Ok(None),
        (Some(times), _) => StepRatio::Finer(times),
        (None, Some(times)) => StepRatio::Coarser(times),
        (None, None) => {
            let message = format!(
                "expected the communication step {step} s divided by a whole number, or a multiple of it, up to a million, found {own} s"
            );
            return Err(scenario.error_at(word, message));
        }
    };
    if let StepRatio::Coarser(times) = ratio
        && !clock.steps.is_multiple_of(times)
    {
        let message = format!("the run has {} steps of {step} s, no multiple of {own} s", clock.steps);
        return Err(scenario.error_at(word, message).with_help("choose another `stop` in [time]"));
    }
    Ok(Some(ratio))
}

/// The coupling, without its loops. Nodes get the steps that they have of their own.
pub(super) fn plan_coupling(
    scenario: &Scenario,
    nodes: &mut [NodePlan],
    columns: &Columns<AllVariables>,
    clock: Option<CommunicationClock>,
    mistakes: &mut ErrorCollector,
) -> CouplingPlan {
    step_ratios(scenario, nodes, clock, mistakes);
    let coupling = &scenario.document.coupling;
    CouplingPlan {
        algorithm: coupling.algorithm,
        iteration: parse_iteration(scenario, mistakes),
        division: step_division(scenario, nodes, columns, mistakes),
        ..CouplingPlan::default()
    }
}

/// Solution of loops.
fn parse_iteration(scenario: &Scenario, mistakes: &mut ErrorCollector) -> LoopIteration {
    let written = &scenario.document.coupling.iteration;
    let mut iteration = LoopIteration { method: written.method, ..LoopIteration::default() };
    if let Some(word) = &written.tolerance {
        iteration.tolerance = *word.get_ref();
        mistakes.ok_or_record(check_relative_tolerance(scenario, word));
    }
    if let Some(word) = &written.passes {
        iteration.passes = *word.get_ref();
        if iteration.passes == 0 {
            mistakes.push(scenario.error_at(word, "expected at least 1 for `passes`, found 0"));
        }
    }
    iteration
}

/// Refuses what is no relative tolerance.
pub(super) fn check_relative_tolerance(scenario: &Scenario, word: &Spanned<f64>) -> Result<(), Error> {
    let tolerance = *word.get_ref();
    if tolerance > 0.0 && tolerance < 1.0 {
        return Ok(());
    }
    let message = format!("expected a relative tolerance between 0 and 1, found {tolerance}");
    Err(scenario.error_at(word, message))
}

fn step_division(
    scenario: &Scenario,
    nodes: &[NodePlan],
    columns: &Columns<AllVariables>,
    mistakes: &mut ErrorCollector,
) -> Option<StepDivision> {
    let coupling = &scenario.document.coupling;
    let estimate = coupling.error.as_ref().map(|word| *word.get_ref()).unwrap_or_default();
    let bonds = coupling.bond.iter();
    let bonds =
        bonds.filter_map(|word| mistakes.ok_or_record(plan_bond(scenario, word, nodes, columns))).collect();
    let control = coupling.tolerance.as_ref().map(|word| (estimate, *word.get_ref()));
    if let Some(word) = &coupling.tolerance {
        mistakes.ok_or_record(check_relative_tolerance(scenario, word));
    } else if let Some(word) = &coupling.error {
        let error = scenario.error_at(word, "an estimate of the error has nothing to decide");
        mistakes.push(error.with_help("add `tolerance` to [coupling]"));
    }
    let energy = coupling.error.as_ref().filter(|word| *word.get_ref() == ErrorEstimate::Energy);
    match (energy, coupling.bond.first()) {
        (Some(word), None) => {
            let error = scenario.error_at(word, "no connection is said to carry power");
            mistakes.push(error.with_help(
                "add [[coupling.bond]] with the inputs `effort` and `flow` of two connections, or leave `error` out",
            ));
        }
        (None, Some(bond)) => {
            let error = scenario.error_at(&bond.effort, "a bond is for `error = \"energy\"`");
            mistakes.push(error.with_help("add `error = \"energy\"` to [coupling]"));
        }
        _ => {}
    }
    if let (Some(word), Algorithm::Iterate) = (energy, coupling.algorithm) {
        let error = scenario.error_at(word, "`iterate` repeats steps until no energy is lost");
        mistakes.push(error.with_help("leave `error` out, or choose another algorithm"));
    }
    let halves = match &coupling.on_discard {
        Some(word) => *word.get_ref() == OnDiscard::Halve,
        None => control.is_some() && estimate == ErrorEstimate::Richardson,
    };
    (control.is_some() || halves).then_some(StepDivision { control, halves_discarded: halves, bonds })
}

fn plan_bond(
    scenario: &Scenario,
    bond: &Bond,
    nodes: &[NodePlan],
    columns: &Columns<AllVariables>,
) -> Result<BondPlan, Error> {
    let inputs = || {
        nodes.iter().enumerate().flat_map(|(node, plan)| {
            let ends = plan.inputs.indices().zip(&plan.connections).enumerate();
            ends.map(move |(place, (input, link))| (TearConnection { node, place }, input, link.source.index))
        })
    };
    let find = |word: &Spanned<String>| {
        let found = inputs().find(|(_, input, _)| columns[*input].qualified_name() == *word.get_ref());
        found.ok_or_else(|| {
            let names: Vec<_> = inputs().map(|(_, input, _)| columns[input].qualified_name()).collect();
            let known = names.iter().map(String::as_str);
            suggest::unknown_name("connected input", word.get_ref(), known)
                .into_error_at(&scenario.source, word.span())
        })
    };
    let (effort, flow) = ErrorCollector::collect_both(find(&bond.effort), find(&bond.flow))?;
    let gives = |node: usize, output| nodes[node].outputs.indices().any(|own| own == output);
    if !(gives(effort.0.node, flow.2) && gives(flow.0.node, effort.2)) {
        let message = format!(
            "expected a flow that comes from the node that takes `{}`, and goes to the one that gives it; `{}` comes from `{}`",
            bond.effort.get_ref(),
            bond.flow.get_ref(),
            columns[flow.2].qualified_name()
        );
        return Err(scenario.error_at(&bond.flow, message));
    }
    let name = format!("{}, {}", bond.effort.get_ref(), bond.flow.get_ref());
    Ok(BondPlan { name, effort: effort.0, flow: flow.0 })
}
