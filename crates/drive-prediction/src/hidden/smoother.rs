//! Looks back: the belief in every row given all measurements, by Rauch, Tung and Striebel.
#![allow(non_snake_case, reason = "symbols as in estimation")]

use super::filter::{Belief, Row, Square};

/// What the smoother needs of a row.
pub(super) struct Step {
    pub prior: Belief,
    pub belief: Belief,
    pub F: Square,
    /// Whether nothing before this row belongs to it.
    pub start: bool,
}

impl From<&Row> for Step {
    fn from(row: &Row) -> Self {
        let Row { prior, belief, F, start, slow, .. } = row;
        Self { prior: *prior, belief: *belief, F: *F, start: *start || *slow }
    }
}

/// Smoothed beliefs.
pub(super) fn smooth(steps: &[Step]) -> Vec<Belief> {
    let mut beliefs: Vec<Belief> = steps.iter().map(|step| step.belief).collect();
    for k in (0..steps.len().saturating_sub(1)).rev() {
        let next = &steps[k + 1];
        if next.start {
            continue;
        }
        let Some(inverse) = next.prior.P.cholesky().map(|it| it.inverse()) else { continue };
        let gain = beliefs[k].P * next.F.transpose() * inverse;
        let later = beliefs[k + 1];
        let belief = &mut beliefs[k];
        belief.x += gain * (later.x - next.prior.x);
        belief.P += gain * (later.P - next.prior.P) * gain.transpose();
        belief.P = (belief.P + belief.P.transpose()) * 0.5;
    }
    beliefs
}
