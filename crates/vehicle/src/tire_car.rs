//! Models the single-track car on load-dependent tires with combined slip and disturbance forces, for estimation.
#![allow(non_snake_case, reason = "forces and matrices are written as in the equations")]

use nalgebra::{Const, SMatrix, SVector, U1, vector};
use num_dual::{Derivative, DualSVec64};
use tire::{Number, Tire, TireOperatingPoint};

use crate::body::{Aerodynamics, G, VehicleBody};
use crate::driven::tire_forces_for_F_x;
use crate::integrate::rk4_steps;
use crate::slip::slip_speed;

/// Single-track car for a filter that knows the driving force, and no wheel speeds.
///
/// The state is that of [`crate::NominalCar`], x = [v_x, v_y, r, ξ_x, ξ_y, ξ_ψ] in m/s, m/s, rad/s, N, N and N m; the ξ stand
/// for all that the model leaves out. Each axle has two tires `W` with half of its load each. Their longitudinal slip is the one at
/// which they transmit their share of the driving force, as far as they can; it weakens their lateral force.
#[derive(Clone, Copy, Debug)]
pub struct TireCar<W> {
    /// Rigid body.
    pub body: VehicleBody,
    /// Drag and downforce.
    pub aero: Aerodynamics,
    /// Part of a braking force that acts at the front [-]; a driving force acts at the rear.
    pub brake_front_share: f64,
    /// Tires of the front and of the rear axle.
    pub tires: [W; 2],
}

/// Forces on the car along its axes.
struct BodyForces<T> {
    F_x: T,
    F_y: T,
    M_z: T,
}

impl<W> TireCar<W> {
    /// The same car on other tires, which may calculate with other numbers.
    pub fn with_tires<U>(&self, tires: [U; 2]) -> TireCar<U> {
        let Self { body, aero, brake_front_share, .. } = *self;
        TireCar { body, aero, brake_front_share, tires }
    }

    /// Forces of the road and of the air at a state, with a driving force [N] and a steering angle [rad].
    #[inline]
    fn body_forces<T: Number>(&self, x: &SVector<T, 6>, F_x: T, delta: T) -> BodyForces<T>
    where
        W: Tire<T>,
    {
        let VehicleBody { m, l_f, l_r, h, .. } = self.body;
        let (L, v_x) = (self.body.wheelbase(), x[0]);
        let drag = self.aero.drag(v_x);
        let [down_f, down_r] = self.aero.downforce(v_x);
        let moved = (F_x - drag) * (h / L);
        let loads = [down_f - moved + m * G * l_r / L, down_r + moved + m * G * l_f / L];
        let front = if F_x < 0.0 { self.brake_front_share } else { 0.0 };
        let shares = [F_x * front, F_x * (1.0 - front)];
        let v = slip_speed(v_x);
        // ISO-W: the slip angle is positive while the contact point moves to the left.
        let alphas = [(x[1] + x[2] * l_f).atan2(v) - delta, (x[1] - x[2] * l_r).atan2(v)];
        let [[F_xf, F_yf], [F_xr, F_yr]] = [0, 1].map(|axle| {
            let slip = TireOperatingPoint {
                alpha: alphas[axle],
                F_z: loads[axle] * 0.5,
                v_x: v,
                ..TireOperatingPoint::default()
            };
            tire_forces_for_F_x(&self.tires[axle], slip, shares[axle] * 0.5).map(|one| one * 2.0)
        });
        let (sin, cos) = delta.sin_cos();
        let lateral_f = F_yf * cos + F_xf * sin;
        BodyForces {
            F_x: F_xf * cos - F_yf * sin + F_xr - drag,
            F_y: lateral_f + F_yr,
            M_z: lateral_f * l_f - F_yr * l_r,
        }
    }

    /// Time derivative of the state: Newton's and Euler's equations as in [`crate::NominalCar::state_derivative`].
    #[inline]
    pub fn state_derivative<T: Number>(&self, x: &SVector<T, 6>, F_x: T, delta: T) -> SVector<T, 6>
    where
        W: Tire<T>,
    {
        let BodyForces { F_x, F_y, M_z } = self.body_forces(x, F_x, delta);
        SVector::from([
            x[1] * x[2] + (F_x + x[3]) / self.body.m,
            (F_y + x[4]) / self.body.m - x[0] * x[2],
            (M_z + x[5]) / self.body.I_zz,
            T::zero(),
            T::zero(),
            T::zero(),
        ])
    }

    /// Measurement y = [v_x, v_y, r, a_y] in m/s, m/s, rad/s and m/s².
    #[inline]
    pub fn measurement<T: Number>(&self, x: &SVector<T, 6>, F_x: T, delta: T) -> SVector<T, 4>
    where
        W: Tire<T>,
    {
        let BodyForces { F_y, .. } = self.body_forces(x, F_x, delta);
        SVector::from([x[0], x[1], x[2], (F_y + x[4]) / self.body.m])
    }
}

/// Numbers that carry derivatives with respect to v_x, v_y and r along.
pub type VelocityDual = DualSVec64<3>;

/// Derivatives with respect to the state, of a car whose tires calculate with dual numbers.
impl<W: Tire<VelocityDual>> TireCar<W> {
    /// Gradients of F_x, F_y and M_z with respect to v_x, v_y and r, one in each row.
    fn body_force_gradients(&self, x: &SVector<f64, 6>, F_x: f64, delta: f64) -> SMatrix<f64, 3, 3> {
        let mut dual = x.map(VelocityDual::from);
        for i in 0..3 {
            dual[i].eps = Derivative::derivative_generic(Const::<3>, U1, i);
        }
        let BodyForces { F_x, F_y, M_z } = self.body_forces(&dual, F_x.into(), delta.into());
        let row = |of: VelocityDual| of.eps.unwrap_generic(Const::<3>, U1).transpose();
        SMatrix::from_rows(&[row(F_x), row(F_y), row(M_z)])
    }

    /// Derivative of [`state_derivative`](Self::state_derivative) with respect to the state.
    pub fn state_jacobian(&self, x: &SVector<f64, 6>, F_x: f64, delta: f64) -> SMatrix<f64, 6, 6> {
        let VehicleBody { m, I_zz, .. } = self.body;
        let per = vector![1.0 / m, 1.0 / m, 1.0 / I_zz];
        let mut A = SMatrix::<f64, 6, 6>::zeros();
        let gradients = SMatrix::from_diagonal(&per) * self.body_force_gradients(x, F_x, delta);
        A.fixed_view_mut::<3, 3>(0, 0).copy_from(&gradients);
        A.fixed_view_mut::<3, 3>(0, 3).copy_from(&SMatrix::from_diagonal(&per));
        A[(0, 1)] += x[2];
        A[(0, 2)] += x[1];
        A[(1, 0)] -= x[2];
        A[(1, 2)] -= x[0];
        A
    }

    /// Derivative of [`measurement`](Self::measurement) with respect to the state.
    pub fn measurement_jacobian(&self, x: &SVector<f64, 6>, F_x: f64, delta: f64) -> SMatrix<f64, 4, 6> {
        let mut H = SMatrix::<f64, 4, 6>::zeros();
        let gradients = self.body_force_gradients(x, F_x, delta);
        for j in 0..3 {
            H[(j, j)] = 1.0;
            H[(3, j)] = gradients[(1, j)] / self.body.m;
        }
        H[(3, 4)] = 1.0 / self.body.m;
        H
    }
}

impl<W: Tire<f64>> TireCar<W> {
    /// Cornering stiffness of the front and of the rear axle at rest [N/rad], for small slip angles.
    pub fn cornering_stiffness(&self) -> [f64; 2] {
        let small = 1e-5;
        let loads = self.body.static_loads();
        [0, 1].map(|axle| {
            let side = |alpha: f64| {
                let F_z = 0.5 * loads[axle];
                self.tires[axle].F_xy(&TireOperatingPoint {
                    alpha,
                    F_z,
                    v_x: 20.0,
                    ..TireOperatingPoint::default()
                })[1]
            };
            (side(-small) - side(small)) / small
        })
    }

    /// State `step` [s] later with the inputs held, by Runge-Kutta steps: as many as keep the poles of the tires, which grow
    /// as 1 / v_x, within the stability limit of the method, and two at least.
    pub fn advance(&self, x: &SVector<f64, 6>, F_x: f64, delta: f64, step: f64) -> SVector<f64, 6> {
        let VehicleBody { m, I_zz, l_f, l_r, .. } = self.body;
        let [C_f, C_r] = self.cornering_stiffness();
        let poles = (C_f + C_r) / m + (l_f * l_f * C_f + l_r * l_r * C_r) / I_zz;
        let n = (step * poles.abs() / slip_speed(x[0]) / 2.5).ceil().clamp(2.0, 1e3);
        rk4_steps(*x, n as usize, step / n, |x| self.state_derivative(x, F_x, delta))
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::vector;
    use tire::MagicFormula;

    use super::*;

    fn car() -> TireCar<MagicFormula> {
        let aero = Aerodynamics { C_lf: 0.3, C_lr: 0.5, ..Aerodynamics::default() };
        let tires = [MagicFormula::default(), MagicFormula { B: 18.0, ..MagicFormula::default() }];
        TireCar { body: VehicleBody::default(), aero, brake_front_share: 0.6, tires }
    }

    #[test]
    fn small_slips_give_the_nominal_car() {
        let car = TireCar {
            aero: Aerodynamics { C_d: 0.0, C_lf: 0.0, C_lr: 0.0, ..Aerodynamics::default() },
            ..car()
        };
        let [C_f, C_r] = car.cornering_stiffness();
        let VehicleBody { m, I_zz, l_f, l_r, .. } = car.body;
        let nominal = crate::NominalCar { m, I_zz, l_f, l_r, C_f, C_r };
        let x = vector![25.0, 1e-4, 2e-4, 10.0, -20.0, 30.0];
        let [found, expected] =
            [car.state_derivative(&x, 0.0, 1e-5), nominal.state_derivative(&x, 0.0, 1e-5)];
        assert_relative_eq!(found, expected, epsilon = 1e-6);
        let stiffness = car.tires[0].cornering_stiffness_per_load() * car.body.static_loads()[0];
        assert_relative_eq!(C_f, stiffness, max_relative = 1e-6);
    }

    #[test]
    fn a_tire_transmits_the_force_that_it_is_asked_for_while_it_can() {
        let tire = MagicFormula::default();
        for alpha in [0.0, 0.02, -0.05] {
            let slip = TireOperatingPoint { alpha, F_z: 2000.0, v_x: 20.0, ..TireOperatingPoint::default() };
            let [free_x, free_y] = tire.F_xy(&slip);
            assert_eq!(free_x, 0.0);
            for F_x in [-1500.0, -300.0, 800.0, 1200.0] {
                let [x, y] = tire_forces_for_F_x(&tire, slip, F_x);
                assert_relative_eq!(x, F_x, max_relative = 1e-6);
                assert!(y.abs() <= free_y.abs() + 1e-9, "{y} and {free_y}");
            }
            let [x, y] = tire_forces_for_F_x(&tire, slip, -9000.0);
            assert!(x < 0.0 && x.hypot(y) <= 1.6 * 2000.0 + 1e-9, "{x} {y}");
        }
    }

    #[test]
    fn no_state_gives_nan() {
        let car = car();
        for v_x in [-30.0, -0.1, 0.0, 1e-9, 0.9, 1.0, 400.0] {
            for (v_y, r) in [(0.0, 0.0), (9.0, -3.0), (-400.0, 50.0)] {
                for F_x in [-1e6, -3000.0, 0.0, 1e-9, 5000.0, 1e6] {
                    let x = vector![v_x, v_y, r, 0.0, 0.0, 0.0];
                    let rates = car.state_derivative(&x, F_x, 0.2);
                    assert!(rates.iter().all(|it| it.is_finite()), "{x} {F_x}");
                    let later = car.advance(&x, F_x, 0.2, 0.01);
                    assert!(later.iter().all(|it| it.is_finite()), "{x} {F_x}");
                }
            }
        }
    }

    #[test]
    fn jacobians_are_those_of_central_differences() {
        let car = car();
        let lifted = car.with_tires(car.tires.map(|it| it.cast::<VelocityDual>()));
        for (v_x, F_x) in [(25.0, 900.0), (25.0, -2500.0), (0.4, 10.0)] {
            let x = vector![v_x, 0.02 * v_x, 0.1, 100.0, -300.0, 50.0];
            let step = vector![1e-5, 1e-5, 1e-5, 1.0, 1.0, 1.0];
            let side = |j: usize, by: f64| {
                let mut x = x;
                x[j] += by * step[j];
                (car.state_derivative(&x, F_x, 0.03), car.measurement(&x, F_x, 0.03))
            };
            let A = lifted.state_jacobian(&x, F_x, 0.03);
            let H = lifted.measurement_jacobian(&x, F_x, 0.03);
            for j in 0..6 {
                let (ahead, behind) = (side(j, 1.0), side(j, -1.0));
                let numeric = (ahead.0 - behind.0) / (2.0 * step[j]);
                assert_relative_eq!(A.column(j).into_owned(), numeric, epsilon = 2e-5);
                let numeric = (ahead.1 - behind.1) / (2.0 * step[j]);
                assert_relative_eq!(H.column(j).into_owned(), numeric, epsilon = 2e-5);
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_solved_slip() {
        use num_dual::Dual64;
        let tire = MagicFormula::default();
        let lifted = tire.cast::<Dual64>();
        for (F_x, alpha) in [(-900.0, 0.03), (700.0, -0.04), (1500.0, 0.01)] {
            let slip = TireOperatingPoint { alpha, F_z: 2000.0, v_x: 20.0, ..TireOperatingPoint::default() };
            let at = |alpha: f64| tire_forces_for_F_x(&tire, TireOperatingPoint { alpha, ..slip }, F_x)[1];
            let numeric = (at(alpha + 1e-6) - at(alpha - 1e-6)) / 2e-6;
            let dual = TireOperatingPoint::<Dual64> {
                alpha: Dual64::from(alpha).derivative(),
                F_z: 2000.0.into(),
                v_x: 20.0.into(),
                ..TireOperatingPoint::default()
            };
            let exact = tire_forces_for_F_x(&lifted, dual, F_x.into())[1].eps;
            assert_relative_eq!(exact, numeric, max_relative = 1e-5);
        }
    }
}
