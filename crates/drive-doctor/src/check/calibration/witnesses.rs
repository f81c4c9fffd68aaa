//! Asks each relation of the motion alone about the place and the clock of `v_y`: what only all of them together say can be the error
//! of something else.
//!
//! Likelihood is no witness of its own. Whatever is wrong with steering or with the model of a front axle bends both.

use numerics::text::significant;

use super::ErrorFit;
use super::log_errors::{LOG_ERRORS, unit};
use super::relation_sums::{NUISANCES, RelationSums};
use super::terms::Relation;
use crate::blocks::ONE_CONSTANT;

/// Standard deviations from 0 at which a relation alone tells an error, and between two that differ.
const TELLS: f64 = 2.5;
const DIFFER: f64 = 3.0;

/// What one relation says, with its standard deviation.
#[derive(Clone, Copy, Debug)]
struct Witness {
    relation: Relation,
    value: f64,
    std: f64,
}

impl Witness {
    fn of(measured: &RelationSums, found: &ErrorFit, place: usize) -> Option<Self> {
        let here = |cause: &&usize| measured.blocks.has(NUISANCES + **cause);
        let causes: Vec<usize> = found.causes.iter().filter(here).copied().collect();
        let index = causes.iter().position(|cause| *cause == found.causes[place])?;
        let own = measured.own.iter().copied();
        let columns: Vec<usize> = own.chain(causes.iter().map(|cause| NUISANCES + cause)).collect();
        let fit = measured.blocks.fit(&columns)?;
        let at = measured.own.len() + index;
        let value = fit.values[at] + found.taken[place];
        Some(Self { relation: measured.relation, value, std: fit.stds[at] })
    }

    fn tells(&self) -> bool {
        self.value.abs() > TELLS * self.std
    }

    /// Whether it is another value, beyond chance and beyond what counts as one.
    fn differs(&self, value: f64) -> bool {
        let apart = (self.value - value).abs();
        apart > DIFFER * self.std && apart > ONE_CONSTANT * value.abs()
    }

    fn words(&self, unit: &str) -> String {
        let of = match self.relation {
            Relation::RigidBody => "a_y and r alone",
            Relation::Rear => "the rear axle alone",
            Relation::Front => "the front axle alone",
        };
        let [low, high] = [-2.0, 2.0].map(|reach| significant(self.value + reach * self.std, 2));
        format!("{of} says {} {unit} [{low}, {high}]", significant(self.value, 2))
    }
}

/// Why an error of `v_y` may not be corrected: the rear axle, which no steering disturbs, does not tell it, no second relation does,
/// or one of them tells another value. `None` where they agree.
pub(super) fn contradiction(
    measured: &[RelationSums],
    found: &ErrorFit,
    place: usize,
) -> Option<String> {
    let value = found.fit.values[found.before + place];
    let unit = unit(LOG_ERRORS[found.causes[place]]);
    let all: Vec<Witness> =
        measured.iter().filter_map(|it| Witness::of(it, found, place)).collect();
    if let Some(other) = all.iter().find(|it| it.differs(value)) {
        return Some(format!("But {}", other.words(unit)));
    }
    let of = |relation| all.iter().find(|it| it.relation == relation && it.tells());
    let others = [Relation::RigidBody, Relation::Front].into_iter().filter_map(of).count();
    match (of(Relation::Rear), others) {
        (None, _) => Some("The rear axle alone does not tell it".to_owned()),
        (_, 0) => Some("Only the rear axle tells it".to_owned()),
        _ => None,
    }
}
