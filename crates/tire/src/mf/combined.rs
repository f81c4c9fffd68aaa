//! Weights the pure forces for combined slip by cosines (Pacejka, Tire and Vehicle Dynamics, section 4.3.2).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use super::curve::Shape;
use super::point::Point;
use super::pure::Lateral;
use crate::number::Number;

/// cos(atan x), without either.
#[inline]
fn cos_atan<T: Number>(x: T) -> T {
    (x * x + 1.0).sqrt().recip()
}

impl<T: Number> MfTire<T> {
    /// Weight of the longitudinal force, G_xα (4.E50 to 4.E57).
    #[inline]
    pub(super) fn G_xa(&self, p: &Point<T>) -> T {
        let c = &self.coefficients;
        let B =
            (c.RBX1 + c.RBX3 * p.gamma_star * p.gamma_star) * cos_atan(c.RBX2 * p.kappa) * c.LXAL;
        let shape = Shape { B, C: c.RCX1, E: self.at_most_1(c.REX1 + c.REX2 * p.dfz) };
        shape.cosine(p.alpha + c.RHX1) / shape.cosine(c.RHX1)
    }

    /// Weight of the lateral force, G_yκ (4.E58 to 4.E65).
    #[inline]
    pub(super) fn G_yk(&self, p: &Point<T>) -> T {
        let c = &self.coefficients;
        let slope = cos_atan(c.RBY2 * (p.alpha - c.RBY3));
        let B = (c.RBY1 + c.RBY4 * p.gamma_star * p.gamma_star) * slope * c.LYKA;
        let S_H = c.RHY1 + c.RHY2 * p.dfz;
        let shape = Shape { B, C: c.RCY1, E: self.at_most_1(c.REY1 + c.REY2 * p.dfz) };
        shape.cosine(p.kappa + S_H) / shape.cosine(S_H)
    }

    /// Lateral force that longitudinal slip makes, S_Vyκ [N] (4.E66, 4.E67).
    #[inline]
    pub(super) fn S_Vyk(&self, p: &Point<T>, lateral: &Lateral<T>) -> T {
        let c = &self.coefficients;
        let rise = c.RVY1 + c.RVY2 * p.dfz + c.RVY3 * p.gamma_star;
        let D = lateral.D * rise * cos_atan(c.RVY4 * p.alpha);
        D * (c.RVY5 * (c.RVY6 * p.kappa).atan()).sin() * c.LVYKA * p.shifts
    }
}
