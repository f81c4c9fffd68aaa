//! Asks whether tires or clocks explain what looks like an error of a sensor: relaxation, downforce, curves that bend more, delays.

use numerics::text::format_significant;

use super::log_errors::{DELAYS, LOG_ERRORS, RELAXATION, STEERING_GAIN, error_unit, smallest_relevant_error};
use super::relation_sums::{NUISANCES, RelationNormalEquations};
use super::{ErrorFit, MeasuredRelations, variance_weighted_equations};
use crate::blocks::ONE_CONSTANT;

/// Standard deviations by which an error must differ from 0 beside a rival, and by which it counts as another than without it.
const SURE: f64 = 3.0;

/// The error beside a rival, with its standard deviation. `None` where the log does not tell them apart.
fn estimate_beside_rival(
    measured: &[RelationNormalEquations],
    found: &ErrorFit,
    place: usize,
    rival: &RivalModel,
) -> Option<[f64; 2]> {
    let own = measured.iter().flat_map(|it| it.own.iter().copied());
    let shape = measured.iter().filter(|_| rival.bends).flat_map(|it| it.rivals.iter().copied());
    let before: Vec<usize> = own.chain(shape).collect();
    let is_there = |cause: usize| measured.iter().any(|it| it.blocks.has_column(NUISANCES + cause));
    let added = rival.causes.iter().filter(|cause| !found.causes.contains(cause) && is_there(**cause));
    let mut causes: Vec<usize> = found.causes.iter().chain(added).copied().collect();
    let fit_of = |causes: &[usize]| {
        let columns: Vec<usize> =
            before.iter().copied().chain(causes.iter().map(|cause| NUISANCES + cause)).collect();
        variance_weighted_equations(measured, &columns).fit_columns(&columns)
    };
    let mut fit = fit_of(&causes)?;
    // No tire's force is before its slip.
    let relaxation = causes.iter().position(|cause| *cause == RELAXATION);
    if let Some(at) = relaxation.filter(|at| fit.values[before.len() + at] < 0.0) {
        causes.remove(at);
        fit = fit_of(&causes)?;
    }
    let at = before.len() + causes.iter().position(|cause| *cause == found.causes[place])?;
    Some([fit.values[at] + found.taken[place], fit.stds[at]])
}

/// Something else that can explain what looks like an error.
#[derive(Clone, Copy)]
pub(super) struct RivalModel {
    name: &'static str,
    /// Whether it sees the motion under the wider filter.
    is_smoother: bool,
    /// Whether curves may bend, and loads and inertia move them.
    bends: bool,
    /// Errors that it has, by their index.
    causes: &'static [usize],
}

const RELAXED: RivalModel = RivalModel {
    name: "the relaxation of the tires",
    is_smoother: false,
    bends: false,
    causes: &[RELAXATION],
};
const BENT: RivalModel =
    RivalModel { name: "relaxation, downforce and the bend of the tires' curves", bends: true, ..RELAXED };
const SLOW: RivalModel =
    RivalModel { name: "the relaxation of the tires, in slow motion,", is_smoother: true, ..RELAXED };
/// A logger samples, holds and averages, so clocks differ by parts of a row.
const CLOCKS: RivalModel = RivalModel { name: "clocks that differ", causes: &DELAYS, ..RELAXED };

const SCALED: RivalModel =
    RivalModel { name: "another scale of the steering", causes: &[STEERING_GAIN, RELAXATION], ..RELAXED };

/// What explains an error of the steering otherwise: what tires do beyond a curve whose slope goes with the speed, and its ratio.
pub(super) const OF_STEERING: [RivalModel; 4] = [RELAXED, BENT, SLOW, SCALED];
/// What explains the place of a sensor otherwise.
pub(super) const OF_PLACES: [RivalModel; 4] = [RELAXED, BENT, SLOW, CLOCKS];

/// Why an error is not one for sure: beside a rival it fades or is another one. `None` where it stays.
pub(super) fn rival_explanation(
    measured: &MeasuredRelations,
    found: &ErrorFit,
    place: usize,
    rivals: &[RivalModel],
) -> Option<String> {
    let value = found.fit.values[found.before + place];
    let error = LOG_ERRORS[found.causes[place]];
    rivals.iter().find_map(|rival| {
        let measured = if rival.is_smoother { &measured.smoother } else { &measured.usual };
        let beside = estimate_beside_rival(measured, found, place, rival);
        let Some([other, std]) = beside else {
            return Some(format!("The log does not tell it from {}", rival.name));
        };
        let apart = (other - value).abs();
        let stays = other.abs() > SURE * std
            && other * value > 0.0
            && other.abs() > smallest_relevant_error(error)
            && (apart < ONE_CONSTANT * value.abs() || apart < SURE * std);
        let [other, std] = [other, 2.0 * std].map(|it| format_significant(it, 2));
        let unit = error_unit(error);
        (!stays).then(|| format!("But beside {} it is {other} {unit} ± {std}", rival.name))
    })
}
