//! Pulls parameters of tires towards expected ones, and those of both axles towards each other.

use nalgebra::DVector;
use numerics::sqp;

/// Pulls on the parameters: ½ λ_reg Σ ((θ − θ_0)/θ_0)² + ½ λ_sim Σ ((θ_f − θ_r)/θ_0)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// λ_reg: towards the expected parameters.
    pub towards_expected: f64,
    /// λ_sim: of the axles towards each other.
    pub towards_each_other: f64,
    /// θ_0: B, C, D, E of a usual tire.
    pub expected: [f64; 4],
}

impl Default for Pull {
    fn default() -> Self {
        Self { towards_expected: 0.0, towards_each_other: 0.0, expected: [15.0, 1.5, 1.2, 0.5] }
    }
}

impl Pull {
    /// What the pulls cost at B, C, D, E of the front and the rear axle and whatever follows.
    pub fn cost(&self, x: &DVector<f64>) -> f64 {
        let square = |i: usize| {
            let off = |from: f64, to: f64| ((from - to) / self.expected[i]).powi(2);
            let expected = off(x[i], self.expected[i]) + off(x[i + 4], self.expected[i]);
            self.towards_expected * expected + self.towards_each_other * off(x[i], x[i + 4])
        };
        0.5 * (0..4).map(square).sum::<f64>()
    }

    /// Adds the pulls to a model in B, C, D, E of the front and the rear axle and whatever follows.
    pub fn add(&self, x: &DVector<f64>, model: &mut sqp::Model) {
        model.cost += self.cost(x);
        for i in 0..4 {
            let weight = self.expected[i].powi(-2);
            let (f, r) = (i, i + 4);
            for place in [f, r] {
                let rise = self.towards_expected * weight;
                let off = x[place] - self.expected[i];
                model.gradient[place] += rise * off;
                model.hessian[(place, place)] += rise;
            }
            let rise = self.towards_each_other * weight;
            let off = x[f] - x[r];
            for (a, b, sign) in [(f, r, 1.0), (r, f, -1.0)] {
                model.gradient[a] += sign * rise * off;
                model.hessian[(a, a)] += rise;
                model.hessian[(a, b)] -= rise;
            }
        }
    }
}
