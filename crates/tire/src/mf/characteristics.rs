//! Finds what a tire is like at one load: peak frictions and stiffnesses.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use super::MfTire;
use crate::slip::TireOperatingPoint;
use crate::tire::Tire;

/// Speed [m/s], that of the usual measurements.
const SPEED: f64 = 16.7;

/// The largest slip [- or rad] that a peak is looked for at.
const LARGEST: f64 = 0.6;

/// Points on the way to a peak.
const POINTS: u32 = 2000;

/// The largest force in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrictionPeak {
    /// Force divided by load [-].
    pub friction: f64,
    /// Its slip [- or rad], without sign; not a number while the force still rises at the largest slip.
    pub slip: f64,
}

/// What a tire is like at a load, its own inflation pressure and 16.7 m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TireCharacteristics {
    /// Load [N].
    pub F_z: f64,
    /// Largest lateral force, to the left.
    pub lateral: FrictionPeak,
    /// Largest force that drives.
    pub driving: FrictionPeak,
    /// Largest force that brakes.
    pub braking: FrictionPeak,
    /// Cornering stiffness −∂F_y/∂α [N/rad]; above 0 for a tire in ISO-W axes.
    pub C_alpha: f64,
    /// Longitudinal slip stiffness ∂F_x/∂κ [N].
    pub C_kappa: f64,
    /// Camber stiffness −∂F_y/∂γ [N/rad]: above 0 where the tire is pushed to the side that it leans to.
    pub C_gamma: f64,
}

impl MfTire {
    /// What the tire is like at a load [N].
    pub fn characteristics_at_load(&self, F_z: f64) -> TireCharacteristics {
        let c = self.coefficients();
        let at = |kappa: f64, alpha: f64, gamma: f64| {
            let pressure = Some(c.INFLPRES);
            TireOperatingPoint {
                kappa,
                alpha,
                gamma,
                F_z,
                v_x: SPEED,
                pressure,
                ..TireOperatingPoint::default()
            }
        };
        let peak = |end: f64, force: &dyn Fn(f64) -> f64| {
            let slip = |i: u32| end.min(LARGEST) * f64::from(i) / f64::from(POINTS);
            let (i, force) = (1..=POINTS)
                .map(|i| (i, force(slip(i))))
                .fold((0, f64::NEG_INFINITY), |best, it| if it.1 > best.1 { it } else { best });
            let slip = if i == POINTS { f64::NAN } else { slip(i) };
            FrictionPeak { friction: force / F_z, slip }
        };
        // On the side of small cambers that is within the limits.
        let [left, right] = [-1e-4, 1e-4].map(|gamma: f64| gamma.max(c.CAMMIN).min(c.CAMMAX));
        let lateral_at = |gamma: f64| self.F_xy(&at(0.0, 0.0, gamma))[1];
        let (_, details) = self.forces_and_details(&at(0.0, 0.0, 0.0));
        TireCharacteristics {
            F_z,
            lateral: peak(-c.ALPMIN, &|alpha| self.F_xy(&at(0.0, -alpha, 0.0))[1]),
            driving: peak(c.KPUMAX, &|kappa| self.F_xy(&at(kappa, 0.0, 0.0))[0]),
            braking: peak(-c.KPUMIN, &|kappa| -self.F_xy(&at(-kappa, 0.0, 0.0))[0]),
            C_alpha: -details.K_ya,
            C_kappa: details.K_xk,
            C_gamma: if left < right { (lateral_at(left) - lateral_at(right)) / (right - left) } else { 0.0 },
        }
    }
}
