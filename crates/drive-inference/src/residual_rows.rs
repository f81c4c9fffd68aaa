//! Every residual of a pass with its derivatives: gradients and Fisher's information for any number of unknowns, over parts of a drive.
#![allow(clippy::needless_range_loop, reason = "indices as in the equations")]

use nalgebra::{DMatrix, DVector};
use numerics::tangent::{DIRECTIONS, Tangent};
use pulp::bytemuck::cast_slice;

use crate::evaluation::{LikelihoodEvaluation, whiten_residual};
use crate::filter_pass::{InnovationVisitor, RowInnovations};

/// Channels of a row: v_x, v_y, r, a_y.
const CHANNELS: usize = 4;
/// Length of a block [rows].
const BLOCK: usize = 200;

/// One residual along up to eight directions.
#[derive(Clone, Copy)]
struct ResidualDerivatives {
    /// Over its standard deviation.
    whitened: f64,
    /// ½ ln of its variance.
    log_std: f64,
    /// Derivatives of the residual over its standard deviation.
    mean: [f64; DIRECTIONS],
    /// Derivatives of its variance over √2 times the variance.
    variance: [f64; DIRECTIONS],
}

/// The residuals of one pass.
pub struct ResidualGroup(Vec<ResidualDerivatives>);

impl ResidualGroup {
    /// Nothing yet, with room for a number of rows.
    pub fn new(rows: usize) -> Self {
        Self(Vec::with_capacity(CHANNELS * rows))
    }

    /// Groups of one direction each as one.
    pub fn merge_directions(alone: impl Iterator<Item = Self>) -> Self {
        let mut all = Self(Vec::new());
        for (direction, one) in alone.enumerate() {
            if direction == 0 {
                all = one;
                continue;
            }
            for (residual, one) in all.0.iter_mut().zip(one.0) {
                residual.mean[direction] = one.mean[0];
                residual.variance[direction] = one.variance[0];
            }
        }
        all
    }
}

impl<S: pulp::Simd, const N: usize> InnovationVisitor<Tangent<S, N>> for ResidualGroup {
    #[inline(always)]
    fn visit(
        &mut self,
        _: usize,
        _: usize,
        innovation: &RowInnovations<Tangent<S, N>>,
        _: &[Tangent<S, N>; 4],
    ) {
        for i in 0..CHANNELS {
            let variance = innovation.variance[i];
            let (e_by, s_by) = whiten_residual(innovation.residual[i], variance);
            let mut residual = ResidualDerivatives {
                whitened: e_by.value(),
                log_std: 0.5 * variance.value().ln(),
                mean: [0.0; DIRECTIONS],
                variance: [0.0; DIRECTIONS],
            };
            let lanes = N * S::F64_LANES;
            residual.mean[..lanes].copy_from_slice(cast_slice::<_, f64>(e_by.derivative_vectors()));
            residual.variance[..lanes].copy_from_slice(cast_slice::<_, f64>(s_by.derivative_vectors()));
            self.0.push(residual);
        }
    }
}

/// Cost ½ Σ (e²/s + ln s) with its derivatives.
#[derive(Clone, Debug)]
pub struct CostExpansion {
    /// The cost.
    pub cost: f64,
    /// Its gradient.
    pub gradient: DVector<f64>,
    /// Fisher's information.
    pub information: DMatrix<f64>,
}

impl CostExpansion {
    /// That of both together.
    pub fn plus(self, other: &Self) -> Self {
        let Self { cost, gradient, information } = self;
        Self {
            cost: cost + other.cost,
            gradient: gradient + &other.gradient,
            information: information + &other.information,
        }
    }

    /// As the model that a minimiser wants.
    pub fn into_sqp_model(self, samples: usize) -> numerics::sqp::QuadraticModel {
        let Self { cost, gradient, information } = self;
        let scale = (CHANNELS as f64 * samples as f64).sqrt();
        numerics::sqp::QuadraticModel { cost, gradient, hessian: information, scale }
    }
}

/// All residuals, of all recordings one after the other.
pub struct ResidualRows {
    groups: Vec<ResidualGroup>,
    directions: usize,
    cancelled: bool,
}

impl ResidualRows {
    /// Those of passes over eight directions each.
    pub fn new(groups: Vec<ResidualGroup>, directions: usize) -> Self {
        Self { groups, directions, cancelled: false }
    }

    /// What is given instead once nobody wants to know.
    pub fn new_cancelled(directions: usize) -> Self {
        Self { groups: Vec::new(), directions, cancelled: true }
    }

    /// Adds the direction from these residuals to others of the same rows, which is a secant.
    pub fn add_secant_direction(&mut self, others: &Self) {
        let (Some(own), Some(others)) = (self.groups.first(), others.groups.first()) else {
            return;
        };
        let towards = |(own, other): (&ResidualDerivatives, &ResidualDerivatives)| {
            let wider = other.log_std - own.log_std;
            let mean = other.whitened * wider.exp() - own.whitened;
            (mean, 0.5_f64.sqrt() * ((2.0 * wider).exp() - 1.0))
        };
        let secants: Vec<(f64, f64)> = own.0.iter().zip(&others.0).map(towards).collect();
        let lane = self.directions % DIRECTIONS;
        if lane == 0 {
            let none = [0.0; DIRECTIONS];
            let bare = |it: &ResidualDerivatives| ResidualDerivatives { mean: none, variance: none, ..*it };
            let bare = ResidualGroup(own.0.iter().map(bare).collect());
            self.groups.push(bare);
        }
        let residuals = self.groups.iter_mut().last().into_iter().flat_map(|group| &mut group.0);
        for (residual, (mean, variance)) in residuals.zip(secants) {
            (residual.mean[lane], residual.variance[lane]) = (mean, variance);
        }
        self.directions += 1;
    }

    /// How many rows there are, with a residual of each channel.
    pub fn len(&self) -> usize {
        self.groups.first().map_or(0, |group| group.0.len() / CHANNELS)
    }

    /// All of it along the first eight directions.
    pub fn to_evaluation(&self) -> LikelihoodEvaluation {
        let CostExpansion { cost, gradient, information } = self.total_expansion();
        let square =
            |channel: usize| self.whitened_residuals(channel).map(|e| e * e).sum::<f64>() / self.len() as f64;
        LikelihoodEvaluation {
            cost,
            gradient: std::array::from_fn(|i| gradient[i]),
            information: std::array::from_fn(|i| std::array::from_fn(|j| information[(i, j)])),
            mean_square: std::array::from_fn(square),
        }
    }

    /// Residuals of a channel over their standard deviations.
    fn whitened_residuals(&self, channel: usize) -> impl Iterator<Item = f64> + '_ {
        let residuals = self.groups.iter().take(1).flat_map(|group| &group.0);
        residuals.skip(channel).step_by(CHANNELS).map(|it| it.whitened)
    }

    /// Correlation of the whitened residuals of a channel with those of the row before.
    pub fn whitened_autocorrelation(&self, channel: usize) -> f64 {
        let e: Vec<f64> = self.whitened_residuals(channel).collect();
        let square: f64 = e.iter().map(|e| e * e).sum();
        e.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / square
    }

    /// The gradient of the cost of each block.
    pub fn block_scores(&self) -> Vec<DVector<f64>> {
        let block = |from: usize| self.gradient_over_rows(from..(from + BLOCK).min(self.len()));
        (0..self.len()).step_by(BLOCK).map(block).collect()
    }

    /// The gradient of the cost of some rows.
    pub fn gradient_over_rows(&self, rows: std::ops::Range<usize>) -> DVector<f64> {
        let range = CHANNELS * rows.start..CHANNELS * rows.end;
        let groups = self.groups.iter().flat_map(|group| sum_gradient(&group.0[range.clone()]));
        DVector::from_iterator(self.directions, groups.take(self.directions))
    }

    /// The sum over all rows.
    pub fn total_expansion(&self) -> CostExpansion {
        self.partial_expansion(0..self.len())
    }

    /// The sum over some rows.
    pub fn partial_expansion(&self, rows: std::ops::Range<usize>) -> CostExpansion {
        let n = self.directions;
        let mut sum = CostExpansion {
            cost: if self.cancelled { f64::INFINITY } else { 0.0 },
            gradient: DVector::zeros(n),
            information: DMatrix::zeros(n, n),
        };
        let range = CHANNELS * rows.start..CHANNELS * rows.end;
        let residuals = |group: usize| &self.groups[group].0[range.clone()];
        if !self.cancelled {
            sum.gradient = self.gradient_over_rows(rows);
        }
        for a in 0..self.groups.len() {
            let from = DIRECTIONS * a;
            for b in a..self.groups.len() {
                let pair = DerivativeProducts { a: residuals(a), b: residuals(b) };
                let products = pulp::Arch::new().dispatch(pair);
                let to = DIRECTIONS * b;
                for i in 0..DIRECTIONS.min(n - from) {
                    for j in 0..DIRECTIONS.min(n - to) {
                        sum.information[(from + i, to + j)] = products[i][j];
                        sum.information[(to + j, from + i)] = products[i][j];
                    }
                }
            }
        }
        if let Some(group) = self.groups.first() {
            let cost = |it: &ResidualDerivatives| 0.5 * it.whitened * it.whitened + it.log_std;
            sum.cost += group.0[range.clone()].iter().map(cost).sum::<f64>();
        }
        sum
    }
}

fn sum_gradient(residuals: &[ResidualDerivatives]) -> [f64; DIRECTIONS] {
    let mut sum = [0.0; DIRECTIONS];
    for residual in residuals {
        let e = residual.whitened;
        let by_variance = 0.5_f64.sqrt() * (1.0 - e * e);
        for (i, sum) in sum.iter_mut().enumerate() {
            *sum += residual.mean[i] * e + residual.variance[i] * by_variance;
        }
    }
    sum
}

/// Σ of the products of the derivatives of the same residuals along two groups of directions. Not a closure: those are not always inlined
/// into the code for wide vectors.
struct DerivativeProducts<'a> {
    a: &'a [ResidualDerivatives],
    b: &'a [ResidualDerivatives],
}

impl pulp::WithSimd for DerivativeProducts<'_> {
    type Output = [[f64; DIRECTIONS]; DIRECTIONS];

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        let mut sum = [[0.0; DIRECTIONS]; DIRECTIONS];
        for (a, b) in self.a.iter().zip(self.b) {
            for i in 0..DIRECTIONS {
                for j in 0..DIRECTIONS {
                    sum[i][j] += a.mean[i] * b.mean[j] + a.variance[i] * b.variance[j];
                }
            }
        }
        sum
    }
}
