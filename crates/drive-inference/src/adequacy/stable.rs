//! Looks at unknowns over blocks of a drive: parts that were not fitted are predicted, halves agree, and intervals are as wide as
//! blocks scatter.

use nalgebra::{DMatrix, DVector};
use tire_inference::model::FitTest;

use crate::explored::inverse;
use crate::rows::{Expansion, Rows};
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
pub struct Scatter {
    /// By the curvature.
    pub curvature: DMatrix<f64>,
    /// By the blocks; no parameter is known better than by the curvature.
    pub blocks: DMatrix<f64>,
}

/// Scores and information of blocks about a minimum.
pub struct Blocks {
    scores: Vec<DVector<f64>>,
    halves: [Expansion; 2],
    /// What was known before any data.
    prior: DMatrix<f64>,
    covariance: DMatrix<f64>,
}

impl Blocks {
    /// Of all residuals, with the second derivatives of the minimum and the part of them that is not of the data.
    pub fn new(rows: &Rows, hessian: &DMatrix<f64>, prior: DMatrix<f64>) -> Self {
        let (len, middle) = (rows.len(), rows.len() / 2);
        Self {
            scores: rows.scores(),
            halves: [rows.part(0..middle), rows.part(middle..len)],
            prior,
            covariance: inverse(hessian),
        }
    }

    /// Covariance of the unknowns from the scatter of blocks: `H⁻¹ Σ g gᵀ H⁻¹` (Huber 1967), and what was known before.
    fn scattered(&self) -> DMatrix<f64> {
        let n = self.covariance.nrows();
        let mean =
            self.scores.iter().fold(DVector::zeros(n), |sum, g| sum + g) / self.scores.len() as f64;
        let scatter = self.scores.iter().fold(self.prior.clone(), |sum, g| {
            let off = g - &mean;
            sum + &off * off.transpose()
        });
        &self.covariance * scatter * &self.covariance
    }

    /// What intervals have to be widened to; nothing unless blocks that were not fitted are predicted badly.
    pub fn scatter(&self) -> Option<Scatter> {
        if self.held_out()?.passed() {
            return None;
        }
        let of_tires = |all: &DMatrix<f64>| all.view((0, 0), (SIZE, SIZE)).into_owned();
        let (curvature, mut blocks) = (of_tires(&self.covariance), of_tires(&self.scattered()));
        let grow =
            DVector::from_fn(SIZE, |i, _| (curvature[(i, i)] / blocks[(i, i)]).sqrt().max(1.0));
        for i in 0..SIZE {
            for j in 0..SIZE {
                blocks[(i, j)] *= grow[i] * grow[j];
            }
        }
        Some(Scatter { curvature, blocks })
    }

    /// The tests.
    pub fn tests(&self) -> Vec<FitTest> {
        self.held_out().into_iter().chain(self.agreement()).collect()
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
    fn agreement(&self) -> Option<FitTest> {
        let [first, second] = &self.halves;
        let own = |half: &Expansion| -> (DVector<f64>, DMatrix<f64>) {
            let covariance = inverse(&(&half.information + &self.prior));
            (-(&covariance * &half.gradient), covariance)
        };
        let [(first, P), (second, Q)] = [own(first), own(second)];
        let off = first - second;
        let n = off.len() as f64;
        let distance = off.dot(&(inverse(&(P + Q)) * &off));
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
