//! Maximises the likelihood of prediction errors over the parameters of both tires, and over the noises.

use nalgebra::DVector;
use numerics::convergence::Convergence;
use numerics::simd_batch::WIDTH;
use numerics::sqp::{self, Limits, Minimum, Model, Objective};
use rayon::prelude::*;
use tire_inference::axles::{Axle, Axles};
use tire_inference::parameters::{Bounds, TireParameters};

use crate::error::Error;
use crate::likelihood::{DriveNoise, Likelihood};
use crate::regularisation::Expected;
use crate::ridge::{Features, reshaped};
use crate::search::{convergence, different};
use crate::tires::{Tires, corners, from_vector, to_vector};

/// Mean squared innovation, in units of its variance, above which a start is too far away for the filter to follow.
const EXPLODED: f64 = 3.0;
/// Factors of the process noise that lead from such a start to the noise that is meant.
const HOMOTOPY: [f64; 2] = [1000.0, 30.0];
/// When to stop on the way through the homotopy, on a part of the recordings, and on all of them. B, C and E
/// are so correlated that a residual of 1e-5 would still be tenths of a standard deviation along the ridge.
const ROUGH: Limits = Limits { iterations: 6, target: 1e-3, tolerance: 1e-2, damping: 1e-2 };
const COARSE: Limits = Limits { iterations: 15, target: 1e-3, tolerance: 1e-2, damping: 1e-2 };
const FINE: Limits = Limits { iterations: 40, target: 1e-6, tolerance: 1e-5, damping: 1e-5 };
/// Points on a way to a minimum at which the cost must fall.
const WAYPOINTS: usize = 4;
/// Most starts that are put together from the axles of others.
const MOST_CROSSED: usize = 4;
/// Largest change of the logarithm of a sensor's noise from its first guess.
const SENSOR_REACH: f64 = 4.0;
/// Bounds of the process noise, after one second.
const PROCESS_LOWEST: [f64; 4] = [1e-6, 1e-6, 1e-6, 1.0];
const PROCESS_HIGHEST: [f64; 4] = [1.0, 1.0, 1.0, 1e5];
/// Most rounds of noises after tires.
const ROUNDS: usize = 3;
/// Difference of the costs on a part of the recordings up to which optima are carried on to all of them [nat].
const CLOSE: f64 = 30.0;
/// Fall of the cost by other noises that is not worth a round [nat].
const SETTLED: f64 = 0.5;

/// The maximum.
#[derive(Clone, Debug)]
pub struct Maximum {
    /// Parameters.
    pub tires: Tires,
    /// Noises, estimated or as given.
    pub noise: DriveNoise,
    /// The minimum of the negative logarithm, for its second derivatives.
    pub minimum: Minimum,
    /// Different optima, best first, with their costs.
    pub optima: Vec<(Tires, f64)>,
    /// How it was reached.
    pub convergence: Convergence,
}

/// Cost of tires, given noises.
pub struct OfTires<'a> {
    /// The likelihood.
    pub likelihood: &'a Likelihood,
    /// The noises.
    pub noise: DriveNoise,
    /// What is expected of the tires.
    pub expected: Expected,
}

impl Objective for OfTires<'_> {
    fn model(&self, x: &DVector<f64>) -> Model {
        let evaluation = self.likelihood.of_tires(&from_vector(x), &self.noise);
        let mut model = evaluation.model(self.likelihood.samples());
        self.expected.add(x, &mut model);
        model
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        let tires = from_vector(x);
        self.likelihood.cost(&tires, &self.noise) + self.expected.cost(&tires)
    }

    fn costs(&self, points: &[DVector<f64>]) -> Vec<f64> {
        let batch = |points: &[DVector<f64>]| -> Vec<f64> {
            // What is missing in the last ones is filled up.
            let all =
                std::array::from_fn(|index| from_vector(&points[index.min(points.len() - 1)]));
            let costs = self.likelihood.costs(&all, &self.noise);
            let expected = points.iter().map(|x| self.expected.cost(&from_vector(x)));
            expected.zip(costs).map(|(expected, cost)| cost + expected).collect()
        };
        points.par_chunks(WIDTH).flat_map_iter(batch).collect()
    }
}

/// Cost of noises, given tires: logarithms of the standard deviations of sensors, variances of the process.
struct OfNoise<'a> {
    likelihood: &'a Likelihood,
    tires: Tires,
}

fn noise_at(x: &DVector<f64>) -> DriveNoise {
    DriveNoise {
        sensor: std::array::from_fn(|i| x[i].exp()),
        process: std::array::from_fn(|i| x[4 + i].sqrt()),
    }
}

impl Objective for OfNoise<'_> {
    fn model(&self, x: &DVector<f64>) -> Model {
        let evaluation = self.likelihood.of_noise(&self.tires, &noise_at(x));
        evaluation.model(self.likelihood.samples())
    }
}

/// What is maximised, and from where.
pub struct Problem<'a> {
    /// The likelihood.
    pub likelihood: &'a Likelihood,
    /// The box of each axle.
    pub bounds: Bounds,
    /// What is expected of the tires.
    pub expected: Expected,
    /// The noises, or where their estimation starts.
    pub noise: DriveNoise,
    /// Whether the noises are estimated.
    pub estimate_noise: bool,
}

impl Problem<'_> {
    /// Maximises from all starts and from others along their ridges.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn maximise(&self, starts: &[Tires]) -> Result<Maximum, Error> {
        let thin = Problem { likelihood: &self.likelihood.thinned(), ..*self };
        let (candidates, count, mut evaluations) = thin.candidates(starts);
        let none = || Error::NoStart { starts: count };
        let first = candidates.first().ok_or_else(none)?;
        let mut noise = self.noise;
        if self.estimate_noise {
            noise = thin.noises(&from_vector(&first.x), &noise, &mut evaluations);
        }
        let mut minima: Vec<Minimum> = Vec::new();
        for candidate in &candidates {
            if !minima.iter().any(|known| self.downhill(&candidate.x, known, &noise)) {
                minima.push(self.minimise(&candidate.x, &noise, FINE));
            }
        }
        evaluations += minima.iter().map(|m| m.evaluations).sum::<usize>();
        let minima = different(minima, f64::INFINITY);
        let mut minimum = minima.first().cloned().ok_or_else(none)?;
        for _ in 0..if self.estimate_noise { ROUNDS } else { 0 } {
            let at = from_vector(&minimum.x);
            let better = self.noises(&at, &noise, &mut evaluations);
            let fall = self.likelihood.cost(&at, &noise) - self.likelihood.cost(&at, &better);
            if fall < SETTLED {
                break;
            }
            noise = better;
            minimum = self.minimise(&minimum.x, &noise, FINE);
            evaluations += minimum.evaluations;
        }
        let mut optima = vec![(from_vector(&minimum.x), minimum.model.cost)];
        optima.extend(minima.iter().skip(1).map(|m| (from_vector(&m.x), m.model.cost)));
        Ok(Maximum {
            tires: from_vector(&minimum.x),
            noise,
            convergence: convergence(&minimum, count, optima.len(), evaluations),
            optima,
            minimum,
        })
    }

    /// Whether a minimum can be reached from a point along its ridge without going uphill: then they are one optimum, and
    /// a minimisation from there, which takes many small steps along the ridge, would tell nothing.
    fn downhill(&self, from: &DVector<f64>, to: &Minimum, noise: &DriveNoise) -> bool {
        let features = |x: &DVector<f64>| Features::of_both(&from_vector(x));
        let (Some(start), Some(end)) = (features(from), features(&to.x)) else {
            return false;
        };
        let objective =
            OfTires { likelihood: self.likelihood, noise: *noise, expected: self.expected };
        let mut before = f64::INFINITY;
        for k in 0..WAYPOINTS {
            let share = k as f64 / WAYPOINTS as f64;
            let tires =
                Axles::new(|axle: Axle| start[axle].towards(&end[axle], share).tire(&self.bounds));
            let x = to_vector(&tires);
            let cost = objective.cost(&x);
            if cost > before {
                return false;
            }
            before = cost;
        }
        to.model.cost <= before
    }

    /// The best minima from all starts, from others along their ridges, and from those with their axles crossed; how many starts
    /// that were, and evaluations.
    fn candidates(&self, starts: &[Tires]) -> (Vec<Minimum>, usize, usize) {
        let along_ridge = |start: &Tires| {
            std::iter::once(*start).chain(reshaped(start, &self.bounds)).collect::<Vec<_>>()
        };
        let search = |starts: &[Tires]| -> Vec<Minimum> {
            starts.par_iter().map(|start| self.from(start, &self.noise)).collect()
        };
        let first: Vec<Tires> = starts.iter().flat_map(along_ridge).collect();
        let mut minima = search(&first);
        minima.extend(search(&crossed(&minima)));
        let evaluations = minima.iter().map(|m| m.evaluations).sum::<usize>();
        let count = minima.len();
        (different(minima, CLOSE), count, evaluations)
    }

    fn minimise(&self, start: &DVector<f64>, noise: &DriveNoise, limits: Limits) -> Minimum {
        let objective =
            OfTires { likelihood: self.likelihood, noise: *noise, expected: self.expected };
        let [lower, upper] = corners(&self.bounds);
        sqp::minimise(&objective, &lower, &upper, start, limits)
    }

    /// From one start; through more process noise if the filter cannot follow.
    fn from(&self, start: &Tires, noise: &DriveNoise) -> Minimum {
        let mut x = to_vector(start);
        let at_start = self.likelihood.of_tires(start, noise).mean_square;
        let follows = at_start.iter().all(|square| *square < EXPLODED);
        let mut evaluations = 1;
        if !follows {
            for factor in HOMOTOPY {
                let minimum = self.minimise(&x, &noise.with_process(factor), ROUGH);
                evaluations += minimum.evaluations;
                x = minimum.x;
            }
        }
        let mut minimum = self.minimise(&x, noise, COARSE);
        minimum.evaluations += evaluations;
        minimum
    }

    fn noises(&self, tires: &Tires, start: &DriveNoise, evaluations: &mut usize) -> DriveNoise {
        let square = |std: &f64| std * std;
        let sensor = start.sensor.iter().map(|std| std.ln());
        let first: Vec<f64> = sensor.chain(start.process.iter().map(square)).collect();
        let bound = |i: usize, sign: f64, process: &[f64; 4]| {
            if i < 4 {
                self.noise.sensor[i].ln() + sign * SENSOR_REACH
            } else {
                square(&process[i - 4])
            }
        };
        let lower = DVector::from_fn(8, |i, _| bound(i, -1.0, &PROCESS_LOWEST));
        let upper = DVector::from_fn(8, |i, _| bound(i, 1.0, &PROCESS_HIGHEST));
        let objective = OfNoise { likelihood: self.likelihood, tires: *tires };
        let limits = Limits { iterations: 8, target: 1e-3, tolerance: 1e-2, damping: 1e-5 };
        let start = DVector::from_vec(first);
        let minimum = sqp::minimise(&objective, &lower, &upper, &start, limits);
        *evaluations += minimum.evaluations;
        noise_at(&minimum.x)
    }
}

/// The front axles of some minima with the rear axles of others, unless that is a minimum itself: both axles have several
/// minima, almost independently of each other.
fn crossed(minima: &[Minimum]) -> Vec<Tires> {
    let known: Vec<Tires> =
        different(minima.to_vec(), 10.0 * CLOSE).iter().map(|m| from_vector(&m.x)).collect();
    let differs = |a: &TireParameters, b: &TireParameters| (a.C - b.C).abs() > 0.05;
    let mut starts: Vec<Tires> = Vec::new();
    for front in &known {
        for rear in &known {
            let mixed = Tires { front: front.front, rear: rear.rear };
            let same = |other: &Tires| {
                !differs(&other.front, &mixed.front) && !differs(&other.rear, &mixed.rear)
            };
            if !known.iter().chain(&starts).any(same) {
                starts.push(mixed);
            }
        }
    }
    starts.truncate(MOST_CROSSED);
    starts
}
