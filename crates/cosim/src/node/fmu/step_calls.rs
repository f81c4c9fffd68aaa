//! Lists the calls of a step of an FMU whose values are handed over as they are.

use fmu_import::{StepCalls, StorageType, ValueCall};

use super::events::is_clock;
use crate::system::{VariableGroup, VariableGroups};

/// The calls for these variables: without events, and without arithmetic, which depends on how numbers are rounded. Nothing if some are
/// not handed over as they are.
pub(super) fn step_calls_for_variables(
    inputs: &VariableGroups,
    outputs: &VariableGroups,
) -> Option<StepCalls> {
    let plain = |group: &VariableGroup| {
        group.is_fully_transferred() && group.clocks.is_empty() && !group.is_int64() && !is_clock(group)
    };
    let plain_input =
        |group: &VariableGroup| plain(group) && group.storage != StorageType::Float32 && !group.tunable;
    let plain_output = |group: &VariableGroup| !group.needed || plain(group);
    let numbers = inputs.numbers.iter().all(plain_input) && outputs.numbers.iter().all(plain_output);
    let texts = !inputs.texts.is_empty() || outputs.texts.iter().any(|group| group.needed);
    if !numbers || texts {
        return None;
    }
    let set = value_calls(&inputs.numbers, |_| true);
    StepCalls::new(&set, &value_calls(&outputs.numbers, |group| group.needed))
}

/// The calls for groups whose values follow each other, of those that are wanted.
fn value_calls(groups: &[VariableGroup], wanted: impl Fn(&VariableGroup) -> bool) -> Vec<ValueCall> {
    let (mut calls, mut begin) = (Vec::new(), 0);
    for group in groups {
        let end = begin + group.places.len();
        if wanted(group) && !group.references.is_empty() {
            let (storage, references) = (group.storage, group.references.clone());
            calls.push(ValueCall { storage, references, values: begin..end });
        }
        begin = end;
    }
    calls
}
