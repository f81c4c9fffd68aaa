//! Identifies the tires of both axles at once from drives under closed-loop control.
//!
//! States are smoothed with a car of linear tires, parameters fitted to points along them, and the result is the start from
//! which the likelihood of the recordings themselves is maximised: by the prediction errors of an extended Kalman filter with
//! the Magic Formula inside. That is unbiased where fits to smoothed states are not, as these are most wrong near the peak.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]

mod car;
mod error;
mod evaluation;
mod filter;
mod identified;
pub mod likelihood;
mod options;
pub mod pem;
pub mod points;
pub mod profile;
mod pull;
mod recording;
pub mod regression;
mod scalar;
pub mod search;
mod series;
pub mod smoothing;
mod tangent;
pub mod validation;
mod valley;
mod verdict;

use std::time::Instant;

use nalgebra::{DMatrix, DVector};
use vehicle::MagicFormula;

pub use error::Error;
pub use identified::{Fitted, Identified, Innovations};
pub use likelihood::{Likelihood, Noise, Theta8};
pub use options::{Bounds, Formulation, Noises, Options};
pub use pull::Pull;
pub use recording::Recording;
pub use regression::{Target, Weights};
pub use series::Series;
pub use smoothing::Smoothing;

use crate::fit::sqp::Minimum;
use crate::parameters::Theta;
use crate::result::Convergence;
use points::Point;
use profile::Explored;

/// The curve of the axle whose parameters begin at a place.
pub fn curve(theta: &Theta8, from: usize) -> MagicFormula {
    let [B, C, D, E] = [theta[from], theta[from + 1], theta[from + 2], theta[from + 3]];
    MagicFormula { B, C, D, E, S_h: 0.0, S_v: 0.0 }
}

/// Identifies both axles from recordings of one car. `progress` is told the share that is done, and what comes next.
///
/// # Errors
///
/// [`Error`] if recordings are unusable or no start leads anywhere.
pub fn identify(
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(f64, &str),
) -> Result<Identified, Error> {
    let begin = Instant::now();
    for (i, recording) in recordings.iter().enumerate() {
        recording.check(i)?;
    }
    let Some(first) = recordings.first() else { return Err(Error::NoRecording) };
    let noise = match options.noises {
        Noises::Known(noise) => noise,
        Noises::Estimated => Noise::of_sensors(first.rough_noise()),
    };
    let mut run = Run { recordings, options, noise, points: Vec::new(), fitted: Vec::new() };
    progress(0.0, "smoothing");
    run.points = run.points()?;
    let mut last = None;
    for formulation in run.formulations() {
        progress(0.1, "fitting");
        last = Some(run.fit(formulation)?);
    }
    let Some(last) = last else { return Err(Error::NoStart { starts: 0 }) };
    progress(if options.profile { 0.3 } else { 0.9 }, "judging");
    Ok(run.identified(last, begin))
}

struct Run<'a> {
    recordings: &'a [Recording],
    options: &'a Options,
    noise: Noise,
    points: Vec<Vec<Point>>,
    fitted: Vec<Fitted>,
}

/// A minimum with the covariance that it means.
struct Best {
    theta: Theta8,
    information: DMatrix<f64>,
    covariance: DMatrix<f64>,
    cost: f64,
    convergence: Convergence,
    likelihood: Likelihood,
}

impl Run<'_> {
    fn points(&self) -> Result<Vec<Vec<Point>>, Error> {
        let car = &self.options.car;
        let of = |(i, recording): (usize, &Recording)| {
            let states =
                smoothing::smoothed(car, recording, i, &self.noise, &self.options.smoothing)?;
            Ok(points::points(car, recording, &states))
        };
        self.recordings.iter().enumerate().map(of).collect()
    }

    /// All formulations to fit, the start of prediction errors before them, the deciding one last.
    fn formulations(&self) -> Vec<Formulation> {
        let mut all = self.options.compare.clone();
        let start = Formulation::Points(Target::AccelerationAndYaw);
        if self.options.method == Formulation::PredictionError {
            all.push(start);
        }
        all.push(self.options.method);
        let mut once = Vec::new();
        for formulation in all.into_iter().rev() {
            if !once.contains(&formulation) {
                once.push(formulation);
            }
        }
        once.reverse();
        once
    }

    fn fit(&mut self, formulation: Formulation) -> Result<Best, Error> {
        let begin = Instant::now();
        let likelihood = Likelihood::new(&self.options.car, self.recordings);
        let (theta, minimum, convergence, found) = match formulation {
            Formulation::Points(target) => {
                let found = self.search(target).run(&self.options.car.body, &self.points)?;
                let extra = (found.odd, Some(found.std));
                (found.theta, found.minimum, found.convergence, extra)
            }
            Formulation::PredictionError => {
                let maximum = self.problem(&likelihood).maximise(&self.starts())?;
                self.noise = maximum.noise;
                (maximum.theta, maximum.minimum, maximum.convergence, ([0.0; 3], None))
            }
        };
        let (information, covariance) = curvature(&minimum);
        let cost = minimum.model.cost;
        let best = Best { theta, information, covariance, cost, convergence, likelihood };
        let (odd, residual_std) = found;
        self.fitted.push(Fitted {
            formulation,
            theta: best.theta,
            std: std::array::from_fn(|i| best.covariance[(i, i)].max(0.0).sqrt()),
            odd,
            residual_std,
            convergence: best.convergence.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        });
        Ok(best)
    }

    fn search(&self, target: Target) -> search::Search {
        let [_, _, s_r, s_y] = self.noise.sensor;
        search::Search {
            target,
            weights: self.options.weights,
            pull: self.options.pull,
            odd: self.options.odd,
            starts: self.options.starts,
            seed: self.options.seed,
            bounds: self.options.bounds,
            // Errors of slip and load come on top of the noises; the fit corrects these guesses.
            std: [s_y.max(0.02), 1.5 * s_r + 1e-3, 200.0, 200.0],
        }
    }

    fn problem<'a>(&self, likelihood: &'a Likelihood) -> pem::Problem<'a> {
        pem::Problem {
            likelihood,
            bounds: self.options.bounds,
            pull: self.options.pull,
            noise: self.noise,
            estimate_noise: self.options.noises == Noises::Estimated,
        }
    }

    /// What fits to points ended with.
    fn starts(&self) -> Vec<Theta8> {
        let start = Formulation::Points(Target::AccelerationAndYaw);
        let is_start = |fitted: &&Fitted| fitted.formulation == start;
        self.fitted.iter().filter(is_start).map(|fitted| fitted.theta).collect()
    }

    fn identified(self, best: Best, begin: Instant) -> Identified {
        let Best { theta, information, covariance, cost, convergence, likelihood } = best;
        let options = self.options;
        let series =
            series::series(&options.car, self.recordings, &likelihood, &theta, &self.noise);
        let problem = self.problem(&likelihood);
        let objective =
            pem::OfTires { likelihood: &likelihood, noise: self.noise, pull: options.pull };
        let explored = Explored {
            objective: &objective,
            x: DVector::from_column_slice(&theta),
            cost,
            information,
            corners: problem.corners(),
        };
        let judge = verdict::Judge {
            explored: &explored,
            covariance: &covariance,
            profile: options.profile && options.method == Formulation::PredictionError,
            pull: options.pull,
            slip_range: [series::slip_range(&series, 0), series::slip_range(&series, 1)],
            samples: likelihood.samples(),
            noise_std: self.noise.sensor[3] / vehicle::G,
            convergence: convergence.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        };
        let [front, rear] = judge.estimates();
        let row = |i: usize| (0..8).map(|j| covariance[(i, j)]).collect();
        Identified {
            front,
            rear,
            curves: [0, 4].map(|o| -> Theta { crate::parameters::theta(&curve(&theta, o)) }),
            covariance: (0..8).map(row).collect(),
            noise: self.noise,
            convergence,
            innovations: innovations(&series),
            formulations: self.fitted,
            series,
            seconds: begin.elapsed().as_secs_f64(),
        }
    }
}

/// Second derivatives of B, C, D, E of both axles, and their inverse together with whatever else was fitted.
fn curvature(minimum: &Minimum) -> (DMatrix<f64>, DMatrix<f64>) {
    let H = &minimum.model.hessian;
    let of_tires = |matrix: &DMatrix<f64>| matrix.view((0, 0), (8, 8)).into_owned();
    (of_tires(H), of_tires(&profile::inverse(H)))
}

fn innovations(series: &[Series]) -> Innovations {
    let mut count = 0.0;
    let mut squares = [0.0; 4];
    let mut products = [0.0; 4];
    for series in series {
        // The first row starts the filter.
        count += series.a_y.len() as f64 - 1.0;
        for (i, column) in series.whitened.iter().enumerate() {
            squares[i] += column[1..].iter().map(|w| w * w).sum::<f64>();
            products[i] += column[1..].windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        }
    }
    Innovations {
        mean_square: squares.map(|square| square / count),
        cost: 0.5 * squares.iter().sum::<f64>(),
        expected_cost: 2.0 * count,
        autocorrelation: std::array::from_fn(|i| products[i] / squares[i]),
    }
}

#[cfg(test)]
mod tests;
