//! Makes a tire of the coefficients of the Magic Formula 5.2, PAC2002, 6.1 or 6.2.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::slip::{RelaxationLengths, TireForces, TireOperatingPoint, ValidityExcess};
use crate::tire::Tire;
use elementary::Number;
use point::NormalisedOperatingPoint;
use pure::PureSlipCurve;
use reciprocals::CoefficientReciprocals;

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

pub use characteristics::{FrictionPeak, TireCharacteristics};
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
    reciprocals: CoefficientReciprocals<T>,
    reading: FormulaConvention,
}

/// What a tire gives beside its forces.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TireForceDetails<T = f64> {
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
    pub fn cast<T: Number>(&self) -> MfTire<T> {
        MfTire::from_checked_coefficients(self.coefficients.cast(), self.reading)
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
        Ok(Self::from_checked_coefficients(coefficients, FormulaConvention::default()))
    }

    /// The same tire by another reading of the equations.
    pub fn with_convention(self, reading: FormulaConvention) -> Self {
        Self { reading, ..self }
    }

    /// The same tire with factors to the frictions `LMUX`, `LMUY` [-] and to the stiffnesses `LKX`, `LKY` [-], all above 0, such as those of
    /// another temperature. Unlike [`MfTire::new`] it checks nothing, so it can be called for every sample.
    pub fn with_scale_factors(mut self, [mu_x, mu_y, k_x, k_y]: [T; 4]) -> Self {
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
    fn from_checked_coefficients(coefficients: Coefficients<T>, reading: FormulaConvention) -> Self {
        Self { reciprocals: CoefficientReciprocals::from_coefficients(&coefficients), coefficients, reading }
    }

    /// The coefficients that it was made of.
    pub fn coefficients(&self) -> &Coefficients<T> {
        &self.coefficients
    }

    /// The lateral curve, and the pure forces [N]: longitudinal, lateral, and the lateral one that acts at the trail, which is that
    /// of the upright wheel since 6.1.
    #[inline(always)]
    fn pure_slip_forces(
        &self,
        p: &NormalisedOperatingPoint<T>,
        longitudinal: &PureSlipCurve<T>,
    ) -> (PureSlipCurve<T>, [T; 3]) {
        let upright = p.gamma.constant_like(0.0);
        if self.coefficients.version.is_before_61() || p.gamma_star.is_exactly_constant(0.0) {
            let [K] = self.cornering_stiffness(p, [p.gamma_star]);
            let lateral = self.lateral_curve(p, p.gamma_star, K);
            let [F_x0, F_y0] = PureSlipCurve::forces([longitudinal, &lateral]);
            return (lateral, [F_x0, F_y0, F_y0]);
        }
        let [K, K_upright] = self.cornering_stiffness(p, [p.gamma_star, upright]);
        let lateral = self.lateral_curve(p, p.gamma_star, K);
        let at_trail = self.lateral_curve(p, upright, K_upright);
        (lateral, PureSlipCurve::forces([longitudinal, &lateral, &at_trail]))
    }

    /// Forces and what they are made of.
    #[inline(always)]
    pub fn forces_and_details(&self, slip: &TireOperatingPoint<T>) -> (TireForces<T>, TireForceDetails<T>) {
        let p = self.normalized_point(slip);
        let longitudinal = self.longitudinal_curve(&p);
        let (lateral, [F_x0, F_y0, F_y0_trail]) = self.pure_slip_forces(&p, &longitudinal);
        let aligning = self.aligning_moment_curve(&p, &longitudinal, &lateral);
        let ([G_xa, G_yk], shrunk) = self.weights_and_cosine(&p, aligning.shape, aligning.slip);
        let F_x = G_xa * (F_x0 * p.direction);
        let F_y = G_yk * self.direction_corrected_force(&p, F_y0) + self.S_Vyk(&p, &lateral);
        let trail = aligning.peak * shrunk;
        let M_z = -trail * (G_yk * self.direction_corrected_force(&p, F_y0_trail))
            + aligning.residual
            + self.longitudinal_force_lever(&p, F_y) * F_x;
        let forces = TireForces {
            F_x,
            F_y,
            M_x: self.overturning_moment(&p, F_y),
            M_y: self.rolling_resistance_moment(&p, slip, F_x),
            M_z,
        };
        let details = TireForceDetails {
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
    fn forces(&self, slip: &TireOperatingPoint<T>) -> TireForces<T> {
        self.forces_and_details(slip).0
    }

    fn F_xy(&self, slip: &TireOperatingPoint<T>) -> [T; 2] {
        let p = self.normalized_point(slip);
        let [K] = self.cornering_stiffness(&p, [p.gamma_star]);
        let lateral = self.lateral_curve(&p, p.gamma_star, K);
        let [F_x0, F_y0] = PureSlipCurve::forces([&self.longitudinal_curve(&p), &lateral]);
        let [G_xa, G_yk] = self.combined_slip_weights(&p);
        let F_y = G_yk * self.direction_corrected_force(&p, F_y0) + self.S_Vyk(&p, &lateral);
        [G_xa * (F_x0 * p.direction), F_y]
    }

    fn F_xy_M_z(&self, slip: &TireOperatingPoint<T>) -> [T; 3] {
        let TireForces { F_x, F_y, M_z, .. } = self.forces(slip);
        [F_x, F_y, M_z]
    }

    fn relaxation(&self, slip: &TireOperatingPoint<T>) -> RelaxationLengths<T> {
        self.relaxation_lengths(&self.normalized_point(slip))
    }

    fn effective_radius(&self, slip: &TireOperatingPoint<T>) -> Option<T> {
        Some(self.rolling_radius(slip).0)
    }

    fn loaded_radius(&self, slip: &TireOperatingPoint<T>, forces: &TireForces<T>) -> Option<T> {
        Some(self.loaded_radius_for_forces(slip, forces))
    }

    fn validity_excess(&self, slip: &TireOperatingPoint<T>) -> ValidityExcess {
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
        ValidityExcess {
            kappa: excess(slip.kappa, c.KPUMIN, c.KPUMAX),
            alpha: excess(slip.alpha, c.ALPMIN, c.ALPMAX),
            gamma: excess(slip.gamma, c.CAMMIN, c.CAMMAX),
            F_z,
            pressure: slip.pressure.map_or(0.0, |it| excess(it, c.PRESMIN, c.PRESMAX)),
        }
    }
}
