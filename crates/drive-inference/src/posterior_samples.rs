//! Draws tires from what the drives say of them: from the posterior of prediction errors, or as the curvature of a cost has it.

use nalgebra::{Cholesky, DMatrix, DVector};
use numerics::importance;
use numerics::resampling::systematic;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use tire_inference::parameters::Parameter;
use tire_inference::posterior::Posterior;
use tire_inference::posterior::report::{Band, Method, Report, Status};
use tire_inference::variational;

use crate::coordinates::Coordinates;
use crate::likelihood::Theta8;
use crate::profile::{Explored, inverse};
use crate::variational::{DriveDensity, Variational, of_axle};

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
pub struct Drawn {
    /// Of the front and the rear axle; a draw of both has the same place in both.
    pub axles: [Posterior; 2],
    /// What the draws are; absent where nobody asked for the posterior.
    pub reports: Option<[Report; 2]>,
    /// Draws from the normal distribution of variational inference, and what it said.
    pub svi: Option<([Posterior; 2], [variational::report::Report; 2])>,
}

impl Drawn {
    /// Draws that are from the posterior.
    pub fn exact(&self) -> Option<&[Posterior; 2]> {
        self.reports.as_ref().filter(|[report, _]| report.is_exact()).map(|_| &self.axles)
    }
}

/// What is wanted of draws.
pub struct Wanted {
    /// Slips of the bands [rad]: smallest and largest of each axle.
    pub slip_range: [[f64; 2]; 2],
    /// Whether the first distribution is that of variational inference.
    pub svi: bool,
    /// Standard deviation of the noise of the friction coefficient [-], to be told.
    pub noise_std: f64,
    /// Of the generators.
    pub seed: u64,
}

/// From the posterior, the prior being flat in the box: with weights, from t distributions about the optima, which have the given
/// costs. Where these do not come close to it, as with slip so low that only the stiffness is known, the status says so and the draws
/// are from the normal distribution. `None` if the work was called off, or the cost has no curvature.
pub fn posterior(
    explored: &Explored,
    optima: &[(Theta8, f64)],
    &Wanted { slip_range, svi, noise_std, seed }: &Wanted,
    go_on: impl Fn() -> bool,
) -> Option<Drawn> {
    let best: Theta8 = std::array::from_fn(|i| explored.x[i]);
    let coordinates = Coordinates::new(&explored.corners, &best);
    let density = DriveDensity { explored, coordinates: &coordinates };
    let log_density = |points: &[DVector<f64>]| density.logs(points);
    let about = |theta: &Theta8, information: &DMatrix<f64>| {
        let z = coordinates.point(theta);
        let covariance = inverse(&coordinates.information(&z, information));
        (z, covariance)
    };
    let others =
        optima.iter().filter(|(theta, cost)| *theta != best && *cost < explored.cost + COMPETITIVE);
    let others = others.map(|(theta, _)| {
        let model = explored.objective.model(&DVector::from_column_slice(theta));
        about(theta, &model.hessian)
    });
    let mut starts: Vec<_> =
        std::iter::once(about(&best, &explored.information)).chain(others).collect();
    let variational = if svi { Variational::fit(&density, starts[0].clone(), seed) } else { None };
    if let Some(variational) = &variational {
        starts[0] = variational.moments();
    }
    let sampled = importance::sample(&log_density, &starts, ENOUGH, seed, go_on)?;
    let even = sampled.is_exact();
    let axles = if even {
        let theta = |index: usize| coordinates.parameters(&sampled.points[index]).map(|(it, _)| it);
        let chosen = systematic(&sampled.weights, DRAWS, seed).into_iter();
        let chosen: Vec<Theta8> = chosen.filter_map(theta).collect();
        [0, 4].map(|o| Posterior { draws: chosen.iter().map(|theta| of_axle(theta, o)).collect() })
    } else {
        // A handful of draws would look like certainty.
        normal(&best, &explored.in_box(), &explored.corners, seed).axles
    };
    let report = |axle: usize| {
        let posterior = &axles[axle];
        let mean = |p: &Parameter| (p.name().to_owned(), posterior.mean(*p));
        Report {
            method: Method::Importance,
            status: if even { Status::Exact } else { Status::Uneven },
            effective_share: sampled.diagnosis.effective_share,
            largest_weight: sampled.diagnosis.largest_weight,
            k_hat: Some(sampled.diagnosis.k_hat),
            cells: sampled.evaluations,
            levels: sampled.rounds,
            mean: Parameter::ALL[..4].iter().map(mean).collect(),
            band: Some(Band::new(posterior, slip_range[axle], BAND)),
            ..Report::default()
        }
    };
    let reports = Some([report(0), report(1)]);
    let svi = variational.map(|variational| {
        let correction = sampled.diagnosis;
        let told = |axle| variational.report(axle, explored, noise_std, correction, starts.len());
        let told = [0, 1].map(told);
        (variational.gaussian, told)
    });
    Some(Drawn { axles, reports, svi })
}

/// From the normal distribution about the best parameters, as far as it is in the box; none if its covariance is not positive
/// definite.
pub fn normal(
    best: &Theta8,
    covariance: &DMatrix<f64>,
    [lower, upper]: &[DVector<f64>; 2],
    seed: u64,
) -> Drawn {
    let mut rng = Pcg64::seed_from_u64(seed);
    let axles = [0, 4].map(|o| {
        let own = covariance.view((o, o), (4, 4)).into_owned();
        let Some(factor) = Cholesky::new(own) else { return Posterior::default() };
        let best = DVector::from_column_slice(&best[o..o + 4]);
        let inside =
            |x: &DVector<f64>| (0..4).all(|i| (lower[o + i]..=upper[o + i]).contains(&x[i]));
        let mut normal = || {
            let z = DVector::from_fn(4, |_, _| rng.sample::<f64, _>(StandardNormal));
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
            let x: [f64; 4] = std::array::from_fn(|i| x[i].clamp(lower[o + i], upper[o + i]));
            [x[0], x[1], x[2], x[3], 0.0, 0.0]
        };
        Posterior { draws: (0..DRAWS).map(&mut draw).collect() }
    });
    Drawn { axles, reports: None, svi: None }
}
