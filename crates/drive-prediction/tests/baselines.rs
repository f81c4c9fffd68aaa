//! The baselines are those of an independent program on logs of real cars.

use crate::support;

use std::slice;

use drive_prediction::baseline::fit_baseline_models;
use drive_prediction::score::{LateralScore, RolloutScore, open_loop, score_lateral_acceleration};
use drive_prediction::{EvenDrive, MotionPredictor};

fn named<'a>(models: &'a [Box<dyn MotionPredictor>], name: &str) -> &'a dyn MotionPredictor {
    models.iter().find(|model| model.name() == name).expect("there is such a baseline").as_ref()
}

fn scores(model: &dyn MotionPredictor, drive: &EvenDrive) -> (LateralScore, RolloutScore) {
    let a_y = score_lateral_acceleration(model, slice::from_ref(drive)).expect("rows count");
    (a_y, open_loop(model, slice::from_ref(drive), 3.0).expect("stretches are long enough"))
}

/// Two digits, as the sheet has them.
fn near(found: f64, sheet: f64, name: &str) {
    assert!((found / sheet - 1.0).abs() < 0.03, "{name}: {found}, not {sheet}");
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_small_car_that_drives_fast() {
    let names = ["circles_rubber_left", "circles_rubber_right", "ramp_rubber_left", "ramp_rubber_right"];
    let fitted: Option<Vec<EvenDrive>> =
        names.into_iter().chain(["free_moderate"]).map(support::dart).collect();
    let fitted = fitted.expect("logs of TRACKSIDE_DATA");
    let judged = support::dart("free_fast").expect("a log of TRACKSIDE_DATA");
    let models = fit_baseline_models(&fitted, &support::dart_body(), support::DART_LAG);
    let persistence =
        open_loop(named(&models, "persistence"), slice::from_ref(&judged), 3.0).expect("it is long");
    near(persistence.v_y, 0.143, "v_y of persistence");
    near(persistence.r, 3.50, "r of persistence");
    near(persistence.position, 4.74, "position of persistence");
    let kinematic =
        open_loop(named(&models, "kinematic"), slice::from_ref(&judged), 0.6).expect("it is long");
    near(kinematic.r, 1.29, "r of kinematic");
    let (a_y, ahead) = scores(named(&models, "linear"), &judged);
    near(a_y.rmse, 1.88, "a_y of linear");
    near(ahead.r, 0.33, "r of linear");
    near(ahead.position, 0.81, "position of linear");
    let (a_y, _) = scores(named(&models, "least squares"), &judged);
    near(a_y.rmse, 0.70, "a_y of least squares");
    near(a_y.coverage.expect("it has a band"), 0.90, "coverage of least squares");
}

#[test]
#[ignore = "needs logs of real cars"]
fn a_race_car_of_1964() {
    let drive = support::lm().expect("a log of TRACKSIDE_DATA");
    let first = drive.motion.t[0];
    let fitted = [drive.restricted_to_interval(first, first + 220.0)];
    let judged = drive.restricted_to_interval(first + 220.0, f64::INFINITY);
    let models = fit_baseline_models(&fitted, &support::lm_body(), 0.0);
    let persistence =
        open_loop(named(&models, "persistence"), slice::from_ref(&judged), 3.0).expect("it is long");
    assert_eq!(persistence.count, 213);
    near(persistence.position, 12.4, "position of persistence");
    let (a_y, ahead) = scores(named(&models, "linear"), &judged);
    near(a_y.rmse, 1.13, "a_y of linear");
    near(ahead.v_y, 0.195, "v_y of linear");
    let (a_y, ahead) = scores(named(&models, "least squares"), &judged);
    near(a_y.rmse, 0.40, "a_y of least squares");
    near(a_y.coverage.expect("it has a band"), 0.99, "coverage of least squares");
    assert!((ahead.spun - 1.0 / 213.0).abs() < 1e-9, "{}", ahead.spun);
}
