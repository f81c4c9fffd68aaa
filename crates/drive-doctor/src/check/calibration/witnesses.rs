//! Asks each relation of the motion alone about the place and the clock of `v_y`: what only all of them together say can be the error
//! of something else.
//!
//! Likelihood is no witness of its own. Whatever is wrong with steering or with the model of a front axle bends both.

use numerics::text::format_significant;

use super::ErrorFit;
use super::log_errors::{LOG_ERRORS, error_unit};
use super::relation_sums::{NUISANCES, RelationNormalEquations};
use super::terms::MotionRelation;
use crate::blocks::ONE_CONSTANT;

/// Standard deviations from 0 at which a relation alone tells an error, and between two that differ.
const TELLS: f64 = 2.5;
const DIFFER: f64 = 3.0;

/// What one relation says, with its standard deviation.
#[derive(Clone, Copy, Debug)]
struct RelationEstimate {
    relation: MotionRelation,
    value: f64,
    std: f64,
}

impl RelationEstimate {
    /// What the relation says while all errors of the log may be there that are `wanted`.
    fn from_relation(
        measured: &RelationNormalEquations,
        found: &ErrorFit,
        place: usize,
        wanted: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let here = |cause: &&usize| wanted(**cause) && measured.blocks.has_column(NUISANCES + **cause);
        let causes: Vec<usize> = found.causes.iter().filter(here).copied().collect();
        let index = causes.iter().position(|cause| *cause == found.causes[place])?;
        let own = measured.own.iter().copied();
        let columns: Vec<usize> = own.chain(causes.iter().map(|cause| NUISANCES + cause)).collect();
        let fit = measured.blocks.fit_columns(&columns)?;
        let at = measured.own.len() + index;
        let value = fit.values[at] + found.taken[place];
        Some(Self { relation: measured.relation, value, std: fit.stds[at] })
    }

    fn is_significant(&self) -> bool {
        self.value.abs() > TELLS * self.std
    }

    /// Whether it is another value, beyond chance and beyond what counts as one.
    fn is_different_from(&self, value: f64) -> bool {
        let apart = (self.value - value).abs();
        apart > DIFFER * self.std && apart > ONE_CONSTANT * value.abs()
    }

    fn describe_estimate(&self, unit: &str) -> String {
        let of = match self.relation {
            MotionRelation::RigidBody => "a_y and r alone",
            MotionRelation::Rear => "the rear axle alone",
            MotionRelation::Front => "the front axle alone",
        };
        let [low, high] = [-2.0, 2.0].map(|reach| format_significant(self.value + reach * self.std, 2));
        format!("{of} says {} {unit} [{low}, {high}]", format_significant(self.value, 2))
    }
}

/// Why an error of `v_y` may not be corrected: the rear axle, which no steering disturbs, does not tell it, no second relation does,
/// or one of them tells another value. `None` where they agree.
pub(super) fn relation_contradiction(
    measured: &[RelationNormalEquations],
    found: &ErrorFit,
    place: usize,
) -> Option<String> {
    let value = found.fit.values[found.before + place];
    let unit = error_unit(LOG_ERRORS[found.causes[place]]);
    let all: Vec<RelationEstimate> = measured
        .iter()
        .filter_map(|it| RelationEstimate::from_relation(it, found, place, |_| true))
        .collect();
    if let Some(other) = all.iter().find(|it| it.is_different_from(value)) {
        return Some(format!("But {}", other.describe_estimate(unit)));
    }
    let of = |relation| all.iter().find(|it| it.relation == relation && it.is_significant());
    let others = [MotionRelation::RigidBody, MotionRelation::Front].into_iter().filter_map(of).count();
    match (of(MotionRelation::Rear), others) {
        (None, _) => Some("The rear axle alone does not tell it".to_owned()),
        (_, 0) => Some("Only the rear axle tells it".to_owned()),
        _ => None,
    }
}

/// Why an error of `a_y` or `r` may not be corrected: the motion of a rigid body, which needs no tires, tells another value or none,
/// with this error alone and with all that were found. `None` where it tells the same.
pub(super) fn kinematic_contradiction(
    measured: &[RelationNormalEquations],
    found: &ErrorFit,
    place: usize,
) -> Option<String> {
    let value = found.fit.values[found.before + place];
    let unit = error_unit(LOG_ERRORS[found.causes[place]]);
    let body = measured.iter().find(|it| it.relation == MotionRelation::RigidBody)?;
    let own = found.causes[place];
    let alone = RelationEstimate::from_relation(body, found, place, |cause| cause == own);
    let together = RelationEstimate::from_relation(body, found, place, |_| true);
    let agrees = |it: &RelationEstimate| it.is_significant() && !it.is_different_from(value);
    match alone.iter().chain(&together).any(agrees) {
        true => None,
        false => Some(match alone {
            Some(alone) => format!("But {}", alone.describe_estimate(unit)),
            None => "The motion of a rigid body does not tell it".to_owned(),
        }),
    }
}
