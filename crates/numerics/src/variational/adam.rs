//! Fits a normal distribution by Adam (Kingma and Ba 2015) on noisy gradients of the evidence lower bound, one draw a step: the
//! way of the literature, for comparison.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::convergence::OptimisationStatus;
use crate::variational::LogDensity;
use crate::variational::gaussian::Gaussian;
use crate::variational::newton::{GaussianFit, NewtonLimits};

/// Of the moving means of gradient and squared gradient.
const MEMORY: [f64; 2] = [0.9, 0.999];
/// Values of the bound that are reported.
const REPORTED: usize = 200;

/// How Adam goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdamSchedule {
    /// Length of a step, in the coordinates of the fit.
    pub step: f64,
    /// How many.
    pub steps: usize,
    /// Whether the result is the mean over the second half of the steps, in which the noise of single draws fades (Polyak and
    /// Juditsky 1992); else it is where the last step led.
    pub average: bool,
}

/// A logarithm of a density and its gradient at a point, that may be noisy.
pub type StochasticLogDensity<'a> = dyn Fn(&DVector<f64>, &mut Pcg64) -> (f64, DVector<f64>) + 'a;

/// Takes all steps, and then says by the density itself how far from the optimum they led. The trace is of means over the
/// draws of many steps each.
pub fn fit_gaussian_by_adam(
    schedule: &AdamSchedule,
    estimate: &StochasticLogDensity,
    start: Gaussian,
    density: &impl LogDensity,
    points: &DMatrix<f64>,
    limits: NewtonLimits,
    seed: u64,
) -> GaussianFit {
    let dimension = start.mean.len();
    let mut random = Pcg64::seed_from_u64(seed);
    let mut gaussian = start;
    let mut walk = GradientMoments::new(dimension * (dimension + 3) / 2);
    let (mut trace, mut sum) = (Vec::new(), 0.0);
    let reported = schedule.steps.div_ceil(REPORTED).max(1);
    let (mut mean, half) = (gaussian.clone(), schedule.steps / 2);
    for step in 0..schedule.steps {
        let e = DVector::from_fn(dimension, |_, _| StandardNormal.sample(&mut random));
        let (log, gradient) = estimate(&gaussian.x_from_deviate(&e), &mut random);
        sum += log + gaussian.entropy();
        if (step + 1) % reported == 0 {
            trace.push(sum / reported as f64);
            sum = 0.0;
        }
        // Mean, then the lower triangle of the factor, whose diagonal moves by its logarithm.
        let mut slope: Vec<f64> = gradient.iter().copied().collect();
        for (i, j) in lower_triangle_indices(dimension) {
            let by = gradient[i] * e[j];
            slope.push(if i == j { by * gaussian.factor[(i, i)] + 1.0 } else { by });
        }
        let moves = walk.adam_moves(&slope, schedule.step);
        for (index, value) in gaussian.mean.iter_mut().enumerate() {
            *value += moves[index];
        }
        for ((i, j), change) in lower_triangle_indices(dimension).zip(&moves[dimension..]) {
            let entry = &mut gaussian.factor[(i, j)];
            *entry = if i == j { *entry * change.exp() } else { *entry + change };
        }
        if schedule.average && step >= half {
            let share = 1.0 / (step - half + 1) as f64;
            mean.mean += (&gaussian.mean - &mean.mean) * share;
            mean.factor += (&gaussian.factor - &mean.factor) * share;
        }
    }
    let gaussian = if schedule.average { mean } else { gaussian };
    let gradient_norm = gaussian.compare_with_density(density, points).gradient_norm();
    let converged = gradient_norm <= limits.tolerance;
    GaussianFit {
        gaussian,
        status: if converged { OptimisationStatus::Converged } else { OptimisationStatus::IterationLimit },
        gradient_norm,
        steps: schedule.steps,
        trace,
        evaluations: schedule.steps + points.ncols(),
    }
}

fn lower_triangle_indices(dimension: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..dimension).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

/// Moving means of gradient and squared gradient.
struct GradientMoments {
    means: [Vec<f64>; 2],
    forgotten: [f64; 2],
}

impl GradientMoments {
    fn new(count: usize) -> Self {
        Self { means: [vec![0.0; count], vec![0.0; count]], forgotten: [1.0; 2] }
    }

    fn adam_moves(&mut self, slope: &[f64], length: f64) -> Vec<f64> {
        for (forgotten, memory) in self.forgotten.iter_mut().zip(MEMORY) {
            *forgotten *= memory;
        }
        let [first, second] = &mut self.means;
        let one = |((slope, m), v): ((&f64, &mut f64), &mut f64)| {
            *m += (1.0 - MEMORY[0]) * (slope - *m);
            *v += (1.0 - MEMORY[1]) * (slope * slope - *v);
            let (m, v) = (*m / (1.0 - self.forgotten[0]), *v / (1.0 - self.forgotten[1]));
            length * m / (v.sqrt() + 1e-8)
        };
        slope.iter().zip(first).zip(second).map(one).collect()
    }
}
