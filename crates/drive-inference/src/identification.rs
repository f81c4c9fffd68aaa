//! Identification of both tires from drives: smoothed states, fits, posterior, verdicts, in this order.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]

use std::time::Instant;

use nalgebra::DMatrix;
use numerics::convergence::Convergence;
use numerics::sqp::{self, Minimum, Objective};
use preparation::{Drive, SystematicError};
use rayon::prelude::*;
use tire_inference::axles::Axles;
use tire_inference::estimate::Estimate;
use tire_inference::model::{CauseEstimate, ModelVerdict};
use tire_inference::parameters::TireParameters;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::ActiveBounds;

use crate::adequacy::{self, BlockScores, ModelResiduals, Scatter};
use crate::error::Error;
use crate::global::{COARSE, FINE};
use crate::joint_posterior::{JointPosterior, MarginalPosterior};
use crate::laplace::{LaplaceApproximation, inverse};
use crate::likelihood::{DriveNoise, Likelihood, Unknowns};
use crate::model_selection::ModelExtension;
use crate::noise_estimate::Noise;
use crate::options::{DriveOptions, Formulation, Noises};
use crate::pem::Optimum;
use crate::points::{self, Point};
use crate::posterior_samples::{self, DrawSettings, TireDraws};
use crate::problem::Problem;
use crate::progress::{Progress, with_progress};
use crate::regression::Target;
use crate::result::{FormulationFit, Identification, Innovations};
use crate::series::Series;
use crate::smoothing::{self, SmoothedDrive};
use crate::tires::{SIZE, Tires, corners, from_array, from_vector};
use crate::{error, pem, search, series, summary, verdict};

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
) -> Result<Identification, Error> {
    let begin = Instant::now();
    error::check(recordings)?;
    let noise = match options.noises {
        Noises::Known(noise) => noise,
        Noises::Estimated => DriveNoise::of_sensors(recordings[0].difference_noise()),
    };
    with_progress(progress, |progress| {
        progress.report(0.0, "smoothing")?;
        let smoothed = smooth_all(recordings, options, &noise, progress)?;
        let both = recordings.iter().zip(&smoothed);
        let points = both.map(|(drive, it)| points::points(&options.car, drive, &it.states));
        let points = points.collect();
        let mut run =
            IdentificationRun { recordings, options, noise, points, fitted: Vec::new(), progress };
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
        run.report(&decisive, smoothed, begin)
    })
}

/// The nominal car along each recording.
fn smooth_all(
    recordings: &[Drive],
    options: &DriveOptions,
    noise: &DriveNoise,
    progress: &Progress,
) -> Result<Vec<SmoothedDrive>, Error> {
    let of = |(recording, drive)| {
        let go_on = || !progress.cancel.is_cancelled();
        smoothing::smooth_states(&options.car, drive, noise, &options.smoothing, go_on)
            .map_err(|source| Error::Smoothing { recording, source })
    };
    recordings.par_iter().enumerate().map(of).collect()
}

struct IdentificationRun<'a> {
    recordings: &'a [Drive],
    options: &'a DriveOptions,
    noise: DriveNoise,
    points: Vec<Vec<Point>>,
    fitted: Vec<FormulationFit>,
    progress: &'a Progress,
}

/// A minimum with what belongs to it.
struct SelectedFit {
    unknowns: Unknowns,
    /// Errors that are variables of the minimum, after the tires.
    active: Vec<SystematicError>,
    /// Gain of what the data asked for [nat].
    gains: Vec<(ModelExtension, f64)>,
    minimum: Minimum,
    optima: Vec<Optimum>,
    convergence: Convergence,
    likelihood: Likelihood,
}

impl IdentificationRun<'_> {
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

    fn fit(&mut self, formulation: Formulation) -> Result<SelectedFit, Error> {
        let begin = Instant::now();
        let (best, odd, residual_std) = match formulation {
            Formulation::Points(target) => {
                let found = self.search(target).run(&self.options.car.body, &self.points)?;
                let mut likelihood = Likelihood::new(&self.options.car, self.recordings);
                likelihood.cancel = self.progress.cancel.clone();
                let best = SelectedFit {
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
                let best = SelectedFit {
                    unknowns,
                    active,
                    gains,
                    minimum,
                    optima,
                    convergence,
                    likelihood,
                };
                (best, [0.0; 3], None)
            }
        };
        let (minimum, covariance) = (&best.minimum, covariance(&best.minimum));
        self.fitted.push(FormulationFit {
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
        let is_start = |fitted: &&FormulationFit| fitted.formulation == START;
        self.fitted.iter().filter(is_start).map(|fitted| fitted.tires).collect()
    }

    /// Everything that is reported of the deciding fit.
    fn report(
        self,
        fit: &SelectedFit,
        smoothed: Vec<SmoothedDrive>,
        begin: Instant,
    ) -> Result<Identification, Error> {
        let SelectedFit { unknowns, minimum, likelihood, .. } = fit;
        let options = self.options;
        let series = series::series(&options.car, self.recordings, likelihood, unknowns);
        let joint = JointPosterior {
            likelihood,
            noise: unknowns.noise,
            expected: options.expected(),
            active: fit.active.clone(),
            held: unknowns.causes,
            std: options.error_std(),
        };
        let corners = corners(&options.prior.bounds);
        let marginal = MarginalPosterior::new(&joint, &minimum.x, &minimum.model.hessian, &corners);
        let laplace = marginal.laplace(minimum, corners);
        // Fits to points do not maximise the likelihood, so that its residuals say nothing of them.
        let blocks = self.has_likelihood().then(|| {
            let step = Drive::shortest_step(self.recordings);
            BlockScores::about(&joint, minimum, &laplace.corners, step)
        });
        let scatter = blocks.as_ref().and_then(BlockScores::scatter);
        let (model, causes) = self.test_model(fit, &joint, &series, blocks.as_ref());
        let evidence = Evidence {
            fit,
            joint: &joint,
            laplace: &laplace,
            scatter: scatter.as_ref(),
            slip_range: Axles::new(|axle| series::slip_range(&series, axle)),
        };
        let draws = self.draw(&evidence)?;
        self.progress.report(0.7, "judging")?;
        let covariance = evidence.covariance();
        let estimates = self.estimates(&evidence, &model, &draws, &covariance, begin);
        Ok(Identification {
            tires: published(&estimates, unknowns.tires),
            estimates,
            covariance: covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
            noise: unknowns.noise,
            causes,
            model,
            errors: unknowns.causes,
            convergence: fit.convergence.clone(),
            innovations: Innovations::of(&series),
            formulations: self.fitted,
            posterior: draws.axles,
            gaussian: draws.svi.map(|(gaussian, _)| gaussian),
            samples: points::samples(&self.points),
            series,
            smoothed,
            seconds: begin.elapsed().as_secs_f64(),
        })
    }

    /// Whether the deciding fit maximises the likelihood.
    fn has_likelihood(&self) -> bool {
        self.options.method == Formulation::PredictionError
    }

    /// Whether tires, errors and noises describe the drives, and the errors as that has them.
    fn test_model(
        &self,
        fit: &SelectedFit,
        joint: &JointPosterior,
        series: &[Series],
        blocks: Option<&BlockScores>,
    ) -> (ModelVerdict, Vec<CauseEstimate>) {
        let SelectedFit { unknowns, gains, minimum, .. } = fit;
        let step = Drive::shortest_step(self.recordings);
        let errors =
            summary::summarise_errors(minimum, joint, gains, unknowns, &self.options.car, step);
        let Some(blocks) = blocks else {
            return summary::apply_model_verdict(ModelVerdict::default(), errors);
        };
        let inputs = self.recordings.iter().map(|drive| unknowns.causes.true_inputs(drive));
        let recordings = &inputs.collect::<Vec<_>>();
        let plausible = errors.iter().map(|it| it.test.clone()).collect();
        let model = adequacy::test_model(&ModelResiduals { recordings, series }, blocks, plausible);
        summary::apply_model_verdict(model, errors)
    }

    /// Draws from the posterior where there is a likelihood, else as the curvature of the cost has it.
    fn draw(&self, evidence: &Evidence) -> Result<TireDraws, Error> {
        let Evidence { fit, joint, laplace, scatter, slip_range } = *evidence;
        let DriveOptions { prior, svi, seed, posterior, .. } = *self.options;
        let settings =
            DrawSettings { prior, slip_range, svi, noise_std: evidence.noise_std(), scatter, seed };
        if posterior && !evidence.is_rough() && self.has_likelihood() {
            let go_on = || !self.progress.cancel.is_cancelled();
            let draws = posterior_samples::posterior(laplace, joint, &fit.optima, &settings, go_on);
            if self.progress.cancel.is_cancelled() {
                return Err(Error::Cancelled);
            }
            if let Some(draws) = draws {
                return Ok(draws);
            }
        }
        Ok(posterior_samples::normal(laplace, scatter, seed))
    }

    /// The estimates of both axles with their verdicts.
    fn estimates(
        &self,
        evidence: &Evidence,
        model: &ModelVerdict,
        draws: &TireDraws,
        covariance: &DMatrix<f64>,
        begin: Instant,
    ) -> Axles<Estimate> {
        let Evidence { fit, joint, laplace, scatter, slip_range } = *evidence;
        let prior = self.options.prior;
        // Draws of the posterior are as wide already; profiles go along the likelihood.
        let scattering =
            scatter.filter(|_| draws.exact().is_none()).map(|it| laplace.scattering(&it.blocks));
        let is_rough = self.has_likelihood().then(|| evidence.is_rough());
        let judge = verdict::Judge {
            laplace: scattering.as_ref().unwrap_or(laplace),
            model,
            pressed: &pressed(joint, &fit.minimum, &prior, is_rough),
            draws,
            covariance,
            profile: self.options.profile && self.has_likelihood(),
            prior,
            slip_range,
            samples: fit.likelihood.samples(),
            noise_std: evidence.noise_std(),
            convergence: fit.convergence.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        };
        judge.estimates()
    }
}

/// What the deciding fit says of the tires.
#[derive(Clone, Copy)]
struct Evidence<'a> {
    fit: &'a SelectedFit,
    joint: &'a JointPosterior<'a>,
    laplace: &'a LaplaceApproximation<'a>,
    /// What intervals are widened to, if parts of the drives that were not fitted ask for it.
    scatter: Option<&'a Scatter>,
    /// Slips that were reached [rad].
    slip_range: Axles<[f64; 2]>,
}

impl Evidence<'_> {
    /// Covariance of B, C, D, E of both axles.
    fn covariance(&self) -> DMatrix<f64> {
        match self.scatter {
            Some(scatter) => scatter.blocks.clone(),
            None => covariance(&self.fit.minimum),
        }
    }

    /// Standard deviation of the noise of the friction coefficient [-].
    fn noise_std(&self) -> f64 {
        self.fit.unknowns.noise.sensor[3] / vehicle::G
    }

    /// Whether rough answers are good enough: a filter with more states takes ten times as long, and scatter decides on intervals of what
    /// does not fit.
    fn is_rough(&self) -> bool {
        self.scatter.is_some() && self.fit.unknowns.is_augmented()
    }
}

/// What the bounds do to both tires: where one stands on a bound, both are looked for in a wider box, roughly or with
/// all digits, if they are those of the likelihood.
fn pressed(
    joint: &JointPosterior,
    minimum: &Minimum,
    prior: &Prior,
    likely: Option<bool>,
) -> Axles<ActiveBounds> {
    let n = SIZE + joint.active.len();
    let start = minimum.x.rows(0, n).into_owned();
    let best = from_vector(&start);
    Axles::new(|axle| {
        ActiveBounds::about(prior, &best[axle].theta(), |wider| {
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
        let quantity = |i: usize| Quantity::from(TireParameters::<f64>::PARAMETERS[i]);
        let value = |i: usize| estimates[axle].mean.get(&quantity(i)).copied().unwrap_or(fitted[i]);
        TireParameters::from(std::array::from_fn(value))
    })
}

/// Covariance of B, C, D, E of both axles, whatever else was fitted.
fn covariance(minimum: &Minimum) -> DMatrix<f64> {
    inverse(&minimum.model.hessian).view((0, 0), (SIZE, SIZE)).into_owned()
}
