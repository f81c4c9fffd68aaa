//! Identifies both axles from simulated closed-loop drives of known tires.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use crate::drive;

use std::sync::LazyLock;

use drive_inference::model_selection::ErrorSelection;
use drive_inference::regression::{RegressionTarget, ResidualWeights};
use drive_inference::smoothing::SmootherOptions;
use drive_inference::tires::to_array;
use drive_inference::validation::{Manoeuvre, compare_tires};
use drive_inference::{
    CarUncertainty, Drive, DriveIdentification, DriveNoise, DriveOptions, ErrorOptions, FitFormulation,
    InputInterpolation, NoiseOption, Tires, identify_tires,
};
use numerics::convergence::OptimisationStatus;
use tire_inference::axles::Axle;
use tire_inference::bounds::Bounds;
use tire_inference::parameters::{Parameter, TireParameters};
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;
use vehicle::SingleTrackCar;

const UNEQUAL: Tires = Tires {
    front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
    rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
};

/// Noises of the nominal car as assumed: EM is for [`prediction_errors_recover_unequal_tires`].
const UNTUNED: SmootherOptions = SmootherOptions { em_passes: 0 };

/// 56 s at two speeds, past the peaks of both axles.
static LIMIT: LazyLock<Drive> = LazyLock::new(|| {
    let car = drive::on_tires(&SingleTrackCar::default(), &UNEQUAL);
    drive::drive(&car, &drive::limit(&[20.0, 35.0], 6.0), &drive::USUAL, 1)
});

/// The same behind actuators with a time constant of 30 ms: no input is held or a line between rows.
static LAGGING: LazyLock<Drive> = LazyLock::new(|| {
    let car = drive::on_tires(&SingleTrackCar::default(), &UNEQUAL);
    let lags = drive::CarEffects { actuator: 0.03, ..drive::CarEffects::default() };
    drive::drive_with_effects(&car, &drive::limit(&[20.0, 35.0], 6.0), &drive::USUAL, 1, lags)
});

fn of(recording: &Drive, options: &DriveOptions) -> DriveIdentification {
    identify_tires(std::slice::from_ref(recording), options, &mut |_, _| true).expect("tires")
}

fn tires(found: &DriveIdentification) -> Tires {
    found.formulations.last().expect("one formulation").tires
}

/// Largest distance of the curves over 0 to 0.3 rad, relative to the peak.
fn curve_error(found: &Tires, axle: Axle) -> f64 {
    let (found, truth) = (found[axle].to_magic_formula(), UNEQUAL[axle].to_magic_formula());
    let off = |k: i32| {
        let slip = 0.003 * f64::from(k);
        (found.friction_coefficient(slip) - truth.friction_coefficient(slip)).abs()
    };
    (0..=100).map(off).fold(0.0, f64::max) / truth.D
}

#[test]
fn inputs_between_rows_are_those_of_the_drive() {
    let causes = ErrorOptions { wanted: ErrorSelection::none(), ..ErrorOptions::default() };
    let options = DriveOptions {
        uncertainty: CarUncertainty::NONE,
        smoothing: UNTUNED,
        posterior: false,
        causes,
        ..DriveOptions::default()
    };
    let held = of(&LIMIT, &options);
    assert_eq!(held.interpolation.delta, InputInterpolation::ZeroOrderHold);
    let lagging = of(&LAGGING, &options);
    let InputInterpolation::FirstOrderLag(time) = lagging.interpolation.delta else {
        panic!("{:?}", lagging.interpolation)
    };
    assert!((0.02..0.045).contains(&time), "{time}");
    let (theta, truth) = (to_array(tires(&lagging)), to_array(UNEQUAL));
    for i in 0..8 {
        let std = lagging.covariance[i][i].sqrt();
        assert!((theta[i] - truth[i]).abs() < 4.0 * std, "{i}: {theta:?} ± {std}");
    }
}

#[test]
fn prediction_errors_recover_unequal_tires() {
    // In a wider box the rear axle's E of 0.9 is so close to its bound that no normal distribution of its logit fits.
    let prior = Prior::lateral().with_bounds(Bounds::GOBLIRSCH);
    let causes = ErrorOptions { wanted: ErrorSelection::none(), ..ErrorOptions::default() };
    let uncertainty = CarUncertainty::NONE;
    let options = DriveOptions { svi: true, prior, causes, uncertainty, ..DriveOptions::default() };
    let found = of(&LIMIT, &options);
    let tires = tires(&found);
    let (theta, truth) = (to_array(tires), to_array(UNEQUAL));
    assert_eq!(found.convergence.status, OptimisationStatus::Converged);
    for i in 0..8 {
        assert!((theta[i] / truth[i] - 1.0).abs() < 0.06, "{theta:?}");
        let std = found.covariance[i][i].sqrt();
        assert!((theta[i] - truth[i]).abs() < 4.0 * std, "{i}: {theta:?} ± {std}");
    }
    for (axle, estimate) in found.estimates.each_ref().into_array().into_iter().enumerate() {
        let posterior = estimate.posterior.as_ref().expect("a posterior");
        assert!(posterior.is_exact() && estimate.source == UncertaintySource::Importance, "{posterior:?}");
        for (i, name) in [Quantity::B, Quantity::C, Quantity::D, Quantity::E].into_iter().enumerate() {
            let index = 4 * axle + i;
            // As much is known as the bound of Cramér and Rao allows, and hardly more or less.
            let ratio = estimate.std[&name] / found.covariance[index][index].sqrt();
            assert!((0.85..1.15).contains(&ratio), "{name}: {ratio}");
            let off = (posterior.mean[&name] - theta[index]) / estimate.std[&name];
            assert!(off.abs() < 0.3, "{name}: {off}");
        }
        // So does a normal distribution in coordinates without bounds, which knows nothing of the draws.
        let svi = estimate.svi.as_ref().expect("variational inference");
        assert!(svi.trusted && svi.diagnosis.k_hat < 0.7, "{svi:?}");
        assert!(svi.status == OptimisationStatus::Converged && svi.elbo_trace.is_sorted(), "{svi:?}");
        for (name, mean) in &posterior.mean {
            let off = (svi.mean[name] - mean) / estimate.std[name];
            let ratio = svi.std[name] / estimate.std[name];
            assert!(off.abs() < 0.2 && (0.85..1.15).contains(&ratio), "{name}: {off} {ratio}");
        }
    }
    for axle in Axle::ALL {
        assert!(curve_error(&tires, axle) < 5e-3, "{tires:?}");
        assert!((tires[axle].stiffness() / UNEQUAL[axle].stiffness() - 1.0).abs() < 5e-3);
    }
    for (sensor, truth) in found.noise.sensor.iter().zip(drive::USUAL) {
        assert!((sensor / truth - 1.0).abs() < 0.05, "{:?}", found.noise);
    }
    let innovations = &found.innovations;
    let share = innovations.cost / innovations.expected_cost;
    assert!((0.9..1.05).contains(&share), "{innovations:?}");
    let series = &found.series[0];
    assert_eq!(series.a_y.len(), LIMIT.len());
    let curves = |tires: &Tires| tires.map(|tire| tire.to_magic_formula()).into_array();
    for manoeuvre in Manoeuvre::ALL {
        let off = compare_tires(manoeuvre, &SingleTrackCar::default(), curves(&tires), curves(&UNEQUAL));
        assert!(off[0] < 0.02 && off[1] < 0.02, "{manoeuvre:?}: {off:?}");
    }
}

#[test]
fn two_recordings_tell_more_than_one() {
    let half = LIMIT.len() / 2;
    let parts = [LIMIT.slice(0..half), LIMIT.slice(half..LIMIT.len())];
    let noises = NoiseOption::Known(DriveNoise::from_sensor_stds(drive::USUAL));
    let options = DriveOptions { noises, smoothing: UNTUNED, ..DriveOptions::default() };
    let std = |recordings: &[Drive]| {
        let found = identify_tires(recordings, &options, &mut |_, _| true).expect("tires");
        found.estimates.map(|estimate| estimate.std[&Quantity::K]).into_array()
    };
    let (one, both) = (std(&parts[..1]), std(&parts));
    assert!(both[0] < one[0] && both[1] < one[1], "{one:?} {both:?}");
}

#[test]
fn slip_far_below_the_peak_is_not_enough() {
    let car = SingleTrackCar::default();
    let recording = drive::drive(&car, &drive::chirp(30.0), &drive::CLEAN, 2);
    let noises = NoiseOption::Known(DriveNoise::from_sensor_stds(drive::CLEAN));
    let options = DriveOptions { noises, smoothing: UNTUNED, profile: true, ..DriveOptions::default() };
    let found = of(&recording, &options);
    for estimate in found.estimates.into_array() {
        for name in [Quantity::B, Quantity::C, Quantity::D, Quantity::E] {
            assert_eq!(estimate.identified[&name], Identifiability::NotIdentifiable, "{name} {estimate:?}");
            let reason = &estimate.reason[&name];
            assert!(reason.contains("slip reached 0.00"), "{reason}");
            assert!(reason.contains("% of the peak slip"), "{reason}");
        }
        assert_eq!(
            estimate.identified[&Quantity::K],
            Identifiability::Identified,
            "{}",
            estimate.reason[&Quantity::K]
        );
        assert!((estimate.mean[&Quantity::K] / 63.36 - 1.0).abs() < 0.02);
    }
}

/// Numbers of a tire that are outside of their intervals, and slips at which its curve is outside of the band.
fn disagreements(found: &DriveIdentification, axle: Axle, tire: &TireParameters) -> Vec<String> {
    let estimate = &found.estimates[axle];
    // Sines of the processor and of the library differ in their last digit.
    let outside = |value: f64, [low, high]: [f64; 2]| !(low - 1e-12..=high + 1e-12).contains(&value);
    let theta = tire.to_theta();
    let parameters = Parameter::ALL[..4].iter().copied().map(Quantity::Parameter);
    let quantities = parameters.chain(Quantity::DERIVED);
    let numbers = quantities.filter(|it| outside(it.value(&theta), estimate.interval[it]));
    let mut list: Vec<String> = numbers.map(|it| it.name().to_owned()).collect();
    let band = estimate.posterior.as_ref().and_then(|it| it.band.as_ref()).expect("a band");
    let ends = band.lower.iter().zip(&band.upper).map(|(low, high)| [*low, *high]);
    let beyond = band.slip.iter().zip(ends);
    let beyond =
        beyond.filter(|(slip, ends)| outside(tire.to_magic_formula().friction_coefficient(**slip), *ends));
    list.extend(beyond.map(|(slip, _)| format!("slip {slip}")));
    list
}

#[test]
fn the_published_tire_is_one_that_its_intervals_and_band_hold() {
    // Too gentle to tell the shape: the best tire is at the end of a ridge.
    let car = drive::on_tires(&SingleTrackCar::default(), &UNEQUAL);
    let noises = NoiseOption::Known(DriveNoise::from_sensor_stds(drive::USUAL));
    let options = DriveOptions { noises, smoothing: UNTUNED, ..DriveOptions::default() };
    let mut rejected = 0;
    for seed in 1..4 {
        let recording = drive::drive(&car, &drive::chirp(20.0), &drive::USUAL, seed);
        let found = of(&recording, &options);
        for axle in Axle::ALL {
            let said = disagreements(&found, axle, &found.tires[axle]);
            assert!(said.is_empty(), "{seed} {axle:?}: {said:?}");
            let mean = &found.estimates[axle].mean;
            assert_eq!((mean[&Quantity::C], mean[&Quantity::K]), {
                let tire = found.tires[axle];
                (tire.C, tire.stiffness())
            });
            let best = found.formulations.last().expect("one").tires[axle];
            rejected += usize::from(!disagreements(&found, axle, &best).is_empty());
        }
    }
    assert!(rejected > 0, "no best tire was one that the posterior rejects: these drives test nothing");
}

#[test]
fn every_formulation_can_be_chosen() {
    let targets = [
        RegressionTarget::SmoothedAcceleration,
        RegressionTarget::Acceleration,
        RegressionTarget::AxleForces,
        RegressionTarget::AccelerationAndYaw,
    ];
    for (target, allowed) in targets.into_iter().zip([0.15, 0.15, 0.15, 0.02]) {
        for weights in [ResidualWeights::Plain, ResidualWeights::Variance { clamp: 0.1 }] {
            let method = FitFormulation::Points(target);
            let options = DriveOptions { method, weights, smoothing: UNTUNED, ..DriveOptions::default() };
            let found = of(&LIMIT, &options);
            let tires = tires(&found);
            let worst = Axle::ALL.map(|axle| curve_error(&tires, axle)).into_iter().fold(0.0, f64::max);
            assert!(worst < allowed, "{target:?} {weights:?}: {worst} {tires:?}");
            assert_eq!(found.formulations.len(), 1);
        }
    }
}

#[test]
fn coupling_draws_the_axles_together_and_odd_terms_are_found_to_be_small() {
    let method = FitFormulation::Points(RegressionTarget::AccelerationAndYaw);
    let free =
        of(&LIMIT, &DriveOptions { method, odd_terms: true, smoothing: UNTUNED, ..DriveOptions::default() });
    let fitted = free.formulations.last().expect("one formulation");
    // The plant has no such terms; at a side-slip of 0.1 rad they may reach some hundredths of m/s².
    assert!(fitted.odd[0].abs() * 0.1 < 0.3, "{:?}", fitted.odd);
    assert!(fitted.odd.iter().all(|factor| *factor != 0.0));
    let smoothing = UNTUNED;
    let tied = DriveOptions { method, axle_coupling: 1e7, smoothing, ..DriveOptions::default() };
    let tied = tires(&of(&LIMIT, &tied));
    for (front, rear) in tied.front.into_array().into_iter().zip(tied.rear.into_array()) {
        assert!((front / rear - 1.0).abs() < 0.02, "{tied:?}");
    }
}
