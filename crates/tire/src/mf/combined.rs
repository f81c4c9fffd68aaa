//! Weights the pure forces for combined slip by cosines (Pacejka, Tire and Vehicle Dynamics, section 4.3.2).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use super::curve::Shape;
use super::point::Point;
use super::pure::Curve;
use crate::real::Real;

/// cos(atan x), without either.
#[inline(always)]
pub(super) fn cos_atan<T: Real>(x: T) -> T {
    (x * x + 1.0).sqrt().recip()
}

impl<T: Real> MfTire<T> {
    /// Weights of the longitudinal force, G_xα (4.E50 to 4.E57), and of the lateral force, G_yκ (4.E58 to 4.E65).
    #[inline(always)]
    pub(super) fn weights(&self, p: &Point<T>) -> [T; 2] {
        let c = &self.coefficients;
        let square = p.gamma_star * p.gamma_star;
        let B_x = (c.RBX1 + c.RBX3 * square) * cos_atan(c.RBX2 * p.kappa) * c.LXAL;
        let x = Shape { B: B_x, C: c.RCX1, E: self.at_most_1(c.REX1 + c.REX2 * p.dfz) };
        let slope = cos_atan(c.RBY2 * (p.alpha - c.RBY3));
        let B_y = (c.RBY1 + c.RBY4 * square) * slope * c.LYKA;
        let y = Shape { B: B_y, C: c.RCY1, E: self.at_most_1(c.REY1 + c.REY2 * p.dfz) };
        let S_Hy = c.RHY1 + c.RHY2 * p.dfz;
        if c.RHX1.is_always(0.0) && S_Hy.is_always(0.0) {
            return Shape::cosines([x, y], [p.alpha, p.kappa]);
        }
        let at = [p.alpha + c.RHX1, c.RHX1, p.kappa + S_Hy, S_Hy];
        let [G_x, G_x0, G_y, G_y0] = Shape::cosines([x, x, y, y], at);
        [G_x / G_x0, G_y / G_y0]
    }

    /// Lateral force that longitudinal slip makes, S_Vyκ [N] (4.E66, 4.E67).
    #[inline(always)]
    pub(super) fn S_Vyk(&self, p: &Point<T>, lateral: &Curve<T>) -> T {
        let c = &self.coefficients;
        if [c.RVY1, c.RVY2, c.RVY3].into_iter().all(|it| it.is_always(0.0)) {
            return c.RVY1;
        }
        let rise = c.RVY1 + c.RVY2 * p.dfz + c.RVY3 * p.gamma_star;
        let D = lateral.D * rise * cos_atan(c.RVY4 * p.alpha);
        D * (c.RVY5 * (c.RVY6 * p.kappa).atan()).sin() * c.LVYKA * p.shifts
    }
}
