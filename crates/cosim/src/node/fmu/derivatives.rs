//! Gives an FMU derivatives of its inputs over time, and asks it for directional derivatives of its outputs.

use std::ops::Range;

use fmu_import::{CallError, Causality, Instance, StorageType, Variability};

use super::FmuNode;
use crate::node::{DirectionalDerivatives, ExtrapolatedInputs, InputPolynomial};
use crate::system::{VariableGroup, VariableGroups};

/// The real numbers of an FMU by their places among the numbers that travel.
#[derive(Debug, Default)]
pub(super) struct RealVariables {
    /// The references of continuous inputs; none for other inputs.
    inputs: Vec<Option<u32>>,
    /// The same of outputs.
    outputs: Vec<Option<u32>>,
    known: DerivativeBuffer,
    unknown: DerivativeBuffer,
}

/// Variables and their derivatives, with memory from one question to the next.
#[derive(Debug, Default)]
struct DerivativeBuffer {
    references: Vec<u32>,
    values: Vec<f64>,
}

impl RealVariables {
    pub fn new(instance: &Instance, inputs: &VariableGroups, outputs: &VariableGroups) -> Self {
        let inputs = continuous_real_references(instance, &inputs.numbers, Causality::Input);
        let outputs = continuous_real_references(instance, &outputs.numbers, Causality::Output);
        RealVariables { inputs, outputs, ..RealVariables::default() }
    }
}

/// The references of real numbers that are no arrays and change continuously.
fn continuous_real_references(
    instance: &Instance,
    groups: &[VariableGroup],
    causality: Causality,
) -> Vec<Option<u32>> {
    let variables = &instance.description().variables;
    let is_continuous = |reference: u32| {
        let mut own = variables.iter().filter(|variable| variable.reference == reference);
        own.any(|it| it.causality == causality && it.variability == Variability::Continuous)
    };
    let of = |group: &VariableGroup| -> Vec<_> {
        let scalars = group.references.len() == group.elements && group.is_fully_transferred();
        let real = scalars && group.storage == StorageType::Float64;
        match real {
            true => group.references.iter().map(|it| is_continuous(*it).then_some(*it)).collect(),
            false => vec![None; group.places.len()],
        }
    };
    groups.iter().flat_map(of).collect()
}

impl FmuNode {
    /// Whether inputs may change within a step: those of co-simulation of FMI 2.0 by their derivatives, those of model exchange as they are.
    pub(in crate::node) fn can_set_input_derivatives(&self) -> bool {
        self.instance.description().interpolated_inputs
    }
}

impl ExtrapolatedInputs for FmuNode {
    /// Gives the FMU its inputs at the start of the step, and the derivatives that they have there; in model exchange it gets the inputs of
    /// each time.
    fn set_extrapolated_inputs(
        &mut self,
        inputs: &mut [f64],
        polynomials: &[InputPolynomial],
        span: Range<f64>,
    ) -> Result<(), CallError> {
        for InputPolynomial { place, polynomial } in polynomials {
            inputs[*place] = polynomial.value_at(span.start);
        }
        self.set_numbers(inputs)?;
        if let Some(model) = &mut self.model_exchange {
            model.inputs().clear();
        }
        for InputPolynomial { place, polynomial } in polynomials {
            let reference = self.real_variables.inputs.get(*place).copied().flatten();
            let Some(reference) = reference else { continue };
            if let Some(model) = &mut self.model_exchange {
                model.inputs().push(reference, *polynomial);
                continue;
            }
            let derivatives = polynomial.derivatives(span.start);
            let count = polynomial.degree().max(1);
            for (order, derivative) in (1..).zip(derivatives).take(count) {
                self.instance.set_input_derivative(reference, order, derivative)?;
            }
        }
        Ok(())
    }
}

impl DirectionalDerivatives for FmuNode {
    fn directional_derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        let FmuNode { instance, real_variables, .. } = self;
        if !instance.description().directional_derivative {
            return Ok(false);
        }
        let RealVariables { inputs, outputs: own, known, unknown } = real_variables;
        outputs.fill(0.0);
        known.references.clear();
        known.values.clear();
        for (reference, change) in inputs.iter().zip(changes).filter(|(_, it)| **it != 0.0) {
            // What changes in jumps has no derivative.
            let Some(reference) = reference else { return Ok(false) };
            known.references.push(*reference);
            known.values.push(*change);
        }
        unknown.references.clear();
        unknown.references.extend(own.iter().flatten());
        unknown.values.clear();
        unknown.values.resize(unknown.references.len(), 0.0);
        if known.references.is_empty() || unknown.references.is_empty() {
            return Ok(true);
        }
        let asked = instance.directional_derivatives(
            &known.references,
            &known.values,
            &unknown.references,
            &mut unknown.values,
        );
        if let Err(error) = asked {
            return if instance.has_failed_fatally() { Err(error) } else { Ok(false) };
        }
        let places = own.iter().enumerate().filter(|(_, reference)| reference.is_some());
        places.zip(&unknown.values).for_each(|((place, _), value)| outputs[place] = *value);
        Ok(true)
    }
}
