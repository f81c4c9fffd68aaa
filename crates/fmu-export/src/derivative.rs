//! Differentiates the output equations of a model: one evaluation with dual numbers per direction.

pub use elementary::Number;
use num_dual::Dual64;

use crate::variable::{Causality, OutputDependencies, VariableRow};

/// Output equations that are written once, for numbers with and without derivatives.
///
/// ```
/// use fmu_export::{Equations, Number};
///
/// struct Mass { m: f64, F: f64, a: f64 }
///
/// impl Equations<1, 1> for Mass {
///     const KNOWN: [&str; 1] = ["F"];
///     const UNKNOWN: [&str; 1] = ["a"];
///     fn equations<T: Number>(&self, [F]: [T; 1]) -> [T; 1] {
///         [F / self.m]
///     }
/// }
///
/// let mut mass = Mass { m: 2.0, F: 3.0, a: 0.0 };
/// [mass.a] = mass.equations([mass.F]);
/// assert_eq!(mass.a, 1.5);
/// ```
///
/// `const DERIVATIVES: Option<EquationDerivatives<Self>> = Some(EquationDerivatives::of());` in the [`Model`](crate::Model) gives their
/// derivatives to the environment.
pub trait Equations<const N: usize, const K: usize> {
    /// The names of the variables that the equations take: inputs, parameters.
    const KNOWN: [&'static str; N];
    /// The names of the variables that the equations give.
    const UNKNOWN: [&'static str; K];

    /// The unknown variables for the given values of the known ones, in the orders of their names.
    fn equations<T: Number>(&self, known: [T; N]) -> [T; K];
}

/// The derivatives of a model's [`Equations`].
#[derive(Debug)]
pub struct EquationDerivatives<M: 'static> {
    pub(crate) known: &'static [&'static str],
    pub(crate) unknown: &'static [&'static str],
    evaluate: fn(&M, &[Dual64]) -> Vec<Dual64>,
}

impl<M: 'static> EquationDerivatives<M> {
    /// Differentiates the equations of the model.
    #[must_use]
    pub const fn of<const N: usize, const K: usize>() -> Self
    where
        M: Equations<N, K>,
    {
        EquationDerivatives {
            known: const { &M::KNOWN },
            unknown: const { &M::UNKNOWN },
            evaluate: |model, known| model.equations(std::array::from_fn(|i| known[i])).to_vec(),
        }
    }

    /// The values of the unknowns and their changes, when the knowns have these values and changes; both
    /// in the orders of their names.
    ///
    /// # Panics
    /// When there are fewer values than knowns.
    #[must_use]
    pub fn directional_derivative(&self, model: &M, known: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let known: Vec<_> = known.iter().map(|(value, change)| Dual64::new(*value, *change)).collect();
        (self.evaluate)(model, &known).iter().map(|unknown| (unknown.re, unknown.eps)).collect()
    }
}

/// How the derivative of one variable with respect to another is found.
pub(crate) enum PartialDerivative {
    /// The equations give it; the index of the unknown in them.
    Equation(usize),
    /// It is zero, by the table.
    Zero,
    /// Neither the equations nor the table give it.
    Missing,
}

/// How to find the derivative of `unknown` with respect to `known`.
pub(crate) fn partial_derivative<M>(
    derivatives: &EquationDerivatives<M>,
    unknown: &VariableRow,
    known: &VariableRow,
) -> PartialDerivative {
    let index = derivatives.unknown.iter().position(|name| *name == unknown.name);
    match index {
        Some(index) if derivatives.known.contains(&known.name) => PartialDerivative::Equation(index),
        // What a table declares of inputs holds in every mode: a state does not jump with an input.
        _ if known.causality == Causality::Input
            && matches!(unknown.depends, OutputDependencies::On(inputs) if !inputs.contains(&known.name)) =>
        {
            PartialDerivative::Zero
        }
        _ => PartialDerivative::Missing,
    }
}
