//! Makes the calls of a step of an FMU whose values are handed over as they are, from one list in memory.

use std::ops::Range;

use fmu_import::{CallError, Instance, StorageType};

use super::events::is_clock;
use crate::system::{VariableGroup, VariableGroups};

/// The calls of a step: without events, and without arithmetic, which depends on how numbers are rounded.
#[derive(Debug)]
pub(super) struct StepCalls {
    set: Vec<GroupCall>,
    get: Vec<GroupCall>,
    /// The value references of all calls.
    references: Vec<u32>,
}

/// A call for one group of variables.
#[derive(Debug)]
struct GroupCall {
    storage: StorageType,
    /// Its value references among those of all calls.
    references: Range<usize>,
    /// Its values among those of the node's side.
    values: Range<usize>,
}

impl StepCalls {
    /// The calls for these variables; nothing if some are not handed over as they are.
    pub fn for_variables(inputs: &VariableGroups, outputs: &VariableGroups) -> Option<Self> {
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
        let mut references = Vec::new();
        let set = group_calls(&inputs.numbers, &mut references, |_| true);
        let get = group_calls(&outputs.numbers, &mut references, |group| group.needed);
        Some(StepCalls { set, get, references })
    }

    /// Makes all calls of a step from a time on and of a length [s].
    ///
    /// # Errors
    /// Those of the calls.
    #[inline]
    pub fn execute_step(
        &self,
        instance: &mut Instance,
        inputs: &[f64],
        time: f64,
        step: f64,
        outputs: &mut [f64],
    ) -> Result<(), CallError> {
        instance.batch_step_calls(|instance| {
            for GroupCall { storage, references, values } in &self.set {
                let references = &self.references[references.clone()];
                instance.set_numbers(*storage, references, &inputs[values.clone()])?;
            }
            instance.step(time, step)?;
            for GroupCall { storage, references, values } in &self.get {
                let references = &self.references[references.clone()];
                instance.get_numbers(*storage, references, &mut outputs[values.clone()])?;
            }
            Ok(())
        })
    }
}

/// The calls for groups whose values follow each other, of those that are wanted.
fn group_calls(
    groups: &[VariableGroup],
    references: &mut Vec<u32>,
    wanted: impl Fn(&VariableGroup) -> bool,
) -> Vec<GroupCall> {
    let (mut calls, mut begin) = (Vec::new(), 0);
    for group in groups {
        let end = begin + group.places.len();
        if wanted(group) {
            let first = references.len();
            references.extend(&group.references);
            calls.push(GroupCall {
                storage: group.storage,
                references: first..references.len(),
                values: begin..end,
            });
        }
        begin = end;
    }
    calls
}
