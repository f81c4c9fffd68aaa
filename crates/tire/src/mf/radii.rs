//! Computes radii, contact patch and relaxation lengths (Besselink, Schmeitz and Pacejka, Vehicle System Dynamics 48, 2010).
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use super::point::NormalisedOperatingPoint;
use crate::coefficients::MagicFormulaVersion;
use crate::slip::{RelaxationLengths, TireForces, TireOperatingPoint};
use elementary::Number;

impl<T: Number> MfTire<T> {
    pub(super) fn relaxation_lengths(&self, p: &NormalisedOperatingPoint<T>) -> RelaxationLengths<T> {
        let c = &self.coefficients;
        let (dfz, dpi) = (p.dfz, p.dpi);
        if c.version.is_before_61() {
            let R0 = c.UNLOADED_RADIUS;
            let falling = (-(c.PTX3 * dfz)).exp();
            let x = (c.PTX1 + c.PTX2 * dfz) * falling * c.LSGKP * R0 * p.F_z / c.FNOMIN;
            let full = p.F_z / (c.PTY2 * c.FNOMIN * c.LFZO);
            let rise = (full.atan() * 2.0).sin();
            let y = c.PTY1 * rise * (-(c.PKY3 * p.gamma.abs()) + 1.0) * R0 * c.LFZO * c.LSGAL;
            return RelaxationLengths { x, y };
        }
        let stiffness = |by_load: T, by_square: T, by_pressure: T| {
            (dfz * (by_load + by_square * dfz) + 1.0) * (by_pressure * dpi + 1.0)
        };
        let along = c.LONGITUDINAL_STIFFNESS * stiffness(c.PCFX1, c.PCFX2, c.PCFX3);
        let across = c.LATERAL_STIFFNESS * stiffness(c.PCFY1, c.PCFY2, c.PCFY3);
        let K_xk = self.longitudinal_curve(p).K;
        let [K_ya] = self.cornering_stiffness(p, [p.gamma_star]);
        RelaxationLengths { x: (K_xk / along).abs(), y: (K_ya / across).abs() }
    }

    /// Pressure relative to the nominal one, less 1, within its limits [-].
    fn normalized_pressure_change(&self, slip: &TireOperatingPoint<T>) -> T {
        self.normalized_point(slip).dpi
    }

    /// Effective rolling radius [m] and speed [rad/s] of the wheel, found together by iteration: the radius of the free tire grows
    /// with the speed.
    pub(super) fn rolling_radius(&self, slip: &TireOperatingPoint<T>) -> (T, T) {
        let c = &self.coefficients;
        let F_z0 = c.FNOMIN;
        let stiffness = c.VERTICAL_STIFFNESS * (c.PFZ1 * self.normalized_pressure_change(slip) + 1.0);
        let load = if slip.F_z.re() > 0.0 { slip.F_z / F_z0 } else { T::from(0.0) };
        let fall = F_z0 / stiffness * (c.DREFF * (c.BREFF * load).atan() + c.FREFF * load);
        let rim = slip.v_x * (slip.kappa + 1.0);
        let mut R_e = c.UNLOADED_RADIUS;
        let mut omega = rim / R_e;
        for _ in 0..100 {
            let turn = omega * c.UNLOADED_RADIUS / c.LONGVL;
            let next = c.UNLOADED_RADIUS * (c.Q_RE0 + c.Q_V1 * turn * turn) - fall;
            let step = (next - R_e).re().abs();
            R_e = next;
            omega = rim / R_e;
            if step <= 1e-15 {
                break;
            }
        }
        (R_e, omega)
    }

    /// Radius of the tire that turns at `omega` [rad/s] without load [m].
    fn free_radius(&self, omega: T) -> T {
        let c = &self.coefficients;
        let turn = omega * c.UNLOADED_RADIUS / c.LONGVL;
        c.UNLOADED_RADIUS * (c.Q_RE0 + c.Q_V1 * turn * turn)
    }

    /// Distance of the wheel's centre to the contact point [m] under a load and forces.
    ///
    /// 5.2: R_Ω − F_z / C_z. 6.1: the square equation of the load over the deflection. 6.2: its root nearest to the free
    /// radius, with the deflection by camber; without a root, at little load, the free radius less what 6.1 gives.
    pub(super) fn loaded_radius_for_forces(&self, slip: &TireOperatingPoint<T>, forces: &TireForces<T>) -> T {
        let c = &self.coefficients;
        let (R0, F_z0) = (c.UNLOADED_RADIUS, c.FNOMIN);
        let dpi = self.normalized_pressure_change(slip);
        let (_, omega) = self.rolling_radius(slip);
        let free = self.free_radius(omega);
        let F_z = self.normalized_point(slip).F_z;
        let pressed = c.PFZ1 * dpi + 1.0;
        if c.version.is_before_61() {
            return free - F_z / (c.VERTICAL_STIFFNESS * pressed);
        }
        let first = c.VERTICAL_STIFFNESS * R0 / F_z0;
        let Q_FZ1 = (first * first - c.Q_FZ2 * 4.0).sqrt();
        let turn = (omega * R0 / c.LONGVL).abs();
        let stiffening = c.Q_V2 * turn - (c.Q_FCX * forces.F_x / F_z0).powi(2) + 1.0;
        if c.version == MagicFormulaVersion::Mf61 {
            let across = (c.Q_FCY * forces.F_y / F_z0).powi(2);
            let load = F_z / F_z0 / ((stiffening - across) * pressed);
            let root = (Q_FZ1 * Q_FZ1 + c.Q_FZ2 * load * 4.0).sqrt();
            return free - R0 * load * 2.0 / (Q_FZ1 + root);
        }
        let gamma = self.normalized_point(slip).gamma;
        let missing = |radius: T| {
            let x = self.cambered_deflection(radius, free, gamma) / R0;
            if x.re() <= 0.0 {
                return -F_z;
            }
            let ratio = radius / free;
            let shift = (c.Q_FYS1 + ratio * (c.Q_FYS2 + c.Q_FYS3 * ratio)) * gamma;
            let weight = (x.ln() * c.Q_FCY2).exp();
            let across = (weight * c.Q_FCY * (forces.F_y - shift) / F_z0).powi(2);
            (stiffening - across) * pressed * x * (Q_FZ1 + c.Q_FZ2 * x) * F_z0 - F_z
        };
        root_below(free, R0.re(), missing)
    }

    /// Deflection [m] of a tire of 6.2 whose wheel's centre is at a distance to the contact point [m], under camber.
    fn cambered_deflection(&self, radius: T, free: T, gamma: T) -> T {
        let c = &self.coefficients;
        let upright = if radius.re() < free.re() { free - radius } else { T::from(0.0) };
        let reference_width = (-(c.ASPECT_RATIO * 0.5) + 1.075) * c.WIDTH;
        let arc = |radius: T| radius * (c.Q_CAM1 + c.Q_CAM2 * radius);
        let whole = arc(free);
        // Without these coefficients camber moves nothing.
        let share = if whole.re() == 0.0 { T::from(0.0) } else { (arc(radius) / whole).powi(2) };
        upright + share * reference_width * 0.125 * gamma.tan().abs() - c.Q_CAM3 * upright * gamma.abs()
    }
}

/// The largest root below `top` of a function that falls there, within the length `within`; `top` itself when the function is not
/// below 0 there: camber alone deflects the tire more than the load does.
///
/// The root is found among values; one step of Newton's method gives it its derivatives.
fn root_below<T: Number>(top: T, within: f64, f: impl Fn(T) -> T) -> T {
    let at = |x: f64| f(T::from(x)).re();
    let (mut high, end) = (top.re(), top.re() - 0.95 * within);
    if at(high) >= 0.0 || at(high).is_nan() {
        return top;
    }
    let step = within / 64.0;
    let mut low = high - step;
    while at(low) < 0.0 {
        (high, low) = (low, low - step);
        if low <= end {
            return T::from(end);
        }
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at(middle) >= 0.0 { low = middle } else { high = middle }
    }
    let x = 0.5 * (low + high);
    let small = 1e-6 * within;
    let slope = (at(x + small) - at(x - small)) / (2.0 * small);
    T::from(x) - f(T::from(x)) / slope
}
