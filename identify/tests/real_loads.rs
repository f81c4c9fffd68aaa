//! Asserts what is said of loads and longitudinal forces of real cars, if the recordings are at hand.

use crate::windows::Log;
use drive_inference::CarUncertainty;
use identify::loads::{AxleLoadEffects, LoadEffectFits};
use identify::uncertainty_propagation::{cars_with_other_brake_share, perturbed_cars};
use preparation::{PointTimeSeries, PreparationPipeline};
use tire_inference::load::{AxleLoadFit, LoadEffectObstacle};
use tire_inference::local::StretchPrior;
use tire_inference::verdict::Identifiability;

/// What is told with this uncertainty of the car.
fn told(log: &Log, uncertainty: &CarUncertainty) -> Vec<AxleLoadEffects> {
    let prepare = |pipeline: &PreparationPipeline| pipeline.prepare(&log.recording).expect("points");
    let mut loads = LoadEffectFits::fit(&prepare(&log.pipeline), &log.pipeline);
    let car = &log.pipeline.car;
    let cars = perturbed_cars(car, uncertainty);
    for (name, cars) in cars.into_iter().chain(cars_with_other_brake_share(car)) {
        let ends = cars.map(|car| {
            let pipeline = PreparationPipeline { car, ..log.pipeline.clone() };
            loads.refit_with_car(&prepare(&pipeline), &pipeline)
        });
        loads.add_car_uncertainty(name, ends);
    }
    let told = loads.axle_load_effects([None; 2]);
    for it in &told {
        let effects = it.effects.as_ref().expect("rows");
        println!("{} {}: load {:.2?}, F_x/F_z {:.2?}", log.name, it.axle, effects.load, effects.longitudinal);
        for (name, effect) in [("K", &effects.K), ("D", &effects.D), ("mu_x", &effects.mu_x)] {
            println!(
                "    {name}: {:.3} {:.3?}, width {:.2}, halves {:.2?}, {:?}: {}",
                effect.value, effect.interval, effect.width, effect.halves, effect.verdict, effect.reason
            );
        }
    }
    told
}

/// Verdicts of K, D and μ_x.
fn verdicts(told: &AxleLoadEffects) -> [Identifiability; 3] {
    let effects = told.effects.as_ref().expect("rows");
    [&effects.K, &effects.D, &effects.mu_x].map(|it| it.verdict)
}

#[test]
#[ignore = "needs logs of real cars"]
fn the_250lm_tells_its_rear_ellipse_and_no_load_sensitivity() {
    let log = Log::of_250lm().expect("a log of TRACKSIDE_DATA");
    // The height is a guess (scenarios/tires_250lm.toml).
    let told = told(&log, &CarUncertainty { h: 0.05, ..CarUncertainty::default() });
    let [front, rear] = [0, 1].map(|axle| verdicts(&told[axle]));
    assert_eq!(front, [Identifiability::NotIdentifiable; 3]);
    assert_eq!(
        rear,
        [Identifiability::NotIdentifiable, Identifiability::NotIdentifiable, Identifiability::Identified]
    );
    let mu_x = &told[1].effects.as_ref().expect("rows").mu_x;
    assert!(mu_x.value > 1.0 && mu_x.value < 1.2, "{mu_x:?}");
}

/// Effects that are put into the forces of a real axle are found on top of its own.
#[test]
#[ignore = "needs logs of real cars"]
fn what_is_added_to_a_real_axle_is_found() {
    let log = Log::of_250lm().expect("a log of TRACKSIDE_DATA");
    let prepared = log.pipeline.prepare(&log.recording).expect("points");
    let (series, usual) = (&prepared.rear.lateral.series, StretchPrior::default());
    let [_, nominal] = log.pipeline.car.body.static_loads();
    let fit = |series: &PointTimeSeries| AxleLoadFit::fit(series, nominal, &usual).expect("a curve");
    let own = fit(series).judge_effects(&[]);
    let square = own.mu_x.value.powi(-2);
    let mut harder = series.clone();
    for (force, other) in harder.samples.force.iter_mut().zip(&series.other) {
        let rest = |square: f64| (1.0 - square * other * other).max(0.2).sqrt();
        *force *= rest(square + 0.4) / rest(square);
    }
    let found = fit(&harder).judge_effects(&[]).mu_x;
    println!("{:.3} with 0.4 more {:.3}", square, found.value.powi(-2));
    assert!((found.value.powi(-2) - square - 0.4).abs() < 0.08, "{found:?}");
    assert_eq!(found.verdict, Identifiability::Identified, "{found:?}");
    let mut steeper = series.clone();
    for (force, load) in steeper.samples.force.iter_mut().zip(&series.load) {
        *force *= 1.0 - 0.3 * (load / nominal - 1.0);
    }
    let found = fit(&steeper).judge_effects(&[]);
    println!("K {:.3} to {:.3}, D {:.3} to {:.3}", own.K.value, found.K.value, own.D.value, found.D.value);
    // What is usual holds them back.
    for (own, found) in [(&own.K, &found.K), (&own.D, &found.D)] {
        let by = found.value - own.value;
        assert!(by < -0.05 && by > -0.35, "{by}");
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn without_load_transfer_nothing_is_said_of_loads() {
    let mut log = Log::of_250lm().expect("a log of TRACKSIDE_DATA");
    log.pipeline.car.body.h = 0.0;
    for axle in told(&log, &CarUncertainty::NONE) {
        let effects = axle.effects.as_ref().expect("rows");
        for effect in [&effects.K, &effects.D] {
            assert_eq!(effect.obstacle, Some(LoadEffectObstacle::Still), "{effect:?}");
        }
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_car_that_hardly_brakes_tells_nothing() {
    for name in ["dart_free_fast.csv", "dart_free_moderate.csv"] {
        let log = Log::of_dart(name).expect("a log of TRACKSIDE_DATA");
        for axle in told(&log, &CarUncertainty::NONE) {
            assert!(verdicts(&axle).iter().all(|it| *it != Identifiability::Identified), "{axle:?}");
        }
    }
}
