//! Resolves `[[fault]]` of FMUs: faults that are injected into their calls.

use std::time::Duration;

use cosim::effect::stream_seed;
use cosim::fault::{CallFault, CallFaultKind};
use cosim::quantity::InputUnit;
use cosim::system::{NodeBody, NodePlan};
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use recording::{AllVariables, Columns, ValueKind};

use crate::document::{Fault, Scenario};
use crate::pattern;

/// Gives nodes the faults of their calls; the nodes with their columns.
pub(super) fn attach_call_faults(
    scenario: &Scenario,
    nodes: &mut [NodePlan],
    columns: &Columns<AllVariables>,
    seed: u64,
    mistakes: &mut ErrorCollector,
) {
    for fault in &scenario.document.fault {
        let attached = match (&fault.input, &fault.node) {
            (None, Some(name)) => find_fmu(scenario, nodes, name).and_then(|index| {
                let made = call_fault(scenario, fault, name, &nodes[index], columns, seed)?;
                nodes[index].faults.push(made);
                Ok(())
            }),
            (Some(_), None) => check_input_fault(scenario, fault),
            _ => {
                let message = "expected either the `input` or the `node` that has the fault";
                Err(scenario.error_at(&fault.from, message.to_owned()))
            }
        };
        mistakes.ok_or_record(attached);
    }
}

/// Refuses words of nodes at the fault of an input.
fn check_input_fault(scenario: &Scenario, fault: &Fault) -> Result<(), Error> {
    let words = [
        ("probability", fault.probability.is_some()),
        ("discard", fault.discard.is_some()),
        ("late", fault.late.is_some()),
        ("nan", fault.nan.is_some()),
        ("crash", fault.crash.is_some()),
    ];
    match words.into_iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((key, _)) => {
            let message = format!("`{key}` is for the calls of a node, and this fault is one of an input");
            Err(scenario
                .error_at(&fault.from, message)
                .with_help("name the FMU: `node = \"NAME\"` in place of `input`"))
        }
    }
}

fn find_fmu(scenario: &Scenario, nodes: &[NodePlan], name: &Spanned<String>) -> Result<usize, Error> {
    let wanted = name.get_ref();
    let fmus = nodes.iter().filter(|node| matches!(node.body, NodeBody::Fmu { .. }));
    match nodes.iter().position(|node| node.name == *wanted) {
        Some(index) if matches!(nodes[index].body, NodeBody::Fmu { .. }) => Ok(index),
        Some(_) => {
            let message = format!("`{wanted}` is no FMU, and only FMUs have calls that can fail");
            Err(scenario.error_at(name, message))
        }
        None => {
            let known = fmus.map(|node| node.name.as_str());
            Err(suggest::unknown_name("FMU", wanted, known).into_error_at(&scenario.source, name.span()))
        }
    }
}

fn call_fault(
    scenario: &Scenario,
    fault: &Fault,
    name: &Spanned<String>,
    plan: &NodePlan,
    columns: &Columns<AllVariables>,
    seed: u64,
) -> Result<CallFault, Error> {
    let wrong = |message: String| Err(scenario.error_at(name, message));
    if !fault.actions(InputUnit::default()).is_ok_and(|actions| actions.is_empty()) {
        return wrong(format!("expected one of `{}` for the calls of a node", Fault::OF_NODES.join("`, `")));
    }
    let late = fault.late.as_ref().map(|word| {
        let seconds = *word.get_ref();
        match Duration::try_from_secs_f64(seconds) {
            Ok(_) => Ok(("late", CallFaultKind::Late(seconds))),
            Err(_) => {
                Err(scenario.error_at(word, format!("expected a time of at least 0 s, found {seconds} s")))
            }
        }
    });
    let nan = fault.nan.as_ref().map(|word| {
        let indices = nan_output_indices(scenario, word, plan, columns)?;
        Ok(("nan", CallFaultKind::NotANumber(indices)))
    });
    let discard = fault.discard.filter(|given| *given).map(|_| Ok(("discard", CallFaultKind::Discard)));
    let crash = fault.crash.filter(|given| *given).map(|_| Ok(("crash", CallFaultKind::Crash)));
    let kinds = ErrorCollector::collect_all([discard, late, nan, crash].into_iter().flatten())?;
    let Ok([(word, kind)]) = <[_; 1]>::try_from(kinds) else {
        return wrong(format!("expected exactly one of `{}`", Fault::OF_NODES.join("`, `")));
    };
    let probability = match &fault.probability {
        None => 1.0,
        Some(word) if (0.0..=1.0).contains(word.get_ref()) => *word.get_ref(),
        Some(word) => {
            let message = format!("expected a probability from 0 to 1, found {}", word.get_ref());
            return Err(scenario.error_at(word, message));
        }
    };
    let [from, until] = super::connections::fault_window(scenario, fault)?;
    let stream = stream_seed(seed, &format!("{} {word}", plan.name));
    Ok(CallFault { from, until, probability, stream, kind })
}

/// The indices of the outputs that are to be NaN.
fn nan_output_indices(
    scenario: &Scenario,
    word: &Spanned<Vec<String>>,
    plan: &NodePlan,
    columns: &Columns<AllVariables>,
) -> Result<Vec<usize>, Error> {
    let mut indices = Vec::new();
    for wanted in word.get_ref() {
        let outputs = plan.outputs.indices().map(|index| &columns[index]).enumerate();
        let reals = outputs.filter(|(_, column)| column.kind == ValueKind::Real);
        let matching = reals.filter(|(_, column)| pattern::matches_wildcard(wanted, &column.variable));
        let before = indices.len();
        indices.extend(matching.map(|(index, _)| index));
        if indices.len() == before {
            let message = format!("`{}` has no output `{wanted}` that is a real number", plan.name);
            return Err(scenario.error_at(word, message));
        }
    }
    indices.sort_unstable();
    indices.dedup();
    Ok(indices)
}
