//! Tests the FMU with samples, parameters and steps that are wrong, and its states.

use fmu_export::description;

use super::*;

#[test]
fn the_table_agrees_with_the_model() {
    assert_eq!(description::model_problems::<FrictionNode>(), Vec::<String>::new());
}

/// An estimator that was initialised.
fn started() -> FrictionNode {
    let mut friction = FrictionNode::default();
    friction.settings.measured_v_y = true;
    friction.initialise().expect("start values");
    friction
}

/// A turn at 20 m/s, more or less near the limit.
fn turn(friction: &mut FrictionNode, k: i32) {
    let t = f64::from(k) * 0.01;
    let delta = 0.05 * t.sin();
    friction.sample =
        SensorSample { v_x: 20.0, v_y: -0.5 * t.sin(), r: 6.0 * delta, a_y: 120.0 * delta, delta };
    friction.step(t, 0.01).expect("a step");
}

/// Whether all that is told are numbers, and the standard deviations positive.
fn is_sound(friction: &mut FrictionNode) -> bool {
    let outputs =
        FrictionNode::VARIABLES.iter().filter(|it| it.row.causality == fmu_export::Causality::Output);
    let mut sound = true;
    for output in outputs {
        if let fmu_export::VariableAccess::Real(at) = output.access {
            sound &= at(friction).is_finite();
        }
    }
    sound && friction.axles.iter().all(|it| it.D > 0.0 && it.K > 0.0 && it.std_D > 0.0 && it.std_K > 0.0)
}

#[test]
fn samples_that_are_none_are_left_out_and_counted() {
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e9] {
        for channel in 0..4 {
            let mut friction = started();
            (0..50).for_each(|k| turn(&mut friction, k));
            let before = friction.axles.map(|it| it.D);
            let mut sample = friction.sample;
            *[&mut sample.v_x, &mut sample.r, &mut sample.a_y, &mut sample.delta][channel] = wrong;
            friction.sample = sample;
            friction.step(0.5, 0.01).expect("a step");
            assert!(is_sound(&mut friction) && !friction.output.used);
            assert_eq!(friction.missing, 1);
            for (axle, before) in friction.axles.iter().zip(before) {
                assert!((axle.D - before).abs() < 1e-3);
            }
            (51..150).for_each(|k| turn(&mut friction, k));
            assert!(is_sound(&mut friction) && friction.output.used);
            assert_eq!(friction.missing, 1);
        }
    }
}

#[test]
fn a_missing_v_y_is_estimated_until_it_is_back() {
    let mut friction = started();
    (0..100).for_each(|k| turn(&mut friction, k));
    let std = friction.output.v_y[1];
    friction.sample.v_y = f64::NAN;
    friction.step(1.0, 0.01).expect("a step");
    assert!(friction.output.used && friction.output.v_y[1] > std);
    assert_eq!(friction.missing, 0);
    assert!(is_sound(&mut friction));
}

#[test]
fn a_car_that_stands_or_goes_backwards_tells_nothing() {
    for v_x in [0.0, -0.0, 1e-300, -20.0, 2.9] {
        let mut friction = started();
        (0..50).for_each(|k| turn(&mut friction, k));
        let before = friction.output.axles;
        for k in 50..100 {
            friction.sample = SensorSample { v_x, v_y: 3.0, r: 1.0, a_y: 8.0, delta: 0.3 };
            friction.step(f64::from(k) * 0.01, 0.01).expect("a step");
            assert!(is_sound(&mut friction) && !friction.output.used);
        }
        for (now, before) in friction.output.axles.iter().zip(before) {
            assert!((now.mean[0] - before.mean[0]).abs() < 0.02);
        }
        (100..200).for_each(|k| turn(&mut friction, k));
        assert!(is_sound(&mut friction) && friction.output.used);
    }
}

#[test]
fn samples_at_random_and_steps_of_all_lengths_leave_numbers() {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    for measured in [true, false] {
        let mut friction = started();
        friction.settings.measured_v_y = measured;
        let mut time = 0.0;
        for _ in 0..20_000 {
            let mut any = |most: f64| match random.random_range(0..40) {
                0 => f64::NAN,
                1 => 0.0,
                2 => most,
                _ => most * random.random_range(-1.0..1.0_f64),
            };
            friction.sample = SensorSample {
                v_x: any(200.0),
                v_y: any(300.0),
                r: any(50.0),
                a_y: any(200.0),
                delta: any(1.5),
            };
            let step = 10.0_f64.powf(random.random_range(-7.0..2.0));
            friction.step(time, step).expect("a step");
            time += step;
            assert!(is_sound(&mut friction), "{friction:?}");
        }
    }
}

#[test]
fn parameters_that_no_car_has_are_refused_by_name() {
    type Perturbation = fn(&mut FrictionNode);
    let cases: [(Perturbation, &str); 9] = [
        (|f| f.settings.body.m = 0.0, "body.m: expected 0.01 to"),
        (|f| f.settings.body.I_zz = f64::NAN, "body.I_zz: expected"),
        (|f| f.settings.body.l_r = -1.6, "body.l_r: expected 0.01 to 100, found -1.6"),
        (|f| f.tires[0].D = 0.0, "tire_f.D: expected 0.01 to 10, found 0"),
        (|f| f.tires[1].B = f64::INFINITY, "tire_r.B: expected"),
        (|f| f.tires[1].C = 2.5, "tire_r.C: expected 0.1 to 2, found 2.5"),
        (|f| f.tires[0].E = 1.5, "tire_f.E: expected -100 to 1, found 1.5"),
        (|f| f.settings.noise_times[0] = 0.0, "model.time: expected"),
        (|f| f.settings.drift.changes = -1.0, "surface.rate: expected"),
    ];
    for (spoil, wanted) in cases {
        let mut friction = FrictionNode::default();
        spoil(&mut friction);
        match friction.initialise() {
            Err(ModelError::Error(found)) => assert!(found.contains(wanted), "{found}"),
            other => panic!("{wanted}: {other:?}"),
        }
    }
}

#[test]
fn limits_of_all_parameters_leave_numbers() {
    let parameters: Vec<_> = FrictionNode::VARIABLES
        .iter()
        .filter(|it| it.row.causality == fmu_export::Causality::Parameter)
        .collect();
    for parameter in parameters {
        let fmu_export::VariableAccess::Real(at) = parameter.access else { continue };
        for limit in [parameter.row.min, parameter.row.max].into_iter().flatten() {
            let mut friction = started();
            *at(&mut friction) = limit;
            friction.initialise().expect("a limit");
            (0..300).for_each(|k| turn(&mut friction, k));
            assert!(is_sound(&mut friction), "{} = {limit}: {:?}", parameter.row.name, friction.output);
        }
    }
}

#[test]
fn a_restored_state_goes_on_bit_for_bit() {
    let mut friction = started();
    (0..100).for_each(|k| turn(&mut friction, k));
    // Curves are no part of the bytes of a state.
    let mut restored = FrictionNode { curves: None, ..friction.clone() };
    for k in 100..300 {
        turn(&mut friction, k);
        turn(&mut restored, k);
        assert_eq!(friction.output, restored.output);
    }
}
