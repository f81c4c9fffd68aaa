//! Draws tires from what the drives say of them: from the posterior of prediction errors, or as the curvature of a cost has it.

use nalgebra::{Cholesky, DMatrix, DVector};
use numerics::importance;
use numerics::resampling::systematic;
use numerics::variational::LogDensity;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use tire_inference::axles::{Axle, Axles};
use tire_inference::parameters::{Parameter, TireParameters};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::{Band, PosteriorReport, SamplingMethod, SamplingStatus};
use tire_inference::prior::Prior;
use tire_inference::variational;

use crate::adequacy::Scatter;
use crate::coordinates::Coordinates;
use crate::joint_posterior::JointPosterior;
use crate::laplace::{LaplaceApproximation, inverse, of_axle};
use crate::pem::Optimum;
use crate::tires::{SIZE, Tires, block, from_vector};
use crate::variational::{DriveDensity, Variational};

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
    pub fn exact(&self) -> Option<&Axles<PosteriorSamples>> {
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
    pub scatter: Option<&'a Scatter>,
    /// Of the generators.
    pub seed: u64,
}

/// From the posterior, the prior being flat in the box: with weights, from t distributions about the optima, which have the given
/// costs. Where these do not come close to it, as with slip so low that only the stiffness is known, the status says so and the draws
/// are from the normal distribution. `None` if the work was called off, or the cost has no curvature.
pub fn posterior(
    laplace: &LaplaceApproximation,
    joint: &JointPosterior,
    optima: &[Optimum],
    &DrawSettings { prior, slip_range, svi, noise_std, scatter, seed }: &DrawSettings,
    go_on: impl Fn() -> bool,
) -> Option<TireDraws> {
    let best = from_vector(&laplace.x);
    let coordinates = Coordinates::new(&laplace.corners, &best);
    let (errors, cost) = (joint.active.len(), laplace.cost);
    let coordinates = &coordinates;
    let density = DriveDensity { objective: joint, errors, cost, coordinates };
    let log_density = |points: &[DVector<f64>]| density.logs(points);
    let competitive = |optimum: &&Optimum| optimum.cost < laplace.cost + COMPETITIVE;
    let mut starts: Vec<_> = optima
        .iter()
        .filter(competitive)
        .map(|optimum| density.about(&optimum.x, &optimum.hessian))
        .collect();
    // Of the tires alone: errors follow them.
    let of_tires = DriveDensity { objective: laplace.objective, errors: 0, cost, coordinates };
    let start = of_tires.about(&laplace.x, &laplace.information);
    let variational = if svi { Variational::fit(&of_tires, start, seed) } else { None };
    if let (Some(variational), 0) = (&variational, errors) {
        starts[0] = variational.moments();
    }
    let sampled = importance::sample(&log_density, &starts, ENOUGH, seed, go_on)?;
    let even = sampled.is_exact();
    let axles = if even {
        choose(&density, &sampled, &best, scatter, seed)
    } else {
        // A handful of draws would look like certainty.
        normal(laplace, scatter, seed).axles
    };
    let report = |axle: Axle| {
        let posterior = &axles[axle];
        let band = Band::new(posterior, slip_range[axle], BAND);
        // A normal distribution that the box cuts need not hold the tire that it is about.
        let band = if even { band } else { band.holding(&best[axle].theta()) };
        let mean = |p: &Parameter| ((*p).into(), posterior.mean(*p));
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
    let reports = Some(Axles::new(report));
    let svi = variational.map(|variational| {
        let correction = sampled.diagnosis;
        let known = (laplace, &prior);
        let report = |axle| {
            let counts = [starts.len(), errors];
            variational.report(axle, known, noise_std, correction, counts)
        };
        let reports = Axles::new(report);
        (variational.gaussian, reports)
    });
    Some(TireDraws { axles, reports, svi })
}

/// Draws with equal weights, widened where blocks of the drives scatter more than the curvature says.
fn choose(
    density: &DriveDensity,
    sampled: &importance::WeightedDraws,
    best: &Tires,
    scatter: Option<&Scatter>,
    seed: u64,
) -> Axles<PosteriorSamples> {
    let coordinates = density.coordinates;
    let widen = scatter.and_then(|scatter| widening(scatter, coordinates, best));
    let centre = coordinates.point(best);
    let tires = |index: usize| {
        let z = sampled.points[index].rows(0, SIZE).into_owned();
        let wide = widen.as_ref().map(|widen| &centre + widen * (&z - &centre));
        density.tires(wide.as_ref().unwrap_or(&z))
    };
    let chosen = systematic(&sampled.weights, DRAWS, seed).into_iter();
    let chosen: Vec<Tires> = chosen.filter_map(tires).collect();
    let draws = |axle| chosen.iter().map(|tires| tires[axle].theta()).collect();
    Axles::new(|axle| PosteriorSamples { samples: draws(axle) })
}

/// Maps distances from the best tires so that their covariance by the curvature becomes that of the blocks.
fn widening(scatter: &Scatter, coordinates: &Coordinates, best: &Tires) -> Option<DMatrix<f64>> {
    let z = coordinates.point(best);
    let none = coordinates.information(&z, &DMatrix::zeros(SIZE, SIZE));
    let factor = |covariance: &DMatrix<f64>| {
        let information = coordinates.information(&z, &inverse(covariance)) - &none;
        Some(Cholesky::new(inverse(&information))?.l())
    };
    let (curvature, blocks) = (factor(&scatter.curvature)?, factor(&scatter.blocks)?);
    Some(blocks * curvature.try_inverse()?)
}

/// From the normal distribution about the best parameters, as far as it is in the box; none if its covariance is not positive
/// definite.
pub fn normal(laplace: &LaplaceApproximation, scatter: Option<&Scatter>, seed: u64) -> TireDraws {
    let mut rng = Pcg64::seed_from_u64(seed);
    let covariance = scatter.map_or_else(|| laplace.in_box(), |it| it.blocks.clone());
    let [lower, upper] = &laplace.corners;
    let axles = Axles::new(|axle| {
        let Some(factor) = Cholesky::new(of_axle(&covariance, axle)) else {
            return PosteriorSamples::default();
        };
        let at = block(axle);
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
            TireParameters::from(x).theta()
        };
        PosteriorSamples { samples: (0..DRAWS).map(&mut draw).collect() }
    });
    TireDraws { axles, ..TireDraws::default() }
}
