//! Computes the forces in pure longitudinal and pure lateral slip (Pacejka, Tire and Vehicle Dynamics, section 4.3.2).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use super::curve::Shape;
use super::point::{EPSILON, Point, sign, signum};
use crate::coefficients::Version;
use crate::number::Number;

/// Curve of the longitudinal force.
#[derive(Clone, Copy, Debug)]
pub(super) struct Longitudinal<T> {
    /// Slip stiffness [N].
    pub K: T,
    /// Friction factor [-].
    pub mu: T,
    /// Force without slip angle [N].
    pub F_x0: T,
}

/// Curve of the lateral force.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lateral<T> {
    pub shape: Shape<T>,
    /// Peak [N].
    pub D: T,
    /// Shifts of slip [rad] and force [N].
    pub S_H: T,
    pub S_V: T,
    /// Cornering stiffness [N/rad]; below 0 in ISO-W axes.
    pub K: T,
    /// Friction factor [-].
    pub mu: T,
    /// Force without longitudinal slip [N].
    pub F_y0: T,
}

impl<T: Number> MfTire<T> {
    #[inline]
    pub(super) fn at_most_1(&self, E: T) -> T {
        if self.reading.limits && E.re() > 1.0 { T::from(1.0) } else { E }
    }

    /// Pure longitudinal slip (4.E9 to 4.E18).
    #[inline]
    pub(super) fn longitudinal(&self, p: &Point<T>) -> Longitudinal<T> {
        let c = &self.coefficients;
        let Point { kappa, gamma, F_z, dfz, dpi, .. } = *p;
        let C = c.PCX1 * c.LCX;
        let friction = (c.PDX1 + c.PDX2 * dfz) * (-(c.PDX3 * gamma * gamma) + 1.0);
        let pressed = friction * (dpi * (c.PPX3 + c.PPX4 * dpi) + 1.0);
        let mu = if F_z.re() == 0.0 { T::from(0.0) } else { pressed * c.LMUX * p.mu };
        let D = mu * F_z;
        let K = F_z
            * (c.PKX1 + c.PKX2 * dfz)
            * (c.PKX3 * dfz).exp()
            * (dpi * (c.PPX1 + c.PPX2 * dpi) + 1.0)
            * c.LKX;
        let B = K / (C * D + EPSILON * sign(D));
        let S_H = (c.PHX1 + c.PHX2 * dfz) * c.LHX * p.shifts;
        let S_V = F_z * (c.PVX1 + c.PVX2 * dfz) * c.LVX * c.LMUX * p.mu * p.shifts;
        let x = kappa + S_H;
        let E = (c.PEX1 + dfz * (c.PEX2 + c.PEX3 * dfz)) * (-c.PEX4 * signum(x) + 1.0) * c.LEX;
        let shape = Shape { B, C, E: self.at_most_1(E) };
        let F_x0 = (D * shape.sine(x) + S_V) * p.direction;
        Longitudinal { K, mu, F_x0 }
    }

    /// Pure lateral slip at a camber (4.E19 to 4.E30): that of the point, or none.
    #[inline]
    pub(super) fn lateral(&self, p: &Point<T>, gamma: T) -> Lateral<T> {
        let c = &self.coefficients;
        let Point { F_z, dfz, dpi, .. } = *p;
        let old = c.version == Version::Mf52;
        let F_z0 = c.FNOMIN * c.LFZO;
        let square = gamma * gamma;
        let C = c.PCY1 * c.LCY;
        let friction = (c.PDY1 + c.PDY2 * dfz) * (-(c.PDY3 * square) + 1.0);
        let scale = c.LMUY * p.mu;
        let pressed = friction * (dpi * (c.PPY3 + c.PPY4 * dpi) + 1.0);
        let mu = if F_z.re() == 0.0 { T::from(0.0) } else { pressed * scale };
        let D = mu * F_z;
        let full = F_z / F_z0 / ((c.PKY2 + c.PKY5 * square) * (c.PPY2 * dpi + 1.0));
        let K = c.PKY1
            * F_z0
            * (c.PPY1 * dpi + 1.0)
            * (-(c.PKY3 * gamma.abs()) + 1.0)
            * (c.PKY4 * full.atan()).sin()
            * c.LKY;
        let S_Vg = F_z * (c.PVY3 + c.PVY4 * dfz) * gamma * c.LKYC * scale;
        let offset = (c.PHY1 + c.PHY2 * dfz) * c.LHY;
        let S_H = if old {
            offset + c.PHY3 * gamma * c.LKYC
        } else {
            let K_g = F_z * (c.PKY6 + c.PKY7 * dfz) * (c.PPY5 * dpi + 1.0) * c.LKYC;
            offset + (K_g * gamma - S_Vg) / (K + EPSILON * sign(K))
        } * p.shifts;
        let S_V = (F_z * (c.PVY1 + c.PVY2 * dfz) * c.LVY * scale + S_Vg) * p.shifts;
        let x = p.alpha + S_H;
        let side = (c.PEY3 + c.PEY4 * gamma) * sign(x);
        let E = (c.PEY1 + c.PEY2 * dfz) * (c.PEY5 * square - side + 1.0) * c.LEY;
        let B = K / (C * D + EPSILON * sign(D));
        let shape = Shape { B, C, E: self.at_most_1(E) };
        let mut F_y0 = D * shape.sine(x) + S_V;
        if self.reading.trigonometric {
            F_y0 *= p.direction;
        }
        Lateral { shape, D, S_H, S_V, K, mu, F_y0 }
    }
}
