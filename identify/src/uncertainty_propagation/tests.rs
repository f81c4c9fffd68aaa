//! The widths that a simulated error of the car asks for are those that are added.

use approx::assert_relative_eq;
use preparation::direction::ForceDirection;
use tire_inference::estimate::identify_tire;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

use super::*;

fn answer() -> TireIdentification {
    let excitation = SyntheticExcitation { samples: 400, ..SyntheticExcitation::default() };
    let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
    identify_tire(&synthetic_samples(&excitation, 0.3), &settings, &[FitMethod::LeastSquares]).expect("a fit")
}

#[test]
fn moves_add_as_squares_and_a_wide_quantity_is_not_identified() {
    let before = answer();
    let theta = before.unrestricted[0].1.theta;
    let moved = |factor: f64| {
        let mut theta = theta;
        theta[2] *= factor;
        theta
    };
    let mut widening = PropagatedUncertainty::default();
    widening.add_refits("m", [moved(0.97), moved(1.03)]);
    widening.add_refits("h", [moved(1.04), moved(0.96)]);
    let mut after = before.clone();
    widening.widen_answer(&mut after, &Prior::longitudinal(), 1);
    let [old, new] = [&before, &after].map(|answer| &answer.estimates[0].1);
    let by = 0.05 * theta[2];
    assert_relative_eq!(new.std[&Quantity::D], old.std[&Quantity::D].hypot(by), max_relative = 1e-9);
    assert_eq!(new.std[&Quantity::B], old.std[&Quantity::B], "B does not move");
    assert!(new.reason[&Quantity::D].contains("most of it by h"), "{}", new.reason[&Quantity::D]);
    let width =
        |estimate: &TireEstimate| estimate.interval[&Quantity::D][1] - estimate.interval[&Quantity::D][0];
    assert_relative_eq!(width(new), width(old).hypot(2.0 * NORMAL_95 * by), max_relative = 0.05);
    let place = new.parameters.iter().position(|it| *it == Parameter::D).expect("D");
    let grown = new.covariance[place][place] - old.covariance[place][place];
    assert_relative_eq!(grown, by * by, max_relative = 1e-9);
    let spread = |answer: &TireIdentification| {
        numerics::statistics::std(&answer.posterior.quantity_values(Quantity::Parameter(Parameter::D)))
    };
    assert_relative_eq!(spread(&after), spread(&before).hypot(by), max_relative = 0.1);

    let band = |estimate: &TireEstimate| {
        let band = estimate.posterior.as_ref().and_then(|report| report.band.as_ref());
        band.map_or(f64::NAN, |band| band.upper[20] - band.lower[20])
    };
    assert!(band(new) > 3.0 * band(old), "the band of {} is {}", band(old), band(new));

    assert_eq!(old.identified[&Quantity::K], Identifiability::Identified);
    let mut wide = PropagatedUncertainty::default();
    wide.add_refits("m", [moved(0.1), moved(1.9)]);
    let mut after = before.clone();
    wide.widen_answer(&mut after, &Prior::longitudinal(), 1);
    assert_eq!(after.estimates[0].1.identified[&Quantity::D], Identifiability::Weak);
}

#[test]
fn an_exact_car_changes_nothing() {
    assert!(perturbed_cars(&Car::default(), &CarUncertainty::NONE).is_empty());
    let before = answer();
    let mut after = before.clone();
    PropagatedUncertainty::default().widen_answer(&mut after, &Prior::longitudinal(), 1);
    assert_eq!(before.estimates[0].1, after.estimates[0].1);
}

#[test]
fn each_datum_moves_by_its_own_standard_deviation() {
    let car = Car::default();
    let uncertainty = CarUncertainty { h: 1.0, ..CarUncertainty::default() };
    let found = perturbed_cars(&car, &uncertainty);
    let names: Vec<_> = found.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["m", "centre of gravity", "I_zz", "h"]);
    let body = |datum: usize, end: usize| found[datum].1[end].body;
    assert_relative_eq!(body(0, 1).m, 1.02 * car.body.m, max_relative = 1e-12);
    assert_relative_eq!(body(1, 0).l_f, car.body.l_f - 0.01, max_relative = 1e-12);
    assert_relative_eq!(body(1, 0).wheelbase(), car.body.wheelbase(), max_relative = 1e-12);
    assert_relative_eq!(body(2, 0).I_zz, 0.9 * car.body.I_zz, max_relative = 1e-12);
    assert_eq!(body(3, 0).h, 0.0);
}

#[test]
fn no_peak_is_widened_to_the_other_side() {
    let before = answer();
    let theta = before.unrestricted[0].1.theta;
    let moved = |factor: f64| {
        let mut theta = theta;
        theta[0] *= factor;
        theta
    };
    let mut wide = PropagatedUncertainty::default();
    wide.add_refits("m", [moved(0.3), moved(1.7)]);
    let shifted = Prior { free: [true; 6], ..Prior::longitudinal() };
    let mut after = before.clone();
    wide.widen_answer(&mut after, &shifted, 1);
    let [old, new] = [&before, &after].map(|answer| answer.estimates[0].1.interval[&Quantity::PeakSlip]);
    assert!(new[0] >= 0.0 && new[0] < old[0] && new[1] > old[1], "{old:?} {new:?}");
}

#[test]
fn brakes_that_nobody_knows_are_moved_about_their_rule() {
    let by_load = BrakeShare::Rule(ShareRule::ByLoad);
    let car = Car { brake_front_share: by_load, ..Car::default() };
    let (_, cars) = cars_with_other_brake_share(&car).expect("a rule");
    let [front, rear] = car.body.static_loads();
    for (car, by) in cars.iter().zip([-0.05, 0.05]) {
        let BrakeShare::Fixed(share) = car.brake_front_share else { panic!("{car:?}") };
        assert_relative_eq!(share, front / (front + rear) + by);
    }
    assert_eq!(cars_with_other_brake_share(&Car { brake_front_share: BrakeShare::Fixed(0.6), ..car }), None);
}
