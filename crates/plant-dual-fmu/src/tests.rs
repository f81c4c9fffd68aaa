//! Tests what the FMU adds to the car.

use super::*;

#[test]
fn the_table_follows_fmi() {
    assert_eq!(fmu_export::description::problems::<Plant>(), [""; 0]);
}

#[test]
fn parameters_that_make_no_car_are_told_with_name_and_bound() {
    let wrong = |change: fn(&mut Plant)| {
        let mut plant = Plant::default();
        change(&mut plant);
        match plant.initialise() {
            Err(ModelError::Error(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(wrong(|p| p.parameters.body.m = -5.0), "body.m is -5, expected a number above 0");
    assert!(
        wrong(|p| p.tires[1].tir = "[MODEL]\nFITTYP = 7\n".to_owned())
            .starts_with("tire_r.tir:2: FITTYP")
    );
    assert!(wrong(|p| p.parameters.body.h = 30.0).contains("tips the body"));
}

#[test]
fn a_state_that_was_read_drives_on_as_the_first_one() {
    let mut plant = Plant::default();
    plant.initialise().expect("a car");
    plant.input.delta = 0.05;
    plant.step(0.0, 0.1).expect("a step");
    let mut other = Plant { car: None, ..plant.clone() };
    plant.step(0.1, 0.1).expect("a step");
    other.step(0.1, 0.1).expect("a step");
    assert_eq!((plant.state, plant.seen.a_y), (other.state, other.seen.a_y));
    assert!(plant.seen.a_y > 1.0 && plant.seen.wheels[1].F_z > plant.seen.wheels[0].F_z);
}

#[test]
fn a_tire_beyond_its_limits_is_told_once() {
    let mut plant =
        Plant { start: Start { v_x: 0.5, v_y: 20.0, ..Start::default() }, ..Plant::default() };
    plant.initialise().expect("a car");
    for k in 0..30 {
        plant.step(f64::from(k) * 0.01, 0.01).expect("a step");
    }
    assert!(plant.told.iter().all(|told| *told), "{:?}", plant.seen.wheels);
}
