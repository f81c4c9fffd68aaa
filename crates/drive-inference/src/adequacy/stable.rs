//! Looks at unknowns over blocks of a drive: parts that were not fitted are predicted, halves agree, and intervals are as wide as
//! blocks scatter.
#![allow(non_snake_case, reason = "symbols as in the literature")]

use nalgebra::{Cholesky, DMatrix, DVector};
use numerics::sqp::{QuadraticModel, SqpMinimum};
use tire_inference::model::FitTest;

use crate::joint_posterior::JointPosterior;
use crate::laplace::inverse_hessian;
use crate::residual_rows::{CostExpansion, ResidualRows};
use crate::tires::SIZE;

/// Name of the test by blocks that were not fitted; where it fails, intervals are as wide as blocks scatter.
pub const HOLD_OUT: &str = "hold-out";
/// Fewest blocks that tell anything.
const FEWEST: usize = 8;
/// Cost of a block that was not fitted, over what is expected if the model is right.
const HELD_OUT: f64 = 1.8;
/// A normal distribution reaches this once in 30,000 times.
const SURE: f64 = 4.0;

/// Covariance of the tires as the curvature of the likelihood has it, and as blocks of the drives scatter.
#[derive(Clone, Debug, PartialEq)]
pub struct ScatterCovariances {
    /// By the curvature.
    pub curvature: DMatrix<f64>,
    /// By the blocks; no combination of parameters is known better than by the curvature.
    pub blocks: DMatrix<f64>,
}

/// Length of the parts over which unknowns scatter [s]: longer than what a road, a driver or the heat of a tire does to them stays
/// the same; and fewest of them.
const PART: f64 = 8.0;
const FEWEST_PARTS: usize = 8;

/// The smallest covariance that is at least both in every direction: in coordinates in which the first is one, no eigenvalue of the
/// second is less. `None` where the first is none.
fn enclosing_covariance(first: &DMatrix<f64>, second: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let L = Cholesky::new(first.clone())?.l();
    let white = L.clone().try_inverse()?;
    let eigen = (&white * second * white.transpose()).symmetric_eigen();
    let axes = L * eigen.eigenvectors;
    let variances = DMatrix::from_diagonal(&eigen.eigenvalues.map(|it| it.max(1.0)));
    Some(&axes * variances * axes.transpose())
}

/// Scores and information of blocks about a minimum.
pub struct BlockScores {
    scores: Vec<DVector<f64>>,
    halves: [CostExpansion; 2],
    /// Longer than blocks.
    parts: Vec<CostExpansion>,
    /// What was known before any data.
    prior: DMatrix<f64>,
    hessian: DMatrix<f64>,
    covariance: DMatrix<f64>,
}

impl BlockScores {
    /// Those of the drives about a minimum in a box; `step` is that of the rows [s].
    pub fn at_minimum(
        joint: &JointPosterior,
        minimum: &SqpMinimum,
        corners: &[DVector<f64>; 2],
        step: f64,
    ) -> Self {
        let directions = joint.variable_directions();
        let n = directions.len();
        let (gradient, hessian) = (DVector::zeros(n), DMatrix::zeros(n, n));
        let mut prior = QuadraticModel { cost: 0.0, gradient, hessian, scale: 1.0 };
        let x = minimum.x.rows(0, n).into_owned();
        joint.add_prior(&x, &mut prior);
        let rows = joint.likelihood.residual_rows(&joint.unknowns_at(&x), &directions);
        let mut hessian = minimum.model.hessian.view((0, 0), (n, n)).into_owned();
        for i in 0..SIZE {
            // Of a uniform distribution in the box: finite where the data tell nothing.
            let within = 12.0 / (corners[1][i] - corners[0][i]).powi(2);
            prior.hessian[(i, i)] += within;
            hessian[(i, i)] += within;
        }
        Self::new(&rows, hessian, prior.hessian, step)
    }

    /// Of all residuals, with the second derivatives of the minimum and the part of them that is not of the data.
    /// `step` is that of the rows [s].
    fn new(rows: &ResidualRows, hessian: DMatrix<f64>, prior: DMatrix<f64>, step: f64) -> Self {
        let (len, middle) = (rows.len(), rows.len() / 2);
        let count = ((len as f64 * step / PART) as usize).max(FEWEST_PARTS);
        let part = |k: usize| rows.partial_expansion(k * len / count..(k + 1) * len / count);
        Self {
            scores: rows.block_scores(),
            halves: [rows.partial_expansion(0..middle), rows.partial_expansion(middle..len)],
            parts: (0..count).map(part).collect(),
            prior,
            covariance: inverse_hessian(&hessian),
            hessian,
        }
    }

    /// Covariance of the unknowns from the scatter of parts, and what was known before: the jackknife that leaves out one part after
    /// the other (Tukey 1958), each by a step of Newton's method. A sum of squared scores would be too small by the share that each
    /// part has in the fit, which is large where a dozen unknowns come from a dozen parts.
    fn jackknife_covariance(&self) -> DMatrix<f64> {
        let count = self.parts.len() as f64;
        let without = |part: &CostExpansion| {
            let moved = inverse_hessian(&(&self.hessian - &part.information)) * &part.gradient;
            // Where the other parts tell nothing.
            let is_told = moved.iter().all(|it| it.is_finite());
            if is_told { moved } else { &self.covariance * &part.gradient }
        };
        let moved: Vec<DVector<f64>> = self.parts.iter().map(without).collect();
        let n = self.covariance.nrows();
        let mean = moved.iter().fold(DVector::zeros(n), |sum, it| sum + it) / count;
        let known = &self.covariance * &self.prior * &self.covariance;
        // The variance of few is uncertain itself: that of Student's distribution.
        let factor = (count - 1.0) / count * (count - 1.0) / (count - 3.0);
        moved.iter().fold(known, |sum, it| {
            let off = it - &mean;
            sum + &off * off.transpose() * factor
        })
    }

    /// Covariance of all unknowns by the curvature, or by the scatter of parts where that is wider.
    pub fn widest_covariance(&self) -> DMatrix<f64> {
        enclosing_covariance(&self.covariance, &self.jackknife_covariance())
            .unwrap_or_else(|| self.covariance.clone())
    }

    /// What intervals have to be widened to; nothing unless blocks that were not fitted are predicted badly.
    pub fn scatter_covariances(&self) -> Option<ScatterCovariances> {
        if self.held_out()?.has_passed() {
            return None;
        }
        let of_tires = |all: &DMatrix<f64>| all.view((0, 0), (SIZE, SIZE)).into_owned();
        let (curvature, blocks) = (of_tires(&self.covariance), of_tires(&self.jackknife_covariance()));
        let blocks = enclosing_covariance(&curvature, &blocks)?;
        Some(ScatterCovariances { curvature, blocks })
    }

    /// The tests.
    pub fn stability_tests(&self) -> Vec<FitTest> {
        self.held_out().into_iter().chain(self.halves_agreement_test()).collect()
    }

    /// A block that is left out costs more by `gᵀ H⁻¹ g` than one that was fitted; its mean is the number of unknowns.
    fn held_out(&self) -> Option<FitTest> {
        if self.scores.len() < FEWEST {
            return None;
        }
        let n = self.covariance.nrows() as f64;
        let excess: f64 = self.scores.iter().map(|g| g.dot(&(&self.covariance * g))).sum();
        let statistic = excess / n;
        Some(FitTest {
            name: HOLD_OUT.to_owned(),
            statistic,
            limit: HELD_OUT,
            sentence: format!(
                "Parts of the drives that are left out of the fit are predicted with {statistic:.1} times the expected loss."
            ),
        })
    }

    /// Both halves of the drives, each with its own unknowns: the distance of these, in a χ² distribution's limit.
    fn halves_agreement_test(&self) -> Option<FitTest> {
        let [first, second] = &self.halves;
        let own = |half: &CostExpansion| -> (DVector<f64>, DMatrix<f64>) {
            let covariance = inverse_hessian(&(&half.information + &self.prior));
            (-(&covariance * &half.gradient), covariance)
        };
        let [(first, P), (second, Q)] = [own(first), own(second)];
        let off = first - second;
        let n = off.len() as f64;
        let distance = off.dot(&(inverse_hessian(&(P + Q)) * &off));
        // Wilson and Hilferty 1931.
        let limit = n * (1.0 - 2.0 / (9.0 * n) + SURE * (2.0 / (9.0 * n)).sqrt()).powi(3);
        (self.scores.len() >= FEWEST).then(|| FitTest {
            name: "halves".to_owned(),
            statistic: distance,
            limit: 2.0 * limit,
            sentence: format!(
                "The two halves of the drives do not agree on tires and sensors (χ² {distance:.0} of {n} unknowns)."
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_larger_of_two_covariances_keeps_what_is_known_along_a_ridge() {
        // The sum is known to 0.01, the difference to 1.
        let ridge =
            |wide: f64| DMatrix::from_row_slice(2, 2, &[wide + 1e-4, 1e-4 - wide, 1e-4 - wide, wide + 1e-4]);
        let both = enclosing_covariance(&ridge(1.0), &ridge(9.0)).expect("covariances");
        assert_relative_eq!(both, ridge(9.0), max_relative = 1e-9);
        let both = enclosing_covariance(&ridge(9.0), &ridge(1.0)).expect("covariances");
        assert_relative_eq!(both, ridge(9.0), max_relative = 1e-9);
        assert!(enclosing_covariance(&DMatrix::zeros(2, 2), &ridge(1.0)).is_none());
    }
}
