//! Tells how far a tire's curve misses the origin, from its straight part.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::robust::fit_robust_line;
use crate::samples::CurveSamples;

/// Estimation of the shifts S_h and S_v of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)]
pub enum ShiftEstimation {
    /// By the fit, together with the other parameters.
    #[default]
    Joint,
    /// By a straight line beforehand (Goblirsch et al.); the fit holds both shifts.
    TwoStep {
        /// Largest slip of the straight part of the curve, in the unit of the slip; 0.015 in the paper's program.
        limit: f64,
        /// Share of the offset that is a shift of the slip [-]; the rest is a shift of the force.
        ///
        /// A line has two numbers, slope K and intercept c, and the curve near its centre three: K, S_h and S_v, of
        /// which K S_h + S_v = c. Root and intercept of the line are the same offset stated twice, so to apply both in
        /// full would shift twice as far as the data say. The paper's program halves both, which is the share 0.5: the
        /// line is met, and the offset goes half here, half there for want of a reason. Points at high slip of both
        /// signs do have one, as S_v makes the peaks differ and S_h does not: hence the joint fit is the default. 1 is
        /// for errors of the slip, such as a turned velocity sensor or steering offset; 0 for those of the force.
        horizontal_share: f64,
    },
}

/// Shifts of a curve, in the convention x = slip + S_h, μ = y(x) + S_v.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurveShift {
    /// Of the slip.
    pub S_h: f64,
    /// Of the force over load [-].
    pub S_v: f64,
    /// Slope of the line: force over load by slip.
    pub K: f64,
    /// How many points it is through.
    pub samples: usize,
}

/// Points that each side of zero slip must have.
const LEAST: usize = 10;

/// Shifts from the points with |slip| ≤ `limit`; `axle` names them in the error.
///
/// # Errors
/// With too few points on either side of zero slip.
pub fn from_line(
    samples: &CurveSamples,
    limit: f64,
    horizontal_share: f64,
    axle: &str,
) -> Result<CurveShift, Error> {
    let near = (0..samples.len()).filter(|&i| samples.slip[i].abs() <= limit);
    let (slip, force): (Vec<f64>, Vec<f64>) = near.map(|i| (samples.slip[i], samples.force[i])).unzip();
    let left = slip.iter().filter(|s| **s < 0.0).count();
    let found = left.min(slip.len() - left);
    let few = || Error::FewNearOrigin { axle: axle.into(), found, least: LEAST, limit };
    if found < LEAST {
        return Err(few());
    }
    let [c, K] = fit_robust_line(&slip, &force).ok_or_else(few)?;
    let S_h = horizontal_share * c / K;
    Ok(CurveShift { S_h, S_v: (1.0 - horizontal_share) * c, K, samples: slip.len() })
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use vehicle::MagicFormula;

    use super::*;

    #[test]
    fn both_halves_together_are_the_offset() {
        let truth = MagicFormula { S_h: 0.003, S_v: 0.02, ..MagicFormula::default() };
        let slip: Vec<f64> = (-60..=60).map(|i| 0.00005 * f64::from(i)).collect();
        let force: Vec<f64> = slip.iter().map(|s| truth.friction_coefficient(*s)).collect();
        let samples = CurveSamples::new(slip, force);
        for share in [0.0, 0.5, 1.0] {
            let found = from_line(&samples, 0.015, share, "front lateral").expect("the points suffice");
            assert_eq!(found.samples, 121);
            // The curve with these shifts meets the data in the middle whatever the share is.
            let curve = MagicFormula { S_h: found.S_h, S_v: found.S_v, ..truth };
            assert_relative_eq!(
                curve.friction_coefficient(0.0),
                truth.friction_coefficient(0.0),
                epsilon = 2e-3
            );
            assert_relative_eq!(
                found.S_h * found.K + found.S_v,
                truth.friction_coefficient(0.0),
                epsilon = 2e-3
            );
        }
    }

    #[test]
    fn one_side_is_not_enough() {
        let slip: Vec<f64> = (0..60).map(|i| 0.0002 * f64::from(i)).collect();
        let error = from_line(&CurveSamples::new(slip.clone(), slip), 0.015, 0.5, "rear lateral");
        let text = error.expect_err("no negative slip").to_string();
        assert!(text.starts_with("rear lateral: 0 points have a slip within ±0.015"), "{text}");
    }
}
