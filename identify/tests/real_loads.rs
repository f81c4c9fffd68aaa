//! Asserts what is said of loads and longitudinal forces of real cars, if the recordings are at hand.

#[path = "../../crates/drive-doctor/tests/support/real_log.rs"]
mod real_log;
#[path = "support/windows.rs"]
mod windows;

use drive_inference::CarUncertainty;
use identify::loads::{Loaded, Loads};
use identify::widening::{braked_otherwise, perturbed};
use preparation::Pipeline;
use windows::Log;

/// What is told with this uncertainty of the car.
fn told(log: &Log, uncertainty: &CarUncertainty) -> Vec<Loaded> {
    let prepare = |pipeline: &Pipeline| pipeline.run(&log.recording).expect("points");
    let begin = std::time::Instant::now();
    let mut loads = Loads::fit(&prepare(&log.pipeline), &log.pipeline);
    println!("one fit and its halves, both axles, with preparation: {:.2?}", begin.elapsed());
    let car = &log.pipeline.car;
    let cars = perturbed(car, uncertainty);
    for (name, cars) in cars.into_iter().chain(braked_otherwise(car)) {
        let ends = cars.map(|car| {
            let pipeline = Pipeline { car, ..log.pipeline.clone() };
            loads.with(&prepare(&pipeline), &pipeline)
        });
        loads.add(name, ends);
    }
    println!("{:.2?}", begin.elapsed());
    let told = loads.told([None; 2]);
    for it in &told {
        let effects = it.effects.as_ref().expect("rows");
        println!(
            "{} {}: load {:.2?}, F_x/F_z {:.2?}",
            log.name, it.axle, effects.load, effects.longitudinal
        );
        for (name, effect) in [("K", &effects.K), ("D", &effects.D), ("mu_x", &effects.mu_x)] {
            println!(
                "    {name}: {:.3} {:.3?}, width {:.2}, halves {:.2?}, {:?}: {}",
                effect.value,
                effect.interval,
                effect.width,
                effect.halves,
                effect.verdict,
                effect.reason
            );
        }
    }
    told
}

#[test]
fn the_250lm_says_what_its_height_leaves_open() {
    let Some(log) = Log::of_250lm() else { return };
    let guessed = CarUncertainty { h: 0.05, ..CarUncertainty::default() };
    told(&log, &CarUncertainty::NONE);
    told(&log, &guessed);
    for name in ["dart_free_fast.csv", "dart_free_moderate.csv"] {
        let log = Log::of_dart(name).expect("the same folder");
        told(&log, &CarUncertainty::NONE);
    }
}
