//! Finds the outputs that somebody uses: an FMU is not asked for the others.

use std::collections::BTreeSet;

use recording::{ColumnIndex, Full, NumberIndex, TextIndex};

use super::{Body, Condition, Origin, System};

/// The columns of a run that somebody uses.
#[derive(Default)]
struct Needed {
    numbers: BTreeSet<NumberIndex<Full>>,
    texts: BTreeSet<TextIndex<Full>>,
}

impl Needed {
    /// What is recorded, connected, checked, analysed and compared. What is drawn is recorded.
    fn of(system: &System) -> Self {
        let mut needed = Needed {
            numbers: system.recorded.numbers().collect(),
            texts: system.recorded.texts().collect(),
        };
        for node in &system.nodes {
            needed.numbers.extend(node.connections.iter().map(|link| link.source.index));
            needed.texts.extend(node.texts.connections.iter().map(|source| source.index));
        }
        for check in &system.checks {
            if let Condition::Run(expression) = &check.condition {
                needed.numbers.extend(expression.numbers());
                needed.texts.extend(expression.texts());
            }
        }
        for wired in system.analyses.iter().flat_map(|analysis| &analysis.wired) {
            if let Origin::Run(number) = wired.origin {
                needed.numbers.insert(number);
            }
        }
        for signal in system.baselines.iter().flat_map(|baseline| &baseline.signals) {
            match signal.column {
                ColumnIndex::Number(number) => drop(needed.numbers.insert(number)),
                ColumnIndex::Text(text) => drop(needed.texts.insert(text)),
            }
        }
        needed
    }
}

impl System {
    /// Lets FMUs be asked for those outputs only that this run uses. Whoever reads the row besides must not call it: the other
    /// outputs have no values any more.
    pub fn leave_unneeded(&mut self) {
        let needed = Needed::of(self);
        for node in &mut self.nodes {
            node.needed.retain(|number| needed.numbers.contains(number));
            let Body::Fmu { outputs, .. } = &mut node.body else { continue };
            // Each group takes all of its own, so that the next one begins where it ends.
            let mut numbers = node.outputs.indices();
            for group in &mut outputs.numbers {
                let own = numbers.by_ref().take(group.places.len());
                group.needed = own.filter(|it| needed.numbers.contains(it)).count() > 0;
            }
            let mut texts = node.texts.outputs.indices();
            for group in &mut outputs.texts {
                let own = texts.by_ref().take(group.places.len());
                group.needed = own.filter(|it| needed.texts.contains(it)).count() > 0;
            }
        }
    }
}
