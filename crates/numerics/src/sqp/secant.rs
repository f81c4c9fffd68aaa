//! Estimates the part of the second derivatives that Gauss and Newton leave out, from how gradients change.
//!
//! The update is that of Dennis, Gay and Welsch (An Adaptive Nonlinear Least-Squares Algorithm, 1981), with their sizing. Of
//! the two models, with this part and without, the one that foretold the last gradient better is used.

use nalgebra::{DMatrix, DVector};

/// What is known of the missing second derivatives.
pub struct SecantHessian {
    missing: DMatrix<f64>,
    trusted: bool,
}

impl SecantHessian {
    /// Nothing known of n unknowns.
    pub fn new(n: usize) -> Self {
        Self { missing: DMatrix::zeros(n, n), trusted: false }
    }

    /// The estimate, while it is trusted.
    pub fn trusted_estimate(&self) -> Option<&DMatrix<f64>> {
        self.trusted.then_some(&self.missing)
    }

    /// Learns from a step from one point to the next: the change of the gradient of the Lagrangian, the Hessians at both ends,
    /// and the unit of each unknown.
    pub fn update(
        &mut self,
        step: &DVector<f64>,
        change: &DVector<f64>,
        before: &DMatrix<f64>,
        after: &DMatrix<f64>,
        width: &DVector<f64>,
    ) {
        let error = |hessian: &DMatrix<f64>| (change - hessian * step).component_div(width).norm();
        self.trusted = error(&(before + &self.missing)) < error(before);
        let along = change.dot(step);
        let rest = change - after * step;
        let curved = step.dot(&(&self.missing * step));
        if curved != 0.0 {
            self.missing *= (step.dot(&rest) / curved).abs().min(1.0);
        }
        // Without curvature along the step the update would be arbitrarily large.
        if along > 1e-8 * step.dot(&(after * step)).abs() {
            let open = rest - &self.missing * step;
            let cross = &open * change.transpose() / along;
            let correction = change * change.transpose() * (step.dot(&open) / (along * along));
            self.missing += &cross + cross.transpose() - correction;
        }
    }
}
