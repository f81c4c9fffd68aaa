//! Estimates speeds, yaw rate and three lumped disturbances of a single-track car.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use kalman::{Gaussian, MeanNis, NisConsistency, UpdateError, discretise, measurement_update, predict};
use nalgebra::{Matrix4, Matrix6, Vector4, Vector6};
use serde::{Deserialize, Serialize};

use crate::car::CarDynamics;

/// Output of the filter after a step: state `[v_x v_y r xi_x xi_y xi_psi]`, measurement `[v_x v_y r a_y]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FilterOutput {
    /// Estimated state [m/s, m/s, rad/s, N, N, N m].
    pub mean: Vector6<f64>,
    /// Its standard deviations.
    pub std: Vector6<f64>,
    /// Measured minus predicted [m/s, m/s, rad/s, m/s2].
    pub innovation: Vector4<f64>,
    /// The innovation squared in units of its covariance.
    pub nis: f64,
    /// Where the mean of these squares stands.
    pub judged: MeanNis,
    /// Whether that mean is outside its band.
    pub warning: bool,
}

/// An extended Kalman filter whose state is extended by disturbances that walk at random.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct CarStateEstimator {
    /// Standard deviations of the measurements.
    pub sensor: Vector4<f64>,
    /// Growth of the state's variances, per second.
    pub process: Vector6<f64>,
    /// Initial standard deviation of the disturbances [N, N, N m].
    pub start_std_xi: f64,
    /// Time that the mean of the normalised innovations squared remembers [s].
    pub warning_time: f64,
    /// Width of the band of that mean, in standard deviations of a normal variable.
    pub warning_deviations: f64,
    /// Whether the first measurement replaces the initial motion.
    pub start_at_measurement: bool,
    belief: Gaussian<6>,
    consistency: NisConsistency<4>,
    has_begun: bool,
}

impl Default for CarStateEstimator {
    fn default() -> Self {
        CarStateEstimator {
            sensor: Vector4::new(0.05, 0.01, 0.01, 0.1),
            process: Vector6::new(1e-6, 1e-6, 1e-6, 9e4, 2.25e6, 2.25e6),
            start_std_xi: 1000.0,
            warning_time: 1.0,
            warning_deviations: 5.0,
            start_at_measurement: false,
            belief: Gaussian { mean: Vector6::zeros(), cov: Matrix6::identity() },
            consistency: NisConsistency::default(),
            has_begun: false,
        }
    }
}

impl CarStateEstimator {
    /// Begins at the motion `[v_x, v_y, r]`, known as well as a measurement, without disturbances.
    pub fn start(&mut self, [v_x, v_y, r]: [f64; 3]) -> FilterOutput {
        let xi = self.start_std_xi;
        let std = Vector6::new(self.sensor[0], self.sensor[1], self.sensor[2], xi, xi, xi);
        let mean = Vector6::new(v_x, v_y, r, 0.0, 0.0, 0.0);
        self.belief = Gaussian { mean, cov: Matrix6::from_diagonal(&std.component_mul(&std)) };
        (self.consistency, self.has_begun) = (NisConsistency::default(), false);
        FilterOutput { mean, std, ..FilterOutput::default() }
    }

    /// Predicts a car by `h` [s] with the inputs held, and corrects by the measurement at the end. The accelerometer
    /// measures the effect of the steering angle too, so `delta` is part of its prediction.
    ///
    /// # Errors
    /// When a measurement is not finite, or the covariance has become indefinite.
    pub fn step(
        &mut self,
        car: &dyn CarDynamics,
        [F_x, delta]: [f64; 2],
        measured: &Vector4<f64>,
        h: f64,
    ) -> Result<FilterOutput, UpdateError> {
        if self.start_at_measurement && !self.has_begun && measured.iter().all(|y| y.is_finite()) {
            self.belief.mean.fixed_rows_mut::<3>(0).copy_from(&measured.fixed_rows::<3>(0));
        }
        let x = &self.belief.mean;
        let (F, Q) =
            discretise(&car.state_jacobian(x, F_x, delta), &Matrix6::from_diagonal(&self.process), h);
        let prior = predict(&self.belief, car.advance(x, F_x, delta, h), &F, &Q);
        let residual = measured - car.predict_measurement(&prior.mean, F_x, delta);
        let R = Matrix4::from_diagonal(&self.sensor.component_mul(&self.sensor));
        let (belief, innovation) =
            measurement_update(&prior, &residual, &car.measurement_jacobian(&prior.mean, F_x, delta), &R)?;
        let kept = (-h / self.warning_time).exp();
        let judged = self.consistency.update_mean_nis(innovation.nis, kept, self.warning_deviations);
        (self.belief, self.has_begun) = (belief, true);
        Ok(FilterOutput {
            mean: belief.mean,
            std: belief.cov.diagonal().map(f64::sqrt),
            innovation: innovation.residual,
            nis: innovation.nis,
            judged,
            warning: !judged.is_consistent(),
        })
    }
}

#[cfg(test)]
mod tests;
