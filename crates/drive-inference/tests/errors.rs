//! Identifies tires from drives with something wrong in the log: it is found, corrected or refused.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use crate::drive;

use crate::mistakes::{MISTAKES, TIRES};
use drive_inference::model_selection::{ErrorSelection, EstimationMode};
use drive_inference::{
    Drive, DriveIdentification, DriveOptions, ErrorOptions, SmootherOptions, identify_tires,
};
use preparation::SystematicError;
use tire_inference::axles::Axle;
use tire_inference::model::ModelFit;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;
use vehicle::SingleTrackCar;

/// 56 s at two speeds of the demo car, with a mistake of the table.
fn spoilt(name: &str) -> Drive {
    let mistake = MISTAKES.iter().find(|mistake| mistake.name == name).expect("a mistake");
    let reference = drive::limit(&[20.0, 35.0], 6.0);
    mistake.drive(&SingleTrackCar::default(), &TIRES[1].1, &reference, 0.0, 1)
}

fn found(recording: &Drive, causes: ErrorOptions, posterior: bool) -> DriveIdentification {
    let smoothing = SmootherOptions { em_passes: 0 };
    let options = DriveOptions { causes, smoothing, posterior, ..DriveOptions::default() };
    identify_tires(std::slice::from_ref(recording), &options, &mut |_, _| true).expect("tires")
}

/// K of both axles is within 4 standard deviations of the truth, and known.
fn knows_the_stiffness(found: &DriveIdentification) {
    for axle in Axle::ALL {
        let (estimate, truth) = (&found.estimates[axle], TIRES[1].1[axle].stiffness());
        let off = (estimate.mean[&Quantity::K] - truth) / estimate.std[&Quantity::K];
        assert!(off.abs() < 4.0, "{axle:?}: {off}");
        assert_eq!(
            estimate.identified[&Quantity::K],
            Identifiability::Identified,
            "{}",
            estimate.reason[&Quantity::K]
        );
    }
}

#[test]
fn an_offset_of_the_steering_is_found_and_corrected() {
    let found = found(&spoilt("steering +0.3 deg"), ErrorOptions::default(), true);
    let first = &found.causes[0];
    assert_eq!(first.name, "steering_offset");
    let off = (first.value - 0.3_f64.to_radians()) / first.std;
    assert!(off.abs() < 4.0 && first.gain.is_some_and(|gain| gain > 100.0), "{first:?}");
    assert_eq!(found.model.verdict, ModelFit::Fits, "{}", found.model.sentence);
    let sentence = &found.model.sentence;
    assert!(sentence.starts_with("The offset of the steering angle is +"), "{sentence}");
    knows_the_stiffness(&found);
}

#[test]
fn errors_are_estimated_when_they_are_on_and_not_when_they_are_off() {
    let recording = spoilt("nothing");
    let with = |mode: EstimationMode| {
        let mut wanted = ErrorSelection::none();
        for cause in [
            SystematicError::SteeringOffset,
            SystematicError::RelaxationFront,
            SystematicError::RelaxationRear,
        ] {
            wanted.0[cause as usize] = mode;
        }
        found(&recording, ErrorOptions { wanted, ..ErrorOptions::default() }, false)
    };
    let on = with(EstimationMode::On);
    let names: Vec<&str> = on.causes.iter().map(|cause| cause.name.as_str()).collect();
    assert_eq!(names, ["steering_offset", "relaxation_front", "relaxation_rear"]);
    assert!(on.causes[0].value.abs() < 4.0 * on.causes[0].std, "{:?}", on.causes[0]);
    assert!(on.causes[1].value < 0.05, "{:?}", on.causes[1]);
    assert!(with(EstimationMode::Off).causes.is_empty());
}

#[test]
fn a_force_that_was_not_recorded_is_refused() {
    let wanted = ErrorOptions { wanted: ErrorSelection::none(), ..ErrorOptions::default() };
    let found = found(&spoilt("F_x = 0"), wanted, false);
    assert_eq!(found.model.verdict, ModelFit::DoesNotFit);
    assert!(found.model.sentence.contains("F_x is 0 N throughout"), "{}", found.model.sentence);
    for estimate in found.estimates.into_array() {
        assert!(estimate.identified.values().all(|verdict| *verdict != Identifiability::Identified));
    }
}
