//! Maps E in its bounds to a height s from 0 to 1 in the plane of the grid.
//!
//! 1 − E is near 2 s² where it is small, and grows as exp(κ s²) beyond: a curve with E = −10 hardly differs from one with E = −12.

/// 1 − E at a height of 1 without a bend, which is that of the box from −1 to 1.
const STRAIGHT: f64 = 2.0;

/// upper − E = (upper − lower) (exp(κ s²) − 1) / (exp(κ) − 1).
#[derive(Clone, Copy, Debug)]
pub struct CurvatureFactorMap {
    lower: f64,
    upper: f64,
    /// κ.
    bend: f64,
}

impl CurvatureFactorMap {
    /// For E between two bounds.
    pub fn new([lower, upper]: [f64; 2]) -> Self {
        // κ (upper − lower) / (exp(κ) − 1) = 2, falling in κ.
        let near = |bend: f64| (upper - lower) * bend / bend.exp_m1();
        let (mut low, mut high) = (0.0, if upper - lower > STRAIGHT { 50.0 } else { 0.0 });
        while high - low > 1e-12 {
            let middle = 0.5 * (low + high);
            if near(middle) > STRAIGHT { low = middle } else { high = middle }
        }
        Self { lower, upper, bend: high }
    }

    /// E at a height.
    pub fn curvature_factor_at(&self, s: f64) -> f64 {
        self.upper - (self.upper - self.lower) * self.share_of_range(s * s)
    }

    /// The share of the way from the upper to the lower bound.
    fn share_of_range(&self, square: f64) -> f64 {
        if self.bend > 0.0 { (self.bend * square).exp_m1() / self.bend.exp_m1() } else { square }
    }

    /// The height of a value of E, or of the nearest one within the bounds.
    pub fn height_of(&self, value: f64) -> f64 {
        let share = ((self.upper - value) / (self.upper - self.lower)).clamp(0.0, 1.0);
        let square = if self.bend > 0.0 { (share * self.bend.exp_m1()).ln_1p() / self.bend } else { share };
        square.sqrt().min(1.0)
    }

    /// ln |dE/ds| but for a constant.
    pub fn log_jacobian(&self, s: f64) -> f64 {
        s.ln() + self.bend * s * s
    }

    /// How many times as far as the first two units of E the whole range goes.
    pub fn range_in_units(&self) -> f64 {
        self.height_of(self.upper - STRAIGHT).recip()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn heights_and_values_belong_together() {
        for bounds in [[-1.0, 1.0], [-20.0, 1.0], [0.5, 0.6]] {
            let height = CurvatureFactorMap::new(bounds);
            for s in [0.01, 0.1, 0.5, 0.9, 1.0] {
                assert_relative_eq!(height.height_of(height.curvature_factor_at(s)), s, max_relative = 1e-9);
                let slope =
                    (height.curvature_factor_at(s - 1e-5) - height.curvature_factor_at(s + 1e-5)) / 2e-5;
                let other =
                    (height.curvature_factor_at(0.3 - 1e-5) - height.curvature_factor_at(0.3 + 1e-5)) / 2e-5;
                let ratio = (height.log_jacobian(s) - height.log_jacobian(0.3)).exp();
                assert_relative_eq!(slope / other, ratio, max_relative = 1e-6);
            }
            assert_relative_eq!(height.curvature_factor_at(1.0), bounds[0], max_relative = 1e-9);
        }
        // Near 1 the needle is as wide as in the box that the grid is made for.
        let share = (1.0 - CurvatureFactorMap::new([-20.0, 1.0]).curvature_factor_at(0.05)) / 0.005;
        assert_relative_eq!(share, 1.0, max_relative = 0.01);
    }
}
