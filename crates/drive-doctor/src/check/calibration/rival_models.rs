//! Asks whether tires explain what looks like an error of a sensor: relaxation, downforce, curves that bend more.

use numerics::text::format_significant;

use super::log_errors::{LOG_ERRORS, RELAXATION, error_unit, smallest_relevant_error};
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
    let mut causes = found.causes.clone();
    if !causes.contains(&RELAXATION) {
        causes.push(RELAXATION);
    }
    let fit_of = |causes: &[usize]| {
        let columns: Vec<usize> =
            before.iter().copied().chain(causes.iter().map(|cause| NUISANCES + cause)).collect();
        variance_weighted_equations(measured, &columns).fit_columns(&columns)
    };
    let mut fit = fit_of(&causes)?;
    let relaxation = causes.iter().position(|cause| *cause == RELAXATION)?;
    // No tire's force is before its slip.
    if fit.values[before.len() + relaxation] < 0.0 {
        causes.remove(relaxation);
        fit = fit_of(&causes)?;
    }
    let at = before.len() + causes.iter().position(|cause| *cause == found.causes[place])?;
    Some([fit.values[at] + found.taken[place], fit.stds[at]])
}

/// What tires can do beyond a curve whose slope goes with the speed.
struct RivalModel {
    name: &'static str,
    /// Whether it sees the motion under the wider filter.
    is_smoother: bool,
    /// Whether curves may bend, and loads and inertia move them.
    bends: bool,
}

const RIVALS: [RivalModel; 3] = [
    RivalModel { name: "the relaxation of the tires", is_smoother: false, bends: false },
    RivalModel {
        name: "relaxation, downforce and the bend of the tires' curves",
        is_smoother: false,
        bends: true,
    },
    RivalModel { name: "the relaxation of the tires, in slow motion,", is_smoother: true, bends: false },
];

/// Why an error is not one for sure: beside what the tires may do, it fades or is another one. `None` where it stays.
pub(super) fn rival_explanation(
    measured: &MeasuredRelations,
    found: &ErrorFit,
    place: usize,
) -> Option<String> {
    let value = found.fit.values[found.before + place];
    let error = LOG_ERRORS[found.causes[place]];
    RIVALS.iter().find_map(|rival| {
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
