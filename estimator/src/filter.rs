//! Estimates speeds, yaw rate and three lumped disturbances of the nominal single-track car.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use kalman::{Consistency, Gaussian, Judged, UpdateError, discretise, predict, update};
use nalgebra::{Matrix4, Matrix6, Vector4, Vector6};
use serde::{Deserialize, Serialize};
use vehicle::NominalCar;

/// Output of the filter after a step: state `[v_x v_y r xi_x xi_y xi_psi]`, measurement `[v_x v_y r a_y]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Estimated state [m/s, m/s, rad/s, N, N, N m].
    pub mean: Vector6<f64>,
    /// Its standard deviations.
    pub std: Vector6<f64>,
    /// Measured minus predicted [m/s, m/s, rad/s, m/s2].
    pub innovation: Vector4<f64>,
    /// The innovation squared in units of its covariance.
    pub nis: f64,
    /// Where the mean of these squares stands.
    pub judged: Judged,
    /// Whether that mean is outside its band.
    pub warning: bool,
}

/// An extended Kalman filter whose state is extended by disturbances that walk at random.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Estimator {
    /// The car that the filter assumes.
    pub car: NominalCar,
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
    consistency: Consistency<4>,
    has_begun: bool,
}

impl Default for Estimator {
    fn default() -> Self {
        Estimator {
            car: NominalCar::default(),
            sensor: Vector4::new(0.05, 0.01, 0.01, 0.1),
            process: Vector6::new(1e-6, 1e-6, 1e-6, 9e4, 2.25e6, 2.25e6),
            start_std_xi: 1000.0,
            warning_time: 1.0,
            warning_deviations: 5.0,
            start_at_measurement: false,
            belief: Gaussian { mean: Vector6::zeros(), cov: Matrix6::identity() },
            consistency: Consistency::default(),
            has_begun: false,
        }
    }
}

impl Estimator {
    /// Begins at the motion `[v_x, v_y, r]`, known as well as a measurement, without disturbances.
    pub fn start(&mut self, [v_x, v_y, r]: [f64; 3]) -> Output {
        let xi = self.start_std_xi;
        let std = Vector6::new(self.sensor[0], self.sensor[1], self.sensor[2], xi, xi, xi);
        let mean = Vector6::new(v_x, v_y, r, 0.0, 0.0, 0.0);
        self.belief = Gaussian { mean, cov: Matrix6::from_diagonal(&std.component_mul(&std)) };
        (self.consistency, self.has_begun) = (Consistency::default(), false);
        Output { mean, std, ..Output::default() }
    }

    /// Predicts by `h` [s] with the inputs held, and corrects by the measurement at the end. The accelerometer
    /// measures the effect of the steering angle too, so `delta` is part of its prediction.
    ///
    /// # Errors
    /// When a measurement is not finite, or the covariance has become indefinite.
    pub fn step(
        &mut self,
        F_x: f64,
        delta: f64,
        measured: &Vector4<f64>,
        h: f64,
    ) -> Result<Output, UpdateError> {
        if self.start_at_measurement && !self.has_begun && measured.iter().all(|y| y.is_finite()) {
            self.belief.mean.fixed_rows_mut::<3>(0).copy_from(&measured.fixed_rows::<3>(0));
        }
        let (car, x) = (&self.car, &self.belief.mean);
        let (F, Q) = discretise(&car.jacobian(x), &Matrix6::from_diagonal(&self.process), h);
        let prior = predict(&self.belief, car.advance(x, F_x, delta, h), &F, &Q);
        let residual = measured - car.measurement(&prior.mean, delta);
        let R = Matrix4::from_diagonal(&self.sensor.component_mul(&self.sensor));
        let (belief, innovation) =
            update(&prior, &residual, &car.measurement_jacobian(&prior.mean), &R)?;
        let kept = (-h / self.warning_time).exp();
        let judged = self.consistency.take(innovation.nis, kept, self.warning_deviations);
        (self.belief, self.has_begun) = (belief, true);
        Ok(Output {
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
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// A steady turn of the nominal car under constant disturbances, measured without noise.
    #[test]
    fn constant_disturbances_are_found() {
        let mut estimator = Estimator::default();
        let car = estimator.car;
        let mut truth = Vector6::new(25.0, 0.0, 0.0, -800.0, 1500.0, -700.0);
        estimator.start([25.0, 0.0, 0.0]);
        let mut output = Output::default();
        for _ in 0..500 {
            truth = car.advance(&truth, 1000.0, 0.01, 0.01);
            let measured = car.measurement(&truth, 0.01);
            output = estimator.step(1000.0, 0.01, &measured, 0.01).expect("a finite step");
        }
        for i in 0..6 {
            let error = (output.mean[i] - truth[i]).abs();
            assert!(error < 0.05 * output.std[i] + 1e-6, "state {i}: off by {error}");
        }
        assert!(output.nis < 1e-3, "{}", output.nis);
    }

    /// The share of steps with a warning, and the mean of the NIS, of a filter on its own model with white noises, whose
    /// sensors are `factor` times as noisy as it believes.
    fn warned(factor: f64) -> (f64, f64) {
        let mut estimator = Estimator::default();
        let (car, h) = (estimator.car, 0.01);
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut truth = Vector6::new(25.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        estimator.start([25.0, 0.0, 0.0]);
        let (mut warnings, mut sum) = (0, 0.0);
        for k in 0..20_000 {
            let delta = 0.02 * (f64::from(k) * h).sin();
            truth = car.advance(&truth, -truth[3], delta, h);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            for i in 0..6 {
                truth[i] += (estimator.process[i] * h).sqrt() * normal();
            }
            let noise = Vector4::from_fn(|i, _| factor * estimator.sensor[i] * normal());
            let measured = car.measurement(&truth, delta) + noise;
            let output = estimator.step(-truth[3], delta, &measured, h).expect("a finite step");
            warnings += u32::from(output.warning);
            sum += output.nis / 20_000.0;
        }
        (f64::from(warnings) / 20_000.0, sum)
    }

    #[test]
    fn a_warning_tells_a_wrong_model_and_no_right_one() {
        let (share, mean) = warned(1.0);
        assert!(share == 0.0 && (mean - 4.0).abs() < 0.15, "warned {share}, mean {mean}");
        let (share, mean) = warned(1.5);
        assert!(share > 0.9 && mean > 5.0, "warned {share}, mean {mean}");
        let (share, _) = warned(0.6);
        assert!(share > 0.9, "warned {share}");
    }

    #[test]
    fn a_filter_that_starts_at_its_measurement_starts_at_any_speed() {
        for v_x in [-3.0, 0.0, 0.5, 12.0, 90.0] {
            let mut estimator = Estimator { start_at_measurement: true, ..Estimator::default() };
            estimator.start([15.0, 0.0, 0.0]);
            let measured = Vector4::new(v_x, 0.0, 0.0, 0.0);
            let mut nis = 0.0;
            for _ in 0..300 {
                let output = estimator.step(0.0, 0.0, &measured, 0.01).expect("a finite step");
                nis = output.nis.max(nis);
                assert!(output.mean.iter().chain(output.std.iter()).all(|x| x.is_finite()));
            }
            assert!(nis < 1.0, "{nis} at {v_x} m/s");
        }
    }

    #[test]
    fn a_measurement_of_nan_is_an_error_and_changes_nothing() {
        let mut estimator = Estimator::default();
        estimator.start([25.0, 0.0, 0.0]);
        let before = estimator.belief;
        let measured = Vector4::new(25.0, f64::NAN, 0.0, 0.0);
        assert!(estimator.step(0.0, 0.0, &measured, 0.01).is_err());
        assert_eq!(estimator.belief, before);
    }
}
