//! Brings an operating point into the range of the formula, and computes what all forces share.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::PI;

use super::{FormulaConvention, MfTire};
use crate::coefficients::MagicFormulaVersion;
use crate::real::Real;
use crate::slip::TireOperatingPoint;

/// Keeps denominators from 0 [N, m/s], with the sign of what it is added to.
pub(super) const EPSILON: f64 = 1e-6;

/// Operating point as the equations take it.
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalisedOperatingPoint<T> {
    /// Longitudinal slip κ [-].
    pub kappa: T,
    /// Slip angle α\* [rad], or its tangent.
    pub alpha: T,
    /// Camber γ [rad].
    pub gamma: T,
    /// Camber γ\* [rad], or its sine.
    pub gamma_star: T,
    /// Load F_z [N].
    pub F_z: T,
    /// Load of the trail and the residual torque [N].
    pub F_z_trail: T,
    /// Relative change of the load, df_z [-].
    pub dfz: T,
    /// Relative change of the pressure, dp_i [-].
    pub dpi: T,
    /// Forward speed [m/s].
    pub v_x: T,
    /// 1 forward and at rest, −1 in reverse.
    pub direction: T,
    /// Share that is left of the shifts at low speed [-].
    pub shifts: T,
    /// cos α′ = V_x / V_c [-].
    pub cos_alpha: T,
    /// cos α\*, of the residual torque [-].
    pub cos_residual: T,
    /// Friction of the road relative to that of the measurements [-].
    pub mu: T,
}

/// 1 for what is not negative, −1 otherwise.
#[inline(always)]
pub(super) fn nonzero_sign<T: Real>(x: T) -> T {
    T::select(x.is_less_than(x.constant_like(0.0)), x.constant_like(-1.0), x.constant_like(1.0))
}

/// −1, 0 or 1.
#[inline(always)]
pub(super) fn signum<T: Real>(x: T) -> T {
    T::select(x.is_equal_to(0.0), x.constant_like(0.0), nonzero_sign(x))
}

/// The nearest value from `low` to `high`; NaN stays.
#[inline(always)]
pub(super) fn clamp<T: Real>(x: T, low: T, high: T) -> T {
    T::select(x.is_less_than(low), low, T::select(high.is_less_than(x), high, x))
}

impl<T: Real> MfTire<T> {
    #[inline(always)]
    pub(super) fn normalized_point(&self, slip: &TireOperatingPoint<T>) -> NormalisedOperatingPoint<T> {
        let (c, per) = (&self.coefficients, &self.reciprocals);
        let (zero, one) = (slip.F_z.constant_like(0.0), slip.F_z.constant_like(1.0));
        let FormulaConvention { limits, trigonometric } = self.reading;
        let v_x = slip.v_x;
        let pressure = slip.pressure.unwrap_or(c.INFLPRES);
        let mut F_z = T::select(slip.F_z.is_not_a_number(), slip.F_z, zero);
        F_z = T::select(zero.is_less_than(slip.F_z), slip.F_z, F_z);
        let (mut kappa, mut alpha, mut gamma) = (slip.kappa, slip.alpha, slip.gamma);
        let (mut inside, mut shifts) = (pressure, one);
        if limits {
            let slow = v_x.abs() * per.VXLOW;
            let fades = slow.is_less_than(one);
            if slow.is_true_anywhere(fades) {
                kappa = T::select(fades, kappa * slow, kappa);
                shifts = T::select(fades, (one - (slow * PI).cos()) * 0.5, one);
                let speed = (v_x.abs() + (v_x * alpha.tan()).abs()) * per.VXLOW;
                alpha = T::select(speed.is_less_than(one), alpha * speed, alpha);
            }
            F_z = T::select(c.FZMAX.is_less_than(F_z), c.FZMAX, F_z);
            kappa = clamp(kappa, c.KPUMIN, c.KPUMAX);
            alpha = clamp(alpha, c.ALPMIN, c.ALPMAX);
            gamma = clamp(gamma, c.CAMMIN, c.CAMMAX);
            inside = clamp(pressure, c.PRESMIN, c.PRESMAX);
        }
        let F_z_trail = match limits {
            true => {
                T::select(zero.is_less_than(F_z), T::select(F_z.is_less_than(c.FZMIN), c.FZMIN, F_z), F_z)
            }
            false => F_z,
        };
        let (sin, cos) = alpha.sin_cos();
        let tan = sin / cos;
        let speed = v_x.abs() * (tan * tan + 1.0).sqrt();
        let dpi = match c.version {
            MagicFormulaVersion::Mf52 => zero,
            _ => inside * per.NOMPRES - 1.0,
        };
        let (alpha, cos_residual, gamma_star) = match trigonometric {
            true => {
                let alpha = tan * nonzero_sign(v_x);
                (alpha, alpha.cos(), gamma.sin())
            }
            false => (alpha, cos, gamma),
        };
        NormalisedOperatingPoint {
            kappa,
            alpha,
            gamma,
            gamma_star,
            F_z,
            F_z_trail,
            dfz: F_z * per.F_z0 - 1.0,
            dpi,
            v_x,
            direction: nonzero_sign(v_x),
            shifts,
            cos_alpha: v_x / (speed + EPSILON),
            cos_residual,
            mu: slip.mu,
        }
    }
}
