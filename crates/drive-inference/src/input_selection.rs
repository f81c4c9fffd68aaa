//! Chooses how the inputs move between rows by the likelihood of the recordings: nothing in a log tells whether a value was held until its row.

use numerics::sqp::{Objective, QuadraticModel};
use preparation::{Drive, InputInterpolation, InputInterpolations, SystematicError};

use crate::laplace::inverse_hessian;
use crate::likelihood::DriveUnknowns;
use crate::problem::PredictionErrorProblem;
use crate::tires::Tires;

/// Gain that a form of an input needs over simpler ones [nat]: that of a time constant by Akaike; and what a delay has to gain.
const ENOUGH: f64 = 1.0;
const ENOUGH_FOR_DELAY: f64 = 5.0;
/// Time constants of actuators that are tried, in steps of the rows: with much shorter ones an input is held, with much longer ones it is a line.
const LAGS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// Recordings with other inputs between their rows.
pub fn with_interpolations(recordings: &[Drive], interpolation: InputInterpolations) -> Vec<Drive> {
    recordings.iter().map(|drive| Drive { interpolation, ..drive.clone() }).collect()
}

/// The likeliest, from tires near the optimum.
pub fn select_interpolations(problem: &PredictionErrorProblem, start: &Tires) -> InputInterpolations {
    let mut at = DriveUnknowns::new(start, &problem.noise.initial_noise());
    let mut least = f64::INFINITY;
    search_interpolations(Drive::shortest_step(problem.recordings), &[], |tried| {
        let recordings = &with_interpolations(problem.recordings, tried);
        let problem = PredictionErrorProblem { recordings, ..problem.clone() };
        let here = cost_to_second_order(&problem, &at);
        // What is still behind the best after twice the decrease of Newton's step is not worth a fit.
        if here.cost - here.gradient.dot(&(inverse_hessian(&here.hessian) * &here.gradient)) > least {
            return here.cost;
        }
        let fit = problem.fit_tires_at_fixed_noise(at);
        let cost = fit.minimum.model.cost;
        if cost < least {
            (at, least) = (problem.fitted_unknowns(&fit), cost);
        }
        cost
    })
}

/// The cost of the tires on all rows.
fn cost_to_second_order(problem: &PredictionErrorProblem, at: &DriveUnknowns) -> QuadraticModel {
    let likelihood = problem.build_likelihood(None);
    let joint = problem.joint_posterior(&likelihood, at.noise, &[]);
    joint.model(&joint.x_from_parameters(&at.tires, &at.causes))
}

/// Likelier inputs between rows than those of the recordings, at the unknowns of a fit to them. `None` where there are none. An input that is
/// held looks like one that moves and is late by half a row: so each form is tried with and without delays that short.
pub fn likelier_interpolations(
    problem: &PredictionErrorProblem,
    at: &DriveUnknowns,
) -> Option<InputInterpolations> {
    let current = problem.recordings.first()?.interpolation;
    let step = Drive::shortest_step(problem.recordings);
    let (mut punctual, mut short) = (*at, 0);
    for delay in SystematicError::DELAYS {
        if at.causes[delay] != 0.0 && at.causes[delay].abs() < step {
            punctual.causes[delay] = 0.0;
            short += 1;
        }
    }
    let mut cost = |tried: InputInterpolations| {
        let recordings = &with_interpolations(problem.recordings, tried);
        let problem = PredictionErrorProblem { recordings, ..problem.clone() };
        let [late, punctual] = [at, &punctual].map(|at| problem.build_likelihood(Some(at)).cost(at));
        punctual.min(late + ENOUGH_FOR_DELAY * f64::from(short))
    };
    let least = cost(current) - ENOUGH;
    let best = search_interpolations(step, &lags(step), &mut cost);
    (best != current && cost(best) < least).then_some(best)
}

/// Actuators whose time constants are tried.
fn lags(step: f64) -> [InputInterpolation; LAGS.len()] {
    LAGS.map(|steps| InputInterpolation::FirstOrderLag(steps * step))
}

/// The interpolations of least cost, or as good and simpler. A wrong form of one input hides that of the other: both are held or both lines
/// at first, then each is chosen again until none changes. `forces` are forms of the longitudinal force that are tried beside a line, a held
/// force and that of the steering angle.
fn search_interpolations(
    step: f64,
    forces: &[InputInterpolation],
    mut cost: impl FnMut(InputInterpolations) -> f64,
) -> InputInterpolations {
    use InputInterpolation::{FirstOrderHold, FirstOrderLag, Hermite, ZeroOrderHold};
    let (mut best, mut least) = (InputInterpolations::default(), f64::INFINITY);
    let mut seen: Vec<InputInterpolations> = Vec::new();
    let mut compare = |tried: InputInterpolations, best: &mut InputInterpolations| {
        if seen.contains(&tried) {
            return;
        }
        seen.push(tried);
        let cost = cost(tried);
        if cost < least - ENOUGH {
            (*best, least) = (tried, cost);
        }
    };
    for both in [FirstOrderHold, ZeroOrderHold] {
        compare(InputInterpolations { delta: both, F_x: both }, &mut best);
    }
    loop {
        let F_x = best.F_x;
        for delta in [FirstOrderHold, ZeroOrderHold, Hermite].into_iter().chain(lags(step)) {
            compare(InputInterpolations { delta, F_x }, &mut best);
        }
        if let FirstOrderLag(time) = best.delta {
            for factor in [0.7, 1.4, 0.84, 1.19] {
                compare(InputInterpolations { delta: FirstOrderLag(factor * time), F_x }, &mut best);
            }
        }
        let delta = best.delta;
        for &force in [FirstOrderHold, ZeroOrderHold, delta].iter().chain(forces) {
            compare(InputInterpolations { delta, F_x: force }, &mut best);
        }
        if best.F_x == F_x {
            return best;
        }
    }
}
