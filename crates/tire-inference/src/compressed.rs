//! Compresses samples to about a hundred numbers that give the sum of squares of any Magic Formula.
//!
//! Between Chebyshev nodes on short intervals the curve is its interpolant to 1e-8, so that sums over samples become
//! sums over nodes: Σ f(xᵢ)² = Σ aⱼ f(xⱼ)² with aⱼ = Σ Lⱼ(xᵢ), and likewise with the measured forces. What needs
//! thousands of evaluations, as a posterior or a profile, costs the same for a thousand samples and for a million.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::PI;

use nalgebra::{SMatrix, SVector};
use preparation::samples::CurveSamples;

use crate::kernel::{self, friction_and_gradient, shape_sums};
use crate::parameters::{COUNT, Normal, Theta};

/// Nodes per interval.
const NODES: usize = 8;
/// Length of an interval in t = ln(1 + |x| / `SCALE`), which stretches low slip, where curves bend: those of B = 200 too.
const WIDTH: f64 = 0.3;
const SCALE: f64 = 0.01;

/// Weighted sum of squares of residuals as a function of the parameters.
#[derive(Clone, Debug)]
pub struct CompressedSamples {
    slip_nodes: Vec<f64>,
    /// Σ w L at each node.
    weight_sums: Vec<f64>,
    /// Σ w y L at each node.
    weighted_force_sums: Vec<f64>,
    /// Σ w, Σ w y, Σ w y².
    total_weight: f64,
    total_weighted_force: f64,
    weighted_force_squares: f64,
    effective_count: usize,
    /// What counts as further observations, and the variance of their noise.
    prior: Option<(Normal, f64)>,
}

/// The sum of squares near a point: value, half its gradient, and half its Hessian without second derivatives of the
/// curve (Gauss-Newton).
pub struct QuadraticExpansion {
    /// Sum of squares.
    pub squares: f64,
    /// Half the gradient.
    pub gradient: SVector<f64, COUNT>,
    /// Half the Hessian.
    pub hessian: SMatrix<f64, COUNT, COUNT>,
}

impl CompressedSamples {
    /// Samples of finite numbers; others would spoil all sums.
    pub fn new(samples: &CurveSamples) -> Self {
        let products = samples.force.iter().zip(&samples.weight).map(|(y, w)| [*w, w * y]);
        let points = samples.slip.iter().zip(products).map(|(&x, [w, wy])| [x, w, wy]);
        let squares = samples.force.iter().zip(&samples.weight).map(|(y, w)| w * y * y);
        Self {
            weighted_force_squares: squares.sum(),
            effective_count: samples.len(),
            ..Self::from_points(points.collect())
        }
    }

    /// Of slips with w and w y at each, but for what does not follow from these.
    fn from_points(mut points: Vec<[f64; 3]>) -> Self {
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut this = Self {
            slip_nodes: Vec::new(),
            weight_sums: Vec::new(),
            weighted_force_sums: Vec::new(),
            total_weight: points.iter().map(|point| point[1]).sum(),
            total_weighted_force: points.iter().map(|point| point[2]).sum(),
            weighted_force_squares: 0.0,
            effective_count: 0,
            prior: None,
        };
        for group in points.chunk_by(|a, b| slip_interval_index(a[0]) == slip_interval_index(b[0])) {
            this.compress_group(group);
        }
        this
    }

    /// The same data and the prior, as observations of parameters that add `variance` times their distance to the
    /// sum of squares: with noise of that variance, a normal prior.
    pub fn with_prior(self, prior: Option<Normal>, variance: f64) -> Self {
        Self { prior: prior.map(|normal| (normal, variance)), ..self }
    }

    /// With a constant sum of squares added, so that noise of this variance is the likeliest one near a curve.
    pub fn with_noise_variance(mut self, variance: f64, theta: &Theta) -> Self {
        self.weighted_force_squares +=
            ((self.effective_count as f64 - 1.0) * variance - self.residual_squares(theta)).max(0.0);
        self
    }

    /// With samples that tell as much as this share of them, independent of each other, would.
    pub fn with_effective_share(mut self, share: f64) -> Self {
        self.effective_count = ((share * self.effective_count as f64).round() as usize).max(1);
        self
    }

    /// What counts as further observations, and the variance of their noise.
    pub fn prior(&self) -> Option<&(Normal, f64)> {
        self.prior.as_ref()
    }

    /// How many independent samples this tells as much as.
    pub fn effective_count(&self) -> usize {
        self.effective_count
    }

    /// Slip of each node with Σ w and Σ w y of the samples that it stands for.
    pub fn slip_nodes(&self) -> impl Iterator<Item = [f64; 3]> {
        self.slip_nodes
            .iter()
            .zip(&self.weight_sums)
            .zip(&self.weighted_force_sums)
            .map(|((slip, weight), force)| [*slip, *weight, *force])
    }

    /// The same samples at slips that are larger by `shift`, without the prior.
    pub fn with_slip_shift(&self, shift: f64) -> Self {
        if shift == 0.0 {
            return self.clone();
        }
        let points = self.slip_nodes().map(|[slip, weight, force]| [slip + shift, weight, force]);
        Self {
            weighted_force_squares: self.weighted_force_squares,
            effective_count: self.effective_count,
            ..Self::from_points(points.collect())
        }
    }

    /// Weighted sum of squared forces.
    pub fn force_squares(&self) -> f64 {
        self.weighted_force_squares
    }

    /// Weighted sum of squared residuals.
    pub fn residual_squares(&self, theta: &Theta) -> f64 {
        let [B, C, D, E, S_h, S_v] = *theta;
        let (slips, weights, forces) = (&self.slip_nodes, &self.weight_sums, &self.weighted_force_sums);
        let moved: Vec<f64>;
        let slips = if S_h == 0.0 {
            slips
        } else {
            moved = slips.iter().map(|slip| slip + S_h).collect();
            &moved
        };
        let [hh, hy, h] = shape_sums([B, C, E], slips, [weights, forces, weights]);
        // Σ w (f² − 2 y f) of f = D h + S_v.
        let change = D * (D * hh + 2.0 * (S_v * h - hy))
            + S_v * (S_v * self.total_weight - 2.0 * self.total_weighted_force);
        // Rounding may leave a perfect fit below zero.
        let squares = (self.weighted_force_squares + change).max(1e-15 * self.weighted_force_squares);
        squares + self.prior_penalty(theta).0
    }

    /// The same, and half its derivatives by the parameters.
    pub fn squares_and_gradient(&self, theta: &Theta) -> (f64, Theta) {
        let (change, gradient) = kernel::weighted_curve_squares(
            theta,
            &self.slip_nodes,
            &self.weight_sums,
            &self.weighted_force_sums,
        );
        let (distance, by_distance) = self.prior_penalty(theta);
        let squares =
            (self.weighted_force_squares + change).max(1e-15 * self.weighted_force_squares) + distance;
        (squares, std::array::from_fn(|i| gradient[i] + by_distance[i]))
    }

    /// The prior adds this, with half its derivatives.
    pub fn prior_penalty(&self, theta: &Theta) -> (f64, Theta) {
        let Some((normal, variance)) = &self.prior else { return (0.0, [0.0; COUNT]) };
        let (distance, gradient) = normal.squared_mahalanobis_distance(theta);
        (variance * distance, gradient.map(|slope| variance * slope))
    }

    /// The same with the Hessian of Gauss and Newton.
    pub fn gauss_newton_expansion(&self, theta: &Theta) -> QuadraticExpansion {
        let mut sum = QuadraticExpansion {
            squares: self.weighted_force_squares,
            gradient: SVector::zeros(),
            hessian: SMatrix::zeros(),
        };
        for ((&slip, weight), force) in
            self.slip_nodes.iter().zip(&self.weight_sums).zip(&self.weighted_force_sums)
        {
            let (f, by) = friction_and_gradient(theta, slip);
            let by = SVector::from(by);
            sum.squares += f * (weight * f - 2.0 * force);
            sum.gradient += by * (weight * f - force);
            sum.hessian.ger(*weight, &by, &by, 1.0);
        }
        sum.squares = sum.squares.max(1e-15 * self.weighted_force_squares);
        let (distance, gradient) = self.prior_penalty(theta);
        sum.squares += distance;
        sum.gradient += SVector::from(gradient);
        if let Some((normal, variance)) = &self.prior {
            sum.hessian += SMatrix::from(normal.precision) * *variance;
        }
        sum
    }

    fn compress_group(&mut self, group: &[[f64; 3]]) {
        let Some(&[first, ..]) = group.first() else { return };
        let index = slip_interval_index(first);
        let node = |k: usize| (PI * (k as f64 + 0.5) / NODES as f64).cos();
        let start = self.slip_nodes.len();
        for k in 0..NODES {
            let t = WIDTH * (f64::from(index.1) + 0.5 + 0.5 * node(k));
            self.slip_nodes.push(f64::from(index.0) * SCALE * t.exp_m1());
        }
        self.weight_sums.resize(start + NODES, 0.0);
        self.weighted_force_sums.resize(start + NODES, 0.0);
        for &[x, w, wy] in group {
            let local = 2.0 * ((x.abs() / SCALE).ln_1p() / WIDTH - f64::from(index.1)) - 1.0;
            for (k, value) in lagrange_basis(local, node).into_iter().enumerate() {
                self.weight_sums[start + k] += w * value;
                self.weighted_force_sums[start + k] += wy * value;
            }
        }
    }
}

/// Sign and number of the interval that a slip is in.
fn slip_interval_index(slip: f64) -> (i32, i32) {
    (if slip < 0.0 { -1 } else { 1 }, ((slip.abs() / SCALE).ln_1p() / WIDTH) as i32)
}

/// Lagrange's polynomials of the Chebyshev nodes at a point of [−1, 1], in the barycentric form.
fn lagrange_basis(at: f64, node: impl Fn(usize) -> f64) -> [f64; NODES] {
    let mut values = [0.0; NODES];
    for (k, value) in values.iter_mut().enumerate() {
        let distance = at - node(k);
        if distance == 0.0 {
            return std::array::from_fn(|j| if j == k { 1.0 } else { 0.0 });
        }
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        *value = sign * (PI * (k as f64 + 0.5) / NODES as f64).sin() / distance;
    }
    let sum: f64 = values.iter().sum();
    values.map(|value| value / sum)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;
    use crate::parameters::magic_formula_from_theta;

    fn samples(limit: f64) -> CurveSamples {
        let slip: Vec<f64> = (0..400).map(|i| limit * (f64::from(i) / 200.0 - 0.9)).collect();
        let truth = magic_formula_from_theta(&[15.0, 2.0, 1.5, 0.8, 0.0, 0.0]);
        let noise = |i: usize| 0.05 * (i as f64 * 12.9898).sin();
        let force = slip.iter().enumerate().map(|(i, &x)| truth.friction_coefficient(x) + noise(i)).collect();
        let mut samples = CurveSamples::new(slip, force);
        for (i, weight) in samples.weight.iter_mut().enumerate() {
            *weight = 0.5 + (i % 3) as f64;
        }
        samples
    }

    fn direct(samples: &CurveSamples, theta: &Theta) -> f64 {
        let residual = |i: usize| {
            samples.force[i] - magic_formula_from_theta(theta).friction_coefficient(samples.slip[i])
        };
        (0..samples.len()).map(|i| samples.weight[i] * residual(i).powi(2)).sum()
    }

    proptest! {
        #[test]
        fn nothing_is_lost(
            B in 5.0_f64..40.0, C in 1.0_f64..3.0, D in 0.1_f64..2.0, E in -1.0_f64..1.0,
            S_h in prop_oneof![Just(0.0), -0.02_f64..0.02], limit in 0.02_f64..1.0,
        ) {
            let samples = samples(limit);
            let theta = [B, C, D, E, S_h, 0.03];
            let compressed = CompressedSamples::new(&samples);
            let moved = compressed.with_slip_shift(S_h).residual_squares(&[B, C, D, E, 0.0, 0.03]);
            for own in [compressed.residual_squares(&theta), moved] {
                // Of a log-likelihood −N/2 ln(squares); a verdict turns on a difference of 1.92.
                let error = 200.0 * (own / direct(&samples, &theta)).ln();
                prop_assert!(error.abs() < 1.92e-4, "{error}");
            }
        }
    }

    #[test]
    fn the_derivatives_are_those_of_the_sum() {
        let prior = Normal::diagonal([14.0, 1.9, 1.45, 0.6, 0.0, 0.01], [2.0, 0.2, 0.1, 0.3, 0.01, 0.1]);
        let compressed = CompressedSamples::new(&samples(0.3)).with_prior(Some(prior), 0.02);
        let theta = [18.0, 1.7, 1.4, 0.5, 0.004, 0.02];
        let near = compressed.gauss_newton_expansion(&theta);
        assert_relative_eq!(near.squares, compressed.residual_squares(&theta), max_relative = 1e-12);
        let (squares, gradient) = compressed.squares_and_gradient(&theta);
        assert_relative_eq!(near.squares, squares, max_relative = 1e-12);
        assert_relative_eq!(near.gradient, SVector::from(gradient), max_relative = 1e-11);
        for i in 0..COUNT {
            let step = 1e-5 * theta[i];
            let moved = |step: f64| {
                let mut theta = theta;
                theta[i] += step;
                compressed.residual_squares(&theta)
            };
            let difference = (moved(step) - moved(-step)) / (4.0 * step);
            assert_relative_eq!(near.gradient[i], difference, max_relative = 1e-5);
        }
    }
}
