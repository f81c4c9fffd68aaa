//! Computes the forces in pure longitudinal and pure lateral slip (Pacejka, Tire and Vehicle Dynamics, section 4.3.2).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use super::curve::CurveShape;
use super::point::{EPSILON, NormalisedOperatingPoint, nonzero_sign, signum};
use crate::real::Real;

/// A denominator kept from 0, on the side of its own sign.
#[inline(always)]
fn nonzero_denominator<T: Real>(x: T) -> T {
    nonzero_denominator_by_sign(x, x)
}

/// A denominator kept from 0, on the side that the sign of another number says.
#[inline(always)]
fn nonzero_denominator_by_sign<T: Real>(x: T, side: T) -> T {
    x + nonzero_sign(side) * EPSILON
}

/// Curve of a pure force, at a slip.
#[derive(Clone, Copy, Debug)]
pub(super) struct PureSlipCurve<T> {
    pub shape: CurveShape<T>,
    /// Slip with its shift.
    pub x: T,
    /// Peak [N].
    pub D: T,
    /// Shifts of slip [- or rad] and force [N].
    pub S_H: T,
    pub S_V: T,
    /// Stiffness [N or N/rad]; below 0 in ISO-W axes for the lateral force.
    pub K: T,
    /// 1 / K, kept from a division by 0.
    pub per_K: T,
    /// Friction factor [-].
    pub mu: T,
}

impl<T: Real> PureSlipCurve<T> {
    /// Forces [N] of independent curves.
    #[inline(always)]
    pub fn forces<const N: usize>(curves: [&Self; N]) -> [T; N] {
        let (mut shapes, mut x) = ([curves[0].shape; N], [curves[0].x; N]);
        for i in 1..N {
            (shapes[i], x[i]) = (curves[i].shape, curves[i].x);
        }
        let mut forces = CurveShape::curve_sines(shapes, x);
        for i in 0..N {
            forces[i] = curves[i].D * forces[i] + curves[i].S_V;
        }
        forces
    }
}

impl<T: Real> MfTire<T> {
    #[inline(always)]
    pub(super) fn clamp_curvature(&self, E: T) -> T {
        let one = E.constant_like(1.0);
        if self.reading.limits { T::select(one.is_less_than(E), one, E) } else { E }
    }

    /// Pure longitudinal slip (4.E9 to 4.E18), but for the direction of travel.
    #[inline(always)]
    pub(super) fn longitudinal_curve(&self, p: &NormalisedOperatingPoint<T>) -> PureSlipCurve<T> {
        let c = &self.coefficients;
        let NormalisedOperatingPoint { kappa, gamma, F_z, dfz, dpi, .. } = *p;
        let C = c.PCX1 * c.LCX;
        let friction = (c.PDX1 + c.PDX2 * dfz) * (-(c.PDX3 * gamma * gamma) + 1.0);
        let pressed = friction * (dpi * (c.PPX3 + c.PPX4 * dpi) + 1.0);
        let mu = T::select(F_z.is_equal_to(0.0), F_z.constant_like(0.0), pressed * c.LMUX * p.mu);
        let D = mu * F_z;
        let K = F_z
            * (c.PKX1 + c.PKX2 * dfz)
            * if c.PKX3.is_exactly_constant(0.0) { F_z.constant_like(1.0) } else { (c.PKX3 * dfz).exp() }
            * (dpi * (c.PPX1 + c.PPX2 * dpi) + 1.0)
            * c.LKX;
        let B = K / nonzero_denominator_by_sign(C * D, D);
        let S_H = (c.PHX1 + c.PHX2 * dfz) * c.LHX * p.shifts;
        let S_V = F_z * (c.PVX1 + c.PVX2 * dfz) * c.LVX * c.LMUX * p.mu * p.shifts;
        let x = kappa + S_H;
        let E = (c.PEX1 + dfz * (c.PEX2 + c.PEX3 * dfz)) * (-c.PEX4 * signum(x) + 1.0) * c.LEX;
        let shape = CurveShape { B, C, E: self.clamp_curvature(E) };
        PureSlipCurve { shape, x, D, S_H, S_V, K, per_K: nonzero_denominator(K).recip(), mu }
    }

    /// Cornering stiffnesses [N/rad] at cambers (4.E25).
    #[inline(always)]
    pub(super) fn cornering_stiffness<const N: usize>(
        &self,
        p: &NormalisedOperatingPoint<T>,
        gamma: [T; N],
    ) -> [T; N] {
        let c = &self.coefficients;
        let F_z0 = c.FNOMIN * c.LFZO;
        let mut rises = if c.PKY5.is_exactly_constant(0.0) {
            let [rise] = self.cornering_load_factor(p, [gamma[0]]);
            [rise; N]
        } else {
            self.cornering_load_factor(p, gamma)
        };
        for i in 0..N {
            let fall = -(c.PKY3 * gamma[i].abs()) + 1.0;
            rises[i] = c.PKY1 * F_z0 * (c.PPY1 * p.dpi + 1.0) * fall * rises[i] * c.LKY;
        }
        rises
    }

    /// The factor sin(p_Ky4 atan(F_z / …)) of the cornering stiffness at cambers.
    #[inline(always)]
    fn cornering_load_factor<const N: usize>(
        &self,
        p: &NormalisedOperatingPoint<T>,
        gamma: [T; N],
    ) -> [T; N] {
        let c = &self.coefficients;
        let mut rises = gamma;
        for i in 0..N {
            let full = (c.PKY2 + c.PKY5 * (gamma[i] * gamma[i])) * (c.PPY2 * p.dpi + 1.0);
            rises[i] = p.F_z * self.reciprocals.F_z0 / full;
        }
        rises = T::arctangents(rises);
        for rise in &mut rises {
            *rise = c.PKY4 * *rise;
        }
        T::sines(rises)
    }

    /// Pure lateral slip at a camber (4.E19 to 4.E30), with the cornering stiffness there.
    #[inline(always)]
    pub(super) fn lateral_curve(&self, p: &NormalisedOperatingPoint<T>, gamma: T, K: T) -> PureSlipCurve<T> {
        let c = &self.coefficients;
        let NormalisedOperatingPoint { F_z, dfz, dpi, .. } = *p;
        let old = c.version.is_before_61();
        let per_K = nonzero_denominator(K).recip();
        let square = gamma * gamma;
        let C = c.PCY1 * c.LCY;
        let friction = (c.PDY1 + c.PDY2 * dfz) * (-(c.PDY3 * square) + 1.0);
        let scale = c.LMUY * p.mu;
        let pressed = friction * (dpi * (c.PPY3 + c.PPY4 * dpi) + 1.0);
        let mu = T::select(F_z.is_equal_to(0.0), F_z.constant_like(0.0), pressed * scale);
        let D = mu * F_z;
        let S_Vg = F_z * (c.PVY3 + c.PVY4 * dfz) * gamma * c.LKYC * scale;
        let offset = (c.PHY1 + c.PHY2 * dfz) * c.LHY;
        let S_H = if old {
            offset + c.PHY3 * gamma * c.LKYC
        } else {
            let K_g = F_z * (c.PKY6 + c.PKY7 * dfz) * (c.PPY5 * dpi + 1.0) * c.LKYC;
            offset + (K_g * gamma - S_Vg) * per_K
        } * p.shifts;
        let S_V = (F_z * (c.PVY1 + c.PVY2 * dfz) * c.LVY * scale + S_Vg) * p.shifts;
        let x = p.alpha + S_H;
        let side = (c.PEY3 + c.PEY4 * gamma) * nonzero_sign(x);
        let E = (c.PEY1 + c.PEY2 * dfz) * (c.PEY5 * square - side + 1.0) * c.LEY;
        let B = K / nonzero_denominator_by_sign(C * D, D);
        let shape = CurveShape { B, C, E: self.clamp_curvature(E) };
        PureSlipCurve { shape, x, D, S_H, S_V, K, per_K, mu }
    }

    /// The lateral force [N] in the direction of travel, which only a tire that takes the sign of the slip angle from it knows.
    #[inline(always)]
    pub(super) fn direction_corrected_force(&self, p: &NormalisedOperatingPoint<T>, F_y0: T) -> T {
        if self.reading.trigonometric { F_y0 * p.direction } else { F_y0 }
    }
}
