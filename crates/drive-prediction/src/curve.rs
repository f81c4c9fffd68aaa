//! Curves of axles: force over load from the slip angle.
#![allow(non_snake_case, reason = "parameters of the Magic Formula are written as in its source")]

use serde::Serialize;

/// Lateral force of an axle over its load, from its slip angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AxleCurve {
    /// K (α + S_h).
    Linear {
        /// Cornering stiffness over load [1/rad].
        K: f64,
        /// Shift of the slip angle [rad].
        S_h: f64,
    },
    /// D sin(C atan(B (α + S_h))): the Magic Formula without curvature.
    MagicFormula {
        /// Stiffness factor [1/rad].
        B: f64,
        /// Shape factor [-].
        C: f64,
        /// Peak [-].
        D: f64,
        /// Shift of the slip angle [rad].
        S_h: f64,
    },
}

impl AxleCurve {
    /// Force over load at a slip angle [rad].
    #[must_use]
    pub fn force(&self, alpha: f64) -> f64 {
        match *self {
            Self::Linear { K, S_h } => K * (alpha + S_h),
            Self::MagicFormula { B, C, D, S_h } => D * (C * (B * (alpha + S_h)).atan()).sin(),
        }
    }
}
