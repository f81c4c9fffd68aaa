//! Finds the peaks and the slip angles of the two tires of an axle.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::golden_section::argmax;
use tire::{MfTire, Tire, TireOperatingPoint};
use vehicle::MagicFormula;

/// The tires of an axle.
#[derive(Debug, Clone)]
pub struct TireAxle(AxleTires);

#[derive(Debug, Clone)]
enum AxleTires {
    Plain(MagicFormula),
    File(Box<MfTire>),
}

/// The peak of the lateral force of an axle.
#[derive(Debug, Clone, Copy)]
pub struct LateralPeak {
    /// [N]
    pub force: f64,
    /// [rad]
    pub slip_angle: f64,
}

/// Largest slip angle and longitudinal slip at which a peak is looked for [rad, -].
const MOST: f64 = 0.5;
/// Speed at which the tires are looked at [m/s]: far from the region of low speed.
const SPEED: f64 = 20.0;

impl TireAxle {
    /// Tires by the simple Magic Formula.
    pub fn from_magic_formula(tire: MagicFormula) -> Self {
        TireAxle(AxleTires::Plain(tire))
    }

    /// Tires of a file.
    pub fn from_tire_file(tire: MfTire) -> Self {
        TireAxle(AxleTires::File(Box::new(tire)))
    }

    /// Forces [N] of a wheel, positive along its slip.
    fn wheel_forces(&self, kappa: f64, angle: f64, F_z: f64) -> [f64; 2] {
        let slip =
            TireOperatingPoint { kappa, alpha: -angle, F_z, v_x: SPEED, ..TireOperatingPoint::default() };
        match &self.0 {
            AxleTires::Plain(tire) => tire.F_xy(&slip),
            AxleTires::File(tire) => tire.F_xy(&slip),
        }
    }

    /// Lateral forces of both wheels to the left and to the right [N] at a slip angle [rad], with a load of the axle and a load that
    /// moved across [N].
    fn lateral_wheel_forces(&self, angle: f64, load: f64, moved: f64) -> [f64; 2] {
        let moved = moved.min(0.5 * load);
        let wheels = [0.5 * load + moved, 0.5 * load - moved];
        [1.0, -1.0]
            .map(|side| wheels.map(|F_z| side * self.wheel_forces(0.0, side * angle, F_z)[1]).iter().sum())
    }

    /// The peak of the lateral force on the weaker side.
    pub fn lateral_peak(&self, load: f64, moved: f64) -> LateralPeak {
        let load = load.max(0.0);
        let weaker = |angle: f64| {
            let [left, right] = self.lateral_wheel_forces(angle, load, moved);
            left.min(right)
        };
        let slip_angle = argmax(weaker, MOST);
        LateralPeak { force: weaker(slip_angle), slip_angle }
    }

    /// The slip angle [rad] up to the peak that gives a lateral force [N], in the mean of both sides.
    pub fn slip_angle_for_force(&self, force: f64, load: f64, moved: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.lateral_peak(load, moved).slip_angle);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            let [left, right] = self.lateral_wheel_forces(middle, load, moved);
            if 0.5 * (left + right) < force { low = middle } else { high = middle }
        }
        high
    }

    /// The largest longitudinal force of both wheels over their load [-], in the weaker direction.
    pub fn longitudinal_friction(&self, load: f64) -> f64 {
        let F_z = 0.5 * load.max(1.0);
        let weaker =
            |kappa: f64| self.wheel_forces(kappa, 0.0, F_z)[0].min(-self.wheel_forces(-kappa, 0.0, F_z)[0]);
        weaker(argmax(weaker, MOST)) / F_z
    }
}
