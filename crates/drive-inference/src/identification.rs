//! Runs an identification from its recordings to what is reported: states, fits, posterior, verdicts.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]

use std::time::Instant;

use nalgebra::DMatrix;
use numerics::convergence::Convergence;
use numerics::sqp::{self, Minimum, Objective};
use rayon::prelude::*;
use tire_inference::axles::Axles;
use tire_inference::estimate::Estimate;
use tire_inference::model::{CauseEstimate, ModelVerdict};
use tire_inference::parameters::TireParameters;
use tire_inference::prior::Prior;
use tire_inference::verdict::Pressed;

use crate::adequacy::{self, Blocks, Leftover};
use crate::error::Error;
use crate::explored::{Explored, inverse};
use crate::global::{COARSE, FINE};
use crate::identified::{Fitted, Identified, Innovations};
use crate::joint::{Joint, Marginal};
use crate::likelihood::{DriveNoise, Likelihood, Unknowns};
use crate::noises::Noise;
use crate::options::{DriveOptions, Formulation, Noises};
use crate::pem::Optimum;
use crate::points::{self, Point};
use crate::posterior_samples::{self, Drawn, Request};
use crate::problem::Problem;
use crate::progress::{Progress, with_progress};
use crate::regression::Target;
use crate::selection::Addition;
use crate::series::Series;
use crate::smoothing::{self, Explained};
use crate::tires::{SIZE, Tires, corners, from_array, from_vector};
use crate::told::Estimated;
use crate::{error, pem, search, series, told, verdict};
use preparation::{Drive, SystematicError};

/// What prediction errors start from.
const START: Formulation = Formulation::Points(Target::AccelerationAndYaw);

/// Identifies both axles from recordings of one car. `progress` receives the share done and the next stage, again and again; `false`
/// cancels the work.
///
/// # Errors
///
/// [`Error`] if recordings are unusable or no start leads anywhere, [`Error::Cancelled`] if the work was cancelled.
pub fn identify(
    recordings: &[Drive],
    options: &DriveOptions,
    progress: &mut dyn FnMut(f64, &str) -> bool,
) -> Result<Identified, Error> {
    let begin = Instant::now();
    error::check(recordings)?;
    let noise = match options.noises {
        Noises::Known(noise) => noise,
        Noises::Estimated => DriveNoise::of_sensors(recordings[0].difference_noise()),
    };
    with_progress(progress, |progress| {
        progress.report(0.0, "smoothing")?;
        let explained = explain(recordings, options, &noise, progress)?;
        let points = |(recording, explained)| points::points(&options.car, recording, explained);
        let states = explained.iter().map(|explained| &explained.smoothed);
        let points = recordings.iter().zip(states).map(points).collect();
        let mut run = Run { recordings, options, noise, points, fitted: Vec::new(), progress };
        let mut decisive = None;
        for formulation in run.formulations() {
            progress.report(0.2, formulation.title())?;
            let best = run.fit(formulation)?;
            if formulation == options.method {
                decisive = Some(best);
            }
        }
        run.fitted.sort_by_key(|fitted| fitted.formulation == options.method);
        let Some(decisive) = decisive else { return Err(Error::NoStart { starts: 0 }) };
        progress.report(0.3, "drawing from the posterior")?;
        run.identified(decisive, explained, begin)
    })
}

/// The nominal car along each recording.
fn explain(
    recordings: &[Drive],
    options: &DriveOptions,
    noise: &DriveNoise,
    progress: &Progress,
) -> Result<Vec<Explained>, Error> {
    let of = |(recording, drive)| {
        let go_on = || !progress.cancel.is_cancelled();
        smoothing::explain(&options.car, drive, noise, &options.smoothing, go_on)
            .map_err(|source| Error::Smoothing { recording, source })
    };
    recordings.par_iter().enumerate().map(of).collect()
}

struct Run<'a> {
    recordings: &'a [Drive],
    options: &'a DriveOptions,
    noise: DriveNoise,
    points: Vec<Vec<Point>>,
    fitted: Vec<Fitted>,
    progress: &'a Progress,
}

/// A minimum with what belongs to it.
struct Best {
    unknowns: Unknowns,
    /// Errors that are variables of the minimum, after the tires.
    active: Vec<SystematicError>,
    /// Gain of what the data asked for [nat].
    gains: Vec<(Addition, f64)>,
    minimum: Minimum,
    optima: Vec<Optimum>,
    convergence: Convergence,
    likelihood: Likelihood,
}

impl Run<'_> {
    /// All formulations to fit, each once: that which prediction errors start from, those to compare, the deciding one.
    fn formulations(&self) -> Vec<Formulation> {
        let wanted = self.options.compare.iter().copied().chain([self.options.method]);
        let mut all: Vec<Formulation> = wanted.collect();
        if all.contains(&Formulation::PredictionError) {
            all.insert(0, START);
        }
        let mut once = Vec::new();
        for formulation in all {
            if !once.contains(&formulation) {
                once.push(formulation);
            }
        }
        once
    }

    fn fit(&mut self, formulation: Formulation) -> Result<Best, Error> {
        let begin = Instant::now();
        let (best, odd, residual_std) = match formulation {
            Formulation::Points(target) => {
                let found = self.search(target).run(&self.options.car.body, &self.points)?;
                let mut likelihood = Likelihood::new(&self.options.car, self.recordings);
                likelihood.cancel = self.progress.cancel.clone();
                let best = Best {
                    unknowns: Unknowns::new(&found.tires, &self.noise),
                    active: Vec::new(),
                    gains: Vec::new(),
                    minimum: found.minimum,
                    optima: Vec::new(),
                    convergence: found.convergence,
                    likelihood,
                };
                (best, found.odd, Some(found.std))
            }
            Formulation::PredictionError => {
                let pem::Maximum {
                    likelihood,
                    unknowns,
                    active,
                    gains,
                    minimum,
                    optima,
                    convergence,
                } = self.problem().maximise(&self.starts())?;
                let best =
                    Best { unknowns, active, gains, minimum, optima, convergence, likelihood };
                (best, [0.0; 3], None)
            }
        };
        let (minimum, covariance) = (&best.minimum, covariance(&best.minimum));
        self.fitted.push(Fitted {
            formulation,
            tires: best.unknowns.tires,
            std: from_vector(&covariance.diagonal().map(|variance| variance.max(0.0).sqrt())),
            at_bound: from_array(std::array::from_fn(|i| minimum.at_bound[i])),
            odd,
            residual_std,
            convergence: best.convergence.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        });
        Ok(best)
    }

    fn search(&self, target: Target) -> search::PointFit {
        let [_, _, s_r, s_y] = self.noise.sensor;
        search::PointFit {
            target,
            weights: self.options.weights,
            expected: self.options.expected(),
            odd_terms: self.options.odd_terms,
            starts: self.options.starts,
            seed: self.options.seed,
            bounds: self.options.prior.bounds,
            // Errors of slip and load come on top of the noises; the fit corrects these guesses.
            std: [s_y.max(0.02), 1.5 * s_r + 1e-3, 200.0, 200.0],
        }
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            car: &self.options.car,
            recordings: self.recordings,
            bounds: self.options.prior.bounds,
            expected: self.options.expected(),
            noise: match self.options.noises {
                Noises::Known(noise) => Noise::Given(noise),
                Noises::Estimated => Noise::Estimated(self.noise),
            },
            std: self.options.error_std(),
            search: self.options.causes.wanted,
            cancel: self.progress.cancel.clone(),
        }
    }

    /// What fits to points ended with.
    fn starts(&self) -> Vec<Tires> {
        let is_start = |fitted: &&Fitted| fitted.formulation == START;
        self.fitted.iter().filter(is_start).map(|fitted| fitted.tires).collect()
    }

    fn identified(
        self,
        best: Best,
        explained: Vec<Explained>,
        begin: Instant,
    ) -> Result<Identified, Error> {
        let Best { unknowns, active, gains, minimum, optima, convergence, ref likelihood } = best;
        let (options, tires, noise) = (self.options, unknowns.tires, unknowns.noise);
        let (expected, std, held) = (options.expected(), options.error_std(), unknowns.causes);
        let series = series::series(&options.car, self.recordings, likelihood, &unknowns);
        let joint = Joint { likelihood, noise, expected, active, held, std };
        let corners = corners(&options.prior.bounds);
        let objective = Marginal::new(&joint, &minimum.x, &minimum.model.hessian, &corners);
        let explored = objective.explored(&minimum, corners);
        let step = Drive::shortest_step(self.recordings);
        // Fits to points do not maximise the likelihood, so that its residuals say nothing of them.
        let likely = options.method == Formulation::PredictionError;
        let blocks = likely.then(|| Blocks::about(&joint, &minimum, &explored.corners, step));
        let scatter = blocks.as_ref().and_then(Blocks::scatter);
        let scatter = scatter.as_ref();
        let covariance = scatter.map_or_else(|| covariance(&minimum), |it| it.blocks.clone());
        let causes = told::causes(&minimum, &joint, &gains, &unknowns, (&options.car, step));
        let (model, causes) = self.judged(causes, &unknowns, &series, blocks.as_ref());
        let slip_range = Axles::new(|axle| series::slip_range(&series, axle));
        let noise_std = noise.sensor[3] / vehicle::G;
        let DriveOptions { prior, svi, seed, .. } = *options;
        let request = Request { prior, slip_range, svi, noise_std, scatter, seed };
        // A filter with more states takes ten times as long, and scatter decides on intervals of what does not fit.
        let is_rough = scatter.is_some() && unknowns.is_wide();
        let drawn = self.draw(&explored, &joint, &optima, (&request, is_rough))?;
        self.progress.report(0.7, "judging")?;
        // Draws of the posterior are as wide already; profiles go along the likelihood.
        let wide =
            scatter.filter(|_| drawn.exact().is_none()).map(|it| explored.scattering(&it.blocks));
        let judge = verdict::Judge {
            explored: wide.as_ref().unwrap_or(&explored),
            model: &model,
            pressed: &pressed(&joint, &minimum, &prior, likely.then_some(is_rough)),
            drawn: &drawn,
            covariance: &covariance,
            profile: options.profile && likely,
            prior,
            slip_range,
            samples: likelihood.samples(),
            noise_std,
            convergence: convergence.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        };
        let estimates = judge.estimates();
        Ok(Identified {
            tires: published(&estimates, tires),
            estimates,
            covariance: covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
            noise,
            causes,
            model,
            errors: unknowns.causes,
            convergence,
            innovations: Innovations::of(&series),
            formulations: self.fitted,
            posterior: drawn.axles,
            gaussian: drawn.svi.map(|(gaussian, _)| gaussian),
            samples: points::samples(&self.points),
            series,
            explained,
            seconds: begin.elapsed().as_secs_f64(),
        })
    }

    /// Whether tires, errors and noises describe the drives, and the errors as that has them.
    fn judged(
        &self,
        causes: Vec<Estimated>,
        at: &Unknowns,
        series: &[Series],
        blocks: Option<&Blocks>,
    ) -> (ModelVerdict, Vec<CauseEstimate>) {
        let Some(blocks) = blocks else { return told::judged(ModelVerdict::default(), causes) };
        let inputs = self.recordings.iter().map(|drive| at.causes.true_inputs(drive));
        let recordings = &inputs.collect::<Vec<_>>();
        let plausible = causes.iter().map(|it| it.test.clone()).collect();
        let model = adequacy::judge(&Leftover { recordings, series }, blocks, plausible);
        told::judged(model, causes)
    }

    /// Draws from the posterior where there is a likelihood, else what the curvature of the cost has it.
    fn draw(
        &self,
        explored: &Explored,
        joint: &Joint,
        optima: &[Optimum],
        (request, is_rough): (&Request, bool),
    ) -> Result<Drawn, Error> {
        let DriveOptions { method, posterior, .. } = *self.options;
        if posterior && !is_rough && method == Formulation::PredictionError {
            let go_on = || !self.progress.cancel.is_cancelled();
            let drawn = posterior_samples::posterior(explored, joint, optima, request, go_on);
            if self.progress.cancel.is_cancelled() {
                return Err(Error::Cancelled);
            }
            if let Some(drawn) = drawn {
                return Ok(drawn);
            }
        }
        Ok(posterior_samples::normal(explored, request.scatter, request.seed))
    }
}

/// What the bounds do to both tires: where one stands on a bound, both are looked for in a wider box, roughly or with
/// all digits, if they are those of the likelihood.
fn pressed(
    joint: &Joint,
    minimum: &Minimum,
    prior: &Prior,
    likely: Option<bool>,
) -> Axles<Pressed> {
    let n = SIZE + joint.active.len();
    let start = minimum.x.rows(0, n).into_owned();
    let best = from_vector(&start);
    Axles::new(|axle| {
        Pressed::about(prior, &best[axle].theta(), |wider| {
            let Some(is_rough) = likely else { return (best[axle].theta(), 0.0) };
            let [lower, upper] = joint.corners(&wider.bounds);
            let found =
                sqp::minimise(joint, &lower, &upper, &start, if is_rough { COARSE } else { FINE });
            let gain = 2.0 * (joint.cost(&start) - found.model.cost);
            (from_vector(&found.x)[axle].theta(), gain)
        })
    })
}

/// The tires of the estimates, which are the fitted ones unless the posterior rejects those.
fn published(estimates: &Axles<Estimate>, fitted: Tires) -> Tires {
    Axles::new(|axle| {
        let fitted = fitted[axle].into_array();
        let place = |i: usize| TireParameters::<f64>::PARAMETERS[i].name();
        let value = |i: usize| estimates[axle].mean.get(place(i)).copied().unwrap_or(fitted[i]);
        TireParameters::from(std::array::from_fn(value))
    })
}

/// Covariance of B, C, D, E of both axles, whatever else was fitted.
fn covariance(minimum: &Minimum) -> DMatrix<f64> {
    inverse(&minimum.model.hessian).view((0, 0), (SIZE, SIZE)).into_owned()
}
