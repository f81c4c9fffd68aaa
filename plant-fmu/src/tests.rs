//! Compares the derivatives of the outputs with central differences.

use fmu_export::{Derivatives, Model, description};
use vehicle::{Input, State};

use super::Plant;

/// Braking and driving, into and out of turns; between them the tires are below and beyond their peaks.
const POINTS: &[(Input, State)] = &[
    (
        Input { F_x: 1500.0, delta: 0.03 },
        State { X: 0.0, Y: 0.0, psi: 0.3, v_x: 20.0, v_y: -0.2, r: 0.15 },
    ),
    (
        Input { F_x: -4000.0, delta: -0.05 },
        State { X: 0.0, Y: 0.0, psi: 0.0, v_x: 35.0, v_y: 0.4, r: -0.2 },
    ),
    (
        Input { F_x: 500.0, delta: 0.25 },
        State { X: 0.0, Y: 0.0, psi: 1.0, v_x: 12.0, v_y: 1.5, r: -0.6 },
    ),
];

#[test]
fn derivatives_are_those_of_central_differences() {
    let derivatives: Derivatives<Plant> = Plant::DERIVATIVES.expect("derivatives");
    for (input, state) in POINTS {
        let plant = Plant { state: *state, ..Plant::default() };
        let values = [input.F_x, input.delta];
        let at = |values: [f64; 2]| derivatives.along(&plant, &values.map(|value| (value, 0.0)));
        for (known, h) in [(0, 1.0), (1, 1e-5)] {
            let step = |h: f64| {
                let mut moved = values;
                moved[known] += h;
                at(moved)
            };
            let mut seeds = values.map(|value| (value, 0.0));
            seeds[known].1 = 1.0;
            for (i, (_, found)) in derivatives.along(&plant, &seeds).into_iter().enumerate() {
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
fn the_table_agrees_with_the_model() {
    assert_eq!(description::problems::<Plant>(), Vec::<String>::new());
}
