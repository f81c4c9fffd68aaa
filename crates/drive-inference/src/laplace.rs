//! The Laplace approximation: a maximum of the likelihood with the second derivatives there, in a box.

use nalgebra::{Cholesky, DMatrix, DVector};
use numerics::sqp::{Objective, QuadraticModel};
use tire_inference::axles::Axle;
use tire_inference::parameters::TireParameters;

use crate::tires::{parameter_block, parameter_indices};

/// A normal distribution about a maximum of the likelihood, by the second derivatives of the cost.
pub struct LaplaceApproximation<'a> {
    /// The cost.
    pub objective: &'a dyn Objective,
    /// Where it is least.
    pub x: DVector<f64>,
    /// The least cost.
    pub cost: f64,
    /// Second derivatives there.
    pub information: DMatrix<f64>,
    /// The box.
    pub corners: [DVector<f64>; 2],
}

impl<'a> LaplaceApproximation<'a> {
    /// The same maximum with tires that scatter by this covariance.
    pub fn with_covariance(&self, covariance: &DMatrix<f64>) -> LaplaceApproximation<'a> {
        let (x, corners) = (self.x.clone(), self.corners.clone());
        LaplaceApproximation {
            objective: self.objective,
            x,
            cost: self.cost,
            information: inverse_hessian(covariance),
            corners,
        }
    }

    /// Covariance with the variance of a uniform distribution over the box as prior: finite where the data tell nothing.
    pub fn in_box(&self) -> DMatrix<f64> {
        let mut information = self.information.clone();
        for i in 0..information.nrows() {
            information[(i, i)] += 12.0 / (self.corners[1][i] - self.corners[0][i]).powi(2);
        }
        inverse_hessian(&information)
    }

    /// Which parameters stand on a bound.
    pub fn at_bound(&self, at: TireParameters<usize>) -> TireParameters<bool> {
        let [lower, upper] = &self.corners;
        at.into_array().map(|i| self.x[i] <= lower[i] || self.x[i] >= upper[i]).into()
    }

    /// The same maximum with K = B C D in place of B of an axle; the cost is given with that.
    pub fn with_stiffness<'b>(&self, objective: &'b dyn Objective, axle: Axle) -> LaplaceApproximation<'b> {
        let at = parameter_indices(axle);
        let with = |x: &DVector<f64>| {
            let mut x = x.clone();
            x[at.B] *= x[at.C] * x[at.D];
            x
        };
        let J = by_stiffness(&self.x, at);
        LaplaceApproximation {
            objective,
            x: with(&self.x),
            cost: self.cost,
            information: J.tr_mul(&self.information) * &J,
            corners: [with(&self.corners[0]), with(&self.corners[1])],
        }
    }

    /// Standard deviation of the stiffness of an axle, all else being somewhere in the box. Its digits would drown in the variances of
    /// B and C, which have no limit.
    pub fn stiffness_std(&self, axle: Axle) -> f64 {
        let index = parameter_indices(axle).B;
        self.with_stiffness(self.objective, axle).in_box()[(index, index)].max(0.0).sqrt()
    }
}

/// A cost with B of one axle replaced by K = B C D.
pub struct StiffnessCost<'a> {
    /// The cost with B.
    pub objective: &'a dyn Objective,
    /// The axle.
    pub axle: Axle,
}

impl StiffnessCost<'_> {
    fn replace_stiffness_by_B(&self, x: &DVector<f64>) -> DVector<f64> {
        let at = parameter_indices(self.axle);
        let mut original = x.clone();
        original[at.B] = x[at.B] / (x[at.C] * x[at.D]);
        original
    }
}

impl Objective for StiffnessCost<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let original = self.replace_stiffness_by_B(x);
        let mut model = self.objective.model(&original);
        let J = by_stiffness(&original, parameter_indices(self.axle));
        model.gradient = J.tr_mul(&model.gradient);
        model.hessian = J.tr_mul(&model.hessian) * &J;
        model
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.objective.cost(&self.replace_stiffness_by_B(x))
    }
}

/// Derivatives of the parameters with respect to those with K in place of B, at parameters with B.
fn by_stiffness(x: &DVector<f64>, at: TireParameters<usize>) -> DMatrix<f64> {
    let mut J = DMatrix::identity(x.len(), x.len());
    J[(at.B, at.B)] = 1.0 / (x[at.C] * x[at.D]);
    J[(at.B, at.C)] = -x[at.B] / x[at.C];
    J[(at.B, at.D)] = -x[at.B] / x[at.D];
    J
}

/// Inverse of second derivatives, scaled so that parameters that the data hardly move keep their digits; where there is no
/// inverse, nothing is known and the entries are infinite.
pub fn inverse_hessian(H: &DMatrix<f64>) -> DMatrix<f64> {
    let n = H.nrows();
    let width = H.diagonal().map(|h| if h > 0.0 { h.sqrt() } else { 1.0 });
    let scaled = DMatrix::from_fn(n, n, |i, j| H[(i, j)] / (width[i] * width[j]));
    match Cholesky::new(scaled) {
        Some(factor) => {
            let inverse = factor.inverse();
            DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (width[i] * width[j]))
        }
        None => DMatrix::from_element(n, n, f64::INFINITY),
    }
}

/// The part of a matrix that belongs to an axle.
pub fn axle_submatrix(matrix: &DMatrix<f64>, axle: Axle) -> DMatrix<f64> {
    let rows = parameter_block(axle);
    matrix.view((rows.start, rows.start), (rows.len(), rows.len())).into_owned()
}
