//! Presses and slows the car of a lap: coefficients that are constant, or those of a map at the ride heights that the loads give.
#![allow(non_snake_case, reason = "coefficients are written as in the equations")]

use nalgebra::SVector;
use num_dual::{Derivative, DualSVec64};
use tire::Number;
use vehicle::{Aerodynamics, BilinearMap, VehicleBody};

use crate::spline::BSplineSurfaces;

/// Intervals of the smoothed map along each ride height.
const INTERVALS: usize = 32;
/// Steps of Newton's method for the ride heights: from rest three or four suffice.
const ITERATIONS: usize = 30;
/// Change of the ride heights at which they are found [m].
const TOLERANCE: f64 = 1e-12;

/// Aerodynamics of a car of a lap.
#[derive(Clone, Debug, Default)]
pub struct LapAero {
    /// Air, area, and the coefficients where no map replaces them.
    pub constant: Aerodynamics,
    /// Coefficients over the ride heights.
    pub platform: Option<AeroPlatform>,
}

impl From<Aerodynamics> for LapAero {
    fn from(constant: Aerodynamics) -> Self {
        LapAero { constant, platform: None }
    }
}

/// A body on springs, whose aerodynamic coefficients depend on how high it stands.
#[derive(Clone, Debug)]
pub struct AeroPlatform {
    /// C_d, C_lf and C_lr [-] over the ride heights of the front and the rear axle [m].
    coefficients: BSplineSurfaces<3>,
    /// Height of the underbody at each axle at rest [m].
    ride_height: [f64; 2],
    /// Stiffness of each axle in heave [N/m], of both wheels; infinite for a body that keeps its height.
    stiffness: [f64; 2],
    /// Height of the pitch centre [m]: links carry the moment of a force at this height, not the springs.
    pitch_centre: f64,
}

/// What loads the springs besides downforce.
#[derive(Clone, Copy, Debug)]
pub struct SpringLoad<T> {
    /// Dynamic pressure times area [N].
    pub pressure: T,
    /// Part of the weight that is normal to the road, and what a banked bend presses [N].
    pub pressing: T,
    /// Sum of the longitudinal forces of the tires [N].
    pub F_x: T,
}

/// Heights g(h) that the loads at heights h give.
struct HeightLinearisation {
    /// g(h) [m].
    loaded: [f64; 2],
    /// Inverse of the Jacobian of h − g(h).
    inverse: [[f64; 2]; 2],
}

/// J⁻¹ (h − g(h)).
fn newton_step<T: Number>(heights: [T; 2], loaded: [T; 2], inverse: [[f64; 2]; 2]) -> [T; 2] {
    let residual = [heights[0] - loaded[0], heights[1] - loaded[1]];
    inverse.map(|row| residual[0] * row[0] + residual[1] * row[1])
}

impl LapAero {
    /// Drag and the downforce of each axle [N], with the body where the loads press it.
    #[inline]
    pub fn drag_and_downforce<T: Number>(
        &self,
        body: &VehicleBody,
        v_x: T,
        load: impl FnOnce(T) -> SpringLoad<T>,
    ) -> (T, [T; 2]) {
        let Some(platform) = &self.platform else {
            return (self.constant.drag(v_x), self.constant.downforce(v_x));
        };
        let load = load(self.pressure(v_x));
        let heights = platform.ride_heights(body, &load);
        platform.drag_and_downforce(load.pressure, heights)
    }

    /// The same with the springs of the axles compressed by these ways [m].
    #[inline]
    pub fn drag_and_downforce_at<T: Number>(&self, v_x: T, compression: [T; 2]) -> (T, [T; 2]) {
        let Some(platform) = &self.platform else {
            return (self.constant.drag(v_x), self.constant.downforce(v_x));
        };
        let heights = [0, 1].map(|axle| -compression[axle] + platform.ride_height[axle]);
        platform.drag_and_downforce(self.pressure(v_x), heights)
    }

    /// Dynamic pressure times area [N].
    fn pressure<T: Number>(&self, v_x: T) -> T {
        v_x * v_x * (0.5 * self.constant.rho * self.constant.area)
    }

    /// The coefficients at rest, for estimates before a lap.
    pub fn at_rest(&self) -> Aerodynamics {
        let Some(platform) = &self.platform else { return self.constant };
        let [C_d, C_lf, C_lr] = platform.coefficients.values(platform.ride_height);
        Aerodynamics { C_d, C_lf, C_lr, ..self.constant }
    }
}

impl AeroPlatform {
    /// A body of these ride heights at rest [m] on axles of this stiffness in heave [N/m], pitching about this height [m].
    pub fn new(map: &BilinearMap<3>, ride_height: [f64; 2], stiffness: [f64; 2], pitch_centre: f64) -> Self {
        let coefficients = BSplineSurfaces::near(map.argument_ranges(), INTERVALS, |front, rear| {
            map.interpolate(front, rear)
        });
        AeroPlatform { coefficients, ride_height, stiffness, pitch_centre }
    }

    /// Drag and the downforce of each axle [N] under this pressure at these ride heights [m].
    fn drag_and_downforce<T: Number>(&self, pressure: T, heights: [T; 2]) -> (T, [T; 2]) {
        let [C_d, C_lf, C_lr] = self.coefficients.values(heights);
        (pressure * C_d, [pressure * C_lf, pressure * C_lr])
    }

    /// Ride heights [m] at which the springs carry what loads them, with derivatives.
    ///
    /// Newton's method finds their values. Two more steps with the same Jacobian give their first and their second derivatives.
    fn ride_heights<T: Number>(&self, body: &VehicleBody, load: &SpringLoad<T>) -> [T; 2] {
        if self.stiffness.iter().all(|stiffness| stiffness.is_infinite()) {
            return self.ride_height.map(T::from);
        }
        let real =
            SpringLoad { pressure: load.pressure.re(), pressing: load.pressing.re(), F_x: load.F_x.re() };
        let mut heights = self.ride_height;
        let mut linear = self.linearise(body, &real, heights);
        for _ in 0..ITERATIONS {
            let step = newton_step(heights, linear.loaded, linear.inverse);
            heights = [heights[0] - step[0], heights[1] - step[1]];
            linear = self.linearise(body, &real, heights);
            if step.iter().all(|step| step.abs() < TOLERANCE) {
                break;
            }
        }
        let mut with_derivatives = heights.map(T::from);
        for _ in 0..2 {
            let coefficients = self.coefficients.values(with_derivatives);
            let loaded = self.loaded_heights(body, load, coefficients);
            let step = newton_step(with_derivatives, loaded, linear.inverse);
            with_derivatives = [with_derivatives[0] - step[0], with_derivatives[1] - step[1]];
        }
        with_derivatives
    }

    /// The heights that the loads at these heights give, with their Jacobian.
    fn linearise(
        &self,
        body: &VehicleBody,
        load: &SpringLoad<f64>,
        heights: [f64; 2],
    ) -> HeightLinearisation {
        type HeightDual = DualSVec64<2>;
        let heights = [0, 1].map(|axle| {
            let mut unit = SVector::zeros();
            unit[axle] = 1.0;
            HeightDual::new(heights[axle], Derivative::some(unit))
        });
        let constant = SpringLoad {
            pressure: HeightDual::from(load.pressure),
            pressing: HeightDual::from(load.pressing),
            F_x: HeightDual::from(load.F_x),
        };
        let loaded = self.loaded_heights(body, &constant, self.coefficients.values(heights));
        let slope = |of: usize, by: usize| {
            let unit = if of == by { 1.0 } else { 0.0 };
            unit - loaded[of].eps.0.map_or(0.0, |eps| eps[by])
        };
        let [[a, b], [c, d]] = [[slope(0, 0), slope(0, 1)], [slope(1, 0), slope(1, 1)]];
        let determinant = a * d - b * c;
        HeightLinearisation {
            loaded: loaded.map(|height| height.re),
            inverse: [[d / determinant, -b / determinant], [-c / determinant, a / determinant]],
        }
    }

    /// Heights [m] on springs that carry these coefficients.
    fn loaded_heights<T: Number>(
        &self,
        body: &VehicleBody,
        load: &SpringLoad<T>,
        [C_d, C_lf, C_lr]: [T; 3],
    ) -> [T; 2] {
        let L = body.wheelbase();
        let rest = body.static_loads();
        let SpringLoad { pressure, pressing, F_x } = *load;
        let moved = (F_x - pressure * C_d) * ((body.h - self.pitch_centre) / L);
        let front = pressing * (body.l_r / L) + pressure * C_lf - moved - rest[0];
        let rear = pressing * (body.l_f / L) + pressure * C_lr + moved - rest[1];
        [-front / self.stiffness[0] + self.ride_height[0], -rear / self.stiffness[1] + self.ride_height[1]]
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use vehicle::G;

    use super::*;
    use crate::tires::unknown;

    const BODY: VehicleBody = VehicleBody { m: 1300.0, I_zz: 2000.0, l_f: 1.4, l_r: 1.3, h: 0.45 };

    /// A car whose front presses more the lower it stands, on springs of these stiffnesses [N/m].
    fn aero(stiffness: [f64; 2]) -> LapAero {
        let axis = vec![0.02, 0.04, 0.06, 0.08, 0.1];
        let bend = |front: f64, rear: f64| {
            [0.5 + front, 1.4 - 12.0 * front + 60.0 * front * front, 1.2 - 4.0 * (rear - front)]
        };
        let z = axis.iter().flat_map(|front| axis.iter().flat_map(move |rear| bend(*front, *rear)));
        let map = BilinearMap::new(axis.clone(), axis.clone(), z.collect()).expect("a map");
        let platform = AeroPlatform::new(&map, [0.06, 0.08], stiffness, 0.05);
        LapAero { constant: Aerodynamics { area: 1.5, ..Aerodynamics::default() }, platform: Some(platform) }
    }

    fn forces<T: Number>(aero: &LapAero, v_x: T, F_x: T) -> [T; 3] {
        let pressing = T::from(BODY.m * G);
        let load = |pressure: T| SpringLoad { pressure, pressing, F_x };
        let (drag, [front, rear]) = aero.drag_and_downforce(&BODY, v_x, load);
        [drag, front, rear]
    }

    #[test]
    fn springs_carry_what_presses_the_body() {
        let aero = aero([120e3, 140e3]);
        let (v_x, F_x) = (60.0, -9000.0);
        let [drag, front, rear] = forces(&aero, v_x, F_x);
        // Plain iteration of heights and forces, from rest.
        let platform = aero.platform.as_ref().expect("a map");
        let pressure = 0.5 * aero.constant.rho * aero.constant.area * v_x * v_x;
        let mut heights = platform.ride_height;
        for _ in 0..500 {
            let [C_d, C_lf, C_lr] = platform.coefficients.values(heights);
            let moved = (F_x - pressure * C_d) * (BODY.h - 0.05) / BODY.wheelbase();
            heights = [0.06 - (pressure * C_lf - moved) / 120e3, 0.08 - (pressure * C_lr + moved) / 140e3];
        }
        assert!(heights[0] < 0.035 && heights[1] < 0.09, "braking pitches the car: {heights:?}");
        for (force, C) in [drag, front, rear].into_iter().zip(platform.coefficients.values(heights)) {
            assert_relative_eq!(force, pressure * C, max_relative = 1e-9);
        }
    }

    #[test]
    fn a_stiff_body_has_the_coefficients_at_rest() {
        let aero = aero([f64::INFINITY; 2]);
        let rest = aero.at_rest();
        let [drag, front, rear] = forces(&aero, 50.0, -5000.0);
        assert_relative_eq!(drag, rest.drag(50.0), max_relative = 1e-12);
        assert_relative_eq!(front, rest.downforce(50.0)[0], max_relative = 1e-12);
        assert_relative_eq!(rear, rest.downforce(50.0)[1], max_relative = 1e-12);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let aero = aero([120e3, 140e3]);
        let (v, F) = (47.0, -6000.0);
        let dual: [num_dual::Dual2SVec64<2>; 3] = forces(&aero, unknown(v, 0, 1.0), unknown(F, 1, 1.0));
        for (i, force) in dual.iter().enumerate() {
            let at = |v: f64, F: f64| forces(&aero, v, F)[i];
            let (h_v, h_F) = (1e-2, 10.0);
            let (gradient, hessian) = (force.v1.0.expect("a gradient"), force.v2.0.expect("a Hessian"));
            assert_relative_eq!(force.re, at(v, F), max_relative = 1e-12);
            let d_v = (at(v + h_v, F) - at(v - h_v, F)) / (2.0 * h_v);
            assert_relative_eq!(gradient[0], d_v, max_relative = 1e-5);
            let d_F = (at(v, F + h_F) - at(v, F - h_F)) / (2.0 * h_F);
            assert_relative_eq!(gradient[1], d_F, max_relative = 1e-5);
            let d_vv = (at(v + h_v, F) - 2.0 * at(v, F) + at(v - h_v, F)) / (h_v * h_v);
            assert_relative_eq!(hessian[(0, 0)], d_vv, max_relative = 1e-3);
            let d_vF = (at(v + h_v, F + h_F) - at(v + h_v, F - h_F) - at(v - h_v, F + h_F)
                + at(v - h_v, F - h_F))
                / (4.0 * h_v * h_F);
            assert_relative_eq!(hessian[(0, 1)], d_vF, max_relative = 1e-3);
        }
    }
}
