//! NoiseModel that is not normal.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::loss::Loss;
use numerics::statistics::{central_95_percent_interval, mean, std};
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use tire_inference::estimate::{TireIdentification, identify_tire};
use tire_inference::kernel;
use tire_inference::noise::NoiseModel;
use tire_inference::posterior::SamplingOptions;
use tire_inference::posterior::robust::RobustLikelihood;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

const TRUTH: [f64; 6] = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];

/// With a twentieth of the samples far off.
fn spoilt(count: usize, seed: u64) -> CurveSamples {
    let excitation =
        SyntheticExcitation { samples: count, slip_std: 0.0, seed, ..SyntheticExcitation::default() };
    let mut samples = synthetic_samples(&excitation, 0.5);
    samples.force.iter_mut().skip(seed as usize % 20).step_by(20).for_each(|force| *force += 0.6);
    samples
}

#[test]
fn the_draws_have_the_moments_of_the_likelihood_on_a_grid() {
    let samples = spoilt(300, 3);
    for loss in [Loss::StudentT { freedom: 3.0, scale: 0.04 }, Loss::Huber { threshold: 0.05 }] {
        let mut prior = Prior { centre: TRUTH, ..Prior::longitudinal() };
        prior.free = [true, false, true, false, false, false];
        let robust = RobustLikelihood::new(&samples, loss, 0.05, 1.0);
        let near = robust.gaussian_approximation(&TRUTH, None);
        let found = robust.draw_posterior(&near, &prior, &[TRUTH], &SamplingOptions::default());
        assert!(found.report.is_exact(), "{:?}", found.report);
        let mut sums = [0.0; 5];
        for k in 0..200 * 200 {
            let (B, D) = (13.0 + (k / 200) as f64 * 0.02, 1.45 + (k % 200) as f64 * 0.0005);
            let cost = kernel::curve_cost(&samples, &[B, 2.0, D, 0.8, 0.0, 0.0], loss);
            let reference = kernel::curve_cost(&samples, &TRUTH, loss);
            let weight = ((reference - cost) / loss.cost_divisor(0.05)).exp();
            for (sum, part) in sums.iter_mut().zip([1.0, B, B * B, D, D * D]) {
                *sum += weight * part;
            }
        }
        for (index, at) in [(1, 0), (3, 2)] {
            let expected = sums[index] / sums[0];
            let width = (sums[index + 1] / sums[0] - expected * expected).sqrt();
            let values: Vec<f64> = found.posterior.samples.iter().map(|theta| theta[at]).collect();
            let (error, ratio) = ((mean(&values) - expected) / width, std(&values) / width);
            assert!(error.abs() < 0.06, "{loss:?}: {error}");
            assert!((ratio - 1.0).abs() < 0.05, "{loss:?}: {ratio}");
        }
    }
}

fn found(samples: &CurveSamples, noise: NoiseModel) -> TireIdentification {
    let settings =
        IdentificationSettings { hold: false, ..IdentificationSettings::new(ForceDirection::Longitudinal) };
    let settings = noise.apply_to_settings(settings, samples).expect("fits");
    identify_tire(samples, &settings, &[FitMethod::LeastSquares]).expect("fits")
}

#[test]
fn with_gross_outliers_student_covers_the_truth_where_normal_noise_does_not() {
    let quantities = [Quantity::K, Quantity::Peak, Quantity::PeakSlip];
    let noises = [NoiseModel::Square, NoiseModel::StudentT { freedom: None, scale: None }];
    let hits = noises.map(|noise| {
        let mut hits = [0; 3];
        for seed in 0..8 {
            let answer = found(&spoilt(1000, seed), noise);
            // As many draws as an interval needs, whether or not their share is what counts as exact.
            let effective = answer.report.effective_share * answer.posterior.samples.len() as f64;
            assert!(effective > 500.0, "{:?}", answer.report);
            for (hit, quantity) in hits.iter_mut().zip(quantities) {
                let [low, high] = central_95_percent_interval(answer.posterior.quantity_values(quantity));
                *hit += usize::from((low..=high).contains(&quantity.value(&TRUTH)));
            }
        }
        hits
    });
    let [normal, student] = hits;
    assert!(normal[1] <= 1, "the outliers lift the peak: {normal:?}");
    assert!(student.iter().all(|hits| *hits >= 6), "{student:?}");
}
