//! Anderson's method: the next guess is the combination of the last ones whose residual is smallest.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Passes that are combined [-].
const DEPTH: usize = 5;
/// Singular values below this share of the largest one are noise [-].
const NOISE: f64 = 1e-12;

/// The last changes of guess and residual, both relative to the sizes of the values (Walker and Ni 2011, type II).
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct AndersonAcceleration {
    changes: VecDeque<(Vec<f64>, Vec<f64>)>,
    last: Option<(Vec<f64>, Vec<f64>)>,
}

impl AndersonAcceleration {
    pub fn begin_step(&mut self) {
        self.changes.clear();
        self.last = None;
    }

    /// The change of the guess with this residual.
    pub fn guess_change(&mut self, residual: Vec<f64>) -> Vec<f64> {
        if let Some((step, before)) = self.last.take() {
            let change = residual.iter().zip(&before).map(|(now, before)| now - before).collect();
            self.changes.push_back((step, change));
            if self.changes.len() > DEPTH.min(residual.len()) {
                self.changes.pop_front();
            }
        }
        let mut step = residual.clone();
        if let Some(weights) = self.least_squares_weights(&residual) {
            for ((moved, changed), weight) in self.changes.iter().zip(&weights) {
                for (place, it) in step.iter_mut().enumerate() {
                    *it -= weight * (moved[place] + changed[place]);
                }
            }
        }
        self.last = Some((step.clone(), residual));
        step
    }

    /// The weights of the changes that leave the smallest residual.
    fn least_squares_weights(&self, residual: &[f64]) -> Option<Vec<f64>> {
        if self.changes.is_empty() {
            return None;
        }
        let columns = self.changes.iter().map(|(_, change)| DVector::from_column_slice(change));
        let matrix = DMatrix::from_columns(&columns.collect::<Vec<_>>());
        let finite = matrix.iter().chain(residual).all(|it| it.is_finite());
        let svd = finite.then(|| matrix.svd(true, true))?;
        let noise = NOISE * svd.singular_values.max();
        let weights = svd.solve(&DVector::from_column_slice(residual), noise).ok()?;
        Some(weights.iter().copied().collect())
    }
}
