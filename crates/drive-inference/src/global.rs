//! Looks for all optima of the likelihood over the tires, with everything else held: on a part of the recordings from many starts,
//! then on all of them from the best.

use nalgebra::DVector;
use numerics::sqp::{self, Objective, SqpLimits, SqpMinimum};
use rayon::prelude::*;
use tire_inference::axles::{Axle, Axles};
use tire_inference::bounds::Bounds;
use tire_inference::parameters::TireParameters;

use crate::error::Error;
use crate::joint_posterior::JointPosterior;
use crate::likelihood::{DriveLikelihood, DriveNoise};
use crate::noise_estimate::NoiseSpecification;
use crate::ridge::{CurveFeatures, reshape_along_ridge};
use crate::search::distinct_minima;
use crate::tires::{Tires, from_vector, to_vector};

/// Mean squared innovation, in units of its variance, above which a start is too far away for the filter to follow.
const EXPLODED: f64 = 3.0;
/// Factors of the process noise that lead from such a start to the noise that is meant.
const HOMOTOPY: [f64; 2] = [1000.0, 30.0];
/// When to stop on the way through the homotopy, on a part of the recordings, and on all of them. B, C and E
/// are so correlated that a residual of 1e-5 would still be tenths of a standard deviation along the ridge.
const ROUGH: SqpLimits = SqpLimits { iterations: 6, target: 1e-3, tolerance: 1e-2, damping: 1e-2 };
pub const COARSE: SqpLimits = SqpLimits { iterations: 15, target: 1e-3, tolerance: 1e-2, damping: 1e-2 };
/// When to stop where every digit counts.
pub const FINE: SqpLimits = SqpLimits { iterations: 40, target: 1e-6, tolerance: 1e-5, damping: 1e-5 };
/// Points on a way to a minimum at which the cost must fall.
const WAYPOINTS: usize = 4;
/// Most starts that are put together from the axles of others.
const MOST_CROSSED: usize = 4;
/// Difference of the costs on a part of the recordings up to which optima are carried on to all of them [nat].
const CLOSE: f64 = 30.0;
/// Fall of the cost on a part of the recordings by other noises that makes other optima possible [nat].
const OTHER_NOISE: f64 = 10.0;

/// A search for tires.
pub struct GlobalSearch<'a> {
    /// The cost; its causes are held.
    pub joint: JointPosterior<'a>,
    /// The box of each axle.
    pub bounds: Bounds,
    /// How the noises are found.
    pub noise: NoiseSpecification,
}

/// What a search found.
pub struct GlobalOptima {
    /// Different minima on all recordings, best first.
    pub minima: Vec<SqpMinimum>,
    /// The noise under which they are minima.
    pub noise: DriveNoise,
    /// Starts that led there.
    pub starts: usize,
    /// Evaluations that it took.
    pub evaluations: usize,
}

impl<'a> GlobalSearch<'a> {
    /// Minimises from all starts and from others along their ridges. Where the noises are estimated, all of them see those of a
    /// minimum near the first start, and the minima those of the best: optima that lie close under one noise are far apart under
    /// another.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn find_optima(&self, starts: &[Tires]) -> Result<GlobalOptima, Error> {
        let thinned = self.joint.likelihood.subsampled();
        let mut thin = self.with_likelihood(&thinned, self.joint.noise);
        let mut starts = starts.to_vec();
        let mut evaluations = 0;
        if let (true, Some(start)) = (self.noise.is_estimated(), starts.first()) {
            let near = thin.minimise_from_tires(start);
            let (noise, more) = self.noise.estimate_noise(&thinned, &thin.joint.unknowns_at(&near.x));
            evaluations += near.evaluations + more;
            starts.push(from_vector(&near.x));
            thin = self.with_likelihood(&thinned, noise);
        }
        let (mut candidates, count, more) = thin.candidate_minima(&starts);
        evaluations += more;
        let none = || Error::NoStart { starts: count };
        let best = candidates.first().ok_or_else(none)?;
        if self.noise.is_estimated() {
            let (noise, more) = self.noise.estimate_noise(&thinned, &thin.joint.unknowns_at(&best.x));
            evaluations += more;
            let fall = thin.joint.cost(&best.x);
            thin = self.with_likelihood(&thinned, noise);
            if fall - thin.joint.cost(&best.x) > OTHER_NOISE {
                let again = |minimum: &SqpMinimum| thin.minimise(&minimum.x, COARSE);
                let minima: Vec<SqpMinimum> = candidates.par_iter().map(again).collect();
                evaluations += minima.iter().map(|minimum| minimum.evaluations).sum::<usize>();
                candidates = distinct_minima(minima, CLOSE);
            }
        }
        let full = self.with_likelihood(self.joint.likelihood, thin.joint.noise);
        let mut minima: Vec<SqpMinimum> = Vec::new();
        for candidate in &candidates {
            if !minima.iter().any(|known| full.is_downhill(&candidate.x, known)) {
                minima.push(full.minimise(&candidate.x, FINE));
            }
        }
        evaluations += minima.iter().map(|m| m.evaluations).sum::<usize>();
        let minima = distinct_minima(minima, f64::INFINITY);
        if minima.is_empty() {
            return Err(none());
        }
        Ok(GlobalOptima { minima, noise: thin.joint.noise, starts: count, evaluations })
    }

    /// The same search on other recordings under another noise.
    fn with_likelihood<'b>(&self, likelihood: &'b DriveLikelihood, noise: DriveNoise) -> GlobalSearch<'b>
    where
        'a: 'b,
    {
        let joint = JointPosterior { likelihood, noise, ..self.joint.clone() };
        GlobalSearch { joint, bounds: self.bounds, noise: self.noise }
    }

    fn minimise(&self, start: &DVector<f64>, limits: SqpLimits) -> SqpMinimum {
        let [lower, upper] = self.joint.box_corners(&self.bounds);
        sqp::minimise_sqp(&self.joint, &lower, &upper, start, limits)
    }

    /// Whether a minimum can be reached from a point along its ridge without going uphill: then they are one optimum, and
    /// a minimisation from there, which takes many small steps along the ridge, would tell nothing.
    fn is_downhill(&self, from: &DVector<f64>, to: &SqpMinimum) -> bool {
        let features = |x: &DVector<f64>| CurveFeatures::from_tires(&from_vector(x));
        let (Some(start), Some(end)) = (features(from), features(&to.x)) else {
            return false;
        };
        let mut before = f64::INFINITY;
        for k in 0..WAYPOINTS {
            let share = k as f64 / WAYPOINTS as f64;
            let tires =
                Axles::from_fn(|axle: Axle| start[axle].interpolate(&end[axle], share).tire_at(&self.bounds));
            let cost = self.joint.cost(&to_vector(&tires));
            if cost > before {
                return false;
            }
            before = cost;
        }
        to.model.cost <= before
    }

    /// The best minima from all starts, from others along their ridges, and from those with their axles crossed; how many starts
    /// that were, and evaluations.
    fn candidate_minima(&self, starts: &[Tires]) -> (Vec<SqpMinimum>, usize, usize) {
        let along_ridge = |start: &Tires| {
            std::iter::once(*start).chain(reshape_along_ridge(start, &self.bounds)).collect::<Vec<_>>()
        };
        let search = |starts: &[Tires]| -> Vec<SqpMinimum> {
            starts.par_iter().map(|start| self.minimise_from_tires(start)).collect()
        };
        let first: Vec<Tires> = starts.iter().flat_map(along_ridge).collect();
        let mut minima = search(&first);
        minima.extend(search(&crossed_axle_tires(&minima)));
        let evaluations = minima.iter().map(|m| m.evaluations).sum::<usize>();
        let count = minima.len();
        (distinct_minima(minima, CLOSE), count, evaluations)
    }

    /// From one start; through more process noise if the filter cannot follow.
    fn minimise_from_tires(&self, start: &Tires) -> SqpMinimum {
        let JointPosterior { likelihood, noise, .. } = self.joint;
        let mut x = to_vector(start);
        let at_start = likelihood.evaluate_by_tires(&self.joint.unknowns_at(&x)).mean_square;
        let follows = at_start.iter().all(|square| *square < EXPLODED);
        let mut evaluations = 1;
        if !follows {
            for factor in HOMOTOPY {
                let minimum =
                    self.with_likelihood(likelihood, noise.scale_process_noise(factor)).minimise(&x, ROUGH);
                evaluations += minimum.evaluations;
                x = minimum.x;
            }
        }
        let mut minimum = self.minimise(&x, COARSE);
        minimum.evaluations += evaluations;
        minimum
    }
}

/// The front axles of some minima with the rear axles of others, unless that is a minimum itself: both axles have several
/// minima, almost independently of each other.
fn crossed_axle_tires(minima: &[SqpMinimum]) -> Vec<Tires> {
    let known: Vec<Tires> =
        distinct_minima(minima.to_vec(), 10.0 * CLOSE).iter().map(|m| from_vector(&m.x)).collect();
    let differs = |a: &TireParameters, b: &TireParameters| (a.C - b.C).abs() > 0.05;
    let mut starts: Vec<Tires> = Vec::new();
    for front in &known {
        for rear in &known {
            let mixed = Tires { front: front.front, rear: rear.rear };
            let same =
                |other: &Tires| !differs(&other.front, &mixed.front) && !differs(&other.rear, &mixed.rear);
            if !known.iter().chain(&starts).any(same) {
                starts.push(mixed);
            }
        }
    }
    starts.truncate(MOST_CROSSED);
    starts
}
