//! The likelihood at one point with its derivatives, summed up from innovations.

use nalgebra::{DMatrix, DVector};
use numerics::simd_batch::{SimdBatch, WIDTH};
use numerics::tangent::{DIRECTIONS, OuterProductSums, Tangent};

use crate::filter_pass::{InnovationVisitor, RowInnovations};

/// The likelihood at one point, with its derivatives.
#[derive(Clone, Debug)]
pub struct LikelihoodEvaluation {
    /// ½ Σ (e²/s + ln s).
    pub cost: f64,
    /// Its derivatives.
    pub gradient: [f64; DIRECTIONS],
    /// Fisher's information.
    pub information: [[f64; DIRECTIONS]; DIRECTIONS],
    /// Mean of e²/s for v_x, v_y, r and a_y; 1 if model and noises are right.
    pub mean_square: [f64; 4],
}

impl LikelihoodEvaluation {
    /// What is reported instead once nobody wants to know.
    pub const CANCELLED: Self = Self {
        cost: f64::INFINITY,
        gradient: [0.0; DIRECTIONS],
        information: [[0.0; DIRECTIONS]; DIRECTIONS],
        mean_square: [0.0; 4],
    };

    /// As the model that a minimiser wants.
    pub fn to_sqp_model(&self, samples: usize) -> numerics::sqp::QuadraticModel {
        numerics::sqp::QuadraticModel {
            cost: self.cost,
            gradient: DVector::from_column_slice(&self.gradient),
            hessian: DMatrix::from_fn(DIRECTIONS, DIRECTIONS, |i, j| self.information[i][j]),
            scale: (4.0 * samples as f64).sqrt(),
        }
    }
}

/// A residual over its standard deviation, and its variance over √2 times itself, with the derivatives of the residual and of
/// the variance alone: their products are Fisher's information.
#[inline(always)]
pub fn whiten_residual<S: pulp::Simd, const N: usize>(
    residual: Tangent<S, N>,
    variance: Tangent<S, N>,
) -> (Tangent<S, N>, Tangent<S, N>) {
    let inverse = 1.0 / variance.value();
    (residual * inverse.sqrt(), variance * (0.5_f64.sqrt() * inverse))
}

/// The costs of several parameter vectors while they grow.
pub struct CostAccumulator(pub [f64; WIDTH]);

impl InnovationVisitor<SimdBatch> for CostAccumulator {
    #[inline(always)]
    fn visit(&mut self, _: usize, _: usize, innovation: &RowInnovations<SimdBatch>, _: &[SimdBatch; 4]) {
        let [e, s] = [innovation.residual, innovation.variance];
        for index in 0..WIDTH {
            let (mut squares, mut determinant) = (0.0, 1.0);
            for i in 0..4 {
                squares += e[i].0[index] * e[i].0[index] / s[i].0[index];
                determinant *= s[i].0[index];
            }
            self.0[index] += 0.5 * (squares + determinant.ln());
        }
    }
}

/// A [`LikelihoodEvaluation`] while it grows.
pub struct EvaluationSums<S: pulp::Simd, const N: usize> {
    cost: Tangent<S, N>,
    products: OuterProductSums<S, N>,
    squares: [f64; 4],
}

impl<S: pulp::Simd, const N: usize> EvaluationSums<S, N> {
    /// Nothing yet.
    pub fn new(simd: S) -> Self {
        Self {
            cost: Tangent::seed(simd, 0.0, 0, 0.0),
            products: OuterProductSums::new(simd),
            squares: [0.0; 4],
        }
    }

    /// All of it, over a number of samples.
    pub fn to_evaluation(&self, samples: usize) -> LikelihoodEvaluation {
        LikelihoodEvaluation {
            cost: self.cost.value(),
            gradient: self.cost.derivatives(),
            information: self.products.to_matrix(),
            mean_square: self.squares.map(|square| square / samples as f64),
        }
    }
}

impl<S: pulp::Simd, const N: usize> InnovationVisitor<Tangent<S, N>> for EvaluationSums<S, N> {
    #[inline(always)]
    fn visit(
        &mut self,
        _: usize,
        _: usize,
        innovation: &RowInnovations<Tangent<S, N>>,
        _: &[Tangent<S, N>; 4],
    ) {
        let mut determinant = 1.0;
        for i in 0..4 {
            let (e, s) = (innovation.residual[i], innovation.variance[i]);
            let inverse = 1.0 / s.value();
            let square = e.value() * e.value() * inverse;
            self.squares[i] += square;
            determinant *= s.value();
            let by_s = 0.5 * inverse * (1.0 - square);
            self.cost = self.cost
                + e.apply_chain_rule(0.5 * square, e.value() * inverse)
                + s.apply_chain_rule(0.0, by_s);
            let (e, s) = whiten_residual(e, s);
            self.products.add_vectors(&[*e.derivative_vectors(), *s.derivative_vectors()]);
        }
        self.cost = self.cost + 0.5 * determinant.ln();
    }
}
