//! Names what the filter asks of a car, and makes the cars that answer.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use nalgebra::{Matrix6, SMatrix, Vector4, Vector6};
use tire::Tire;
use vehicle::{NominalCar, TireCar, VelocityDual};

/// A car with the state `[v_x v_y r xi_x xi_y xi_psi]` and the measurement `[v_x v_y r a_y]`, under a driving force [N] and
/// a road-wheel angle [rad].
pub trait CarDynamics: Send + Sync {
    /// The state `h` [s] later with the inputs held.
    fn advance(&self, x: &Vector6<f64>, F_x: f64, delta: f64, h: f64) -> Vector6<f64>;

    /// The derivative of the state's rate with respect to the state.
    fn state_jacobian(&self, x: &Vector6<f64>, F_x: f64, delta: f64) -> Matrix6<f64>;

    /// The measurement in a state.
    fn predict_measurement(&self, x: &Vector6<f64>, F_x: f64, delta: f64) -> Vector4<f64>;

    /// The derivative of the measurement with respect to the state.
    fn measurement_jacobian(&self, x: &Vector6<f64>, F_x: f64, delta: f64) -> SMatrix<f64, 4, 6>;
}

impl CarDynamics for NominalCar {
    fn advance(&self, x: &Vector6<f64>, F_x: f64, delta: f64, h: f64) -> Vector6<f64> {
        self.advance(x, F_x, delta, h)
    }

    fn state_jacobian(&self, x: &Vector6<f64>, _: f64, _: f64) -> Matrix6<f64> {
        self.state_jacobian(x)
    }

    fn predict_measurement(&self, x: &Vector6<f64>, _: f64, delta: f64) -> Vector4<f64> {
        self.measurement(x, delta)
    }

    fn measurement_jacobian(&self, x: &Vector6<f64>, _: f64, _: f64) -> SMatrix<f64, 4, 6> {
        self.measurement_jacobian(x)
    }
}

/// A car on tires, and the same one in numbers that carry derivatives along.
pub struct OnTires<W, V> {
    /// For values.
    pub car: TireCar<W>,
    /// For derivatives.
    pub dual: TireCar<V>,
}

impl<W, V> CarDynamics for OnTires<W, V>
where
    W: Tire<f64> + Send + Sync,
    V: Tire<VelocityDual> + Send + Sync,
{
    fn advance(&self, x: &Vector6<f64>, F_x: f64, delta: f64, h: f64) -> Vector6<f64> {
        self.car.advance(x, F_x, delta, h)
    }

    fn state_jacobian(&self, x: &Vector6<f64>, F_x: f64, delta: f64) -> Matrix6<f64> {
        self.dual.state_jacobian(x, F_x, delta)
    }

    fn predict_measurement(&self, x: &Vector6<f64>, F_x: f64, delta: f64) -> Vector4<f64> {
        self.car.measurement(x, F_x, delta)
    }

    fn measurement_jacobian(&self, x: &Vector6<f64>, F_x: f64, delta: f64) -> SMatrix<f64, 4, 6> {
        self.dual.measurement_jacobian(x, F_x, delta)
    }
}
