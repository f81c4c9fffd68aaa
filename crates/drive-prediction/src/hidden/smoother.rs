//! The smoother of Rauch, Tung and Striebel over the rows of the filter: the estimate in every row given all measurements.
#![allow(non_snake_case, reason = "symbols as in estimation")]

use kalman::{Gaussian, smooth_step};

use super::car::STATES;
use super::filter::{FilterRow, StateMatrix};

/// What the smoother needs of a row.
pub(super) struct SmootherStep {
    prior: Gaussian<STATES>,
    posterior: Gaussian<STATES>,
    F: StateMatrix,
    /// Whether nothing before this row belongs to it.
    start: bool,
}

impl From<&FilterRow> for SmootherStep {
    fn from(row: &FilterRow) -> Self {
        let FilterRow { prior, posterior, F, start, slow, .. } = row;
        let (prior, posterior) = (prior.into(), posterior.into());
        Self { prior, posterior, F: *F, start: *start || *slow }
    }
}

/// Smoothed estimates; one before a prediction that is singular stays as it was filtered.
pub(super) fn rts_smooth(steps: &[SmootherStep]) -> Vec<Gaussian<STATES>> {
    let mut smoothed: Vec<_> = steps.iter().map(|step| step.posterior).collect();
    for k in (0..steps.len().saturating_sub(1)).rev() {
        let next = &steps[k + 1];
        if next.start {
            continue;
        }
        let state = smooth_step(&smoothed[k], &next.F, &next.prior, &smoothed[k + 1]);
        smoothed[k] = state.unwrap_or(smoothed[k]);
    }
    smoothed
}
