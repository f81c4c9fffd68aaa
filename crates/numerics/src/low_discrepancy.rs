//! Makes points without gaps: in the unit cube, for starts; and points that stand for the standard normal distribution, few, the same
//! each time, with exactly its mean and covariance.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Dimensions that there are direction numbers for.
const DIMENSIONS: usize = 8;
const BITS: usize = 32;

/// Primitive polynomials, without their first and last coefficient, and first direction numbers of the dimensions from the
/// second on: Joe and Kuo, "Constructing Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput. 30
/// (2008), their set new-joe-kuo-6.
const DIRECTIONS: [(u32, &[u32]); DIMENSIONS - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
];

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
        std::array::from_fn(|i| {
            (self.first + index as f64 * self.root.powi(-(i as i32 + 1))).fract()
        })
    }
}

/// An even number of points as columns: each with its mirror image, mean 0 and covariance 1 to rounding. At least twice as
/// many points as dimensions, of which there are at most eight.
pub fn normal_points(dimension: usize, count: usize, seed: u64) -> DMatrix<f64> {
    let half = count.div_ceil(2).max(dimension);
    let mut shift = Pcg64::seed_from_u64(seed);
    let shifts: [u32; DIMENSIONS] = std::array::from_fn(|_| shift.random());
    let mut points = DMatrix::zeros(dimension, 2 * half);
    for k in 0..half {
        let uniform = sobol(k as u32, &shifts);
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

/// A point of Sobol's sequence in the open unit cube, its bits turned over where those of the shifts are set.
fn sobol(index: u32, shifts: &[u32; DIMENSIONS]) -> [f64; DIMENSIONS] {
    std::array::from_fn(|dimension| {
        let numbers = directions(dimension);
        let bits = (0..BITS).filter(|bit| index >> bit & 1 == 1);
        let number = bits.fold(shifts[dimension], |sum, bit| sum ^ numbers[bit]);
        (f64::from(number) + 0.5) / 2.0_f64.powi(BITS as i32)
    })
}

/// Direction numbers by the recurrence of Bratley and Fox (1988).
fn directions(dimension: usize) -> [u32; BITS] {
    let Some(&(polynomial, first)) = dimension.checked_sub(1).and_then(|d| DIRECTIONS.get(d))
    else {
        return std::array::from_fn(|bit| 1 << (BITS - 1 - bit));
    };
    let degree = first.len();
    let mut numbers = [0; BITS];
    for bit in 0..BITS {
        numbers[bit] = if bit < degree {
            first[bit] << (BITS - 1 - bit)
        } else {
            let last = numbers[bit - degree];
            let taps = (1..degree).filter(|tap| polynomial >> (degree - 1 - tap) & 1 == 1);
            taps.fold(last ^ (last >> degree), |sum, tap| sum ^ numbers[bit - tap])
        };
    }
    numbers
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn the_first_points_are_those_of_the_tables() {
        // Points 1 to 3 in their natural order, as in Joe and Kuo's notes.
        let none = [0; DIMENSIONS];
        for (index, first) in [(1, [0.5; 3]), (2, [0.25, 0.75, 0.75]), (3, [0.75, 0.25, 0.25])] {
            for (own, expected) in sobol(index, &none).into_iter().zip(first) {
                assert_abs_diff_eq!(own, expected, epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn each_power_of_two_of_points_fills_each_axis_evenly() {
        let shifts = [0x1234_5678; DIMENSIONS];
        for dimension in 0..DIMENSIONS {
            let mut cells: Vec<usize> =
                (0..64).map(|k| (64.0 * sobol(k, &shifts)[dimension]) as usize).collect();
            cells.sort_unstable();
            assert!(cells.into_iter().eq(0..64), "dimension {dimension}");
        }
        // Of the first two, 64 points are a net: one in each of 8 by 8 cells.
        let mut cells: Vec<usize> = (0..64)
            .map(|k| {
                let u = sobol(k, &shifts);
                8 * (8.0 * u[0]) as usize + (8.0 * u[1]) as usize
            })
            .collect();
        cells.sort_unstable();
        assert!(cells.into_iter().eq(0..64));
    }

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
