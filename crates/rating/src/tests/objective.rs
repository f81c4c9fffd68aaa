//! Checks ratings of signals by formula against the package objective-rating-metrics 1.3 of TU Graz, and what the standard leaves open.

use std::f64::consts::PI;

use crate::objective::MOST;
use crate::{RatingError, RatingGrade, rate_signal};

struct Pair {
    name: &'static str,
    samples: u32,
    dt: f64,
    reference: fn(f64) -> f64,
    candidate: fn(f64) -> f64,
    /// Corridor, phase, magnitude, slope and overall of the other program.
    scores: [f64; 5],
    /// Samples that the candidate is late.
    late: f64,
    grade: RatingGrade,
}

const PAIRS: [Pair; 7] = [
    Pair {
        name: "a sine that is late and larger",
        samples: 401,
        dt: 0.01,
        reference: |t| (PI * t).sin(),
        candidate: |t| 1.1 * (PI * (t - 0.05)).sin(),
        scores: [0.7011287865772251, 0.9376558603491272, 0.9444218078162453, 0.95, 0.8468670482639646],
        late: 5.0,
        grade: RatingGrade::Good,
    },
    Pair {
        name: "a damped oscillation of another frequency",
        samples: 1001,
        dt: 0.005,
        reference: |t| 5.0 * (-0.5 * t).exp() * (6.0 * t).sin(),
        candidate: |t| 4.5 * (-0.6 * t).exp() * (6.3 * t).sin(),
        scores: [
            0.7198322914068482,
            0.04095904095904104,
            0.3511986120356826,
            0.7157236257919138,
            0.5095091723200669,
        ],
        late: 192.0,
        grade: RatingGrade::Poor,
    },
    Pair {
        name: "an offset and a vibration",
        samples: 501,
        dt: 0.01,
        reference: |t| 2.0 + (3.0 * t).sin(),
        candidate: |t| 2.3 + (3.0 * t).sin() + 0.1 * (40.0 * t).sin(),
        scores: [0.7926510965247056, 1.0, 0.9378168093405911, 0.6356451520429003, 0.8317528308865806],
        late: 0.0,
        grade: RatingGrade::Good,
    },
    Pair {
        name: "steps with lags, which begin with equal costs of the warping",
        samples: 501,
        dt: 0.01,
        reference: |t| 4.0 * (1.0 - (-(t - 1.0).max(0.0) / 0.2).exp()),
        candidate: |t| 4.4 * (1.0 - (-(t - 1.1).max(0.0) / 0.3).exp()),
        scores: [
            0.8213782152134835,
            0.8502994011976048,
            0.8593217722878133,
            0.810815958238128,
            0.8326387124301027,
        ],
        late: 15.0,
        grade: RatingGrade::Good,
    },
    Pair {
        name: "a growing oscillation that is early",
        samples: 301,
        dt: 0.01,
        reference: |t| (2.0 * t).cos() * t,
        candidate: |t| (2.0 * (t + 0.2)).cos() * t,
        scores: [
            0.6800059319308097,
            0.6677740863787376,
            0.9139826729016681,
            0.9407385306760633,
            0.7765014307636178,
        ],
        late: -20.0,
        grade: RatingGrade::Fair,
    },
    Pair {
        name: "the other sign",
        samples: 301,
        dt: 0.01,
        reference: |t| (4.0 * t).sin(),
        candidate: |t| -(4.0 * t).sin(),
        scores: [
            0.06003414349810373,
            0.0033222591362126715,
            0.7844461649939942,
            0.6466825952021403,
            0.31090386126571096,
        ],
        late: 60.0,
        grade: RatingGrade::Poor,
    },
    Pair {
        name: "a pulse at 10 kHz",
        samples: 1001,
        dt: 1e-4,
        reference: |t| 30.0 * (-((t - 0.04) / 0.012).powi(2)).exp(),
        candidate: |t| 27.0 * (-((t - 0.043) / 0.014).powi(2)).exp(),
        scores: [
            0.8596310500761266,
            0.8501498501498501,
            0.9610549594685468,
            0.8742214218969083,
            0.8809376663335118,
        ],
        late: 30.0,
        grade: RatingGrade::Good,
    },
];

fn sampled(of: fn(f64) -> f64, samples: u32, dt: f64) -> Vec<f64> {
    (0..samples).map(|k| of(f64::from(k) * dt)).collect()
}

#[test]
fn scores_are_those_of_another_program() {
    for pair in PAIRS {
        let [reference, candidate] =
            [pair.reference, pair.candidate].map(|of| sampled(of, pair.samples, pair.dt));
        let found = rate_signal(&reference, &candidate, pair.dt).expect(pair.name);
        let scores = [found.corridor, found.phase, found.magnitude, found.slope, found.overall];
        let differ = scores.iter().zip(pair.scores).any(|(a, b)| (a - b).abs() > 1e-9);
        assert!(!differ, "{}: {scores:?} instead of {:?}", pair.name, pair.scores);
        assert_eq!((found.delay / pair.dt).round(), pair.late, "{}", pair.name);
        assert_eq!(found.grade, pair.grade, "{}", pair.name);
    }
}

/// A vibration passes the mean of nine slopes at one rate and not at another. The scores are those of the other program.
#[test]
fn ratings_depend_on_the_rate_of_samples() {
    for (samples, dt, expected) in [(201, 0.01, 0.810175809594031), (2001, 1e-3, 0.7917562437416916)] {
        let reference = sampled(PAIRS[1].reference, samples, dt);
        let candidate = sampled(|t| (PAIRS[1].candidate)(t) + 0.05 * (150.0 * t).sin(), samples, dt);
        let found = rate_signal(&reference, &candidate, dt).expect("a rating").overall;
        assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
    }
}

#[test]
fn a_signal_agrees_with_itself() {
    let signal = sampled(|t| (3.0 * t).sin() + 0.2, 200, 0.02);
    let found = rate_signal(&signal, &signal, 0.02).expect("a rating");
    assert_eq!((found.overall, found.delay, found.grade), (1.0, 0.0, RatingGrade::Excellent));
    assert_eq!([found.corridor, found.phase, found.magnitude, found.slope], [1.0; 4]);
}

#[test]
fn a_unit_of_both_changes_nothing() {
    let [reference, candidate] = [PAIRS[2].reference, PAIRS[2].candidate].map(|of| sampled(of, 300, 0.01));
    let scaled = |values: &[f64]| values.iter().map(|value| -57.3 * value).collect::<Vec<_>>();
    let one = rate_signal(&reference, &candidate, 0.01).expect("a rating");
    let other = rate_signal(&scaled(&reference), &scaled(&candidate), 0.01).expect("a rating");
    assert!((one.overall - other.overall).abs() < 1e-9, "{one:?} {other:?}");
}

#[test]
fn constant_signals_divide_by_zero_and_are_rated() {
    let [zeros, ones] = [vec![0.0; 50], vec![1.0; 50]];
    assert_eq!(rate_signal(&zeros, &zeros, 0.1).expect("a rating").overall, 1.0);
    assert_eq!(rate_signal(&ones, &ones, 0.1).expect("a rating").overall, 1.0);
    // No shift is found, and both are as steep; all the rest is wrong.
    let found = rate_signal(&zeros, &ones, 0.1).expect("a rating");
    assert_eq!([found.corridor, found.phase, found.magnitude, found.slope], [0.0, 1.0, 0.0, 1.0]);
    let ramp = sampled(|t| t, 50, 0.1);
    let found = rate_signal(&zeros, &ramp, 0.1).expect("a rating");
    assert!(found.overall.is_finite() && found.slope == 0.0, "{found:?}");
}

#[test]
fn long_signals_become_means_and_are_rated_as_short_ones() {
    let slow = |samples, dt| {
        let [reference, candidate] =
            [PAIRS[0].reference, PAIRS[0].candidate].map(|of| sampled(of, samples, dt));
        rate_signal(&reference, &candidate, dt).expect("a rating")
    };
    let (short, long) = (slow(2001, 2e-3), slow(40_001, 1e-4));
    assert!(40_001 > 4 * MOST && (short.overall - long.overall).abs() < 2e-3, "{short:?} {long:?}");
    // Whole shifts of five samples each.
    assert!((long.delay - 0.05).abs() < 5.1e-4, "{long:?}");
}

#[test]
fn grades_begin_above_their_thresholds() {
    let grades = [0.941, 0.94, 0.801, 0.8, 0.581, 0.58, 0.0, f64::NAN].map(RatingGrade::from_overall);
    use RatingGrade::{Excellent, Fair, Good, Poor};
    assert_eq!(grades, [Excellent, Good, Good, Fair, Fair, Poor, Poor, Poor]);
    assert_eq!(Good.to_string(), "good");
}

#[test]
fn what_cannot_be_rated_is_refused() {
    let signal = sampled(f64::sin, 50, 0.1);
    let mut broken = signal.clone();
    broken[7] = f64::NAN;
    let not_finite = |what| Err(RatingError::NotFinite { what, index: 7 });
    assert_eq!(rate_signal(&signal, &broken, 0.1), not_finite("the candidate"));
    assert_eq!(rate_signal(&broken, &signal, 0.1), not_finite("the reference"));
    let lengths = RatingError::Lengths { what: "the candidate", reference: 50, found: 49 };
    assert_eq!(rate_signal(&signal, &signal[1..], 0.1), Err(lengths));
    assert_eq!(
        rate_signal(&signal[..10], &signal[..10], 0.1),
        Err(RatingError::Short { least: 11, found: 10 })
    );
    assert!(rate_signal(&signal[..11], &signal[..11], 0.1).is_ok());
    assert!(rate_signal(&[], &[], 0.1).is_err());
}
