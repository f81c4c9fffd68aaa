//! Notes corrections that reading a modelDescription.xml made, and default start times and steps that the run is far from.

use std::collections::BTreeSet;

use cosim::clock::CommunicationClock;
use cosim::system::{NodeBody, NodePlan};

use super::node_draft::NodeDraft;
use crate::document::Scenario;

/// A communication step that is so many times the step of an FMU is most likely a slip.
const FAR_ABOVE: f64 = 10.0;

/// Start times that differ by less are the same [s].
const SAME: f64 = 1e-9;

/// What to tell of the descriptions of these nodes, once for each archive.
pub(super) fn description_notes(nodes: &[NodeDraft], clock: Option<CommunicationClock>) -> Vec<String> {
    let (mut known, mut notes) = (BTreeSet::new(), Vec::new());
    for node in nodes {
        let NodeBody::Fmu { fmu, .. } = &node.body else { continue };
        if !known.insert(&fmu.path) {
            continue;
        }
        let (file, about) = (fmu.path.display(), &fmu.description);
        let corrections = about.corrections.iter();
        notes.extend(corrections.map(|it| format!("{file}: modelDescription.xml: {it}")));
        let own = about.default_start;
        let differs = |clock: &CommunicationClock| own != 0.0 && (own - clock.start).abs() > SAME;
        if let Some(CommunicationClock { start, .. }) = clock.filter(differs) {
            // Recordings have no times before 0.
            let cure = match own > 0.0 {
                true => {
                    format!(": write `start = {own}` in [time], with a `stop` after it, to start there")
                }
                false => String::new(),
            };
            let name = &node.name;
            notes.push(format!(
                "`{name}`: the run starts at {start} s, and the description of {file} at {own} s{cure}"
            ));
        }
    }
    notes
}

/// Notes steps of FMUs that are far above those that they are made for: the communication step, or the step that a scenario gives to one.
pub(super) fn coarse_step_notes(
    scenario: &Scenario,
    nodes: &[NodePlan],
    clock: CommunicationClock,
) -> Vec<String> {
    let note = |node: &NodePlan| {
        let NodeBody::Fmu { fmu, .. } = &node.body else { return None };
        let about = &fmu.description;
        let own = about.internal_step.filter(|step| *step > 0.0).map(|step| (step, "fixedInternalStepSize"));
        let own = about.default_step.filter(|step| *step > 0.0).map(|step| (step, "stepSize")).or(own);
        let (own, attribute) = own?;
        let step = node.step_ratio.map_or(clock, |ratio| ratio.node_clock(&clock)).step;
        if step <= FAR_ABOVE * own * (1.0 + SAME) {
            return None;
        }
        let fixed = match about.variable_step {
            true => "",
            false => " and takes steps of one length only (canHandleVariableCommunicationStepSize)",
        };
        let (name, times) = (&node.name, step / own);
        let of_node = scenario.document.fmu.iter().find(|fmu| fmu.name.get_ref() == name);
        let of_run = scenario.document.time.as_ref().map(|time| &time.step);
        let word = of_node.and_then(|fmu| fmu.step.as_ref()).or(of_run)?;
        let place = scenario.source.describe_position(word.span().start);
        Some(format!(
            "{place}: `{name}` gets steps of {step} s, {times:.0} times the {own} s that its description proposes ({attribute}){fixed}: \
             write `step` in its [[fmu]] or a shorter one in [time]"
        ))
    };
    nodes.iter().filter_map(note).collect()
}
