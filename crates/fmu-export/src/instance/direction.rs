//! Computes directional derivatives of outputs, where FMI 2.0 defines them.

use super::{Instance, find_variable, is_tunable, is_writable, real_accessor};
use crate::co_simulation::CoSimulation as _;
use crate::derivative::{EquationDerivatives, PartialDerivative, partial_derivative};
use crate::error::{FmiResult, reject};
use crate::lifecycle::LifecycleState;
use crate::model::Model;
use crate::variable::{Causality, Variable, VariableKind, VariableRow};

impl<M: Model> Instance<M> {
    /// How `unknowns` change when `knowns` change by `changes`.
    pub(super) fn compute_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        changes: &[f64],
    ) -> FmiResult<Vec<f64>> {
        let Some(derivatives) = M::DERIVATIVES else {
            return reject("a directional derivative is not supported");
        };
        let indices = self.equation_indices(&derivatives, unknowns, knowns)?;
        self.refresh_outputs()?;
        let seeds = derivatives.known.iter().map(|name| {
            let reference = M::VARIABLES.iter().position(|variable| variable.row.name == *name);
            let at = reference.and_then(|reference| real_accessor::<M>(reference as u32));
            let value = at.map_or(f64::NAN, |at| *at(&mut self.current.model));
            let seeds = knowns.iter().zip(changes);
            let seeds = seeds.filter(|(known, _)| Some(**known as usize) == reference);
            (value, seeds.map(|(_, change)| change).sum())
        });
        let seeds: Vec<_> = seeds.collect();
        let found = derivatives.directional_derivative(&self.current.model, &seeds);
        Ok(indices.into_iter().map(|index| index.map_or(0.0, |index| found[index].1)).collect())
    }

    /// The index of each unknown in the equations; none when no known moves it.
    fn equation_indices(
        &self,
        derivatives: &EquationDerivatives<M>,
        unknowns: &[u32],
        knowns: &[u32],
    ) -> FmiResult<Vec<Option<usize>>> {
        let state = self.current.lifecycle.state;
        let row = |reference: u32, may: fn(&VariableRow, LifecycleState) -> bool, part: &str| {
            let Variable { row, access } = find_variable::<M>(reference)?;
            if access.kind() == VariableKind::Real && may(row, state) {
                return Ok(row);
            }
            reject(format!("{} is no real {part} in the state {state:?}", row.name))
        };
        let knowns: Vec<_> =
            knowns.iter().map(|known| row(*known, is_known, "known")).collect::<FmiResult<_>>()?;
        let mut indices = Vec::with_capacity(unknowns.len());
        for unknown in unknowns {
            let (unknown, mut index) = (row(*unknown, is_unknown, "unknown")?, None);
            for known in &knowns {
                match partial_derivative::<M>(derivatives, unknown, known) {
                    PartialDerivative::Equation(found) => index = Some(found),
                    PartialDerivative::Zero => {}
                    PartialDerivative::Missing => {
                        return reject(format!(
                            "the derivative of {} with respect to {} is not known",
                            unknown.name, known.name
                        ));
                    }
                }
            }
            indices.push(index);
        }
        Ok(indices)
    }
}

/// Whether a variable may be varied in a state (FMI 2.0, section 2.1.9).
fn is_known(row: &VariableRow, state: LifecycleState) -> bool {
    match state {
        LifecycleState::Initialization => is_writable(row, state),
        _ => row.causality == Causality::Input || is_tunable(row),
    }
}

/// Whether a variable responds in a state (FMI 2.0, section 2.1.9).
fn is_unknown(row: &VariableRow, state: LifecycleState) -> bool {
    match state {
        LifecycleState::Initialization => row.is_initial_unknown(),
        _ => row.causality == Causality::Output,
    }
}
