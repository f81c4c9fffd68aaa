//! Weights the pure forces for combined slip by cosines (Pacejka, Tire and Vehicle Dynamics, section 4.3.2).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use super::curve::CurveShape;
use super::point::NormalisedOperatingPoint;
use super::pure::PureSlipCurve;
use crate::real::Real;

/// cos(atan x), without either.
#[inline(always)]
pub(super) fn cos_atan<T: Real>(x: T) -> T {
    (x * x + 1.0).sqrt().recip()
}

/// Curves of the weights of the longitudinal and the lateral force, the slips that they are asked at, and where they are 1.
struct CombinedSlipWeighting<T> {
    x: CurveShape<T>,
    y: CurveShape<T>,
    alpha: T,
    kappa: T,
    /// S_Hxα [rad].
    alpha_0: T,
    /// S_Hyκ [-].
    kappa_0: T,
}

impl<T: Real> MfTire<T> {
    /// Weights of the longitudinal force, G_xα (4.E50 to 4.E57), and of the lateral force, G_yκ (4.E58 to 4.E65).
    #[inline(always)]
    pub(super) fn combined_slip_weights(&self, p: &NormalisedOperatingPoint<T>) -> [T; 2] {
        let CombinedSlipWeighting { x, y, alpha, kappa, alpha_0, kappa_0 } = self.combined_slip_weighting(p);
        if alpha_0.is_exactly_constant(0.0) && kappa_0.is_exactly_constant(0.0) {
            return CurveShape::curve_cosines([x, y], [alpha, kappa]);
        }
        let [G_x, G_x0, G_y, G_y0] =
            CurveShape::curve_cosines([x, x, y, y], [alpha, alpha_0, kappa, kappa_0]);
        [G_x / G_x0, G_y / G_y0]
    }

    /// The weights, and the cosine of another curve at its slip, which is calculated beside them.
    #[inline(always)]
    pub(super) fn weights_and_cosine(
        &self,
        p: &NormalisedOperatingPoint<T>,
        other: CurveShape<T>,
        slip: T,
    ) -> ([T; 2], T) {
        let CombinedSlipWeighting { x, y, alpha, kappa, alpha_0, kappa_0 } = self.combined_slip_weighting(p);
        if alpha_0.is_exactly_constant(0.0) && kappa_0.is_exactly_constant(0.0) {
            let [G_x, G_y, cos] = CurveShape::curve_cosines([x, y, other], [alpha, kappa, slip]);
            return ([G_x, G_y], cos);
        }
        let [G_x, G_x0, G_y, G_y0, cos] =
            CurveShape::curve_cosines([x, x, y, y, other], [alpha, alpha_0, kappa, kappa_0, slip]);
        ([G_x / G_x0, G_y / G_y0], cos)
    }

    #[inline(always)]
    fn combined_slip_weighting(&self, p: &NormalisedOperatingPoint<T>) -> CombinedSlipWeighting<T> {
        let c = &self.coefficients;
        let square = p.gamma_star * p.gamma_star;
        let B_x = (c.RBX1 + c.RBX3 * square) * cos_atan(c.RBX2 * p.kappa) * c.LXAL;
        let x = CurveShape { B: B_x, C: c.RCX1, E: self.clamp_curvature(c.REX1 + c.REX2 * p.dfz) };
        let slope = cos_atan(c.RBY2 * (p.alpha - c.RBY3));
        let B_y = (c.RBY1 + c.RBY4 * square) * slope * c.LYKA;
        let y = CurveShape { B: B_y, C: c.RCY1, E: self.clamp_curvature(c.REY1 + c.REY2 * p.dfz) };
        let (alpha_0, kappa_0) = (c.RHX1, c.RHY1 + c.RHY2 * p.dfz);
        CombinedSlipWeighting { x, y, alpha: p.alpha + alpha_0, kappa: p.kappa + kappa_0, alpha_0, kappa_0 }
    }

    /// Lateral force that longitudinal slip makes, S_Vyκ [N] (4.E66, 4.E67).
    #[inline(always)]
    pub(super) fn S_Vyk(&self, p: &NormalisedOperatingPoint<T>, lateral: &PureSlipCurve<T>) -> T {
        let c = &self.coefficients;
        if [c.RVY1, c.RVY2, c.RVY3].into_iter().all(|it| it.is_exactly_constant(0.0)) {
            return c.RVY1;
        }
        let rise = c.RVY1 + c.RVY2 * p.dfz + c.RVY3 * p.gamma_star;
        let D = lateral.D * rise * cos_atan(c.RVY4 * p.alpha);
        D * (c.RVY5 * (c.RVY6 * p.kappa).atan()).sin() * c.LVYKA * p.shifts
    }
}
