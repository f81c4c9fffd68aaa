//! Chooses how the inputs move between rows by the likelihood of the recordings: nothing in a log tells whether a value was held until its row.

use preparation::{Drive, InputInterpolation, InputInterpolations};

use crate::likelihood::DriveUnknowns;
use crate::problem::PredictionErrorProblem;
use crate::tires::Tires;
use preparation::SystematicErrors;

/// Gain that a form of an input needs over simpler ones [nat]: that of a time constant by Akaike.
const ENOUGH: f64 = 1.0;

/// Recordings with other inputs between their rows.
pub fn with_interpolations(recordings: &[Drive], interpolation: InputInterpolations) -> Vec<Drive> {
    recordings.iter().map(|drive| Drive { interpolation, ..drive.clone() }).collect()
}

/// Time constants of actuators that are tried, in steps of the rows: with much shorter ones an input is held, with much longer ones it is a line.
const LAGS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// The likeliest, from tires near the optimum: that of the steering angle first, which acts more on what is measured.
pub fn select_interpolations(problem: &PredictionErrorProblem, start: &Tires) -> InputInterpolations {
    let noise = problem.noise.initial_noise();
    let first = DriveUnknowns { tires: *start, causes: SystematicErrors::default(), noise };
    let (mut best, mut least, mut at) = (InputInterpolations::default(), f64::INFINITY, first);
    let mut gain_of = |tried: InputInterpolations, best: &mut InputInterpolations| {
        let recordings = &with_interpolations(problem.recordings, tried);
        let fit = PredictionErrorProblem { recordings, ..problem.clone() }.fit_tires_at_fixed_noise(at);
        let cost = fit.minimum.model.cost;
        if cost < least - ENOUGH {
            at = problem.fitted_unknowns(&fit);
            (*best, least) = (tried, cost);
        }
    };
    let step = Drive::shortest_step(problem.recordings);
    let others = || {
        let lags = LAGS.map(|steps| InputInterpolation::FirstOrderLag(steps * step));
        [InputInterpolation::ZeroOrderHold, InputInterpolation::Hermite].into_iter().chain(lags)
    };
    let line = InputInterpolation::FirstOrderHold;
    gain_of(InputInterpolations { delta: line, F_x: line }, &mut best);
    for delta in others() {
        gain_of(InputInterpolations { delta, F_x: line }, &mut best);
    }
    if let InputInterpolation::FirstOrderLag(time) = best.delta {
        for factor in [0.7, 1.4, 0.84, 1.19] {
            let delta = InputInterpolation::FirstOrderLag(factor * time);
            gain_of(InputInterpolations { delta, F_x: line }, &mut best);
        }
    }
    let delta = best.delta;
    for F_x in [InputInterpolation::ZeroOrderHold, delta] {
        gain_of(InputInterpolations { delta, F_x }, &mut best);
    }
    best
}
