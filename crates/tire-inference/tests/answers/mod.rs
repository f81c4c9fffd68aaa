//! Data as they come: few, copied, in loops, of mixed loads, one-sided, of much noise or none of a tire. Each gets the answer of a
//! statistician: intervals that hold the truth, no verdict beyond the data, and a sentence about the cause.

mod coverage;

use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use tire_inference::estimate::{TireIdentification, identify_tire};
use tire_inference::fit::FitError;
use tire_inference::parameters::{Theta, magic_formula_from_theta};
use tire_inference::quantity::Quantity;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::verdict::Identifiability;

/// Outside of the box of the literature.
const TIRE: Theta = [9.0, 1.6, 1.1, -1.2, 0.0, 0.0];

fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Pcg64::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

/// Slips of a function of the share of the rows that are over, noise of the force.
fn measured(count: usize, noise: f64, seed: u64, slip: impl Fn(f64) -> f64) -> CurveSamples {
    let mut random = normal(seed);
    let slips: Vec<f64> = (0..count).map(|i| slip(i as f64 / (count - 1) as f64)).collect();
    let force = slips
        .iter()
        .map(|&x| magic_formula_from_theta(&TIRE).friction_coefficient(x) + noise * random())
        .collect();
    CurveSamples::new(slips, force)
}

fn answer(samples: &CurveSamples) -> TireIdentification {
    let settings = IdentificationSettings::new(ForceDirection::Lateral);
    identify_tire(samples, &settings, &[FitMethod::LeastSquares]).expect("a fit")
}

fn refusal(samples: &CurveSamples) -> String {
    let settings = IdentificationSettings::new(ForceDirection::Lateral);
    let error: FitError = identify_tire(samples, &settings, &[]).expect_err("no tire");
    error.to_string()
}

fn holds(answer: &TireIdentification, quantity: Quantity, truth: &Theta) -> bool {
    let judgement = answer.judgements.iter().find(|it| it.quantity == quantity).expect("judged");
    (judgement.interval[0]..=judgement.interval[1]).contains(&quantity.value(truth))
}

fn identified(answer: &TireIdentification) -> Vec<&'static str> {
    let known = answer.judgements.iter().filter(|it| it.verdict == Identifiability::Identified);
    known.map(|it| it.quantity.name()).collect()
}

fn message(answer: &TireIdentification) -> &str {
    answer.report.predictive.as_ref().map_or("", |predictive| predictive.message.as_str())
}

#[test]
fn twelve_points_give_wide_intervals_that_hold_the_truth() {
    let answers: Vec<_> = (0..8).map(|seed| answer(&measured(12, 0.03, seed, |share| 0.3 * share))).collect();
    for quantity in Quantity::DERIVED {
        // Of a chance of 95 %, 4 or fewer of 8 have one of 0.04 %.
        let held = answers.iter().filter(|answer| holds(answer, quantity, &TIRE)).count();
        assert!(held > 4, "{quantity:?}: {held} of 8");
    }
    assert!(answers.iter().all(|answer| answer.report.predictive.is_none()), "too few to test");
}

#[test]
fn rows_that_are_there_ten_times_tell_as_much_as_once() {
    let once = measured(150, 0.03, 1, |share| 0.3 * share);
    let rows: Vec<usize> = (0..1500).map(|row| row % 150).collect();
    let next: Vec<usize> = (0..1500).map(|row| row / 10).collect();
    let alone = answer(&once);
    for rows in [rows, next] {
        let copied = answer(&once.select_rows(&rows));
        for (a, b) in alone.judgements.iter().zip(&copied.judgements) {
            let ratio = b.std / a.std;
            assert!((0.9..1.15).contains(&ratio), "{}: {ratio} times as wide", a.quantity.name());
        }
        let independent = copied.report.predictive.expect("tested").independent;
        assert!((independent / 150.0 - 1.0).abs() < 0.01, "{independent}");
    }
}

#[test]
fn a_loop_of_hysteresis_is_named() {
    // From 0 to both sides and back, on a bench: the way out has more force than the way back.
    let angle = |share: f64| std::f64::consts::TAU * share;
    let mut samples = measured(1000, 0.01, 2, |share| 0.17 * angle(share).sin());
    for (row, force) in samples.force.iter_mut().enumerate() {
        *force += 0.06 * angle(row as f64 / 999.0).cos() * samples.slip[row].signum();
    }
    let found = answer(&samples);
    assert!(identified(&found).is_empty(), "{:?}", identified(&found));
    assert!(message(&found).contains("rises and falls"), "{}", message(&found));
    assert!(holds(&found, Quantity::K, &TIRE), "{:?}", found.judgements);
}

#[test]
fn mixed_loads_are_named() {
    let mut samples = measured(800, 0.02, 3, |share| 0.35 * (40.0 * share).sin());
    let mut random = normal(4);
    for force in &mut samples.force {
        // Rows of two loads, shuffled.
        *force *= if random() > 0.0 { 1.12 } else { 0.88 };
    }
    let found = answer(&samples);
    assert!(identified(&found).is_empty(), "{:?}", identified(&found));
    assert!(message(&found).contains("each load by itself"), "{}", message(&found));
    for truth in [0.88, 1.12].map(|factor| factor * TIRE[2]) {
        let peak = &found.judgements.iter().find(|it| it.quantity == Quantity::Peak).expect("peak");
        assert!((peak.mean - truth).abs() < 0.2, "between both: {}", peak.mean);
    }
}

#[test]
fn one_side_of_the_curve_does_not_tell_its_shifts_for_certain() {
    let shifted = [9.0, 1.6, 1.1, -1.2, 0.004, 0.03];
    let mut random = normal(0);
    let slip: Vec<f64> = (0..300).map(|i| 0.03 + 0.25 * f64::from(i) / 299.0).collect();
    let force = slip
        .iter()
        .map(|&x| magic_formula_from_theta(&shifted).friction_coefficient(x) + 0.03 * random())
        .collect();
    let samples = CurveSamples::new(slip, force);
    let held = IdentificationSettings { hold: false, ..IdentificationSettings::new(ForceDirection::Lateral) };
    let mut free = held.clone();
    free.prior.free = [true; 6];
    let [held, found] =
        [held, free].map(|it| identify_tire(&samples, &it, &[FitMethod::LeastSquares]).expect("a fit"));
    for it in &found.judgements {
        let name = it.quantity.name();
        let shift = ["S_h", "S_v"].contains(&name);
        assert!(!shift || it.verdict != Identifiability::Identified, "{}", it.reason);
        assert!(holds(&found, it.quantity, &shifted), "{name}: {:?}", it.interval);
        // What shifts could be is added to all that they move.
        let alone = held.judgements.iter().find(|other| other.quantity == it.quantity);
        if let Some(alone) = alone.filter(|_| ["D", "K"].contains(&name)) {
            assert!(it.std > 1.5 * alone.std, "{name}: {} and {}", it.std, alone.std);
        }
    }
}

#[test]
fn much_noise_leaves_the_shape_open() {
    let mut held = 0;
    for seed in 0..3 {
        let found = answer(&measured(300, 0.5, seed, |share| 0.3 * share));
        let known = identified(&found);
        assert!(!["B", "C", "E"].iter().any(|name| known.contains(name)), "{known:?}");
        held += u32::from(holds(&found, Quantity::K, &TIRE) && holds(&found, Quantity::Peak, &TIRE));
    }
    assert!(held >= 2, "{held} of 3");
}

#[test]
fn what_is_no_tire_is_refused_with_its_correction() {
    let good = measured(300, 0.03, 5, |share| 0.6 * share - 0.3);
    let mut noise = normal(6);
    let unrelated = CurveSamples::new(good.slip.clone(), good.slip.iter().map(|_| noise()).collect());
    assert!(refusal(&unrelated).contains("no relation beyond chance"), "{}", refusal(&unrelated));
    let mut mirrored = good.clone();
    mirrored.force.iter_mut().for_each(|force| *force *= -1.0);
    assert!(refusal(&mirrored).contains("sign = -1"), "{}", refusal(&mirrored));
    let mut degrees = good.clone();
    degrees.slip.iter_mut().for_each(|slip| *slip = slip.to_degrees());
    assert!(refusal(&degrees).contains("unit = \"deg\""), "{}", refusal(&degrees));
}

#[test]
fn a_missing_number_is_named_before_anything_is_said_of_the_tire() {
    let good = measured(300, 0.03, 5, |share| 0.3 * share);
    for broken in [f64::NAN, f64::INFINITY] {
        let mut samples = good.clone();
        samples.slip[7] = broken;
        assert!(refusal(&samples).contains("slip[7]"), "{}", refusal(&samples));
        let mut samples = good.clone();
        samples.force[9] = broken;
        assert!(refusal(&samples).contains("force[9]"), "{}", refusal(&samples));
    }
    assert!(refusal(&CurveSamples::default()).contains("no samples"));
    assert!(refusal(&good.select_rows(&[0, 100, 200])).contains("at least 5"));
    let mut short = good.clone();
    short.weight.pop();
    assert!(refusal(&short).contains("299"), "{}", refusal(&short));
}
