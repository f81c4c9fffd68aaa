//! Checks that runs can be identified one after the other, each starting from the results of the earlier ones.

use identify::prior_from_file;
use numerics::statistics::{mean, std};
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use serde_json::json;
use tire_inference::bounds::Bounds;
use tire_inference::compressed::CompressedSamples;
use tire_inference::estimate::{TireIdentification, identify_tire};
use tire_inference::parameters::{COUNT, Normal, Parameter};
use tire_inference::posterior::{self, grid};
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::verdict::Identifiability;

fn data(count: usize, level: f64, seed: u64) -> CurveSamples {
    let excitation =
        SyntheticExcitation { samples: count, slip_std: 0.0, seed, ..SyntheticExcitation::default() };
    synthetic_samples(&excitation, level)
}

fn joined(first: &CurveSamples, second: &CurveSamples) -> CurveSamples {
    let join = |a: &[f64], b: &[f64]| a.iter().chain(b).copied().collect();
    CurveSamples::new(join(&first.slip, &second.slip), join(&first.force, &second.force))
}

fn found(samples: &CurveSamples, prior_from_file: Option<Normal>) -> TireIdentification {
    let usual = IdentificationSettings::new(ForceDirection::Longitudinal);
    let prior = usual.prior.with_bounds(Bounds::GOBLIRSCH);
    let settings = IdentificationSettings { prior, prior_from_file, ..usual };
    identify_tire(samples, &settings, &[FitMethod::LeastSquares]).expect("fits")
}

/// As the program does: by way of the report.
fn passed_on(answer: &TireIdentification) -> Normal {
    let report = json!({ "analyses": { "tires": {
        "preparation": {}, "least_squares": { "front": answer.estimates[0].1 },
    } } });
    let free = Prior::longitudinal().free;
    prior_from_file::parse_prior(&report.to_string(), "front", &free).expect("reads").expect("has this curve")
}

#[test]
fn two_halves_one_after_the_other_say_what_they_say_together() {
    // So many that the posterior of each half is close to normal.
    let (first, second) = (data(6000, 0.75, 1), data(6000, 0.75, 2));
    let together = found(&joined(&first, &second), None);
    let after = found(&second, Some(passed_on(&found(&first, None))));
    assert!(after.report.is_exact(), "{:?}", after.report);
    for quantity in
        Quantity::DERIVED.into_iter().chain(Parameter::ALL[..4].iter().map(|&p| Quantity::Parameter(p)))
    {
        let [one, other] = [&after, &together].map(|answer| answer.posterior.quantity_values(quantity));
        let (error, ratio) = ((mean(&one) - mean(&other)) / std(&other), std(&one) / std(&other));
        let name = quantity.name();
        assert!(error.abs() < 0.2, "{name}: off by {error} standard deviations");
        assert!((ratio - 1.0).abs() < 0.1, "{name}: {ratio} times the width");
        let value = |answer: &TireIdentification| answer.estimates[0].1.mean[&quantity];
        let apart = (value(&after) - value(&together)) / std(&other);
        assert!(apart.abs() < 0.2, "{name}: the fits differ by {apart} standard deviations");
    }
}

#[test]
fn what_the_bench_knows_the_run_need_not_tell() {
    // Low slips tell the stiffness and nothing else; the bench knows the shape.
    let run = data(1000, 0.08, 3);
    let bench = "[front]\nmean = { C = 2.0, E = 0.8 }\nstd = { C = 0.01, E = 0.01 }\n";
    let bench = prior_from_file::parse_prior(bench, "front", &[true; COUNT]).expect("reads");
    let (alone, helped) = (found(&run, None), found(&run, bench));
    let verdict = |answer: &TireIdentification, name: Quantity| answer.estimates[0].1.identified[&name];
    assert_eq!(verdict(&alone, Quantity::B), Identifiability::NotIdentifiable);
    for name in [Quantity::B, Quantity::C, Quantity::D, Quantity::E] {
        let reason = &helped.estimates[0].1.reason[&name];
        assert_eq!(verdict(&helped, name), Identifiability::Identified, "{reason}");
    }
    let (value, width) = (helped.estimates[0].1.mean[&Quantity::B], helped.estimates[0].1.std[&Quantity::B]);
    assert!((value - 15.0).abs() < 3.0 * width && width < 1.0, "{value} ± {width}");
}

#[test]
fn the_grid_multiplies_the_likelihood_with_what_was_known() {
    // With everything but D and S_v held the product can be summed on a grid of its own.
    let data = CompressedSamples::new(&data(200, 0.3, 4));
    let mean_of = [15.0, 2.0, 1.52, 0.8, 0.0, 0.01];
    let covariance = nalgebra::dmatrix![1e-4, -3e-5; -3e-5, 4e-5];
    let known = Normal::from_covariance(&[2, 5], mean_of, &covariance);
    let data = data.with_prior(known, 0.0025);
    let prior = Prior {
        free: [false, false, true, false, false, true],
        centre: [15.0, 2.0, 1.5, 0.8, 0.0, 0.0],
        ..Prior::longitudinal()
    };
    let found =
        grid::draw_from_grid(&data, &prior, &[], &posterior::SamplingOptions::default()).expect("applies");
    let mut sums = [0.0; 5];
    for k in 0..300 * 300 {
        let (peak, shift) = (1.4 + (k / 300) as f64 * 0.0008, -0.06 + (k % 300) as f64 * 0.0004);
        let squares = data.residual_squares(&[15.0, 2.0, peak, 0.8, 0.0, shift]);
        let weight = (-0.5 * 199.0 * (squares / 0.5).ln()).exp();
        for (sum, part) in sums.iter_mut().zip([1.0, peak, peak * peak, shift, shift * shift]) {
            *sum += weight * part;
        }
    }
    for (index, at) in [(1, 2), (3, 5)] {
        let expected = sums[index] / sums[0];
        let width = (sums[index + 1] / sums[0] - expected * expected).sqrt();
        let values: Vec<f64> = found.posterior.samples.iter().map(|theta| theta[at]).collect();
        assert!((mean(&values) - expected).abs() < 0.05 * width, "{} {expected}", mean(&values));
        assert!((std(&values) / width - 1.0).abs() < 0.05, "{} {width}", std(&values));
    }
}
