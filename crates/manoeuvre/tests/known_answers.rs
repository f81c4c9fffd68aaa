//! Compares characteristic values with answers that are known in closed form.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::f64::consts::{PI, TAU};

use crate::support::{Car, common, log, manoeuvre, values};
use manoeuvre::kind::{
    AccelerationTest, BrakingInATurn, ConstantQuantity, FrequencyResponse, LaneChange, ManoeuvreKind,
    MuSplitBraking, SineWithDwell, SlowlyIncreasingSteer, SteadyCircle, SteerExcitation, StepSteer,
    StopAndGo, TipIn,
};
use manoeuvre::{Direction, ManoeuvreDriver, ManoeuvreLog};
use units::STANDARD_GRAVITY;

#[track_caller]
fn near(found: Option<f64>, expected: f64, share: f64) {
    let found = found.expect("a number");
    let apart = (found - expected).abs();
    assert!(apart <= share * expected.abs(), "{found} instead of {expected}: {:.2e}", apart / expected);
}

#[test]
fn the_understeer_gradient_of_a_linear_car_is_that_of_the_closed_form() {
    let car = Car::new(6.0);
    for (constant, speed) in
        [(ConstantQuantity::Radius, 6.0), (ConstantQuantity::Speed, 20.0), (ConstantQuantity::Steer, 6.0)]
    {
        let kind = SteadyCircle { constant, ..SteadyCircle::default() };
        let car = Car { state: Car::new(speed).state, ..car };
        let values = values(&manoeuvre(common(speed), kind), car, 120.0).expect("a test");
        near(values.get_number("understeer_gradient"), car.understeer_gradient(), 0.01);
        let characteristic = (car.wheelbase() / car.understeer_gradient()).sqrt();
        near(values.get_number("characteristic_speed"), characteristic, 0.01);
        assert_eq!(values.get_number("critical_speed"), None);
    }
    // A car with its centre of gravity far behind oversteers.
    let car = Car { l_f: 1.6, l_r: 1.1, ..Car::new(6.0) };
    let values = values(&manoeuvre(common(6.0), SteadyCircle::default()), car, 120.0).expect("a test");
    near(values.get_number("understeer_gradient"), car.understeer_gradient(), 0.01);
    near(values.get_number("critical_speed"), (car.wheelbase() / -car.understeer_gradient()).sqrt(), 0.01);
}

/// Yaw rate and lateral acceleration over the road-wheel angle of the linear car at jω: (C (jω I - A)^-1 B + D).
fn transfer(car: &Car, v: f64, frequency: f64) -> [[f64; 2]; 2] {
    let Car { m, I_zz, l_f, l_r, C_f, C_r, .. } = *car;
    let (a11, a12) = (-(C_f + C_r) / (m * v), (C_r * l_r - C_f * l_f) / (m * v) - v);
    let (a21, a22) =
        ((C_r * l_r - C_f * l_f) / (I_zz * v), -(C_f * l_f * l_f + C_r * l_r * l_r) / (I_zz * v));
    let (b1, b2) = (C_f / m, C_f * l_f / I_zz);
    let w = TAU * frequency;
    let mul = |a: [f64; 2], b: [f64; 2]| [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
    let div = |a: [f64; 2], b: [f64; 2]| {
        let size = b[0] * b[0] + b[1] * b[1];
        let [re, im] = mul(a, [b[0], -b[1]]);
        [re / size, im / size]
    };
    let det = mul([-a11, w], [-a22, w]);
    let det = [det[0] - a12 * a21, det[1]];
    let v_y = div([b1 * -a22 + a12 * b2, b1 * w], det);
    let r = div([b2 * -a11 + a21 * b1, b2 * w], det);
    // a_y = dv_y/dt + v r.
    let a_y = [-w * v_y[1] + v * r[0], w * v_y[0] + v * r[1]];
    [r, a_y]
}

#[test]
fn the_frequency_response_of_a_linear_car_is_its_transfer_function() {
    let v = 25.0;
    let car = Car { drag: 0.0, ..Car::new(v) };
    // Sines have no leakage; a sweep and random steering are means over neighbouring lines.
    for (excitation, gain, phase) in [
        (SteerExcitation::Sine, 0.003, 0.003),
        (SteerExcitation::Sweep, 0.01, 0.01),
        (SteerExcitation::Random, 0.01, 0.01),
    ] {
        let kind = FrequencyResponse { excitation, amplitude: 0.01, ..FrequencyResponse::default() };
        let values = values(&manoeuvre(common(v), kind), car, 220.0).expect("a test");
        let frequencies = values.get_list("frequencies").to_vec();
        for (place, name) in ["yaw_rate", "lateral_acceleration"].into_iter().enumerate() {
            for (k, frequency) in frequencies.iter().enumerate() {
                let [mut re, mut im] = transfer(&car, v, *frequency)[place];
                if place == 1 {
                    // The acceleration at the end of a step has the steering of that step: what follows the steering at once,
                    // C_f / m, comes half a step later than the held steering, and unfiltered by the hold.
                    let (half, direct) = (PI * frequency * 0.01, car.C_f / car.m);
                    let (sin, cos) = half.sin_cos();
                    re += direct * (cos * half / sin - 1.0);
                    im -= direct * half;
                }
                let list = |of: &str| values.get_list(&format!("{name}_{of}"))[k];
                let about = format!("{excitation:?} {name} at {frequency:.3} Hz");
                let apart = (list("gain") / re.hypot(im) - 1.0).abs();
                assert!(apart < gain, "{about}: gain {apart:.2e}");
                let apart = (list("phase") - im.atan2(re)).abs();
                assert!(apart < phase, "{about}: phase {apart:.2e} rad");
                assert!(list("coherence") > 0.99, "{about}: {}", list("coherence"));
            }
        }
        let bandwidth = values.get_number("yaw_rate_bandwidth").expect("a bandwidth");
        let size = |f: f64| transfer(&car, v, f)[0][0].hypot(transfer(&car, v, f)[0][1]);
        assert!((size(bandwidth) / size(0.2) - 0.5_f64.sqrt()).abs() < 0.02, "{bandwidth} Hz");
    }
}

/// A log of a step steer whose yaw rate and acceleration answer as a second-order system.
fn second_order(kind: &StepSteer, omega: f64, zeta: f64, step: f64) -> ManoeuvreLog {
    let half = 0.5 * kind.amplitude / kind.rate;
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let answer = |t: f64| {
        let t = (t - half).max(0.0);
        let wave = (damped * t).cos() + zeta * omega / damped * (damped * t).sin();
        1.0 - (-zeta * omega * t).exp() * wave
    };
    let t: Vec<f64> = (0..=(kind.hold / step) as u32 + 1).map(|k| f64::from(k) * step).collect();
    let r: Vec<f64> = t.iter().map(|t| 0.2 * answer(*t)).collect();
    ManoeuvreLog {
        a_y: r.iter().map(|r| 20.0 * r).collect(),
        steer: t.iter().map(|t| (kind.rate * t).min(kind.amplitude)).collect(),
        v_x: vec![20.0; t.len()],
        v_y: vec![-0.4; t.len()],
        phase: vec![1.0; t.len()],
        r,
        t,
        ..ManoeuvreLog::default()
    }
}

#[test]
fn the_times_of_a_second_order_system_are_found() {
    let (omega, zeta) = (8.0, 0.5);
    let kind = StepSteer { amplitude: 0.02, rate: 1.0, hold: 6.0, ..StepSteer::default() };
    let log = second_order(&kind, omega, zeta, 0.001);
    let values = kind.characteristic_values(&common(20.0), &log).expect("values");
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let overshoot = (-PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
    near(values.get_number("yaw_rate_peak_time"), PI / damped, 0.002);
    near(values.get_number("yaw_rate_overshoot"), overshoot, 1e-4);
    near(values.get_number("steady_yaw_rate"), 0.2, 1e-6);
    near(values.get_number("yaw_rate_gain"), 10.0, 1e-6);
    near(values.get_number("steady_sideslip"), -(0.02_f64.atan()), 1e-9);
    near(values.get_number("TB"), PI / damped * -(0.02_f64.atan()), 0.002);
    // 90 % by bisection of the closed form.
    let answer = |t: f64| {
        let wave = (damped * t).cos() + zeta * omega / damped * (damped * t).sin();
        1.0 - (-zeta * omega * t).exp() * wave
    };
    let (mut low, mut high) = (0.0, PI / damped);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if answer(middle) < 0.9 { low = middle } else { high = middle }
    }
    near(values.get_number("lateral_acceleration_response_time"), low, 1e-4);
    // Without overshoot there is no peak.
    let damped = kind
        .characteristic_values(&common(20.0), &second_order(&kind, omega, 1.0 - 1e-9, 0.001))
        .expect("values");
    assert_eq!(
        (damped.get_number("yaw_rate_peak_time"), damped.get_number("yaw_rate_overshoot")),
        (None, Some(0.0))
    );
}

#[test]
fn the_sine_with_dwell_has_the_form_of_the_standard_to_the_sample() {
    let kind = SineWithDwell { amplitude: Some(0.05), ..SineWithDwell::default() };
    let log = log(&manoeuvre(common(22.2), kind), Car::new(22.2), 12.0).expect("a test");
    let first = log.phase.iter().position(|phase| *phase == 3.0).expect("the sine");
    let (f, dwell) = (0.7, 0.5);
    for (k, steer) in log.steer.iter().enumerate() {
        let t = log.t[k] - log.t[first];
        let expected = if t < 0.0 || t > 1.0 / f + dwell {
            0.0
        } else if t <= 0.75 / f {
            (TAU * f * t).sin()
        } else if t <= 0.75 / f + dwell {
            -1.0
        } else {
            (TAU * f * (t - dwell)).sin()
        };
        assert!((steer - 0.05 * expected).abs() < 1e-9, "{t} s: {steer} instead of {}", 0.05 * expected);
    }
    // Both half waves have the area 1 / (pi f), and the rest at the peak is a rectangle.
    let n = 200_000;
    let h = kind.steer_duration() / f64::from(n);
    let area = |positive: bool| {
        let value = |k: u32| kind.steer_shape((f64::from(k) + 0.5) * h);
        (0..n).map(value).filter(|it| (*it > 0.0) == positive).sum::<f64>() * h
    };
    near(Some(area(true)), 1.0 / (PI * f), 1e-5);
    near(Some(area(false)), -1.0 / (PI * f) - dwell, 1e-5);
}

#[test]
fn a_is_the_angle_at_three_tenths_of_g_and_the_amplitude_its_multiple() {
    let (v, car) = (80.0 / 3.6, Car::new(80.0 / 3.6));
    let slope = car.wheelbase() / (v * v) + car.understeer_gradient();
    let search = SlowlyIncreasingSteer::default();
    let found = values(&manoeuvre(common(v), search), car, 40.0).expect("a test");
    // The car is late by some tenths of a second, in which the angle goes on.
    let A = found.get_number("A").expect("A");
    let late = (A - slope * 0.3 * STANDARD_GRAVITY) / search.rate;
    assert!((0.0..0.3).contains(&late), "A is late by {late} s");
    near(found.get_number("steer_gradient"), slope, 0.02);
    let kind = SineWithDwell { times_A: Some(5.0), ..SineWithDwell::default() };
    let values = values(&manoeuvre(common(v), kind), car, 60.0).expect("a test");
    assert_eq!(values.get_number("A"), found.get_number("A"));
    near(values.get_number("amplitude"), 5.0 * A, 1e-12);
    // A linear car is straight again at once, and its displacement is that of the steering.
    assert!(values.get_number("yaw_rate_ratio_1_00").expect("a ratio").abs() < 0.05);
    assert!(values.get_number("lateral_displacement").expect("a way") > 1.83);
    near(values.get_number("entry_speed"), v, 0.02);
}

#[test]
fn braking_and_acceleration_have_the_times_and_ways_of_constant_forces() {
    let car = Car { drag: 0.0, ..Car::new(25.0) };
    let found = values(
        &manoeuvre(common(25.0), MuSplitBraking { force: 6000.0, ..MuSplitBraking::default() }),
        car,
        15.0,
    )
    .expect("a test");
    near(found.get_number("mean_deceleration"), 4.0, 0.005);
    near(found.get_number("stopping_distance"), 25.0 * 25.0 / 8.0, 0.005);
    near(found.get_number("stopping_time"), 25.0 / 4.0, 0.01);
    assert!(found.get_number("lateral_deviation_max").expect("a way") < 1e-9);
    let car = Car { drag: 0.5, ..Car::new(0.0) };
    let found = values(
        &manoeuvre(common(0.0), AccelerationTest { force: 3000.0, ..AccelerationTest::default() }),
        car,
        200.0,
    )
    .expect("a test");
    // m dv/dt = F - k v²: v = v_max tanh(t F / (m v_max)).
    let top = (3000.0_f64 / 0.5).sqrt();
    let scale = 1500.0 * top / 3000.0;
    near(found.get_number("time_to_speed"), scale * (27.0 / 0.972 / top).atanh(), 0.002);
    near(found.get_number("top_speed"), top, 0.01);
    near(found.get_number("acceleration_max"), 2.0, 0.002);
    let way = 1500.0 / (2.0 * 0.5) * (3000.0 / (3000.0 - 0.5 * (27.0_f64 / 0.972).powi(2))).ln();
    near(found.get_number("distance_to_speed"), way, 0.002);
}

#[test]
fn in_a_bend_a_neutral_change_changes_nothing_and_braking_stops() {
    let car = Car { drag: 0.0, ..Car::new(20.0) };
    let kind = TipIn { radius: 100.0, force: 0.0, ..TipIn::default() };
    let found = values(&manoeuvre(common(20.0), kind), car, 30.0).expect("a test");
    near(found.get_number("lateral_acceleration_0"), 4.0, 0.01);
    near(found.get_number("yaw_rate_ratio_1_0"), 1.0, 0.002);
    assert!(found.get_number("path_deviation_2_0").expect("a way").abs() < 0.1);
    assert_eq!(found.get_number("stopping_time"), None);
    let kind = BrakingInATurn { force: 6000.0, ..BrakingInATurn::default() };
    let found = values(&manoeuvre(common(20.0), kind), car, 30.0).expect("a test");
    near(found.get_number("longitudinal_acceleration"), -4.0, 0.01);
    near(found.get_number("stopping_time"), 5.0, 0.02);
    // The car understeers: slower it turns in.
    assert!(found.get_number("yaw_rate_ratio_1_0").expect("a ratio") > 1.0);
    assert!(found.get_number("path_deviation_2_0").expect("a way") < 0.0);
}

#[test]
fn the_lane_change_is_passed_slowly_and_failed_by_a_wide_car() {
    for course in [
        manoeuvre::kind::LaneChangeCourse::DoubleLaneChange,
        manoeuvre::kind::LaneChangeCourse::ObstacleAvoidance,
    ] {
        let kind = LaneChange { course, ..LaneChange::default() };
        let found = values(&manoeuvre(common(12.0), kind), Car::new(12.0), 40.0).expect("a test");
        assert_eq!(
            (found.get_number("cones_hit"), found.get_number("passed")),
            (Some(0.0), Some(1.0)),
            "{found:?}"
        );
        assert!(found.get_number("clearance").expect("a way") > 0.0);
        near(found.get_number("entry_speed"), 12.0, 0.05);
    }
    // Faster than the driver can follow.
    let found =
        values(&manoeuvre(common(45.0), LaneChange::default()), Car::new(45.0), 40.0).expect("a test");
    assert!(
        found.get_number("cones_hit").expect("a number") > 0.0 && found.get_number("clearance") < Some(0.0)
    );
}

#[test]
fn a_car_without_creep_stays_where_it_stands() {
    let car = Car { drag: 0.0, ..Car::new(0.0) };
    let kind = StopAndGo { force: 3000.0, ..StopAndGo::default() };
    let found = values(&manoeuvre(common(10.0), kind), car, 60.0).expect("a test");
    assert_eq!(found.get_number("creep_speed"), Some(0.0));
    near(found.get_number("stopping_time"), 9.5 / 2.0, 0.1);
    // It rolls on with the 0.2 m/s at which the brake is left.
    assert!(found.get_number("drift").expect("a way") < 0.2 * 3.1);
}

#[test]
fn a_test_to_the_right_is_the_mirror_of_one_to_the_left() {
    let kind = SineWithDwell { times_A: Some(3.0), ..SineWithDwell::default() };
    let right = manoeuvre::CommonParameters { direction: Direction::Right, ..common(22.2) };
    let [left, right] =
        [common(22.2), right].map(|common| values(&manoeuvre(common, kind), Car::new(22.2), 60.0));
    let (left, right) = (left.expect("a test"), right.expect("a test"));
    assert_eq!(left, right);
}

#[test]
fn a_driver_goes_on_from_what_it_remembered_to_the_last_bit() {
    let kind = LaneChange::default();
    let manoeuvre = manoeuvre(common(15.0), kind);
    let mut driver = ManoeuvreDriver::new(std::sync::Arc::clone(&manoeuvre));
    let input = |k: u32| {
        let t = f64::from(k) * 0.01;
        [15.0, 0.1 * t.sin(), 0.05 * t.cos(), 0.3, 15.0 * t, 0.2 * t.sin(), 0.01 * t]
    };
    for k in 0..300 {
        driver.step_commands(f64::from(k) * 0.01, &input(k));
    }
    let bytes = postcard::to_stdvec(&driver.saved_state()).expect("bytes");
    let rest = |driver: &mut ManoeuvreDriver| -> Vec<_> {
        (300..600).map(|k| driver.step_commands(f64::from(k) * 0.01, &input(k)).map(f64::to_bits)).collect()
    };
    let mut other = ManoeuvreDriver::new(manoeuvre);
    other.restore_state(postcard::from_bytes(&bytes).expect("a memory"));
    assert_eq!(rest(&mut driver), rest(&mut other));
}
