//! Makes a tire of the coefficients of the Magic Formula 5.2, PAC2002, 6.1 or 6.2.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::slip::{Forces, Relaxation, Slip, Validity};
use crate::tire::Tire;
use elementary::Number;
use point::Point;
use pure::Curve;
use reciprocals::Reciprocals;

mod characteristics;
mod check;
mod combined;
mod curve;
mod moments;
mod point;
mod pure;
mod radii;
mod reciprocals;
mod set;

pub use characteristics::{Characteristics, Peak};
pub use check::{BadCoefficient, RANGES};
pub use set::MfSet;

/// How the equations are read where sources differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormulaConvention {
    /// Inputs stay within the limits of validity, curvatures below 1, and slips fade at low speed.
    pub limits: bool,
    /// Slip angle and camber enter as tan α sgn V_x and sin γ (Pacejka's book), not as they are.
    pub trigonometric: bool,
}

impl Default for FormulaConvention {
    fn default() -> Self {
        Self { limits: true, trigonometric: false }
    }
}

/// A tire by the Magic Formula 5.2, PAC2002, 6.1 or 6.2.
#[derive(Clone, Copy, Debug)]
pub struct MfTire<T = f64> {
    coefficients: Coefficients<T>,
    reciprocals: Reciprocals<T>,
    reading: FormulaConvention,
}

/// What a tire gives beside its forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Details<T = f64> {
    /// Friction factors of the pure curves [-].
    pub mu: [T; 2],
    /// Longitudinal slip stiffness ∂F_x/∂κ [N].
    pub K_xk: T,
    /// Cornering stiffness ∂F_y/∂α [N/rad]; below 0 in ISO-W axes.
    pub K_ya: T,
    /// Pneumatic trail [m].
    pub trail: T,
    /// Residual torque [N m].
    pub residual: T,
}

impl MfTire {
    /// The same tire as constants of another number type.
    pub fn lift<T: Number>(&self) -> MfTire<T> {
        MfTire::made_of(self.coefficients.lift(), self.reading)
    }
}

impl<T: Number> MfTire<T> {
    /// A tire of these coefficients.
    ///
    /// # Errors
    ///
    /// Names the first coefficient that no tire can have: not finite, or outside of the bound that the formula needs.
    pub fn new(coefficients: Coefficients<T>) -> Result<Self, BadCoefficient> {
        coefficients.check()?;
        Ok(Self::made_of(coefficients, FormulaConvention::default()))
    }

    /// The same tire by another reading of the equations.
    pub fn with_convention(self, reading: FormulaConvention) -> Self {
        Self { reading, ..self }
    }

    /// The same tire with factors to the frictions `LMUX`, `LMUY` [-] and to the stiffnesses `LKX`, `LKY` [-], all above 0, such as those of
    /// another temperature. Unlike [`MfTire::new`] it checks nothing, so it can be called for every sample.
    pub fn scaled(mut self, [mu_x, mu_y, k_x, k_y]: [T; 4]) -> Self {
        let c = &mut self.coefficients;
        c.LMUX *= mu_x;
        c.LMUY *= mu_y;
        c.LKX *= k_x;
        c.LKY *= k_y;
        self
    }
}

impl<T: Real> MfTire<T> {
    /// A tire of coefficients that were checked.
    fn made_of(coefficients: Coefficients<T>, reading: FormulaConvention) -> Self {
        Self { reciprocals: Reciprocals::of(&coefficients), coefficients, reading }
    }

    /// The coefficients that it was made of.
    pub fn coefficients(&self) -> &Coefficients<T> {
        &self.coefficients
    }

    /// The lateral curve, and the pure forces [N]: longitudinal, lateral, and the lateral one that acts at the trail, which is that
    /// of the upright wheel since 6.1.
    #[inline(always)]
    fn pure(&self, p: &Point<T>, longitudinal: &Curve<T>) -> (Curve<T>, [T; 3]) {
        let upright = p.gamma.constant(0.0);
        if self.coefficients.version.is_before_61() || p.gamma_star.is_always(0.0) {
            let [K] = self.cornering_stiffness(p, [p.gamma_star]);
            let lateral = self.lateral(p, p.gamma_star, K);
            let [F_x0, F_y0] = Curve::forces([longitudinal, &lateral]);
            return (lateral, [F_x0, F_y0, F_y0]);
        }
        let [K, K_upright] = self.cornering_stiffness(p, [p.gamma_star, upright]);
        let lateral = self.lateral(p, p.gamma_star, K);
        let at_trail = self.lateral(p, upright, K_upright);
        (lateral, Curve::forces([longitudinal, &lateral, &at_trail]))
    }

    /// Forces and what they are made of.
    #[inline(always)]
    pub fn details(&self, slip: &Slip<T>) -> (Forces<T>, Details<T>) {
        let p = self.point(slip);
        let longitudinal = self.longitudinal(&p);
        let (lateral, [F_x0, F_y0, F_y0_trail]) = self.pure(&p, &longitudinal);
        let aligning = self.aligning(&p, &longitudinal, &lateral);
        let ([G_xa, G_yk], shrunk) = self.weights_beside(&p, aligning.shape, aligning.slip);
        let F_x = G_xa * (F_x0 * p.direction);
        let F_y = G_yk * self.directed(&p, F_y0) + self.S_Vyk(&p, &lateral);
        let trail = aligning.peak * shrunk;
        let M_z = -trail * (G_yk * self.directed(&p, F_y0_trail))
            + aligning.residual
            + self.lever(&p, F_y) * F_x;
        let forces = Forces {
            F_x,
            F_y,
            M_x: self.overturning(&p, F_y),
            M_y: self.rolling(&p, slip, F_x),
            M_z,
        };
        let details = Details {
            mu: [longitudinal.mu, lateral.mu],
            K_xk: longitudinal.K,
            K_ya: lateral.K,
            trail,
            residual: aligning.residual,
        };
        (forces, details)
    }
}

impl<T: Number> Tire<T> for MfTire<T> {
    fn forces(&self, slip: &Slip<T>) -> Forces<T> {
        self.details(slip).0
    }

    fn F_xy(&self, slip: &Slip<T>) -> [T; 2] {
        let p = self.point(slip);
        let [K] = self.cornering_stiffness(&p, [p.gamma_star]);
        let lateral = self.lateral(&p, p.gamma_star, K);
        let [F_x0, F_y0] = Curve::forces([&self.longitudinal(&p), &lateral]);
        let [G_xa, G_yk] = self.weights(&p);
        let F_y = G_yk * self.directed(&p, F_y0) + self.S_Vyk(&p, &lateral);
        [G_xa * (F_x0 * p.direction), F_y]
    }

    fn F_xy_M_z(&self, slip: &Slip<T>) -> [T; 3] {
        let Forces { F_x, F_y, M_z, .. } = self.forces(slip);
        [F_x, F_y, M_z]
    }

    fn relaxation(&self, slip: &Slip<T>) -> Relaxation<T> {
        self.relaxation_lengths(&self.point(slip))
    }

    fn effective_radius(&self, slip: &Slip<T>) -> Option<T> {
        Some(self.rolling_radius(slip).0)
    }

    fn loaded_radius(&self, slip: &Slip<T>, forces: &Forces<T>) -> Option<T> {
        Some(self.rest_radius(slip, forces))
    }

    fn validity(&self, slip: &Slip<T>) -> Validity {
        let c = &self.coefficients;
        let excess = |x: T, low: T, high: T| {
            let (x, low, high) = (x.re(), low.re(), high.re());
            if x < low {
                x - low
            } else if x > high {
                x - high
            } else if x.is_nan() {
                x
            } else {
                0.0
            }
        };
        let F_z = if slip.F_z.re() <= 0.0 { 0.0 } else { excess(slip.F_z, c.FZMIN, c.FZMAX) };
        Validity {
            kappa: excess(slip.kappa, c.KPUMIN, c.KPUMAX),
            alpha: excess(slip.alpha, c.ALPMIN, c.ALPMAX),
            gamma: excess(slip.gamma, c.CAMMIN, c.CAMMAX),
            F_z,
            pressure: slip.pressure.map_or(0.0, |it| excess(it, c.PRESMIN, c.PRESMAX)),
        }
    }
}
