//! Interpolates inputs during a step by their derivatives from the importer.

use serde::{Deserialize, Serialize};

use super::{Instance, InstanceSnapshot, find_variable, real_accessor};
use crate::error::{FmiResult, reject};
use crate::model::{Model, ModelError};
use crate::variable::{Causality, Variability, Variable, VariableKind};

/// Highest order of an input derivative. Extrapolation gains nothing from higher ones.
const HIGHEST_ORDER: i32 = 4;

/// A derivative of an input at the beginning of the next step.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct InputDerivative {
    pub reference: u32,
    order: i32,
    value: f64,
}

impl InputDerivative {
    /// Rejects a derivative that the model cannot follow.
    pub fn check_supported<M: Model>(&self) -> FmiResult {
        let InputDerivative { reference, order, value } = *self;
        let Variable { row, access } = find_variable::<M>(reference)?;
        let name = row.name;
        if row.causality != Causality::Input
            || row.variability != Variability::Continuous
            || access.kind() != VariableKind::Real
        {
            return reject(format!("{name} is no continuous input and has no derivative"));
        }
        if !(1..=HIGHEST_ORDER).contains(&order) {
            return reject(format!("expected an order of 1 .. {HIGHEST_ORDER} for {name}, found {order}"));
        }
        if !value.is_finite() {
            return reject(format!("the derivative {value} of {name} is not finite"));
        }
        Ok(())
    }
}

impl<M: Model> InstanceSnapshot<M> {
    /// Steps the model. With interpolated inputs it steps in sub-steps, each under the inputs of its
    /// middle: of the values that an input could be held at this one has an error of second order, and
    /// none for what integrates a ramp. The inputs stay at their values of the end.
    pub(super) fn advance(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        if self.slopes.is_empty() {
            return self.model.step(time, step);
        }
        // The slack keeps a ratio that is whole but for rounding from costing one sub-step more.
        let n = (step / M::INFO.substep - 1e-9).ceil().max(1.0);
        let start = self.interpolated_inputs();
        for i in 0..n as u64 {
            let at = step * (i as f64 / n);
            self.extrapolate_inputs(&start, at + 0.5 * step / n);
            self.model.step(time + at, step / n)?;
        }
        self.extrapolate_inputs(&start, step);
        Ok(())
    }

    /// The inputs with derivatives, and their values.
    fn interpolated_inputs(&mut self) -> Vec<(u32, f64)> {
        let mut inputs = Vec::new();
        for InputDerivative { reference, .. } in &self.slopes {
            if inputs.iter().all(|(other, _)| other != reference)
                && let Some(at) = real_accessor::<M>(*reference)
            {
                inputs.push((*reference, *at(&mut self.model)));
            }
        }
        inputs
    }

    /// Sets inputs to the sum of their Taylor series, `time` [s] after the beginning of the step.
    fn extrapolate_inputs(&mut self, start: &[(u32, f64)], time: f64) {
        for (input, start) in start {
            let Some(at) = real_accessor::<M>(*input) else { continue };
            let terms = self.slopes.iter().filter(|slope| slope.reference == *input);
            let change: f64 = terms
                .map(|slope| (1..=slope.order).fold(slope.value, |term, k| term * time / f64::from(k)))
                .sum();
            *at(&mut self.model) = start + change;
        }
    }
}

impl<M: Model> Instance<M> {
    /// Takes derivatives of inputs for the next step: all of them, or none.
    pub(super) fn store_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> FmiResult {
        let slopes = references
            .iter()
            .zip(orders)
            .zip(values)
            .map(|((&reference, &order), &value)| InputDerivative { reference, order, value });
        let slopes: Vec<_> = slopes.collect();
        slopes.iter().try_for_each(InputDerivative::check_supported::<M>)?;
        let kept = &mut self.current.slopes;
        for new in slopes {
            kept.retain(|slope| (slope.reference, slope.order) != (new.reference, new.order));
            kept.push(new);
        }
        Ok(())
    }
}
