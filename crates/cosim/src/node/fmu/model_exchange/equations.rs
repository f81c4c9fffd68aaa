//! Evaluates the differential equations of an FMU for the integrator.

use std::collections::HashMap;

use fmu_import::{CallError, EquationStructure, Instance, RealInputs};

use crate::extrapolation::ExtrapolationPolynomial;
use crate::ode::{OdeSystem, SparsityPattern};

/// Inputs that change within a step, by their polynomials.
#[derive(Debug, Default)]
pub(in crate::node::fmu) struct ChangingInputs {
    references: Vec<u32>,
    polynomials: Vec<ExtrapolationPolynomial>,
    values: Vec<f64>,
}

impl ChangingInputs {
    pub fn clear(&mut self) {
        self.references.clear();
        self.polynomials.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.references.is_empty()
    }

    pub fn push(&mut self, reference: u32, polynomial: ExtrapolationPolynomial) {
        self.references.push(reference);
        self.polynomials.push(polynomial);
    }

    /// The inputs at a time [s].
    pub fn values_at(&mut self, time: f64) -> RealInputs<'_> {
        self.values.clear();
        self.values.extend(self.polynomials.iter().map(|polynomial| polynomial.value_at(time)));
        RealInputs { references: &self.references, values: &self.values }
    }
}

/// The entries of the Jacobian that the description allows to differ from 0.
pub(super) fn sparsity_pattern(equations: &EquationStructure) -> SparsityPattern {
    let states = &equations.states;
    let places = states.iter().zip(0..).map(|(state, place)| Some((state.reference?, place)));
    let Some(places) = places.collect::<Option<HashMap<u32, usize>>>() else {
        return SparsityPattern::dense(states.len());
    };
    let dependencies = states.iter().map(|state| match &state.dependencies {
        Some(references) => references.iter().filter_map(|it| places.get(it).copied()).collect(),
        None => (0..states.len()).collect(),
    });
    SparsityPattern::from_dependencies(&dependencies.collect::<Vec<_>>())
}

/// The equations `dx/dt = f(t, x)` of an FMU in continuous-time mode.
pub(super) struct FmuEquations<'a> {
    instance: &'a mut Instance,
    inputs: &'a mut ChangingInputs,
    by_differences: &'a mut bool,
    /// The value references of the derivatives.
    unknowns: Vec<u32>,
    /// Why f has no value where it was evaluated last.
    refusal: Option<CallError>,
}

impl<'a> FmuEquations<'a> {
    pub fn new(
        instance: &'a mut Instance,
        inputs: &'a mut ChangingInputs,
        by_differences: &'a mut bool,
    ) -> Self {
        FmuEquations { instance, inputs, by_differences, unknowns: Vec::new(), refusal: None }
    }

    /// Why f had no value where it was evaluated last without one.
    pub fn take_refusal(self) -> Option<CallError> {
        self.refusal
    }
}

impl OdeSystem for FmuEquations<'_> {
    type Error = CallError;

    fn evaluate_derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<bool, CallError> {
        let inputs = self.inputs.values_at(time);
        let evaluated = self.instance.batch_step_calls(|calls| {
            calls.set_point(time, inputs, states)?;
            calls.get_derivatives(derivatives)
        });
        match evaluated {
            Err(error) if error.discarded => self.refusal = Some(error),
            Err(error) => return Err(error),
            Ok(()) => {
                let wrong = derivatives.iter().position(|it| !it.is_finite());
                let Some(wrong) = wrong else { return Ok(true) };
                let about = self.instance.description();
                let call = about.version.function("fmi2GetDerivatives", "fmi3GetContinuousStateDerivatives");
                let state = &about.equations.states[wrong];
                let what = format!(
                    "gave {} for `{}`, the derivative of `{}` = {}, at {time} s",
                    derivatives[wrong], state.derivative, state.name, states[wrong]
                );
                self.refusal = Some(CallError::new(call, what));
            }
        }
        Ok(false)
    }

    fn directional_derivative(&mut self, group: &[usize], slopes: &mut [f64]) -> Result<bool, CallError> {
        if *self.by_differences {
            return Ok(false);
        }
        let states = &self.instance.description().equations.states;
        if self.unknowns.is_empty() {
            self.unknowns.extend(states.iter().filter_map(|it| it.derivative_reference));
        }
        let knowns = group.iter().map(|state| states[*state].reference).collect::<Option<Vec<_>>>();
        let Some(knowns) = knowns else { return Ok(false) };
        let seed = vec![1.0; knowns.len()];
        let asked = self.instance.directional_derivatives(&knowns, &seed, &self.unknowns, slopes);
        match asked {
            Err(error) if self.instance.has_failed_fatally() => Err(error),
            Ok(()) if slopes.iter().all(|it| it.is_finite()) => Ok(true),
            // What an FMU refuses one time it refuses each time.
            _ => {
                *self.by_differences = true;
                Ok(false)
            }
        }
    }
}
