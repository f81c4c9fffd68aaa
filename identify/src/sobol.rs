//! Tells which parameter the friction coefficient is sensitive to, at each slip: Sobol's indices.
//!
//! The coefficient is a smooth function of few parameters in a small box, so that a tensor grid of Gauss-Legendre nodes
//! gives the indices to rounding where random sampling gives two or three digits.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::quadrature::gauss_legendre;
use serde::Serialize;
use tire_inference::kernel::friction_coefficient;
use tire_inference::parameters::by_parameter;
use vehicle::MagicFormula;

/// Nodes per axis: the error of an index is below 1e-8 for ±10 % about the usual tires, see the tests.
const NODES: usize = 8;

/// Shares of the variance of the friction coefficient at one slip, in the order B, C, D, E.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SobolIndices {
    /// Slip angle [rad] or slip ratio [-].
    pub slip: f64,
    /// Standard deviation of the friction coefficient [-].
    pub std: f64,
    /// Share in which a parameter has a part, alone or with others.
    #[serde(serialize_with = "by_parameter")]
    pub total: [f64; 4],
    /// Share of a parameter alone.
    #[serde(serialize_with = "by_parameter")]
    pub first: [f64; 4],
    /// Share of each pair beyond that of its two parameters; symmetric, the diagonal is 0.
    pub second: [[f64; 4]; 4],
}

/// Indices at each slip when B, C, D and E are uniform within ± `spread` (0.1: 10 %) of those of a curve, independent of
/// each other. Slips where nothing varies, as at x = 0, are left out.
pub fn sobol_indices(curve: &MagicFormula, spread: f64, slips: &[f64]) -> Vec<SobolIndices> {
    with_nodes(curve, spread, slips, NODES)
}

/// As [`sobol_indices`], with a number of nodes per axis.
pub fn with_nodes(curve: &MagicFormula, spread: f64, slips: &[f64], nodes: usize) -> Vec<SobolIndices> {
    let rule = gauss_legendre(nodes);
    let weight: Vec<f64> = rule.iter().map(|node| node.1).collect();
    let axis =
        |centre: f64| -> Vec<f64> { rule.iter().map(|node| centre * (1.0 + spread * node.0)).collect() };
    let (B, C, E) = (axis(curve.B), axis(curve.C), axis(curve.E));
    let shape = |slip: f64| {
        let mut values = Vec::with_capacity(nodes.pow(3));
        for &B in &B {
            for &E in &E {
                let shape = |&C: &f64| friction_coefficient(&[B, C, 1.0, E, curve.S_h, 0.0], slip);
                values.extend(C.iter().map(shape));
            }
        }
        values
    };
    let D = FactorMoments { mean: curve.D, variance: (spread * curve.D).powi(2) / 3.0 };
    slips
        .iter()
        .filter_map(|&slip| ShapeMoments::from_grid_values(&shape(slip), &weight).to_sobol_indices(slip, &D))
        .collect()
}

/// Mean and variance of the factor D, which needs no grid.
struct FactorMoments {
    mean: f64,
    variance: f64,
}

/// Moments of the shape g = μ / D over B, E and C: the axes of the grid, outermost first.
struct ShapeMoments {
    mean: f64,
    square: f64,
    /// Variance of the mean of g given one of B, E, C.
    one: [f64; 3],
    /// Variance of the mean of g given all but one of B, E, C.
    all_but: [f64; 3],
}

impl ShapeMoments {
    fn from_grid_values(values: &[f64], weight: &[f64]) -> Self {
        let n = weight.len();
        // Means over one axis, and over two: [kept axis][node].
        let mut planes = [vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]];
        let mut lines = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let (mut mean, mut square) = (0.0, 0.0);
        for (at, &g) in values.iter().enumerate() {
            let (i, j, k) = (at / (n * n), at / n % n, at % n);
            let (wi, wj, wk) = (weight[i], weight[j], weight[k]);
            planes[0][j * n + k] += wi * g;
            planes[1][i * n + k] += wj * g;
            planes[2][i * n + j] += wk * g;
            lines[0][i] += wj * wk * g;
            lines[1][j] += wi * wk * g;
            lines[2][k] += wi * wj * g;
            mean += wi * wj * wk * g;
            square += wi * wj * wk * g * g;
        }
        // Of the differences to the mean: their squares do not cancel.
        let one = lines.map(|line| line.iter().zip(weight).map(|(g, w)| w * (g - mean).powi(2)).sum());
        let all_but = planes.map(|plane| {
            plane.iter().enumerate().map(|(at, g)| weight[at / n] * weight[at % n] * (g - mean).powi(2)).sum()
        });
        Self { mean, square, one, all_but }
    }

    /// Sobol 1993: shares of Var(D g), where D is independent of g.
    fn to_sobol_indices(&self, slip: f64, D: &FactorMoments) -> Option<SobolIndices> {
        // Positions of B, E and C among B, C, D, E.
        const PLACE: [usize; 3] = [0, 3, 1];
        let spread = self.square - self.mean * self.mean;
        let mean_square = D.mean * D.mean;
        let whole = mean_square * spread + D.variance * self.square;
        if whole <= 1e-30 {
            return None;
        }
        let mut found =
            SobolIndices { slip, std: whole.sqrt(), total: [0.0; 4], first: [0.0; 4], second: [[0.0; 4]; 4] };
        found.first[2] = D.variance * self.mean * self.mean / whole;
        found.total[2] = D.variance * self.square / whole;
        for (axis, &index) in PLACE.iter().enumerate() {
            found.first[index] = mean_square * self.one[axis] / whole;
            found.total[index] = (mean_square + D.variance) * (spread - self.all_but[axis]) / whole;
            found.set_second_order(index, 2, D.variance * self.one[axis] / whole);
            let (left, right) = ((axis + 1) % 3, (axis + 2) % 3);
            let both = self.all_but[axis] - self.one[left] - self.one[right];
            found.set_second_order(PLACE[left], PLACE[right], mean_square * both / whole);
        }
        Some(found)
    }
}

impl SobolIndices {
    fn set_second_order(&mut self, i: usize, j: usize, share: f64) {
        self.second[i][j] = share;
        self.second[j][i] = share;
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    fn truth() -> MagicFormula {
        MagicFormula { B: 15.0, C: 2.0, D: 1.5, E: 0.8, S_h: 0.0, S_v: 0.0 }
    }

    #[test]
    fn the_indices_are_those_of_sixty_five_thousand_saltelli_samples() {
        // Slip, standard deviation, total and first-order indices of B, C, D, E: an independent Monte Carlo run with the
        // estimators of Saltelli and Jansen, good to about 0.002.
        #[rustfmt::skip]
        let peer = [
            (0.005, 0.0222, [0.330, 0.334, 0.339, 0.000], [0.328, 0.332, 0.337, 0.000]),
            (0.02,  0.0730, [0.266, 0.325, 0.411, 0.000], [0.265, 0.323, 0.409, 0.000]),
            (0.05,  0.0923, [0.073, 0.183, 0.744, 0.002], [0.072, 0.181, 0.744, 0.002]),
            (0.08,  0.0868, [0.005, 0.016, 0.982, 0.001], [0.002, 0.012, 0.982, 0.000]),
            (0.12,  0.0907, [0.015, 0.111, 0.870, 0.011], [0.011, 0.105, 0.869, 0.008]),
            (0.20,  0.1148, [0.027, 0.453, 0.455, 0.075], [0.024, 0.444, 0.454, 0.068]),
            (0.40,  0.1679, [0.022, 0.675, 0.141, 0.172], [0.021, 0.665, 0.139, 0.165]),
            (0.75,  0.2134, [0.015, 0.759, 0.051, 0.183], [0.015, 0.751, 0.048, 0.179]),
            (1.00,  0.2284, [0.012, 0.798, 0.033, 0.164], [0.012, 0.792, 0.030, 0.160]),
        ];
        let slips: Vec<f64> = peer.iter().map(|row| row.0).collect();
        for (own, (slip, std, total, first)) in sobol_indices(&truth(), 0.1, &slips).iter().zip(peer) {
            assert_eq!(own.slip, slip);
            assert_abs_diff_eq!(own.std, std, epsilon = 2e-4);
            for i in 0..4 {
                assert_abs_diff_eq!(own.total[i], total[i], epsilon = 0.003);
                assert_abs_diff_eq!(own.first[i], first[i], epsilon = 0.003);
            }
        }
    }

    #[test]
    fn a_finer_grid_changes_no_index_by_more_than_1e_8() {
        let slips: Vec<f64> = (1..=100).map(|percent| f64::from(percent) / 100.0).collect();
        let fine = with_nodes(&truth(), 0.1, &slips, 16);
        for (own, fine) in sobol_indices(&truth(), 0.1, &slips).iter().zip(&fine) {
            for i in 0..4 {
                assert_abs_diff_eq!(own.total[i], fine.total[i], epsilon = 1e-8);
                assert_abs_diff_eq!(own.first[i], fine.first[i], epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn shares_of_all_orders_are_the_whole() {
        for found in sobol_indices(&truth(), 0.3, &[0.01, 0.06, 0.09, 0.3, 1.0]) {
            let first: f64 = found.first.iter().sum();
            let second: f64 = found.second.iter().flatten().sum::<f64>() / 2.0;
            let total: f64 = found.total.iter().sum();
            let higher = 1.0 - first - second;
            assert!(higher > -1e-12, "orders above the second have the share {higher}");
            // Each pair is counted twice in the total indices, each triple three times, all four together four times.
            let excess = total - first - 2.0 * second;
            assert!(excess >= 3.0 * higher - 1e-12 && excess <= 4.0 * higher + 1e-12);
            for i in 0..4 {
                assert!(found.total[i] >= found.first[i] + found.second[i].iter().sum::<f64>() - 1e-12);
            }
        }
    }

    #[test]
    fn the_peak_depends_on_d_alone_and_the_origin_on_nothing() {
        let peak = truth().peak_slip().expect("a peak exists");
        let found = sobol_indices(&truth(), 1e-3, &[0.0, peak]);
        assert_eq!(found.len(), 1, "at slip 0 the coefficient is 0 for every tire");
        assert_abs_diff_eq!(found[0].total[2], 1.0, epsilon = 1e-4);
    }
}
