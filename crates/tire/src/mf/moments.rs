//! Computes the moments (Pacejka, Tire and Vehicle Dynamics, section 4.3.2).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use super::MfTire;
use super::combined::cos_atan;
use super::curve::CurveShape;
use super::point::{NormalisedOperatingPoint, nonzero_sign, signum};
use super::pure::PureSlipCurve;
use crate::coefficients::MagicFormulaVersion;
use crate::real::Real;
use crate::slip::TireOperatingPoint;

/// The curve of the trail and the residual torque, of which the aligning moment consists.
#[derive(Clone, Copy, Debug)]
pub(super) struct AligningMomentCurve<T> {
    /// Curve of the trail, whose cosine it follows.
    pub shape: CurveShape<T>,
    /// Slip angle [rad] that the trail is asked at.
    pub slip: T,
    /// Trail t [m] where the cosine is 1.
    pub peak: T,
    /// Residual torque M_zr [N m].
    pub residual: T,
}

/// √(tan² α + x²), the tangent of the slip angle that acts as α and the longitudinal slip x do, and that angle's sign.
#[inline(always)]
fn equivalent_slip<T: Real>(alpha: T, x: T) -> (T, T) {
    let tan = alpha.tan();
    // The root has no derivative at 0.
    let length = T::select(x.is_equal_to(0.0), tan * nonzero_sign(tan), (tan * tan + x * x).sqrt());
    (length, T::select(x.is_equal_to(0.0), nonzero_sign(alpha), signum(alpha)))
}

impl<T: Real> MfTire<T> {
    /// Trail and residual torque (4.E31 to 4.E49 and 4.E71 to 4.E78); `lateral` is that at the point's camber.
    #[inline(always)]
    pub(super) fn aligning_moment_curve(
        &self,
        p: &NormalisedOperatingPoint<T>,
        longitudinal: &PureSlipCurve<T>,
        lateral: &PureSlipCurve<T>,
    ) -> AligningMomentCurve<T> {
        let (c, per) = (&self.coefficients, &self.reciprocals);
        let R0 = c.UNLOADED_RADIUS;
        let (F_z, dfz, dpi) = (p.F_z_trail, p.dfz, p.dpi);
        let gamma = p.gamma_star;
        let scale = c.LMUY * p.mu;
        // Without friction there is no force at the trail, however steep its curve.
        let softened = T::select(scale.is_equal_to(0.0), scale, c.LKY / scale);
        let S_Ht = c.QHZ1 + c.QHZ2 * dfz + (c.QHZ3 + c.QHZ4 * dfz) * gamma;
        let S_Hf = lateral.S_H + lateral.S_V * lateral.per_K;
        let x = longitudinal.K * lateral.per_K * p.kappa;
        let (alpha_t, alpha_r) = (p.alpha + S_Ht, p.alpha + S_Hf);
        let steep =
            (c.QBZ1 + dfz * (c.QBZ2 + c.QBZ3 * dfz)) * (c.QBZ4 * p.gamma + c.QBZ5 * p.gamma.abs() + 1.0);
        let B = steep * softened;
        let C = c.QCZ1;
        let peak = F_z * (R0 * per.FNOMIN) * (c.QDZ1 + c.QDZ2 * dfz) * (-(c.PPZ1 * dpi) + 1.0) * c.LTR;
        let D = peak * (p.gamma * (c.QDZ3 + c.QDZ4 * p.gamma) + 1.0);
        let ((t, t_sign), (r, r_sign)) = (equivalent_slip(alpha_t, x), equivalent_slip(alpha_r, x));
        let [side, t, r] = T::arctangents([B * C * alpha_t, t, r]);
        let side = side * FRAC_2_PI;
        let E = (c.QEZ1 + dfz * (c.QEZ2 + c.QEZ3 * dfz)) * ((c.QEZ4 + c.QEZ5 * gamma) * side + 1.0);
        let shape = CurveShape { B, C, E: self.clamp_curvature(E) };
        let by_camber =
            (c.QDZ8 + c.QDZ9 * dfz) * (c.PPZ2 * dpi + 1.0) + (c.QDZ10 + c.QDZ11 * dfz) * gamma.abs();
        let D_r = F_z
            * R0
            * ((c.QDZ6 + c.QDZ7 * dfz) * c.LRES + by_camber * gamma * c.LKZC)
            * scale
            * signum(p.v_x)
            * p.cos_residual;
        let B_r = c.QBZ9 * softened + c.QBZ10 * lateral.shape.B * lateral.shape.C;
        let residual = D_r * cos_atan(B_r * (r * r_sign)) * p.shifts;
        AligningMomentCurve { shape, slip: t * t_sign, peak: D * p.cos_alpha * p.shifts, residual }
    }

    /// Lever arm s of the longitudinal force [m] (4.E76).
    #[inline(always)]
    pub(super) fn longitudinal_force_lever(&self, p: &NormalisedOperatingPoint<T>, F_y: T) -> T {
        let c = &self.coefficients;
        let by_camber = (c.SSZ3 + c.SSZ4 * p.dfz) * p.gamma;
        let sum = c.SSZ1 + c.SSZ2 * (F_y * self.reciprocals.FNOMIN) + by_camber;
        c.UNLOADED_RADIUS * sum * c.LS
    }

    /// Overturning moment [N m] (4.E69, with the terms of 6.x).
    #[inline(always)]
    pub(super) fn overturning_moment(&self, p: &NormalisedOperatingPoint<T>, F_y: T) -> T {
        let (c, per) = (&self.coefficients, &self.reciprocals);
        let gamma = p.gamma;
        // Below the valid range it fades with the square of the load.
        let faded = p.F_z * (p.F_z * per.FZMIN).powi(2);
        let F_z = T::select(p.F_z.is_less_than(c.FZMIN), faded, p.F_z);
        let (F_y1, F_z1) = (F_y * per.FNOMIN, F_z * per.FNOMIN);
        let simple = c.QSX1 * c.LVMX + c.QSX3 * F_y1;
        if c.version == MagicFormulaVersion::Mf52 {
            return c.UNLOADED_RADIUS * F_z * (simple - c.QSX2 * gamma) * c.LMX;
        }
        let pressed = c.PPMX1 * p.dpi + 1.0;
        let mut sum = simple - c.QSX2 * gamma * pressed;
        if !(c.QSX4.is_exactly_constant(0.0) && c.QSX10.is_exactly_constant(0.0)) {
            let atans = T::arctangents([(c.QSX6 * F_z1).powi(2), c.QSX9 * F_y1, c.QSX11 * F_z1]);
            let [load, across, cambered] = atans;
            let together = (c.QSX5 * load).cos() * (c.QSX7 * gamma + c.QSX8 * across).sin();
            sum += c.QSX4 * together + c.QSX10 * cambered * gamma;
        }
        let arm = F_y * (c.QSX13 + c.QSX14 * gamma.abs()) - F_z * c.QSX12 * gamma * gamma.abs();
        c.UNLOADED_RADIUS * c.LMX * (F_z * sum + arm)
    }

    /// Rolling resistance moment [N m] (4.E70).
    #[inline(always)]
    pub(super) fn rolling_resistance_moment(
        &self,
        p: &NormalisedOperatingPoint<T>,
        slip: &TireOperatingPoint<T>,
        F_x: T,
    ) -> T {
        let (c, per) = (&self.coefficients, &self.reciprocals);
        let zero = F_x.constant_like(0.0);
        let given = T::select(zero.is_less_than(slip.F_z), slip.F_z, zero);
        let F_z = T::select(given.is_less_than(c.FZMIN), given * (given * per.FZMIN), given);
        let v = (p.v_x * per.LONGVL).abs();
        let sum = c.QSY1 + c.QSY2 * (F_x * per.FNOMIN) + c.QSY3 * v + c.QSY4 * v.powi(4);
        let moment = if c.version == MagicFormulaVersion::Mf52 {
            -c.UNLOADED_RADIUS * F_z * c.LMY * sum
        } else {
            let gamma = p.gamma;
            let F_z1 = F_z * per.FNOMIN;
            let camber = (c.QSY5 + c.QSY6 * F_z1) * gamma * gamma;
            let by_load = if c.QSY7.is_exactly_constant(1.0) && c.QSY8.is_exactly_constant(0.0) {
                F_z1
            } else {
                (F_z1.ln() * c.QSY7 + (p.dpi + 1.0).ln() * c.QSY8).exp()
            };
            let moment = -c.UNLOADED_RADIUS * c.FNOMIN * c.LMY * (sum + camber) * by_load;
            T::select(F_z1.is_equal_to(0.0), zero, moment)
        };
        moment * self.rolling_share(p, slip) * p.direction
    }

    /// How much of the rolling resistance is there at a low speed of the rim.
    #[inline(always)]
    fn rolling_share(&self, p: &NormalisedOperatingPoint<T>, slip: &TireOperatingPoint<T>) -> T {
        let low = self.coefficients.VXLOW;
        let turn = slip.kappa + 1.0;
        // The moment opposes the turn of the wheel, also of one that turns backwards.
        let mut share = nonzero_sign(turn);
        let crawls = (p.v_x * turn).abs().is_less_than(low);
        if turn.is_true_anywhere(crawls) {
            share = T::select(crawls, (turn / (low / p.v_x.abs()) * FRAC_PI_2).sin(), share);
        }
        T::select(p.v_x.is_equal_to(0.0), turn.constant_like(0.0), share)
    }
}
