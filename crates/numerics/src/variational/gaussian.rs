//! A normal distribution of any covariance, and how well it matches a density.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use crate::variational::LogDensity;

/// x = mean + factor e, where e is standard normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// Its mean.
    pub mean: DVector<f64>,
    /// Lower triangle with a positive diagonal: the Cholesky factor of the covariance.
    pub factor: DMatrix<f64>,
}

impl Gaussian {
    /// The normal distribution with the density's height and curvature at a point, for a positive definite precision.
    pub fn laplace(mean: DVector<f64>, precision: DMatrix<f64>) -> Option<Self> {
        let factor = precision.cholesky()?.inverse().cholesky()?.l();
        Some(Self { mean, factor })
    }

    /// From a standard normal deviate.
    pub fn x_from_deviate(&self, e: &DVector<f64>) -> DVector<f64> {
        &self.mean + &self.factor * e
    }

    /// ln det of the factor.
    pub fn log_determinant(&self) -> f64 {
        self.factor.diagonal().iter().map(|width| width.ln()).sum()
    }

    /// −∫ q ln q.
    pub fn entropy(&self) -> f64 {
        self.log_determinant() + 0.5 * self.mean.len() as f64 * (1.0 + TAU.ln())
    }

    /// The evidence lower bound and what it wants changed, over points that stand for the standard normal distribution.
    pub fn compare_with_density(
        &self,
        density: &impl LogDensity,
        points: &DMatrix<f64>,
    ) -> DensityComparison {
        let dimension = self.mean.len();
        let count = points.ncols() as f64;
        let mut sum = DensityComparison {
            elbo: 0.0,
            slope: DVector::zeros(dimension),
            bend: DMatrix::zeros(dimension, dimension),
        };
        let deviates: Vec<DVector<f64>> = points.column_iter().map(|e| e.into_owned()).collect();
        let places: Vec<DVector<f64>> = deviates.iter().map(|e| self.x_from_deviate(e)).collect();
        for (e, (log, gradient)) in deviates.iter().zip(density.log_densities_and_gradients(&places)) {
            let whitened = self.factor.tr_mul(&gradient);
            sum.elbo += log;
            sum.bend.ger(1.0 / count, &whitened, e, 1.0);
            sum.slope += whitened / count;
        }
        sum.elbo = sum.elbo / count + self.entropy();
        // Stein's identity makes the matrix symmetric on average only. The lower triangle is what the factor can follow.
        sum.bend.fill_upper_triangle_with_lower_triangle();
        sum
    }
}

/// How a normal distribution and a density match, in coordinates where the former is standard normal.
#[derive(Clone, Debug)]
pub struct DensityComparison {
    /// Evidence lower bound [nat].
    pub elbo: f64,
    /// Mean of the gradient of the log-density: 0 at the optimum.
    pub slope: DVector<f64>,
    /// Mean of its Hessian: −1 at the optimum.
    pub bend: DMatrix<f64>,
}

impl DensityComparison {
    /// √(|slope|² + ½ |1 + bend|²): to first order how far the mean is off, in standard deviations, and by which share the
    /// covariance. Has no unit, whatever the coordinates.
    pub fn gradient_norm(&self) -> f64 {
        let identity = DMatrix::<f64>::identity(self.slope.len(), self.slope.len());
        (self.slope.norm_squared() + 0.5 * (&self.bend + identity).norm_squared()).sqrt()
    }
}
