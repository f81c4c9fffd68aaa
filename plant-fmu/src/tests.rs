//! Compares the derivatives of the outputs with central differences.

use std::sync::Arc;

use car_file::{CarParameter, implausible_parameters};
use fmu_export::{EquationDerivatives, Model, ModelError, RealValue, description, real_values};
use vehicle::detailed_track::WheelDynamicsOptions;
use vehicle::{PlanarState, SingleTrackInput};

use super::SingleTrackPlant;

/// Braking and driving, into and out of turns; between them the tires are below and beyond their peaks.
const POINTS: &[(SingleTrackInput, PlanarState)] = &[
    (
        SingleTrackInput { F_x: 1500.0, delta: 0.03 },
        PlanarState { X: 0.0, Y: 0.0, psi: 0.3, v_x: 20.0, v_y: -0.2, r: 0.15 },
    ),
    (
        SingleTrackInput { F_x: -4000.0, delta: -0.05 },
        PlanarState { X: 0.0, Y: 0.0, psi: 0.0, v_x: 35.0, v_y: 0.4, r: -0.2 },
    ),
    (
        SingleTrackInput { F_x: 500.0, delta: 0.25 },
        PlanarState { X: 0.0, Y: 0.0, psi: 1.0, v_x: 12.0, v_y: 1.5, r: -0.6 },
    ),
];

/// The plain car, and one with every option.
fn plants() -> [SingleTrackPlant; 3] {
    let mut detailed = SingleTrackPlant::default();
    detailed.details.options = WheelDynamicsOptions { spin: true, combined: true, relaxation: true };
    detailed.details.steering.compliance = 1e-6;
    let mut combined = SingleTrackPlant::default();
    combined.details.options.combined = true;
    combined.details.lock.drive = 0.4;
    combined.details.lock.sensitivity = 0.5;
    [SingleTrackPlant::default(), combined, detailed]
}

#[test]
fn the_car_that_it_starts_with_is_plausible() {
    let given = |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: true };
    let parameters: Vec<_> = real_values(&mut SingleTrackPlant::default()).iter().map(given).collect();
    assert!(parameters.len() > 40, "{parameters:?}");
    assert_eq!(implausible_parameters(&parameters), [""; 0]);
}

#[test]
fn derivatives_are_those_of_central_differences() {
    let derivatives: EquationDerivatives<SingleTrackPlant> =
        SingleTrackPlant::DERIVATIVES.expect("derivatives");
    for (plant, (input, state)) in plants().iter().flat_map(|it| POINTS.iter().map(move |at| (it, at))) {
        let mut plant = SingleTrackPlant { start: *state, ..plant.clone() };
        plant.initialise().expect("a car");
        let values = [input.F_x, input.delta, 0.9, 1.1, 0.05, -0.1];
        let at =
            |values: [f64; 6]| derivatives.directional_derivative(&plant, &values.map(|value| (value, 0.0)));
        for (known, h) in [(0, 1.0), (1, 1e-5), (2, 1e-5), (3, 1e-5), (4, 1e-5), (5, 1e-5)] {
            let step = |h: f64| {
                let mut moved = values;
                moved[known] += h;
                at(moved)
            };
            let mut seeds = values.map(|value| (value, 0.0));
            seeds[known].1 = 1.0;
            for (i, (_, found)) in derivatives.directional_derivative(&plant, &seeds).into_iter().enumerate()
            {
                let expected = (step(h)[i].0 - step(-h)[i].0) / (2.0 * h);
                // What is zero is so but for the rounding of the difference.
                let rounding = 1e-10 * at(values)[i].0.abs() / h;
                let allowed = 1e-6 * expected.abs() + rounding;
                assert!((found - expected).abs() <= allowed, "{known} {i}: {found} {expected}");
            }
        }
    }
}

#[test]
fn options_that_make_no_car_are_told_with_name_and_bound() {
    let wrong = |change: fn(&mut SingleTrackPlant)| {
        let mut plant = SingleTrackPlant::default();
        change(&mut plant);
        match plant.initialise() {
            Err(ModelError::Error(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    let negative = |p: &mut SingleTrackPlant| {
        p.details.options.spin = true;
        p.vehicle.body.m = -5.0;
    };
    assert_eq!(wrong(negative), "body.m is -5, expected a number above 0");
    let text = Arc::new("[MODEL]\nFITTYP = 7\n".to_owned());
    let alone = |p: &mut SingleTrackPlant| p.tires[1].tir = "rear.tir".to_owned().into();
    assert_eq!(
        wrong(alone),
        "tire_r.tir is given and tire_f.tir is empty, expected a file for both axles or for none"
    );
    let mut plant = SingleTrackPlant::default();
    plant.tires.iter_mut().for_each(|choice| choice.tir = Arc::clone(&text));
    let Err(ModelError::Error(error)) = plant.initialise() else { panic!("no error") };
    assert!(error.starts_with("tire_f.tir:2: FITTYP"), "{error}");
}

#[test]
fn a_state_that_was_read_drives_on_as_the_first_one() {
    for mut plant in plants() {
        plant.initialise().expect("a car");
        (plant.input.delta, plant.input.F_x) = (0.05, -900.0);
        plant.step(0.0, 0.1).expect("a step");
        let mut other = SingleTrackPlant { built: None, ..plant.clone() };
        plant.step(0.1, 0.1).expect("a step");
        other.step(0.1, 0.1).expect("a step");
        plant.compute_outputs();
        other.compute_outputs();
        assert_eq!((plant.state, plant.outputs.omega), (other.state, other.outputs.omega));
        assert!(plant.outputs.motion.a_y > 1.0, "{:?}", plant.outputs.motion);
    }
}

#[test]
fn a_tire_parameter_that_changes_changes_the_car_with_options_too() {
    for mut plant in plants() {
        plant.initialise().expect("a car");
        plant.input.delta = 0.02;
        plant.step(0.0, 0.5).expect("a step");
        plant.compute_outputs();
        let before = plant.outputs.motion.F_yf;
        plant.vehicle.tire_f.D *= 0.5;
        plant.compute_outputs();
        assert!(plant.outputs.motion.F_yf < 0.6 * before, "{} after {before}", plant.outputs.motion.F_yf);
    }
}

#[test]
fn the_table_agrees_with_the_model() {
    assert_eq!(description::model_problems::<SingleTrackPlant>(), Vec::<String>::new());
}
