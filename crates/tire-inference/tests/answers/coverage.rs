//! How often the published intervals hold the truth, for tires in and outside of the literature's box.

use preparation::direction::ForceDirection;
use tire_inference::bounds::Bounds;
use tire_inference::estimate::identify_tire;
use tire_inference::parameters::Theta;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::verdict::Identifiability;

const SEEDS: u64 = 5;
const TIRES: [Theta; 2] = [[15.0, 2.0, 1.5, 0.8, 0.0, 0.0], [9.0, 1.6, 1.1, -1.2, 0.0, 0.0]];

#[test]
#[ignore = "takes long: coverage of posteriors"]
fn intervals_hold_the_truth_and_the_published_point() {
    assert!(Bounds::GOBLIRSCH.lower[3] > TIRES[1][3], "the second is outside");
    let mut held = [0; 7];
    let mut names = [""; 7];
    for (tire, level) in TIRES.iter().flat_map(|tire| [0.1, 0.75].map(|level| (tire, level))) {
        for seed in 0..SEEDS {
            let force_std = 0.033 * tire[2];
            let excitation = SyntheticExcitation {
                truth: *tire,
                seed,
                samples: 400,
                force_std,
                slip_std: 0.0,
                ..SyntheticExcitation::default()
            };
            let measured = synthetic_samples(&excitation, level);
            let settings = IdentificationSettings::new(ForceDirection::Lateral);
            let answer = identify_tire(&measured, &settings, &[FitMethod::LeastSquares]).expect("a fit");
            for (k, it) in answer.judgements.iter().enumerate() {
                let within = |value: f64| (it.interval[0]..=it.interval[1]).contains(&value);
                held[k] += u32::from(within(it.quantity.value(tire)));
                names[k] = it.quantity.name();
                let published = answer.estimates[0].1.mean[&it.quantity];
                assert!(within(published), "{}: {published} outside of {:?}", names[k], it.interval);
            }
        }
    }
    // Of a chance of 95 %, 15 or fewer of 20 have one of 0.3 %.
    assert!(held.iter().all(|held| *held > 15), "{names:?} {held:?}");
}

/// Seeds whose noise cuts off the posterior of E before the truth: of 200 seeds 27 had B `identified` but for this, 11 of them beside it.
#[test]
fn a_posterior_that_is_narrow_by_luck_identifies_nothing() {
    let answer = |tire: Theta, seed: u64| {
        let excitation = SyntheticExcitation {
            truth: tire,
            seed,
            samples: 1000,
            force_std: 0.033 * tire[2],
            slip_std: 0.0,
            ..SyntheticExcitation::default()
        };
        let settings = IdentificationSettings::new(ForceDirection::Lateral);
        identify_tire(&synthetic_samples(&excitation, 0.25), &settings, &[]).expect("a fit").judgements
    };
    for seed in [34, 37, 79, 187] {
        for it in answer(TIRES[0], seed) {
            let shape = ["B", "C", "E"].contains(&it.quantity.name());
            let expected = if shape { Identifiability::Weak } else { Identifiability::Identified };
            assert_eq!(it.verdict, expected, "{seed}: {}", it.reason);
            assert_eq!(shape, it.reason.contains("twice the noise"), "{seed}: {}", it.reason);
        }
    }
    for it in answer(TIRES[1], 0) {
        assert_eq!(it.verdict, Identifiability::Identified, "{}", it.reason);
    }
}
