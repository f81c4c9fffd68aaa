//! Fits a normal distribution with full covariance to a density by maximising the evidence lower bound.

pub mod adam;
pub mod assessment;
pub mod gaussian;
pub mod newton;

use nalgebra::DVector;

/// A density on all of space, and its logarithm's gradient. Constants may be left out.
pub trait LogDensity {
    /// How many coordinates there are.
    fn dimension(&self) -> usize;

    /// Logarithm and gradient at a point.
    fn log_density_and_gradient(&self, x: &DVector<f64>) -> (f64, DVector<f64>);

    /// The logarithm alone at several points.
    fn log_densities(&self, points: &[DVector<f64>]) -> Vec<f64> {
        points.iter().map(|x| self.log_density_and_gradient(x).0).collect()
    }

    /// Logarithms and gradients at several points.
    fn log_densities_and_gradients(&self, points: &[DVector<f64>]) -> Vec<(f64, DVector<f64>)> {
        points.iter().map(|x| self.log_density_and_gradient(x)).collect()
    }
}
