//! Finds the outputs that somebody uses: an FMU is not asked for the others.

use std::collections::BTreeSet;
use std::ops::Range;

use recording::{AllVariables, NumberIndex, TextIndex};

use super::{NodeBody, System, VariableGroup};

/// The columns of a run that somebody uses.
#[derive(Debug, Default)]
pub struct UsedColumns {
    /// Those of numbers.
    pub numbers: BTreeSet<NumberIndex<AllVariables>>,
    /// Those of texts.
    pub texts: BTreeSet<TextIndex<AllVariables>>,
}

impl System {
    /// Lets FMUs be asked for those outputs only that are needed or connected. Whoever reads the row besides must not call it: the other
    /// outputs have no values any more.
    pub fn restrict_outputs(&mut self, mut needed: UsedColumns) {
        for node in &self.nodes {
            needed.numbers.extend(node.connections.iter().map(|link| link.source.index));
            needed.texts.extend(node.texts.connections.iter().map(|source| source.index));
        }
        for node in &mut self.nodes {
            node.needed.retain(|number| needed.numbers.contains(number));
            node.texts.unneeded = !node.texts.outputs.indices().any(|text| needed.texts.contains(&text));
            node.exact.unneeded = !node.exact.numbers.iter().any(|number| needed.numbers.contains(number));
            let NodeBody::Fmu { outputs, .. } = &mut node.body else { continue };
            // Each group takes all of its own, so that the next one begins where it ends.
            let mut numbers = node.outputs.indices();
            outputs.numbers = std::mem::take(&mut outputs.numbers)
                .into_iter()
                .flat_map(|group| {
                    let own = numbers.by_ref().take(group.places.len());
                    split_group_by_need(
                        group,
                        &own.map(|it| needed.numbers.contains(&it)).collect::<Vec<_>>(),
                    )
                })
                .collect();
            let mut texts = node.texts.outputs.indices();
            for group in &mut outputs.texts {
                let own = texts.by_ref().take(group.places.len());
                group.needed = own.filter(|it| needed.texts.contains(it)).count() > 0;
            }
        }
    }
}

/// Parts a group into those before the first value that is needed, those up to the last one, and those behind it: one call takes what is
/// needed. A group with arrays stays whole, since an array is read as a whole.
fn split_group_by_need(mut group: VariableGroup, needed: &[bool]) -> Vec<VariableGroup> {
    let (first, last) = match needed.iter().position(|it| *it) {
        Some(first) => (first, needed.iter().rposition(|it| *it).unwrap_or(first) + 1),
        None => (0, needed.len()),
    };
    group.needed = needed.contains(&true);
    let scalars = group.is_fully_transferred() && group.references.len() == group.elements;
    if !group.needed || !scalars {
        return vec![group];
    }
    let parts = [(0..first, false), (first..last, true), (last..needed.len(), false)];
    let part = |(range, needed): (Range<usize>, bool)| VariableGroup {
        references: group.references[range.clone()].to_vec(),
        elements: range.len(),
        places: (0..range.len()).collect(),
        needed,
        clocks: group.clocks.clone(),
        ..group
    };
    parts.into_iter().filter(|(range, _)| !range.is_empty()).map(part).collect()
}

#[cfg(test)]
mod tests {
    use fmu_import::StorageType;

    use super::*;

    fn group(references: &[u32], elements: usize) -> VariableGroup {
        VariableGroup {
            tunable: false,
            storage: StorageType::Float64,
            references: references.to_vec(),
            elements,
            discrete: false,
            clocks: vec![7],
            places: (0..elements).collect(),
            needed: true,
        }
    }

    #[test]
    fn an_fmu_is_asked_for_what_is_between_the_first_needed_value_and_the_last() {
        let parts = split_group_by_need(group(&[4, 3, 2, 1], 4), &[false, true, false, true]);
        let shown: Vec<_> = parts.iter().map(|it| (&it.references[..], it.needed)).collect();
        assert_eq!(shown, [(&[4][..], false), (&[3, 2, 1], true)]);
        assert!(parts.iter().all(|it| it.is_fully_transferred() && it.clocks == [7]));
        assert_eq!(parts.iter().map(|it| it.elements).collect::<Vec<_>>(), [1, 3]);
        let one = split_group_by_need(group(&[4, 3, 2], 3), &[false, true, false]);
        assert_eq!(one.iter().map(|it| it.needed).collect::<Vec<_>>(), [false, true, false]);
    }

    #[test]
    fn an_array_and_what_nobody_needs_stay_whole() {
        let array = split_group_by_need(group(&[4], 3), &[false, true, false]);
        assert_eq!(array, [group(&[4], 3)]);
        let nothing = split_group_by_need(group(&[4, 3], 2), &[false, false]);
        assert_eq!(nothing, [VariableGroup { needed: false, ..group(&[4, 3], 2) }]);
        assert_eq!(split_group_by_need(group(&[4, 3], 2), &[true, true]), [group(&[4, 3], 2)]);
    }
}
