//! Holds a normal distribution of parameters, such as what is known of them from elsewhere.

use nalgebra::DMatrix;

/// A normal distribution of some parameters; of the others, whose rows and columns of the precision are 0, it says nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normal<const N: usize> {
    /// Expected values.
    pub mean: [f64; N],
    /// Inverse of the covariance.
    pub precision: [[f64; N]; N],
}

impl<const N: usize> Normal<N> {
    /// Of independent parameters; infinite standard deviations where nothing is known.
    pub fn diagonal(mean: [f64; N], std: [f64; N]) -> Self {
        let mut precision = [[0.0; N]; N];
        (0..N).for_each(|i| precision[i][i] = std[i].powi(-2));
        Self { mean, precision }
    }

    /// Of the parameters at some places, with their covariance. `None` if that is not positive definite.
    pub fn from_covariance(places: &[usize], mean: [f64; N], covariance: &DMatrix<f64>) -> Option<Self> {
        // The scales of B and of a shift differ by four orders of magnitude.
        let scale: Vec<f64> = (0..places.len()).map(|k| covariance[(k, k)].sqrt()).collect();
        let correlation =
            DMatrix::from_fn(places.len(), places.len(), |k, l| covariance[(k, l)] / (scale[k] * scale[l]));
        let inverse = correlation.cholesky()?.inverse();
        let mut precision = [[0.0; N]; N];
        for (k, &i) in places.iter().enumerate() {
            for (l, &j) in places.iter().enumerate() {
                precision[i][j] = inverse[(k, l)] / (scale[k] * scale[l]);
            }
        }
        let finite = precision.iter().flatten().chain(&mean).all(|number| number.is_finite());
        finite.then_some(Self { mean, precision })
    }

    /// (θ − mean)ᵀ precision (θ − mean), and half its gradient.
    pub fn squared_mahalanobis_distance(&self, theta: &[f64; N]) -> (f64, [f64; N]) {
        let away: [f64; N] = std::array::from_fn(|i| theta[i] - self.mean[i]);
        let gradient = self.precision.map(|row| row.iter().zip(&away).map(|(p, d)| p * d).sum());
        (gradient.iter().zip(&away).map(|(g, d)| g * d).sum(), gradient)
    }
}
