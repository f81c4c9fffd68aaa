//! Evaluates the Magic Formula over many samples: cost, gradient and the Hessian of Gauss and Newton in one pass.
//!
//! The definition is [`vehicle::MagicFormula`], whose functions are those of the standard library; what is computed here, with
//! functions that the compiler vectorises, agrees with it to rounding.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

mod slope;
mod squares;
mod terms;

use numerics::loss::Loss;
use preparation::samples::CurveSamples;
use rayon::prelude::*;

use crate::parameters::{COUNT, Parameter, Theta};

pub use slope::{CurveDerivatives, ValueAndSlope, curve_derivatives};
pub use squares::weighted_curve_squares;
use terms::MagicFormulaTerms;

/// Samples that one thread sums up: fixed, so that the order of all additions is the same for any number of threads.
const CHUNK: usize = 4096;
/// Samples whose columns fit into the first-level cache.
const BLOCK: usize = 128;
/// Partial sums that are kept side by side.
const PARTIAL_SUMS: usize = 8;
/// Below, starting threads takes longer than the sums.
const PARALLEL_FROM: usize = 4 * CHUNK;

/// A column of numbers, one for each sample of a block.
type BlockColumn = [f64; BLOCK];

/// What one pass over the samples gives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CostDerivatives {
    /// Σ weight · loss(residual), where the loss of a square is r²/2.
    pub cost: f64,
    /// Its derivatives with respect to the parameters.
    pub gradient: Theta,
    /// JᵀWJ, J being the derivatives of the curve and W the weights under the loss.
    pub hessian: [Theta; COUNT],
}

impl CostDerivatives {
    fn add(mut self, other: &Self) -> Self {
        self.cost += other.cost;
        for i in 0..COUNT {
            self.gradient[i] += other.gradient[i];
            for j in 0..COUNT {
                self.hessian[i][j] += other.hessian[i][j];
            }
        }
        self
    }
}

/// Cost, gradient and Hessian; the rows and columns of parameters that are not `free` stay 0.
pub fn cost_derivatives(
    samples: &CurveSamples,
    theta: &Theta,
    free: &[bool; COUNT],
    loss: Loss,
) -> CostDerivatives {
    let columns: Vec<usize> = (0..COUNT).filter(|&i| free[i]).collect();
    sum_over_chunks(samples, |range| {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || chunk_cost_derivatives(samples, range, theta, &columns, loss),
        )
    })
}

/// The cost alone.
pub fn curve_cost(samples: &CurveSamples, theta: &Theta, loss: Loss) -> f64 {
    let chunk = |range| {
        let cost = pulp::Arch::new().dispatch(
            #[inline(always)]
            || chunk_cost(samples, range, theta, loss),
        );
        CostDerivatives { cost, ..CostDerivatives::default() }
    };
    sum_over_chunks(samples, chunk).cost
}

/// Friction coefficient at a slip.
#[inline(always)]
pub fn friction_coefficient(theta: &Theta, slip: f64) -> f64 {
    let [B, C, D, E, S_h, S_v] = *theta;
    MagicFormulaTerms::new([B, C, D, E], slip + S_h).value() + S_v
}

/// Friction coefficient at a slip and its derivatives with respect to the parameters.
#[inline(always)]
pub fn friction_and_gradient(theta: &Theta, slip: f64) -> (f64, Theta) {
    let [B, C, D, E, S_h, S_v] = *theta;
    let terms = MagicFormulaTerms::new([B, C, D, E], slip + S_h);
    let [by_B, by_C, by_D, by_E, by_x] = terms.gradient();
    (terms.value() + S_v, [by_B, by_C, by_D, by_E, by_x, 1.0])
}

/// The argument C atan v of the sine at a slip, and its derivatives with respect to the parameters.
pub fn sine_argument(theta: &Theta, slip: f64) -> (f64, Theta) {
    let [B, C, D, E, S_h, _] = *theta;
    let terms = MagicFormulaTerms::new([B, C, D, E], slip + S_h);
    let by_v = C * terms.flat;
    let by_u = by_v * terms.p;
    let by_theta = [by_u * terms.x, terms.w, 0.0, -by_v * terms.bend, by_u * B, 0.0];
    (C * terms.w, by_theta)
}

/// Σ a h², Σ b h and Σ c h over slips, where h is the curve of B, C and E with D = 1 and without shifts. The number of slips
/// is a multiple of eight.
pub fn shape_sums(of: [f64; 3], slips: &[f64], [a, b, c]: [&[f64]; 3]) -> [f64; 3] {
    let [hh, yh, h, ..] =
        pulp::Arch::new().dispatch(ShapeSumKernel::<false> { of, slips, weights: [a, b, c, a] });
    [hh, yh, h]
}

/// What [`shape_sums`] gives, and Σ c h h', Σ a h'², Σ d h' and Σ a h', where h' is the slope of h.
pub fn shapes_and_slopes(of: [f64; 3], slips: &[f64], weights: [&[f64]; 4]) -> [f64; 7] {
    pulp::Arch::new().dispatch(ShapeSumKernel::<true> { of, slips, weights })
}

/// Not a closure: those are not always inlined into the code for wide vectors, which then is not made.
struct ShapeSumKernel<'a, const SLOPES: bool> {
    of: [f64; 3],
    slips: &'a [f64],
    weights: [&'a [f64]; 4],
}

impl<const SLOPES: bool> pulp::WithSimd for ShapeSumKernel<'_, SLOPES> {
    type Output = [f64; 7];

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> [f64; 7] {
        let [B, C, E] = self.of;
        let [a, b, c, d] = self.weights.map(|weights| weights.as_chunks::<PARTIAL_SUMS>().0);
        let mut sums = [[0.0; PARTIAL_SUMS]; 7];
        let tire = [B, C, 1.0, E, 0.0, 0.0];
        for (index, slips) in self.slips.as_chunks::<PARTIAL_SUMS>().0.iter().enumerate() {
            let (mut h, mut slope) = ([0.0; PARTIAL_SUMS], [0.0; PARTIAL_SUMS]);
            for k in 0..PARTIAL_SUMS {
                if SLOPES {
                    let (value, by) = friction_and_gradient(&tire, slips[k]);
                    (h[k], slope[k]) = (value, by[Parameter::S_h as usize]);
                } else {
                    h[k] = friction_coefficient(&tire, slips[k]);
                }
            }
            for k in 0..PARTIAL_SUMS {
                sums[0][k] += a[index][k] * h[k] * h[k];
                sums[1][k] += b[index][k] * h[k];
                sums[2][k] += c[index][k] * h[k];
                if SLOPES {
                    sums[3][k] += c[index][k] * h[k] * slope[k];
                    sums[4][k] += a[index][k] * slope[k] * slope[k];
                    sums[5][k] += d[index][k] * slope[k];
                    sums[6][k] += a[index][k] * slope[k];
                }
            }
        }
        sums.map(sum_partial_sums)
    }
}

/// Adds up the chunks in their order, whoever calculates them.
fn sum_over_chunks(
    samples: &CurveSamples,
    chunk: impl Fn(std::ops::Range<usize>) -> CostDerivatives + Sync,
) -> CostDerivatives {
    let n = samples.len();
    let range = |i: usize| i * CHUNK..((i + 1) * CHUNK).min(n);
    let chunks = n.div_ceil(CHUNK);
    if n < PARALLEL_FROM {
        return (0..chunks).fold(CostDerivatives::default(), |total, i| total.add(&chunk(range(i))));
    }
    let parts: Vec<CostDerivatives> = (0..chunks).into_par_iter().map(|i| chunk(range(i))).collect();
    parts.iter().fold(CostDerivatives::default(), CostDerivatives::add)
}

/// Slip, force and weight of a block, filled up with samples of weight 0.
#[inline(always)]
fn sample_block(samples: &CurveSamples, from: usize, to: usize) -> [BlockColumn; 3] {
    let mut columns = [[0.0; BLOCK]; 3];
    for (column, source) in columns.iter_mut().zip([&samples.slip, &samples.force, &samples.weight]) {
        column[..to - from].copy_from_slice(&source[from..to]);
    }
    columns
}

#[inline(always)]
fn chunk_cost_derivatives(
    samples: &CurveSamples,
    range: std::ops::Range<usize>,
    theta: &Theta,
    free: &[usize],
    loss: Loss,
) -> CostDerivatives {
    let mut total = CostDerivatives::default();
    for from in range.clone().step_by(BLOCK) {
        let [slip, force, weight] = sample_block(samples, from, (from + BLOCK).min(range.end));
        let mut J = [[0.0; BLOCK]; COUNT];
        let mut residual = [0.0; BLOCK];
        for i in 0..BLOCK {
            let (value, gradient) = friction_and_gradient(theta, slip[i]);
            residual[i] = value - force[i];
            for k in 0..COUNT {
                J[k][i] = gradient[k];
            }
        }
        let (cost, weight) = block_cost_and_weights(loss, &residual, &weight);
        total.cost += cost;
        for (index, &i) in free.iter().enumerate() {
            let mut weighted = [0.0; BLOCK];
            for k in 0..BLOCK {
                weighted[k] = weight[k] * J[i][k];
            }
            total.gradient[i] += dot(&weighted, &residual);
            for &j in &free[index..] {
                total.hessian[i][j] += dot(&weighted, &J[j]);
            }
        }
    }
    for i in 0..COUNT {
        for j in 0..i {
            total.hessian[i][j] = total.hessian[j][i];
        }
    }
    total
}

#[inline(always)]
fn chunk_cost(samples: &CurveSamples, range: std::ops::Range<usize>, theta: &Theta, loss: Loss) -> f64 {
    let mut total = 0.0;
    for from in range.clone().step_by(BLOCK) {
        let [slip, force, weight] = sample_block(samples, from, (from + BLOCK).min(range.end));
        let mut residual = [0.0; BLOCK];
        for i in 0..BLOCK {
            residual[i] = friction_coefficient(theta, slip[i]) - force[i];
        }
        total += block_cost_and_weights(loss, &residual, &weight).0;
    }
    total
}

/// Cost of a block, and the weights that make the loss a sum of squares to first order.
#[inline(always)]
fn block_cost_and_weights(loss: Loss, residual: &BlockColumn, weight: &BlockColumn) -> (f64, BlockColumn) {
    if let Loss::Square = loss {
        let mut half = [0.0; BLOCK];
        for i in 0..BLOCK {
            half[i] = 0.5 * weight[i] * residual[i];
        }
        return (dot(&half, residual), *weight);
    }
    let mut cost = [0.0; BLOCK];
    let mut effective = [0.0; BLOCK];
    for i in 0..BLOCK {
        cost[i] = loss.cost(residual[i]);
        effective[i] = weight[i] * loss.weight(residual[i]);
    }
    (dot(weight, &cost), effective)
}

/// Σ a b, in partial sums.
#[inline(always)]
fn dot(a: &BlockColumn, b: &BlockColumn) -> f64 {
    let mut sums = [0.0; PARTIAL_SUMS];
    for (a, b) in a.chunks_exact(PARTIAL_SUMS).zip(b.chunks_exact(PARTIAL_SUMS)) {
        for k in 0..PARTIAL_SUMS {
            sums[k] += a[k] * b[k];
        }
    }
    sum_partial_sums(sums)
}

#[inline(always)]
fn sum_partial_sums([a, b, c, d, e, f, g, h]: [f64; PARTIAL_SUMS]) -> f64 {
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
