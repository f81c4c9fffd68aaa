//! Predicts logs of real cars that were not fitted, beside simple models that see the same inputs:
//! `cargo run --release -p drive-prediction --example predicted_logs -- FOLDER`.

#[path = "../tests/support/mod.rs"]
mod support;

use std::slice;
use std::time::Instant;

use drive_prediction::baseline::fit_baseline_models;
use drive_prediction::car::parameters::NAMES;
use drive_prediction::car::{CarPredictor, CarSpecification};
use drive_prediction::score::{open_loop, score_lateral_acceleration};
use drive_prediction::{EvenDrive, MotionPredictor};

fn main() {
    let folder = std::env::args().nth(1).map_or_else(support::folder, Into::into);
    let names = [
        "circles_rubber_left",
        "circles_rubber_right",
        "ramp_rubber_left",
        "ramp_rubber_right",
        "free_moderate",
        "free_fast",
    ];
    let dart: Option<Vec<EvenDrive>> =
        names.into_iter().map(|name| support::dart_in(&folder, name)).collect();
    for held in ["free_fast", "free_moderate"] {
        let Some(dart) = &dart else { break };
        let (judged, fitted): (Vec<EvenDrive>, Vec<EvenDrive>) =
            dart.iter().cloned().partition(|drive| drive.name == held);
        report(&fitted, &judged[0], &support::dart_car(), support::DART_LAG);
    }
    if let Some(drive) = support::lm_in(&folder) {
        let first = drive.motion.t[0];
        let fitted = [drive.restricted_to_interval(first, first + 220.0)];
        report(&fitted, &drive.restricted_to_interval(first + 220.0, f64::INFINITY), &support::lm_car(), 0.0);
    }
}

fn report(fitted: &[EvenDrive], judged: &EvenDrive, car: &CarSpecification, lag: f64) {
    println!("\n{}", judged.name);
    let begin = Instant::now();
    let found = match CarPredictor::fit(fitted, car) {
        Ok(found) => found,
        Err(error) => return println!("{error}"),
    };
    println!("fitted in {:.1} s, noise {:.4?}", begin.elapsed().as_secs_f64(), found.fitted.residual_std);
    let values = found.fitted.parameters.iter().zip(found.fitted.parameter_std);
    for (name, (value, std)) in NAMES.iter().zip(values) {
        print!("{name} {value:.4} ± {std:.4}; ");
    }
    println!("\nworth {:.1?}\n{:.3?}", found.fitted.effective_rollouts, found.bands);
    let mut models = fit_baseline_models(fitted, &car.body, lag);
    models.push(Box::new(CarWithoutPast(found.clone())));
    models.push(Box::new(found));
    println!(
        "| | a_y | inside | v_y 3 s | r | position | spun | inside | 0.6 s v_y | r | position | inside |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    models.iter().for_each(|model| line(model.as_ref(), slice::from_ref(judged)));
}

/// The car without what the log's past says.
struct CarWithoutPast(CarPredictor);

impl MotionPredictor for CarWithoutPast {
    fn name(&self) -> &str {
        "identified, without past"
    }

    fn road_wheel_angles(&self, drive: &EvenDrive) -> Vec<f64> {
        self.0.road_wheel_angles(drive)
    }

    fn simulate_states(
        &self,
        drive: &EvenDrive,
        steering: &[f64],
        start: usize,
        rows: usize,
    ) -> Vec<[f64; 2]> {
        self.0.simulate_states(drive, steering, start, rows)
    }

    fn a_y(&self, drive: &EvenDrive, steering: &[f64], row: usize) -> Option<f64> {
        self.0.a_y(drive, steering, row)
    }
}

fn line(model: &dyn MotionPredictor, judged: &[EvenDrive]) {
    let share = |it: Option<f64>| it.map_or(String::new(), |it| format!("{it:.3}"));
    let a_y = score_lateral_acceleration(model, judged);
    print!(
        "| {} | {} | {} ",
        model.name(),
        share(a_y.map(|it| it.rmse)),
        share(a_y.and_then(|it| it.coverage))
    );
    for horizon in [3.0, 0.6] {
        let Some(score) = open_loop(model, judged, horizon) else { continue };
        print!("| {:.4} | {:.4} | {:.3} ", score.v_y, score.r, score.position);
        if horizon > 1.0 {
            print!("| {:.3} ", score.spun);
        }
        let inside = score.coverage.map(|it| format!("{:.3} {:.3}", it[0], it[1]));
        print!("| {} ", inside.unwrap_or_default());
    }
    println!("|");
}
