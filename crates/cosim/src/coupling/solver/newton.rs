//! Newton's method, with derivatives that are corrected by what was seen (Broyden 1965).

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// After so many passes of a step, the derivatives are asked for again [-].
const STALE: u32 = 8;

/// The derivatives of what the loop gives by what it gets, and the last pass.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct BroydenNewton {
    /// By columns.
    derivatives: Option<Vec<Vec<f64>>>,
    /// Whether they lead nowhere.
    stale: bool,
    /// The change of the guess, and the residual before it.
    last: Option<(Vec<f64>, Vec<f64>)>,
    passes: u32,
}

impl BroydenNewton {
    pub fn begin_step(&mut self) {
        self.last = None;
        self.passes = 0;
    }

    /// Whether its derivatives are those of so many values.
    pub fn is_sized_for(&self, count: usize) -> bool {
        let square = |it: &Vec<Vec<f64>>| it.len() == count && it.iter().all(|it| it.len() == count);
        self.derivatives.as_ref().is_none_or(square)
    }

    pub fn needs_jacobian(&self) -> bool {
        self.stale || self.derivatives.is_none()
    }

    pub fn set_jacobian(&mut self, columns: &[Vec<f64>]) {
        let finite = columns.iter().flatten().all(|it| it.is_finite());
        // Without derivatives the first pass is one of a fixed point.
        let zeros = || vec![vec![0.0; columns.len()]; columns.len()];
        self.derivatives = Some(if finite { columns.to_vec() } else { zeros() });
        (self.last, self.stale) = (None, false);
    }

    /// How far the solution is, by the derivatives that it has; nothing without any. All is relative to the sizes of the values.
    pub fn predicted_change(&self, residual: Vec<f64>, scale: &dyn Fn(usize) -> f64) -> Vec<f64> {
        let (Some(columns), false) = (&self.derivatives, residual.iter().all(|it| *it == 0.0)) else {
            return Vec::new();
        };
        let count = residual.len();
        let matrix = residual_jacobian(columns, scale);
        let step = matrix.lu().solve(&DVector::from_vec(residual));
        step.map_or_else(|| vec![f64::INFINITY; count], |step| step.iter().copied().collect())
    }

    /// The change of the guess with this residual, both relative to the sizes of the values.
    pub fn guess_change(&mut self, residual: Vec<f64>, scale: &dyn Fn(usize) -> f64) -> Vec<f64> {
        let count = residual.len();
        self.passes += 1;
        let Some(columns) = &mut self.derivatives else { return residual };
        let mut matrix = residual_jacobian(columns, scale);
        let now = DVector::from_vec(residual);
        if let Some((moved, before)) = &self.last {
            let relative = |it: &Vec<f64>| DVector::from_fn(count, |row, _| it[row] / scale(row));
            let (moved, before) = (relative(moved), relative(before));
            let square = moved.norm_squared();
            let surprise = &now - before - &matrix * &moved;
            let correction = surprise * moved.transpose() / square;
            if correction.iter().all(|it| it.is_finite()) {
                matrix += &correction;
                for (column, values) in columns.iter_mut().enumerate() {
                    for (row, value) in values.iter_mut().enumerate() {
                        *value += correction[(row, column)] * scale(row) / scale(column);
                    }
                }
            }
        }
        let step = matrix.lu().solve(&-&now).filter(|step| step.iter().all(|it| it.is_finite()));
        if step.is_none() || self.passes.is_multiple_of(STALE) {
            self.stale = true;
        }
        let step = step.unwrap_or_else(|| now.clone());
        let absolute = |it: &DVector<f64>| (0..count).map(|row| it[row] * scale(row)).collect();
        self.last = Some((absolute(&step), absolute(&now)));
        step.iter().copied().collect()
    }
}

/// The derivative of the residual by the guess, in relative terms.
fn residual_jacobian(columns: &[Vec<f64>], scale: &dyn Fn(usize) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(columns.len(), columns.len(), |row, column| {
        let own = if row == column { 1.0 } else { 0.0 };
        columns[column][row] * scale(column) / scale(row) - own
    })
}
