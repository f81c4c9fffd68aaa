//! Asserts that effects of load and longitudinal force with known answers are found, that intervals hold them, and that what looks alike
//! is not claimed.

use preparation::samples::CurveSamples;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use crate::parameters::magic_formula_from_theta;

const NOMINAL: f64 = 4000.0;
const SEEDS: u64 = 60;

/// k, d, μ_x.
const TRUTH: [f64; EFFECTS] = [-0.35, -0.22, 1.15];

/// How load and longitudinal force follow the forward acceleration a [g].
struct Axle {
    /// F_z / F_z0 − 1 of acceleration and dynamic pressure, from 0 to 1.
    load: fn(f64, f64) -> f64,
    /// F_x / F_z of acceleration.
    longitudinal: fn(f64) -> f64,
    truth: [f64; EFFECTS],
    /// Curvatures of K and D by load.
    bend: [f64; 2],
    /// Slip angle that is seldom exceeded [rad].
    slip: f64,
}

/// Rear axle of a car with downforce, driven and braked.
const USUAL: Axle = Axle {
    load: |a, air| 0.3 * a + 0.5 * air - 0.25,
    longitudinal: |a| a,
    truth: TRUTH,
    bend: [0.0; 2],
    slip: 0.14,
};

impl Axle {
    /// Five minutes at 25 Hz; noise hangs together over 0.8 s, the road falls to one side, and the slip has an offset.
    fn drive(&self, seed: u64) -> PointTimeSeries {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let phases = [draw(), draw(), draw()].map(|it| 3.0 * it);
        let (fall, late) = (0.02 * draw(), 0.001 * draw());
        let ([k, d, mu_x], [k2, d2]) = (self.truth, self.bend);
        let (mut noise, mut series) = (0.0, PointTimeSeries::default());
        for row in 0..7500 {
            let time = 0.04 * f64::from(row);
            let wave = |omega: f64, phase: usize| (omega * time + phases[phase]).sin();
            let slip = self.slip * wave(0.9, 0) * (0.6 + 0.4 * wave(0.11, 1));
            let a = 0.45 * (wave(0.37, 1) + 0.6 * wave(0.53, 2));
            let air = 0.5 + 0.5 * wave(0.071, 2);
            let (z, force) = ((self.load)(a, air), (self.longitudinal)(a));
            let (K, D) = (20.0 * (1.0 + k * z + k2 * z * z), 1.1 * (1.0 + d * z + d2 * z * z));
            let tire = magic_formula_from_theta(&[K / (1.35 * D), 1.35, D, 0.1, 0.0, 0.0]);
            let rest = (1.0 - (force / mu_x).powi(2)).max(0.0);
            noise = 0.95 * noise + 0.008 * draw();
            series.time.push(time);
            series.samples.slip.push(slip);
            series.samples.force.push(rest.sqrt() * tire.friction_coefficient(slip + late) + fall + noise);
            series.load.push(NOMINAL * (1.0 + z));
            series.other.push(force);
        }
        let CurveSamples { slip, force, .. } = series.samples;
        PointTimeSeries { samples: CurveSamples::new(slip, force), ..series }
    }

    fn told(&self, seed: u64) -> LoadEffects {
        let usual = StretchPrior::default();
        super::AxleLoadFit::fit(&self.drive(seed), NOMINAL, &usual).expect("a curve").judge_effects(&[])
    }
}

fn holds(effect: &LoadEffect, truth: f64) -> bool {
    let [low, high] = effect.interval.map(|end| end.unwrap_or(f64::INFINITY));
    (low..=high).contains(&truth)
}

fn of(told: &LoadEffects) -> [&LoadEffect; EFFECTS] {
    [&told.K, &told.D, &told.mu_x]
}

/// Tires as they usually differ.
fn usual_tire(seed: u64) -> Axle {
    let mut random = Pcg64::seed_from_u64(1000 + seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let square = (1.0 + 0.6 * draw()).max(0.0);
    let truth = [-0.15 + 0.3 * draw(), -0.15 + 0.15 * draw(), square.powf(-0.5)];
    Axle { truth, bend: [0.2 * draw(), 0.2 * draw()], ..USUAL }
}

#[test]
fn intervals_hold_the_truth_in_nineteen_of_twenty_cases() {
    let (mut inside, mut identified) = ([0; EFFECTS], [0; EFFECTS]);
    for seed in 0..SEEDS {
        let axle = usual_tire(seed);
        let told = axle.told(seed);
        for (place, effect) in of(&told).into_iter().enumerate() {
            inside[place] += u64::from(holds(effect, axle.truth[place]));
            identified[place] += u64::from(effect.verdict == Identifiability::Identified);
        }
    }
    println!("inside {inside:?}, identified {identified:?} of {SEEDS}");
    let all: u64 = inside.iter().sum();
    // 95 % of 180 are 171 with a standard deviation of 3.
    assert!(all >= 162 && inside.iter().all(|it| *it >= 52), "{inside:?} of {SEEDS}");
    assert!(identified.iter().all(|it| *it >= 50), "{identified:?} of {SEEDS}");
}

#[test]
fn a_constant_load_tells_nothing_of_loads() {
    let axle = Axle { load: |_, _| 0.0, ..USUAL };
    for seed in 0..5 {
        let told = axle.told(seed);
        for effect in [&told.K, &told.D] {
            assert_eq!(effect.verdict, Identifiability::NotIdentifiable, "{effect:?}");
            assert_eq!(effect.obstacle, Some(LoadEffectObstacle::Still));
            assert!(effect.reason.contains("other loads"), "{}", effect.reason);
        }
        assert_eq!(told.mu_x.verdict, Identifiability::Identified, "{:?}", told.mu_x);
    }
    let axle = Axle { longitudinal: |_| 0.0, ..USUAL };
    let told = axle.told(0);
    assert_eq!(told.mu_x.obstacle, Some(LoadEffectObstacle::Still));
    assert_eq!(told.D.verdict, Identifiability::Identified, "{:?}", told.D);
}

#[test]
fn small_slips_tell_nothing_of_friction_by_load() {
    let told = Axle { slip: 0.015, ..USUAL }.told(1);
    assert_eq!(told.D.verdict, Identifiability::NotIdentifiable, "{:?}", told.D);
    assert_ne!(told.K.verdict, Identifiability::NotIdentifiable, "{:?}", told.K);
}

/// A load that is the square of the longitudinal force: friction by load and the ellipse are the same.
#[test]
fn what_looks_alike_is_not_claimed_twice() {
    let alike = Axle { load: |a, _| a * a, ..USUAL };
    let mut hidden = 0;
    for seed in 0..20 {
        let told = alike.told(seed);
        let sure = |effect: &LoadEffect| effect.verdict != Identifiability::NotIdentifiable;
        assert!(!(sure(&told.mu_x) && sure(&told.D)), "{told:?}");
        hidden += u64::from(told.D.obstacle == Some(LoadEffectObstacle::HiddenByLongitudinalForce));
        assert_ne!(told.mu_x.verdict, Identifiability::Identified, "{:?}", told.mu_x);
        assert_ne!(told.D.verdict, Identifiability::Identified, "{:?}", told.D);
    }
    println!("hidden {hidden} of 20");
}

/// An axle that is only braked: its load grows with its longitudinal force.
#[test]
fn a_braked_axle_keeps_what_it_claims() {
    let front = Axle { load: |a, _| -0.4 * a, longitudinal: |a| a.min(0.0), ..USUAL };
    let (mut inside, mut claims) = ([0; EFFECTS], [0; EFFECTS]);
    for seed in 0..40 {
        let told = front.told(seed);
        for (place, effect) in of(&told).into_iter().enumerate() {
            inside[place] += u64::from(holds(effect, TRUTH[place]));
            claims[place] += u64::from(effect.verdict == Identifiability::Identified);
        }
    }
    println!("braked: inside {inside:?}, claims {claims:?} of 40");
    assert!(inside.iter().all(|it| *it >= 35), "{inside:?} of 40");
}

#[test]
fn halves_that_differ_lower_the_verdict() {
    let mut first = USUAL.drive(3);
    let other = Axle { truth: [0.5, 0.5, 0.8], ..USUAL }.drive(3);
    let middle = first.time.len() / 2;
    first.samples.force[middle..].copy_from_slice(&other.samples.force[middle..]);
    let told = super::AxleLoadFit::fit(&first, NOMINAL, &StretchPrior::default())
        .expect("a curve")
        .judge_effects(&[]);
    for effect in [&told.K, &told.D] {
        assert_ne!(effect.verdict, Identifiability::Identified, "{effect:?}");
        assert_eq!(effect.obstacle, Some(LoadEffectObstacle::HalvesDiffer), "{effect:?}");
    }
}

#[test]
fn what_is_not_known_of_the_car_counts() {
    let axle = super::AxleLoadFit::fit(&USUAL.drive(2), NOMINAL, &StretchPrior::default()).expect("a curve");
    let [k, d, s] = axle.all.load_effects();
    let told = axle.judge_effects(&[("h", [[k, d - 0.1, s], [k, d + 0.1, s]])]);
    assert_eq!(told.D.obstacle, Some(LoadEffectObstacle::Car("h")), "{:?}", told.D);
    assert!(told.D.reason.contains("Measure it"), "{}", told.D.reason);
    assert_eq!(told.K.verdict, Identifiability::Identified);
    let width = |effect: &LoadEffect| effect.interval[1].zip(effect.interval[0]).map(|(a, b)| a - b);
    assert!(width(&told.D) > Some(0.39), "{:?}", told.D);
}

#[test]
fn rows_that_are_no_drive_are_no_axle() {
    let usual = StretchPrior::default();
    let mut still = USUAL.drive(1);
    still.samples.slip.fill(0.01);
    let mut wild = USUAL.drive(1);
    wild.load[7] = f64::NAN;
    let mut infinite = USUAL.drive(1);
    infinite.other[7] = f64::INFINITY;
    let short = USUAL.drive(1).select_rows(&[0, 1, 2]);
    for series in [still, wild, infinite, short, PointTimeSeries::default()] {
        assert!(super::AxleLoadFit::fit(&series, NOMINAL, &usual).is_none());
    }
    let mut one_time = USUAL.drive(1);
    one_time.time.fill(3.0);
    let told = super::AxleLoadFit::fit(&one_time, NOMINAL, &usual).expect("rows").judge_effects(&[]);
    assert!(of(&told).iter().all(|it| it.value.is_finite()), "{told:?}");
}
