//! Finds how outputs respond to inputs, where FMI 2.0 allows the question.

use super::{Instance, Outcome, is_tunable, real, refuse, variable, writable};
use crate::Model;
use crate::derivative::{Derivatives, Partial, partial};
use crate::lifecycle::State;
use crate::variable::{Causality, Kind, Row, Variable};

impl<M: Model> Instance<M> {
    /// How `unknowns` change when `knowns` change by `changes`.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        changes: &[f64],
    ) -> Outcome<Vec<f64>> {
        let Some(derivatives) = M::DERIVATIVES else {
            return refuse("a directional derivative is not supported");
        };
        let places = self.places(&derivatives, unknowns, knowns)?;
        self.refresh()?;
        let seeds = derivatives.known.iter().map(|name| {
            let reference = M::VARIABLES.iter().position(|variable| variable.row.name == *name);
            let at = reference.and_then(|reference| real::<M>(reference as u32));
            let value = at.map_or(f64::NAN, |at| *at(&mut self.current.model));
            let asked = knowns.iter().zip(changes);
            let asked = asked.filter(|(known, _)| Some(**known as usize) == reference);
            (value, asked.map(|(_, change)| change).sum())
        });
        let seeds: Vec<_> = seeds.collect();
        let found = derivatives.along(&self.current.model, &seeds);
        Ok(places.into_iter().map(|place| place.map_or(0.0, |place| found[place].1)).collect())
    }

    /// The place of each unknown in the equations, none for those that no known moves.
    fn places(
        &self,
        derivatives: &Derivatives<M>,
        unknowns: &[u32],
        knowns: &[u32],
    ) -> Outcome<Vec<Option<usize>>> {
        let state = self.current.state;
        let row = |reference: u32, may: fn(&Row, State) -> bool, part: &str| {
            let Variable { row, access } = variable::<M>(reference)?;
            if access.kind() == Kind::Real && may(row, state) {
                return Ok(row);
            }
            refuse(format!("{} is no real {part} in the state {state:?}", row.name))
        };
        let knowns: Vec<_> =
            knowns.iter().map(|known| row(*known, is_known, "known")).collect::<Outcome<_>>()?;
        let mut places = Vec::with_capacity(unknowns.len());
        for unknown in unknowns {
            let (unknown, mut place) = (row(*unknown, is_unknown, "unknown")?, None);
            for known in &knowns {
                match partial::<M>(derivatives, unknown, known) {
                    Partial::Equation(found) => place = Some(found),
                    Partial::Zero => {}
                    Partial::Missing => {
                        return refuse(format!(
                            "the derivative of {} with respect to {} is not known",
                            unknown.name, known.name
                        ));
                    }
                }
            }
            places.push(place);
        }
        Ok(places)
    }
}

/// Which variables may be varied when (FMI 2.0, section 2.1.9).
fn is_known(row: &Row, state: State) -> bool {
    match state {
        State::Initialization => writable(row, state),
        _ => row.causality == Causality::Input || is_tunable(row),
    }
}

/// Which variables respond when (FMI 2.0, section 2.1.9).
fn is_unknown(row: &Row, state: State) -> bool {
    match state {
        State::Initialization => row.is_initial_unknown(),
        _ => row.causality == Causality::Output,
    }
}
