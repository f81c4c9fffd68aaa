//! Makes points without gaps: in the unit cube, for starts; and points that stand for the standard normal distribution, few, the same
//! each time, with exactly its mean and covariance.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::sobol::{Sobol, cell_midpoint};

/// The most dimensions of normal points.
const DIMENSIONS: usize = 8;

/// Points of the unit cube: the additive recurrence x_k = fract(x_0 + k α), with α_i = g^−i and g the root of g^(d+1) = g + 1, whose
/// discrepancy is low in any dimension. The first point is the middle, unless a seed turns it.
#[derive(Clone, Copy, Debug)]
pub struct AdditiveRecurrence<const N: usize> {
    root: f64,
    first: f64,
}

impl<const N: usize> AdditiveRecurrence<N> {
    /// With x_0 turned by a seed.
    pub fn new(seed: u64) -> Self {
        let root = (0..60).fold(1.2_f64, |g, _| (1.0 + g).powf(1.0 / (N as f64 + 1.0)));
        Self { root, first: 0.5 + (seed as f64 * 0.754_877_666_246_692_7).fract() }
    }

    /// A point.
    pub fn point(&self, index: usize) -> [f64; N] {
        std::array::from_fn(|i| (self.first + index as f64 * self.root.powi(-(i as i32 + 1))).fract())
    }
}

/// An even number of points as columns: each with its mirror image, mean 0 and covariance 1 to rounding. At least twice as
/// many points as dimensions, of which there are at most eight.
pub fn normal_points(dimension: usize, count: usize, seed: u64) -> DMatrix<f64> {
    let half = count.div_ceil(2).max(dimension);
    let mut shift = Pcg64::seed_from_u64(seed);
    let shifts: [u32; DIMENSIONS] = std::array::from_fn(|_| shift.random());
    let sequence = Sobol::with_const_dimensions::<DIMENSIONS>();
    let mut points = DMatrix::zeros(dimension, 2 * half);
    for k in 0..half {
        // Its bits turned over where those of the shifts are set.
        let uniform = std::array::from_fn::<f64, DIMENSIONS, _>(|d| {
            cell_midpoint(sequence.coordinate_bits(k as u32, d) ^ shifts[d])
        });
        for (pair, u) in uniform.as_chunks::<2>().0.iter().enumerate() {
            // Box and Muller.
            let (sin, cos) = (TAU * u[1]).sin_cos();
            for (index, part) in [(2 * pair, cos), (2 * pair + 1, sin)] {
                if index < dimension {
                    points[(index, k)] = (-2.0 * u[0].ln()).sqrt() * part;
                }
            }
        }
    }
    let first = points.columns(0, half);
    let covariance = first * first.transpose() / half as f64;
    // More points than dimensions, and no two alike: the covariance has full rank.
    if let Some(factor) = covariance.cholesky()
        && let Some(matched) = factor.l().solve_lower_triangular(&first)
    {
        points.columns_mut(0, half).copy_from(&matched);
    }
    let mirrored = -points.columns(0, half);
    points.columns_mut(half, half).copy_from(&mirrored);
    points
}

/// The standard normal density's logarithm at a point.
pub fn log_normal(e: &DVector<f64>) -> f64 {
    -0.5 * (e.norm_squared() + e.len() as f64 * TAU.ln())
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn the_additive_recurrence_leaves_no_gaps() {
        let points = AdditiveRecurrence::<6>::new(0);
        assert_eq!(points.point(0), [0.5; 6]);
        for axis in 0..6 {
            let mut places: Vec<f64> = (0..64).map(|k| points.point(k)[axis]).collect();
            places.sort_by(f64::total_cmp);
            let gap = places.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            assert!(gap < 4.0 / 64.0, "axis {axis}: {gap}");
        }
        assert_ne!(AdditiveRecurrence::<6>::new(1).point(0), [0.5; 6]);
    }

    #[test]
    fn mean_and_covariance_are_exact_and_the_fourth_moment_is_near() {
        for dimension in 1..=7 {
            let points = normal_points(dimension, 128, 5);
            assert_eq!(points.shape(), (dimension, 128));
            assert!(points.column_sum().amax() < 1e-12);
            let covariance = &points * points.transpose() / 128.0;
            let expected = DMatrix::<f64>::identity(dimension, dimension);
            assert!((covariance - expected).amax() < 1e-12);
            for row in points.row_iter() {
                let fourth = row.iter().map(|e| e.powi(4)).sum::<f64>() / 128.0;
                assert_abs_diff_eq!(fourth, 3.0, epsilon = 0.8);
            }
        }
        assert_ne!(normal_points(5, 64, 1), normal_points(5, 64, 2));
    }
}
