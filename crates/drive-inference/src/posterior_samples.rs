//! Draws tires from what the drives say of them: from the posterior of prediction errors, or as the curvature of a cost has it.

use nalgebra::{Cholesky, DMatrix, DVector};
use numerics::importance;
use numerics::resampling::systematic_resample;
use numerics::variational::LogDensity;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use tire_inference::axles::{Axle, Axles};
use tire_inference::parameters::{Parameter, TireParameters};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::{CurveBand, PosteriorReport, SamplingMethod, SamplingStatus};
use tire_inference::prior::Prior;
use tire_inference::variational;

use crate::adequacy::ScatterCovariances;
use crate::coordinates::UnboundedCoordinates;
use crate::joint_posterior::JointPosterior;
use crate::laplace::{LaplaceApproximation, axle_submatrix, inverse_hessian};
use crate::pem::LocalLikelihoodOptimum;
use crate::tires::{SIZE, Tires, from_vector, parameter_block};
use crate::variational::{DriveLogPosterior, VariationalTirePosterior};

/// How many there are.
const DRAWS: usize = 2048;
/// Effective draws of the posterior: ends of 95 % intervals are then off by a tenth of a standard deviation.
const ENOUGH: f64 = 500.0;
/// How often a draw outside the box is made again before it is moved to its border.
const TRIES: usize = 200;
/// Slips of the band.
const BAND: usize = 41;
/// Optima whose cost is higher than the least by this [nat] are no modes.
const COMPETITIVE: f64 = 10.0;

/// Draws of both axles.
#[derive(Clone, Debug, Default)]
pub struct TireDraws {
    /// Of each axle; a draw of both has the same index in both.
    pub axles: Axles<PosteriorSamples>,
    /// What the draws are; absent where nobody asked for the posterior.
    pub reports: Option<Axles<PosteriorReport>>,
    /// Draws from the normal distribution of variational inference, and what it said.
    pub svi: Option<(Axles<PosteriorSamples>, Axles<variational::report::VariationalReport>)>,
}

impl TireDraws {
    /// Draws that are from the posterior.
    pub fn posterior_draws(&self) -> Option<&Axles<PosteriorSamples>> {
        self.reports.as_ref().filter(|reports| reports.front.is_exact()).map(|_| &self.axles)
    }
}

/// What draws are to be like.
#[derive(Clone, Copy)]
pub struct DrawSettings<'a> {
    /// What is known of each tire before any data.
    pub prior: Prior,
    /// Slips of the bands [rad]: smallest and largest of each axle.
    pub slip_range: Axles<[f64; 2]>,
    /// Whether the first distribution is that of variational inference.
    pub svi: bool,
    /// Standard deviation of the noise of the friction coefficient [-], to be reported.
    pub noise_std: f64,
    /// What draws are widened to.
    pub scatter: Option<&'a ScatterCovariances>,
    /// Of the generators.
    pub seed: u64,
}

/// From the posterior, the prior being flat in the box: with weights, from t distributions about the optima, which have the given
/// costs. Where these do not come close to it, as with slip so low that only the stiffness is known, the status says so and the draws
/// are from the normal distribution. `None` if the work was called off, or the cost has no curvature.
pub fn draw_drive_posterior(
    laplace: &LaplaceApproximation,
    joint: &JointPosterior,
    optima: &[LocalLikelihoodOptimum],
    &DrawSettings { prior, slip_range, svi, noise_std, scatter, seed }: &DrawSettings,
    go_on: impl Fn() -> bool,
) -> Option<TireDraws> {
    let best = from_vector(&laplace.x);
    let coordinates = UnboundedCoordinates::new(&laplace.corners, &best);
    let (errors, cost) = (joint.active.len(), laplace.cost);
    let coordinates = &coordinates;
    let density = DriveLogPosterior { objective: joint, errors, cost, coordinates };
    let log_density = |points: &[DVector<f64>]| density.log_densities(points);
    let competitive = |optimum: &&LocalLikelihoodOptimum| optimum.cost < laplace.cost + COMPETITIVE;
    let mut starts: Vec<_> = optima
        .iter()
        .filter(competitive)
        .map(|optimum| density.normal_at_minimum(&optimum.x, &optimum.hessian))
        .collect();
    // Of the tires alone: errors follow them.
    let of_tires = DriveLogPosterior { objective: laplace.objective, errors: 0, cost, coordinates };
    let (mean, covariance) = of_tires.normal_at_minimum(&laplace.x, &laplace.information);
    let variational =
        if svi { VariationalTirePosterior::fit(&of_tires, mean, covariance, seed) } else { None };
    if let (Some(variational), 0) = (&variational, errors) {
        starts[0] = variational.mean_and_covariance();
    }
    let sampled = importance::sample_by_importance(&log_density, &starts, ENOUGH, seed, go_on)?;
    let even = sampled.is_exact();
    let axles = if even {
        resample_and_widen(&density, &sampled, &best, scatter, seed)
    } else {
        // A handful of draws would look like certainty.
        draw_normal_tires(laplace, scatter, seed).axles
    };
    let report = |axle: Axle| {
        let posterior = &axles[axle];
        let band = CurveBand::new(posterior, slip_range[axle], BAND);
        // A normal distribution that the box cuts need not hold the tire that it is about.
        let band = if even { band } else { band.widened_to_contain(&best[axle].to_theta()) };
        let mean = |p: &Parameter| ((*p).into(), posterior.parameter_mean(*p));
        PosteriorReport {
            method: SamplingMethod::Importance,
            status: if even { SamplingStatus::Exact } else { SamplingStatus::Uneven },
            effective_share: sampled.diagnosis.effective_share,
            largest_weight: sampled.diagnosis.largest_weight,
            k_hat: Some(sampled.diagnosis.k_hat),
            cells: sampled.evaluations,
            levels: sampled.rounds,
            mean: TireParameters::<f64>::PARAMETERS.iter().map(mean).collect(),
            band: Some(band),
            ..PosteriorReport::default()
        }
    };
    let reports = Some(Axles::from_fn(report));
    let svi = variational.map(|variational| {
        let correction = sampled.diagnosis;
        let report = |axle| {
            let counts = [starts.len(), errors];
            variational.axle_report(axle, laplace, &prior, noise_std, correction, counts)
        };
        let reports = Axles::from_fn(report);
        (variational.gaussian, reports)
    });
    Some(TireDraws { axles, reports, svi })
}

/// Draws with equal weights, widened where blocks of the drives scatter more than the curvature says.
fn resample_and_widen(
    density: &DriveLogPosterior,
    sampled: &importance::WeightedDraws,
    best: &Tires,
    scatter: Option<&ScatterCovariances>,
    seed: u64,
) -> Axles<PosteriorSamples> {
    let coordinates = density.coordinates;
    let widen = scatter.and_then(|scatter| widening_matrix(scatter, coordinates, best));
    let centre = coordinates.z_from_tires(best);
    let tires = |index: usize| {
        let z = sampled.points[index].rows(0, SIZE).into_owned();
        let wide = widen.as_ref().map(|widen| &centre + widen * (&z - &centre));
        density.tires_at(wide.as_ref().unwrap_or(&z))
    };
    let chosen = systematic_resample(&sampled.weights, DRAWS, seed).into_iter();
    let chosen: Vec<Tires> = chosen.filter_map(tires).collect();
    let draws = |axle| chosen.iter().map(|tires| tires[axle].to_theta()).collect();
    Axles::from_fn(|axle| PosteriorSamples { samples: draws(axle) })
}

/// Maps distances from the best tires so that their covariance by the curvature becomes that of the blocks.
fn widening_matrix(
    scatter: &ScatterCovariances,
    coordinates: &UnboundedCoordinates,
    best: &Tires,
) -> Option<DMatrix<f64>> {
    let z = coordinates.z_from_tires(best);
    let none = coordinates.transform_information(&z, &DMatrix::zeros(SIZE, SIZE));
    let factor = |covariance: &DMatrix<f64>| {
        let information = coordinates.transform_information(&z, &inverse_hessian(covariance)) - &none;
        Some(Cholesky::new(inverse_hessian(&information))?.l())
    };
    let (curvature, blocks) = (factor(&scatter.curvature)?, factor(&scatter.blocks)?);
    Some(blocks * curvature.try_inverse()?)
}

/// From the normal distribution about the best parameters, as far as it is in the box; none if its covariance is not positive
/// definite.
pub fn draw_normal_tires(
    laplace: &LaplaceApproximation,
    scatter: Option<&ScatterCovariances>,
    seed: u64,
) -> TireDraws {
    let mut rng = Pcg64::seed_from_u64(seed);
    let covariance = scatter.map_or_else(|| laplace.in_box(), |it| it.blocks.clone());
    let [lower, upper] = &laplace.corners;
    let axles = Axles::from_fn(|axle| {
        let Some(factor) = Cholesky::new(axle_submatrix(&covariance, axle)) else {
            return PosteriorSamples::default();
        };
        let at = parameter_block(axle);
        let part = |x: &DVector<f64>| x.rows_range(at.clone()).into_owned();
        let (best, lower, upper) = (part(&laplace.x), part(lower), part(upper));
        let inside = |x: &DVector<f64>| (0..x.len()).all(|i| (lower[i]..=upper[i]).contains(&x[i]));
        let mut normal = || {
            let z = DVector::from_fn(best.len(), |_, _| rng.sample::<f64, _>(StandardNormal));
            &best + factor.l() * z
        };
        let mut draw = |_| {
            let mut x = normal();
            for _ in 0..TRIES {
                if inside(&x) {
                    break;
                }
                x = normal();
            }
            let x: [f64; 4] = std::array::from_fn(|i| x[i].clamp(lower[i], upper[i]));
            TireParameters::from(x).to_theta()
        };
        PosteriorSamples { samples: (0..DRAWS).map(&mut draw).collect() }
    });
    TireDraws { axles, ..TireDraws::default() }
}
