//! Makes the calls of a step of an FMU whose values are handed over as they are, from one list in memory.

use std::ops::Range;

use fmu_import::{CallError, Instance, Storage};

use super::events::is_clock;
use crate::system::{VariableGroup, VariableGroups};

/// The calls of a step: without events, and without arithmetic, which depends on how numbers are rounded.
#[derive(Debug)]
pub(super) struct StepCalls {
    set: Vec<Call>,
    get: Vec<Call>,
    /// The value references of all calls.
    references: Vec<u32>,
}

/// A call for one group of variables.
#[derive(Debug)]
struct Call {
    storage: Storage,
    /// Its value references among those of all calls.
    references: Range<usize>,
    /// Its values among those of the node's side.
    values: Range<usize>,
}

impl StepCalls {
    /// The calls for these variables; nothing if some are not handed over as they are.
    pub fn of(inputs: &VariableGroups, outputs: &VariableGroups) -> Option<Self> {
        let plain = |group: &VariableGroup| {
            group.is_whole() && group.clocks.is_empty() && !group.is_exact() && !is_clock(group)
        };
        let plain_input = |group: &VariableGroup| {
            plain(group) && group.storage != Storage::Float32 && !group.tunable
        };
        let plain_output = |group: &VariableGroup| !group.needed || plain(group);
        let numbers =
            inputs.numbers.iter().all(plain_input) && outputs.numbers.iter().all(plain_output);
        let texts = !inputs.texts.is_empty() || outputs.texts.iter().any(|group| group.needed);
        if !numbers || texts {
            return None;
        }
        let mut references = Vec::new();
        let set = calls(&inputs.numbers, &mut references, |_| true);
        let get = calls(&outputs.numbers, &mut references, |group| group.needed);
        Some(StepCalls { set, get, references })
    }

    /// Makes all calls of a step from a time on and of a length [s].
    ///
    /// # Errors
    /// Those of the calls.
    #[inline]
    pub fn make(
        &self,
        instance: &mut Instance,
        inputs: &[f64],
        time: f64,
        step: f64,
        outputs: &mut [f64],
    ) -> Result<(), CallError> {
        instance.batch(|instance| {
            for Call { storage, references, values } in &self.set {
                let references = &self.references[references.clone()];
                instance.set_numbers(*storage, references, &inputs[values.clone()])?;
            }
            instance.step(time, step)?;
            for Call { storage, references, values } in &self.get {
                let references = &self.references[references.clone()];
                instance.get_numbers(*storage, references, &mut outputs[values.clone()])?;
            }
            Ok(())
        })
    }
}

/// The calls for groups whose values follow each other, of those that are wanted.
fn calls(
    groups: &[VariableGroup],
    references: &mut Vec<u32>,
    wanted: impl Fn(&VariableGroup) -> bool,
) -> Vec<Call> {
    let (mut calls, mut begin) = (Vec::new(), 0);
    for group in groups {
        let end = begin + group.places.len();
        if wanted(group) {
            let first = references.len();
            references.extend(&group.references);
            calls.push(Call {
                storage: group.storage,
                references: first..references.len(),
                values: begin..end,
            });
        }
        begin = end;
    }
    calls
}
