//! Sums the squares of a curve at weighted slips, with derivatives: what a posterior needs thousands of times.

use crate::kernel::{BLOCK, PARTIAL_SUMS, friction_and_gradient, sum_partial_sums};
use crate::parameters::{COUNT, Theta};

/// Σ (a f² − 2 b f) of the curve f over slips, and half its derivatives by the parameters. The number of slips is a multiple
/// of eight.
pub fn weighted_curve_squares(theta: &Theta, slips: &[f64], weights: &[f64], forces: &[f64]) -> (f64, Theta) {
    pulp::Arch::new().dispatch(CurveSquaresKernel { theta, slips, weights, forces })
}

/// Not a closure, see [`crate::kernel::ShapeSumKernel`].
struct CurveSquaresKernel<'a> {
    theta: &'a Theta,
    slips: &'a [f64],
    weights: &'a [f64],
    forces: &'a [f64],
}

impl pulp::WithSimd for CurveSquaresKernel<'_> {
    type Output = (f64, Theta);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        let [weights, forces] = [self.weights, self.forces].map(|sums| sums.as_chunks::<PARTIAL_SUMS>().0);
        let mut squares = [0.0; PARTIAL_SUMS];
        let mut slopes = [[0.0; PARTIAL_SUMS]; COUNT];
        let mut f = [0.0; BLOCK];
        let mut by = [[0.0; BLOCK]; COUNT];
        for (index, slips) in self.slips.chunks(BLOCK).enumerate() {
            for (i, &slip) in slips.iter().enumerate() {
                let (value, gradient) = friction_and_gradient(self.theta, slip);
                f[i] = value;
                for k in 0..COUNT {
                    by[k][i] = gradient[k];
                }
            }
            let from = index * BLOCK / PARTIAL_SUMS;
            for (index, f) in f[..slips.len()].as_chunks::<PARTIAL_SUMS>().0.iter().enumerate() {
                let (weights, forces) = (&weights[from + index], &forces[from + index]);
                let mut residual = [0.0; PARTIAL_SUMS];
                for k in 0..PARTIAL_SUMS {
                    residual[k] = weights[k] * f[k] - forces[k];
                    squares[k] += f[k] * (residual[k] - forces[k]);
                }
                for (slopes, by) in slopes.iter_mut().zip(&by) {
                    for k in 0..PARTIAL_SUMS {
                        slopes[k] += residual[k] * by[index * PARTIAL_SUMS + k];
                    }
                }
            }
        }
        (sum_partial_sums(squares), slopes.map(sum_partial_sums))
    }
}
