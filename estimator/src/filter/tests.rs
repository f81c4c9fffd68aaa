//! Tests the filter on the cars that it assumes, and on wrong ones.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire::MagicFormula;
use vehicle::{Aerodynamics, NominalCar, TireCar, VehicleBody, VelocityDual};

use super::*;
use crate::car::OnTires;

/// A steady turn of the nominal car under constant disturbances, measured without noise.
#[test]
fn constant_disturbances_are_found() {
    let mut estimator = CarStateEstimator::default();
    let car = NominalCar::default();
    let mut truth = Vector6::new(25.0, 0.0, 0.0, -800.0, 1500.0, -700.0);
    estimator.start([25.0, 0.0, 0.0]);
    let mut output = FilterOutput::default();
    for _ in 0..500 {
        truth = car.advance(&truth, 1000.0, 0.01, 0.01);
        let measured = car.measurement(&truth, 0.01);
        output = estimator.step(&car, [1000.0, 0.01], &measured, 0.01).expect("a finite step");
    }
    for i in 0..6 {
        let error = (output.mean[i] - truth[i]).abs();
        assert!(error < 0.05 * output.std[i] + 1e-6, "state {i}: off by {error}");
    }
    assert!(output.nis < 1e-3, "{}", output.nis);
}

/// Cars of the same body: with linear tires, and with those of the demo car.
fn cars() -> (NominalCar, OnTires<MagicFormula, MagicFormula<VelocityDual>>) {
    let tires = [MagicFormula::default(); 2];
    let car = TireCar {
        body: VehicleBody::default(),
        aero: Aerodynamics::default(),
        brake_front_share: 0.6,
        tires,
    };
    let dual = car.with_tires(tires.map(|it| it.cast()));
    let [C_f, C_r] = car.cornering_stiffness();
    (NominalCar { C_f, C_r, ..NominalCar::default() }, OnTires { car, dual })
}

/// How often the filter warns, the mean of its NIS and the largest lateral acceleration [m/s²], over runs of 20 s in which `truth`
/// corners, brakes and accelerates under random disturbances, and the filter assumes `model`. The sensors are `factor` times as
/// noisy as it believes.
fn drive(truth: &dyn CarDynamics, model: &dyn CarDynamics, factor: f64) -> [f64; 3] {
    let h = 0.01;
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (mut count, mut warnings, mut sum, mut most) = (0.0, 0.0, 0.0, 0.0_f64);
    for _ in 0..10 {
        let process = Vector6::new(1e-6, 1e-6, 1e-6, 9e2, 9e2, 9e2);
        let mut estimator = CarStateEstimator { process, start_std_xi: 1.0, ..CarStateEstimator::default() };
        let mut x = Vector6::new(25.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        estimator.start([25.0, 0.0, 0.0]);
        for k in 0..2000 {
            let t = f64::from(k) * h;
            let delta = 0.06 * (2.0 * t).sin();
            let F_x = 1500.0 * (25.0 + 3.0 * (0.9 * t).sin() - x[0]);
            x = truth.advance(&x, F_x, delta, h);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            for i in 0..6 {
                x[i] += (estimator.process[i] * h).sqrt() * normal();
            }
            let noise = Vector4::from_fn(|i, _| factor * estimator.sensor[i] * normal());
            let measured = truth.predict_measurement(&x, F_x, delta);
            most = most.max(measured[3].abs());
            let output = estimator.step(model, [F_x, delta], &(measured + noise), h).expect("a finite step");
            warnings += f64::from(u8::from(output.warning));
            sum += output.nis;
            count += 1.0;
        }
    }
    [warnings / count, sum / count, most]
}

#[test]
fn a_warning_tells_noises_of_a_wrong_size_and_no_right_ones() {
    let (nominal, _) = cars();
    let [share, mean, _] = drive(&nominal, &nominal, 1.0);
    assert!(share == 0.0 && (mean - 4.0).abs() < 0.15, "warned {share}, mean {mean}");
    let [share, mean, _] = drive(&nominal, &nominal, 1.5);
    assert!(share > 0.8 && mean > 5.0, "warned {share}, mean {mean}");
    let [share, ..] = drive(&nominal, &nominal, 0.6);
    assert!(share > 0.8, "warned {share}");
}

#[test]
fn tires_in_the_model_are_consistent_at_the_limit_and_linear_ones_are_not() {
    let (nominal, on_tires) = cars();
    let [share, mean, most] = drive(&on_tires, &on_tires, 1.0);
    assert!(most > 12.0, "the car corners at {most} m/s2");
    assert!(share < 0.002 && (mean - 4.0).abs() < 0.15, "warned {share}, mean {mean}");
    let [share, mean, _] = drive(&on_tires, &nominal, 1.0);
    assert!(share > 0.5 && mean > 8.0, "warned {share}, mean {mean}");
}

#[test]
fn a_filter_that_starts_at_its_measurement_starts_at_any_speed() {
    for v_x in [-3.0, 0.0, 0.5, 12.0, 90.0] {
        let mut estimator = CarStateEstimator { start_at_measurement: true, ..CarStateEstimator::default() };
        estimator.start([15.0, 0.0, 0.0]);
        let measured = Vector4::new(v_x, 0.0, 0.0, 0.0);
        let mut nis = 0.0;
        for _ in 0..300 {
            let output =
                estimator.step(&NominalCar::default(), [0.0; 2], &measured, 0.01).expect("a finite step");
            nis = output.nis.max(nis);
            assert!(output.mean.iter().chain(output.std.iter()).all(|x| x.is_finite()));
        }
        assert!(nis < 1.0, "{nis} at {v_x} m/s");
    }
}

#[test]
fn a_measurement_of_nan_is_an_error_and_changes_nothing() {
    let mut estimator = CarStateEstimator::default();
    estimator.start([25.0, 0.0, 0.0]);
    let before = estimator.belief;
    let measured = Vector4::new(25.0, f64::NAN, 0.0, 0.0);
    assert!(estimator.step(&NominalCar::default(), [0.0; 2], &measured, 0.01).is_err());
    assert_eq!(estimator.belief, before);
}
