//! Holds a normal distribution of parameters, such as what is known of them from elsewhere.

use nalgebra::DMatrix;

use crate::parameters::{COUNT, Theta};

/// A normal distribution of some parameters; of the others, whose rows and columns of the precision are 0, it says nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normal {
    /// Expected values.
    pub mean: Theta,
    /// Inverse of the covariance.
    pub precision: [Theta; COUNT],
}

impl Normal {
    /// Of independent parameters; infinite standard deviations where nothing is known.
    pub fn diagonal(mean: Theta, std: Theta) -> Self {
        let mut precision = [[0.0; COUNT]; COUNT];
        (0..COUNT).for_each(|i| precision[i][i] = std[i].powi(-2));
        Self { mean, precision }
    }

    /// Of the parameters at some places, with their covariance. `None` if that is not positive definite.
    pub fn new(places: &[usize], mean: Theta, covariance: &DMatrix<f64>) -> Option<Self> {
        // The scales of B and of a shift differ by four orders of magnitude.
        let scale: Vec<f64> = (0..places.len()).map(|k| covariance[(k, k)].sqrt()).collect();
        let correlation = DMatrix::from_fn(places.len(), places.len(), |k, l| {
            covariance[(k, l)] / (scale[k] * scale[l])
        });
        let inverse = correlation.cholesky()?.inverse();
        let mut precision = [[0.0; COUNT]; COUNT];
        for (k, &i) in places.iter().enumerate() {
            for (l, &j) in places.iter().enumerate() {
                precision[i][j] = inverse[(k, l)] / (scale[k] * scale[l]);
            }
        }
        let finite = precision.iter().flatten().chain(&mean).all(|number| number.is_finite());
        finite.then_some(Self { mean, precision })
    }

    /// (θ − mean)ᵀ precision (θ − mean), and half its gradient.
    pub fn distance(&self, theta: &Theta) -> (f64, Theta) {
        let away: Theta = std::array::from_fn(|i| theta[i] - self.mean[i]);
        let gradient = self.precision.map(|row| row.iter().zip(&away).map(|(p, d)| p * d).sum());
        (gradient.iter().zip(&away).map(|(g, d)| g * d).sum(), gradient)
    }
}
