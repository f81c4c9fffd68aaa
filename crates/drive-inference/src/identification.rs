//! Identification of both tires from drives: smoothed states, fits, posterior, verdicts, in this order.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]

use std::cell::OnceCell;
use std::time::Instant;

use nalgebra::DMatrix;
use numerics::sqp::{self, Objective, SqpMinimum};
use preparation::Drive;
use rayon::prelude::*;
use tire_inference::axles::Axles;
use tire_inference::estimate::TireEstimate;
use tire_inference::model::{FitTest, ModelVerdict, SystematicErrorEstimate};
use tire_inference::parameters::TireParameters;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::ActiveBounds;

use crate::adequacy::{self, BlockScores, CHANNELS, ModelResiduals, ScatterCovariances};
use crate::error::Error;
use crate::global::{COARSE, FINE};
use crate::joint_posterior::{JointPosterior, MarginalPosterior};
use crate::laplace::{LaplaceApproximation, inverse_hessian};
use crate::likelihood::{DriveLikelihood, DriveNoise, DriveUnknowns};
use crate::noise_estimate::NoiseSpecification;
use crate::options::{DriveOptions, FitFormulation, NoiseOption};
use crate::outliers::{self, Outliers};
use crate::pem::SelectedFit;
use crate::points::{self, RegressionPoint};
use crate::posterior_samples::{self, DrawSettings, TireDraws};
use crate::problem::PredictionErrorProblem;
use crate::progress::{ProgressReporter, with_progress};
use crate::regression::RegressionTarget;
use crate::result::{DriveIdentification, FormulationFit, InnovationStatistics};
use crate::series::IdentificationSeries;
use crate::smoothing::{self, SmoothedDrive};
use crate::tires::{SIZE, Tires, box_corners, from_array, from_vector};
use crate::{error, input_selection, search, series, steering_steps, summary, verdict};

/// What prediction errors start from.
const START: FitFormulation = FitFormulation::Points(RegressionTarget::AccelerationAndYaw);

/// Identifies both axles from recordings of one car. `progress` receives the share done and the next stage, again and again; `false`
/// cancels the work.
///
/// # Errors
///
/// [`Error`] if recordings are unusable or no start leads anywhere, [`Error::Cancelled`] if the work was cancelled.
pub fn identify_tires(
    recordings: &[Drive],
    options: &DriveOptions,
    progress: &mut dyn FnMut(f64, &str) -> bool,
) -> Result<DriveIdentification, Error> {
    let begin = Instant::now();
    error::check_recordings(recordings)?;
    let noise = match options.noises {
        NoiseOption::Known(noise) => noise,
        NoiseOption::Estimated => DriveNoise::from_sensor_stds(recordings[0].difference_noise()),
    };
    with_progress(progress, |progress| {
        progress.report_stage(0.0, "smoothing")?;
        let smoothed = smooth_recordings(recordings, options, &noise, progress)?;
        let both = recordings.iter().zip(&smoothed);
        let points = both.map(|(drive, it)| points::regression_points(&options.car, drive, &it.states));
        let points = points.collect();
        let interpolated = OnceCell::new();
        let (fitted, outliers) = (Vec::new(), Outliers::default());
        let mut run = IdentificationRun { recordings, options, noise, points, fitted, outliers, progress };
        let mut decisive = None;
        for formulation in run.formulations_to_fit() {
            progress.report_stage(0.2, formulation.title())?;
            if formulation == FitFormulation::PredictionError {
                let (recordings, outliers) = run.recordings_to_predict();
                (run.recordings, run.outliers) = (interpolated.get_or_init(|| recordings), outliers);
            }
            let best = run.fit_formulation(formulation)?;
            if formulation == options.method {
                decisive = Some(best);
            }
        }
        run.fitted.sort_by_key(|fitted| fitted.formulation == options.method);
        let Some(decisive) = decisive else { return Err(Error::NoStart { starts: 0 }) };
        progress.report_stage(0.3, "drawing from the posterior")?;
        run.into_identification(&decisive, smoothed, begin)
    })
}

/// The nominal car along each recording.
fn smooth_recordings(
    recordings: &[Drive],
    options: &DriveOptions,
    noise: &DriveNoise,
    progress: &ProgressReporter,
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
    points: Vec<Vec<RegressionPoint>>,
    fitted: Vec<FormulationFit>,
    outliers: Outliers,
    progress: &'a ProgressReporter,
}

impl IdentificationRun<'_> {
    /// All formulations to fit, each once: that which prediction errors start from, those to compare, the deciding one.
    fn formulations_to_fit(&self) -> Vec<FitFormulation> {
        let wanted = self.options.compare.iter().copied().chain([self.options.method]);
        let mut all: Vec<FitFormulation> = wanted.collect();
        if all.contains(&FitFormulation::PredictionError) {
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

    fn fit_formulation(&mut self, formulation: FitFormulation) -> Result<SelectedFit, Error> {
        let begin = Instant::now();
        let (best, odd, residual_std) = match formulation {
            FitFormulation::Points(target) => {
                let found = self.point_fit(target).fit_points(&self.options.car.body, &self.points)?;
                let mut likelihood = DriveLikelihood::new(&self.options.car, self.recordings);
                likelihood.cancel = self.progress.cancel.clone();
                let best = SelectedFit {
                    unknowns: DriveUnknowns::new(&found.tires, &self.noise),
                    active: Vec::new(),
                    gains: Vec::new(),
                    minimum: found.minimum,
                    optima: Vec::new(),
                    convergence: found.convergence,
                    likelihood,
                    interpolation: Drive::common_interpolation(self.recordings),
                };
                (best, found.odd, Some(found.std))
            }
            FitFormulation::PredictionError => {
                let best = self.prediction_error_problem().maximise_likelihood(&self.start_tires())?;
                (best, [0.0; 3], None)
            }
        };
        let (minimum, covariance) = (&best.minimum, tire_covariance(&best.minimum));
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

    fn point_fit(&self, target: RegressionTarget) -> search::PointFit {
        let [_, _, s_r, s_y] = self.noise.sensor;
        search::PointFit {
            target,
            weights: self.options.weights,
            expected: self.options.tire_regularisation(),
            odd_terms: self.options.odd_terms,
            starts: self.options.starts,
            seed: self.options.seed,
            bounds: self.options.prior.bounds,
            // Errors of slip and load come on top of the noises; the fit corrects these guesses.
            std: [s_y.max(0.02), 1.5 * s_r + 1e-3, 200.0, 200.0],
        }
    }

    fn prediction_error_problem(&self) -> PredictionErrorProblem<'_> {
        PredictionErrorProblem {
            car: &self.options.car,
            recordings: self.recordings,
            bounds: self.options.prior.bounds,
            expected: self.options.tire_regularisation(),
            noise: match self.options.noises {
                NoiseOption::Known(noise) => NoiseSpecification::Given(noise),
                NoiseOption::Estimated => NoiseSpecification::Estimated(self.noise),
            },
            std: self.options.error_std(),
            search: self.options.causes.wanted,
            cancel: self.progress.cancel.clone(),
        }
    }

    /// The recordings without outliers, with inputs that move between rows as the likelihood has it.
    fn recordings_to_predict(&self) -> (Vec<Drive>, Outliers) {
        let start = self.start_tires();
        let Some(start) = start.first() else { return (self.recordings.to_vec(), Outliers::default()) };
        let problem = self.prediction_error_problem();
        let (recordings, outliers) = outliers::without_outliers(&problem, start)
            .unwrap_or_else(|| (self.recordings.to_vec(), Outliers::default()));
        let problem = PredictionErrorProblem { recordings: &recordings, ..problem };
        let interpolation = input_selection::select_interpolations(&problem, start);
        (input_selection::with_interpolations(&recordings, interpolation), outliers)
    }

    /// What fits to points ended with.
    fn start_tires(&self) -> Vec<Tires> {
        let is_start = |fitted: &&FormulationFit| fitted.formulation == START;
        self.fitted.iter().filter(is_start).map(|fitted| fitted.tires).collect()
    }

    /// Everything that is reported of the deciding fit.
    fn into_identification(
        self,
        fit: &SelectedFit,
        smoothed: Vec<SmoothedDrive>,
        begin: Instant,
    ) -> Result<DriveIdentification, Error> {
        let SelectedFit { unknowns, minimum, likelihood, .. } = fit;
        let options = self.options;
        let interpolation = fit.interpolation;
        let series = series::identification_series(&options.car, self.recordings, likelihood, unknowns);
        let joint = JointPosterior {
            likelihood,
            noise: unknowns.noise,
            expected: options.tire_regularisation(),
            active: fit.active.clone(),
            held: unknowns.causes,
            std: options.error_std(),
        };
        let corners = box_corners(&options.prior.bounds);
        let marginal = MarginalPosterior::new(&joint, &minimum.x, &minimum.model.hessian, &corners);
        let laplace = marginal.laplace_approximation(minimum, corners);
        // Fits to points do not maximise the likelihood, so that its residuals say nothing of them.
        let blocks = self.is_likelihood_maximised().then(|| {
            let step = Drive::shortest_step(self.recordings);
            BlockScores::at_minimum(&joint, minimum, &laplace.corners, step)
        });
        let scatter = blocks.as_ref().and_then(BlockScores::scatter_covariances);
        let (model, causes) = self.test_model(fit, &joint, &series, blocks.as_ref());
        let evidence = TireEvidence {
            fit,
            joint: &joint,
            laplace: &laplace,
            scatter: scatter.as_ref(),
            slip_range: Axles::from_fn(|axle| series::slip_range(&series, axle)),
        };
        let draws = self.draw_tires(&evidence)?;
        self.progress.report_stage(0.7, "judging")?;
        let covariance = evidence.tire_covariance();
        let estimates = self.axle_estimates(&evidence, &model, &draws, &covariance, begin);
        Ok(DriveIdentification {
            interpolation,
            tires: published_tires(&estimates, unknowns.tires),
            estimates,
            covariance: covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
            noise: unknowns.noise,
            causes,
            model,
            errors: unknowns.causes,
            convergence: fit.convergence.clone(),
            innovations: InnovationStatistics::from_series(&series),
            formulations: self.fitted,
            posterior: draws.axles,
            gaussian: draws.svi.map(|(gaussian, _)| gaussian),
            samples: points::friction_samples(&self.points),
            series,
            smoothed,
            seconds: begin.elapsed().as_secs_f64(),
        })
    }

    /// Whether the deciding fit maximises the likelihood.
    fn is_likelihood_maximised(&self) -> bool {
        self.options.method == FitFormulation::PredictionError
    }

    /// Whether tires, errors and noises describe the drives, and the errors as that has them.
    fn test_model(
        &self,
        fit: &SelectedFit,
        joint: &JointPosterior,
        series: &[IdentificationSeries],
        blocks: Option<&BlockScores>,
    ) -> (ModelVerdict, Vec<SystematicErrorEstimate>) {
        let SelectedFit { unknowns, gains, minimum, .. } = fit;
        let step = Drive::shortest_step(self.recordings);
        let mut errors = summary::summarise_errors(minimum, joint, gains, unknowns, &self.options.car, step);
        if self.outliers.count() > 0 {
            let values = CHANNELS.len() * self.recordings.iter().map(Drive::len).sum::<usize>();
            errors.push(summary::summarise_outliers(&self.outliers, values));
        }
        summary::sort_by_gain(&mut errors);
        let Some(blocks) = blocks else {
            return summary::apply_model_verdict(ModelVerdict::default(), errors);
        };
        let inputs = self.recordings.iter().map(|drive| unknowns.causes.corrected_inputs(drive));
        let recordings = &inputs.collect::<Vec<_>>();
        let mut others: Vec<FitTest> = errors.iter().map(|it| it.test.clone()).collect();
        others.push(steering_steps::steering_step_test(self.recordings, &self.options.car, unknowns));
        let likeliest = summary::likeliest_cause(&errors);
        let model = adequacy::test_model(&ModelResiduals { recordings, series }, blocks, others, likeliest);
        summary::apply_model_verdict(model, errors)
    }

    /// Draws from the posterior where there is a likelihood, else as the curvature of the cost has it.
    fn draw_tires(&self, evidence: &TireEvidence) -> Result<TireDraws, Error> {
        let TireEvidence { fit, joint, laplace, scatter, slip_range } = *evidence;
        let DriveOptions { prior, svi, seed, posterior, .. } = *self.options;
        let settings =
            DrawSettings { prior, slip_range, svi, noise_std: evidence.noise_std(), scatter, seed };
        if posterior && !evidence.is_rough() && self.is_likelihood_maximised() {
            let go_on = || !self.progress.cancel.is_cancelled();
            let draws =
                posterior_samples::draw_drive_posterior(laplace, joint, &fit.optima, &settings, go_on);
            if self.progress.cancel.is_cancelled() {
                return Err(Error::Cancelled);
            }
            if let Some(draws) = draws {
                return Ok(draws);
            }
        }
        Ok(posterior_samples::draw_normal_tires(laplace, scatter, seed))
    }

    /// The estimates of both axles with their verdicts.
    fn axle_estimates(
        &self,
        evidence: &TireEvidence,
        model: &ModelVerdict,
        draws: &TireDraws,
        covariance: &DMatrix<f64>,
        begin: Instant,
    ) -> Axles<TireEstimate> {
        let TireEvidence { fit, joint, laplace, scatter, slip_range } = *evidence;
        let prior = self.options.prior;
        // Draws of the posterior are as wide already; profiles go along the likelihood.
        let scattering = scatter
            .filter(|_| draws.posterior_draws().is_none())
            .map(|it| laplace.with_covariance(&it.blocks));
        let is_rough = self.is_likelihood_maximised().then(|| evidence.is_rough());
        let judge = verdict::TireJudge {
            laplace: scattering.as_ref().unwrap_or(laplace),
            model,
            pressed: &active_bounds(joint, &fit.minimum, &prior, is_rough),
            draws,
            covariance,
            profile: self.options.profile && self.is_likelihood_maximised(),
            prior,
            slip_range,
            samples: fit.likelihood.sample_count(),
            noise_std: evidence.noise_std(),
            convergence: fit.convergence.clone(),
            seconds: begin.elapsed().as_secs_f64(),
        };
        judge.axle_estimates()
    }
}

/// What the deciding fit says of the tires.
#[derive(Clone, Copy)]
struct TireEvidence<'a> {
    fit: &'a SelectedFit,
    joint: &'a JointPosterior<'a>,
    laplace: &'a LaplaceApproximation<'a>,
    /// What intervals are widened to, if parts of the drives that were not fitted ask for it.
    scatter: Option<&'a ScatterCovariances>,
    /// Slips that were reached [rad].
    slip_range: Axles<[f64; 2]>,
}

impl TireEvidence<'_> {
    /// Covariance of B, C, D, E of both axles.
    fn tire_covariance(&self) -> DMatrix<f64> {
        match self.scatter {
            Some(scatter) => scatter.blocks.clone(),
            None => tire_covariance(&self.fit.minimum),
        }
    }

    /// Standard deviation of the noise of the friction coefficient [-].
    fn noise_std(&self) -> f64 {
        self.fit.unknowns.noise.sensor[3] / vehicle::G
    }

    /// Whether rough answers are good enough: a filter with more states takes ten times as long, and scatter decides on intervals of what
    /// does not fit.
    fn is_rough(&self) -> bool {
        self.scatter.is_some() && self.fit.unknowns.has_augmented_state()
    }
}

/// What the bounds do to both tires: where one stands on a bound, both are looked for in a wider box, roughly or with
/// all digits, if they are those of the likelihood.
fn active_bounds(
    joint: &JointPosterior,
    minimum: &SqpMinimum,
    prior: &Prior,
    likely: Option<bool>,
) -> Axles<ActiveBounds> {
    let n = SIZE + joint.active.len();
    let start = minimum.x.rows(0, n).into_owned();
    let best = from_vector(&start);
    Axles::from_fn(|axle| {
        ActiveBounds::with_search(prior, &best[axle].to_theta(), |wider| {
            let Some(is_rough) = likely else { return (best[axle].to_theta(), 0.0) };
            let [lower, upper] = joint.box_corners(&wider.bounds);
            let found =
                sqp::minimise_sqp(joint, &lower, &upper, &start, if is_rough { COARSE } else { FINE });
            let gain = 2.0 * (joint.cost(&start) - found.model.cost);
            (from_vector(&found.x)[axle].to_theta(), gain)
        })
    })
}

/// The tires of the estimates, which are the fitted ones unless the posterior rejects those.
fn published_tires(estimates: &Axles<TireEstimate>, fitted: Tires) -> Tires {
    Axles::from_fn(|axle| {
        let fitted = fitted[axle].into_array();
        let quantity = |i: usize| Quantity::from(TireParameters::<f64>::PARAMETERS[i]);
        let value = |i: usize| estimates[axle].mean.get(&quantity(i)).copied().unwrap_or(fitted[i]);
        TireParameters::from(std::array::from_fn(value))
    })
}

/// Covariance of B, C, D, E of both axles, whatever else was fitted.
fn tire_covariance(minimum: &SqpMinimum) -> DMatrix<f64> {
    inverse_hessian(&minimum.model.hessian).view((0, 0), (SIZE, SIZE)).into_owned()
}
