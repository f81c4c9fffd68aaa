//! Gives the logarithm of the posterior of a tire in coordinates without bounds, and its gradient.
//!
//! The coordinates are the logit of each free parameter's place in its box, and ln σ of the noise. The prior is that of the
//! exact posterior: flat in the box and in σ.

use nalgebra::{DMatrix, DVector};
use numerics::variational::LogDensity;
use preparation::samples::CurveSamples;
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::compressed::CompressedSamples;
use crate::kernel::friction_and_gradient;
use crate::parameters::Theta;
use crate::prior::Prior;

/// A start this close to a bound, as a share of where tires of the literature are, is moved inside: the logit of the bound itself is
/// infinite.
const INSIDE: f64 = 0.01;

/// The posterior of one tire.
pub struct TireLogPosterior<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
    free: Vec<usize>,
}

impl<'a> TireLogPosterior<'a> {
    /// Of the parameters that are free in `prior`, and the noise.
    pub fn new(data: &'a CompressedSamples, prior: &'a Prior) -> Self {
        Self { data, prior, free: prior.free_parameters().map(|parameter| parameter as usize).collect() }
    }

    /// The tire at a point.
    pub fn theta_at(&self, x: &DVector<f64>) -> Theta {
        let mut theta = self.prior.centre;
        for (k, &i) in self.free.iter().enumerate() {
            let [low, width] = self.bound_and_width(i);
            theta[i] = low + width * logistic(x[k]);
        }
        theta
    }

    /// The standard deviation of the noise at a point.
    pub fn noise_std(&self, x: &DVector<f64>) -> f64 {
        x[self.free.len()].exp()
    }

    /// The point of a tire and its noise.
    pub fn unbounded_coordinates(&self, theta: &Theta, noise_std: f64) -> DVector<f64> {
        let likely = self.prior.restricted_to_literature().bounds;
        let logits = self.free.iter().map(|&i| {
            let [low, width] = self.bound_and_width(i);
            let inside = INSIDE * ((likely.upper[i] - likely.lower[i]) / width).min(1.0);
            let share = ((theta[i] - low) / width).clamp(inside, 1.0 - inside);
            (share / (1.0 - share)).ln()
        });
        let tiny = f64::MIN_POSITIVE;
        DVector::from_iterator(self.dimension(), logits.chain([noise_std.max(tiny).ln()]))
    }

    /// Less the Hessian at a point, without second derivatives of the curve: positive definite.
    pub fn information_matrix(&self, x: &DVector<f64>) -> DMatrix<f64> {
        let near = self.data.gauss_newton_expansion(&self.theta_at(x));
        let slopes = self.theta_derivatives(x);
        let precision = self.noise_std(x).powi(-2);
        let last = self.free.len();
        DMatrix::from_fn(last + 1, last + 1, |k, l| match (k < last, l < last) {
            (true, true) => {
                let share = logistic(x[k]);
                let box_term = if k == l { 2.0 * share * (1.0 - share) } else { 0.0 };
                let (i, j) = (self.free[k], self.free[l]);
                precision * near.hessian[(i, j)] * slopes[k] * slopes[l] + box_term
            }
            (false, false) => 2.0 * near.squares * precision,
            _ => 0.0,
        })
    }

    /// Lower bound and width of the box.
    fn bound_and_width(&self, i: usize) -> [f64; 2] {
        let bounds = &self.prior.bounds;
        [bounds.lower[i], bounds.upper[i] - bounds.lower[i]]
    }

    /// dθ/dx of each free parameter.
    fn theta_derivatives(&self, x: &DVector<f64>) -> Vec<f64> {
        let slope = |(k, &i): (usize, &usize)| {
            let share = logistic(x[k]);
            self.bound_and_width(i)[1] * share * (1.0 - share)
        };
        self.free.iter().enumerate().map(slope).collect()
    }

    /// From a sum of squares and half its derivatives to the logarithm and its gradient.
    fn log_posterior_from_squares(&self, x: &DVector<f64>, squares: f64, by: &Theta) -> (f64, DVector<f64>) {
        let last = self.free.len();
        let (count, log_noise) = (self.data.effective_count() as f64, x[last]);
        let precision = (-2.0 * log_noise).exp();
        let box_term = |&z: &f64| -z.abs() - 2.0 * (-z.abs()).exp().ln_1p();
        let log = (1.0 - count) * log_noise - 0.5 * squares * precision
            + x.iter().take(last).map(box_term).sum::<f64>();
        let slopes = self.theta_derivatives(x);
        let gradient = |k: usize| {
            if k == last {
                return 1.0 - count + squares * precision;
            }
            -precision * by[self.free[k]] * slopes[k] + 1.0 - 2.0 * logistic(x[k])
        };
        (log, DVector::from_fn(last + 1, |k, _| gradient(k)))
    }
}

impl LogDensity for TireLogPosterior<'_> {
    fn dimension(&self) -> usize {
        self.free.len() + 1
    }

    fn log_density_and_gradient(&self, x: &DVector<f64>) -> (f64, DVector<f64>) {
        let (squares, by) = self.data.squares_and_gradient(&self.theta_at(x));
        self.log_posterior_from_squares(x, squares, &by)
    }
}

/// The same from some of the samples at a time.
pub struct MinibatchPosterior<'a> {
    /// From all samples.
    pub whole: &'a TireLogPosterior<'a>,
    /// The samples that it is made of.
    pub samples: &'a CurveSamples,
    /// How many of them at a time.
    pub size: usize,
}

impl MinibatchPosterior<'_> {
    /// An unbiased estimate of logarithm and gradient at a point.
    pub fn estimate_log_posterior(&self, x: &DVector<f64>, random: &mut Pcg64) -> (f64, DVector<f64>) {
        let CurveSamples { slip, force, weight } = self.samples;
        let theta = self.whole.theta_at(x);
        let (mut squares, mut by) = (0.0, Theta::default());
        for _ in 0..self.size {
            let i = random.random_range(0..slip.len());
            let (value, gradient) = friction_and_gradient(&theta, slip[i]);
            let residual = value - force[i];
            squares += weight[i] * residual * residual;
            for (sum, by) in by.iter_mut().zip(gradient) {
                *sum += weight[i] * residual * by;
            }
        }
        let share = slip.len() as f64 / self.size as f64;
        let (distance, by_distance) = self.whole.data.prior_penalty(&theta);
        let by = std::array::from_fn(|i| share * by[i] + by_distance[i]);
        self.whole.log_posterior_from_squares(x, share * squares + distance, &by)
    }
}

fn logistic(z: f64) -> f64 {
    1.0 / (1.0 + (-z).exp())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use rand::SeedableRng;

    use super::*;
    use crate::parameters::Normal;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    fn problem() -> (CurveSamples, Prior, DVector<f64>) {
        let excitation = SyntheticExcitation { samples: 300, ..SyntheticExcitation::default() };
        let prior = Prior { free: [true; 6], ..Prior::lateral() };
        let point = DVector::from_vec(vec![-0.9, 0.1, 1.0, 1.6, 0.3, -0.2, -2.9]);
        (synthetic_samples(&excitation, 0.3), prior, point)
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let (samples, prior, x) = problem();
        let known = Normal::diagonal([14.0, 1.9, 1.45, 0.6, 0.0, 0.01], [0.2; 6]);
        let data = CompressedSamples::new(&samples).with_prior(Some(known), 0.0025);
        let density = TireLogPosterior::new(&data, &prior);
        let (_, gradient) = density.log_density_and_gradient(&x);
        for k in 0..density.dimension() {
            let moved = |step: f64| {
                let mut x = x.clone();
                x[k] += step;
                density.log_density_and_gradient(&x).0
            };
            let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert_relative_eq!(gradient[k], difference, max_relative = 1e-6, epsilon = 1e-6);
        }
    }

    #[test]
    fn a_point_and_its_tire_belong_together() {
        let (samples, prior, x) = problem();
        let data = CompressedSamples::new(&samples);
        let density = TireLogPosterior::new(&data, &prior);
        let theta = density.theta_at(&x);
        assert!(prior.contains(&theta));
        assert_relative_eq!(
            density.unbounded_coordinates(&theta, density.noise_std(&x)),
            x,
            max_relative = 1e-12,
            epsilon = 1e-12
        );
        let corner = density.unbounded_coordinates(&prior.bounds.upper, 0.0);
        assert!(corner.iter().all(|z| z.is_finite()));
    }

    #[test]
    fn batches_are_right_on_average() {
        let (samples, prior, x) = problem();
        let known = Normal::diagonal([14.0, 1.9, 1.45, 0.6, 0.0, 0.01], [0.2; 6]);
        let data = CompressedSamples::new(&samples).with_prior(Some(known), 0.0025);
        let whole = TireLogPosterior::new(&data, &prior);
        let batch = MinibatchPosterior { whole: &whole, samples: &samples, size: 50 };
        let mut random = Pcg64::seed_from_u64(3);
        let count = 4000.0;
        let (mut sum, mut squares) = (DVector::zeros(7), DVector::zeros(7));
        for _ in 0..count as usize {
            let gradient = batch.estimate_log_posterior(&x, &mut random).1;
            squares += gradient.component_mul(&gradient);
            sum += gradient;
        }
        let (mean, exact) = (sum / count, whole.log_density_and_gradient(&x).1);
        for k in 0..7 {
            let error = ((squares[k] / count - mean[k] * mean[k]) / count).sqrt();
            assert!((mean[k] - exact[k]).abs() < 4.0 * error + 1e-6 * exact[k].abs(), "{k}");
        }
    }
}
