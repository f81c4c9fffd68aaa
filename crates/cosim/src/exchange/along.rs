//! Steps nodes whose inputs have courses within a step.

use std::mem::take;

use super::{Exchange, Interruption, set_others};
use crate::course::Moving;
use crate::system::NodePlan;

/// The inputs of a node that have courses within a step.
pub(super) fn moving(plan: &NodePlan) -> Vec<Moving> {
    let links = plan.connections.iter().enumerate();
    let moving =
        links.filter_map(|(place, link)| Some(Moving::new(place, link.course?, link.source.at)));
    moving.collect()
}

impl Exchange<'_> {
    /// The last values of inputs with courses, by the names of the inputs.
    pub(crate) fn moving(&self) -> Vec<(String, Moving)> {
        let all = self.plans.iter().zip(&self.moving).flat_map(|(plan, moving)| {
            let name = |place| Some(self.columns[plan.inputs.index(place)?].name());
            moving.iter().filter_map(move |it| Some((name(it.place)?, *it)))
        });
        all.collect()
    }

    /// Goes on with values of inputs that have the same courses.
    pub(crate) fn recall_moving(&mut self, kept: &[(String, Moving)]) {
        for (plan, moving) in self.plans.iter().zip(&mut self.moving) {
            for own in moving {
                let name = plan.inputs.index(own.place).map(|input| self.columns[input].name());
                if let Some((_, kept)) = kept.iter().find(|(kept, _)| Some(kept) == name.as_ref()) {
                    own.recall(kept);
                }
            }
        }
    }

    /// Hands a node its inputs with their courses, and lets it go to the end of the step. Those that know their value at the end have it afterwards, since outputs
    /// may follow it.
    pub(super) fn step_along(&mut self, node: usize) -> Result<(), Interruption> {
        let ((clock, tick), span) = (self.part, self.span());
        let (mut held, mut courses) = take(&mut self.scratch);
        let inputs = self.plans[node].inputs;
        held.clear();
        held.extend_from_slice(&self.row[inputs]);
        courses.clear();
        for moving in &mut self.moving[node] {
            let before = inputs.index(moving.place).map(|input| self.start[input]);
            let value = held[moving.place];
            moving.note(span, before.unwrap_or(value), value);
            courses.push((moving.place, moving.course()));
        }
        let settles = self.moving[node].iter().any(Moving::knows_end);
        let done = self.call(node, |plan, node, row| {
            set_others(plan, node, row)?;
            node.set_courses(&mut held, &courses, span)?;
            node.step(&clock, tick)?;
            if settles { node.settle(&row[plan.inputs]) } else { Ok(()) }
        });
        self.scratch = (held, courses);
        done
    }
}
