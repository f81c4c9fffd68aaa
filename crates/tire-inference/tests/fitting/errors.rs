//! Problems without a fit, and the messages about them.

use numerics::loss::Loss;
use preparation::samples::CurveSamples;
use tire_inference::bounds::Bounds;
use tire_inference::fit::{
    CurveConstraints, CurveFitProblem, FitError, FitOptions, SlipNoise, least_squares,
};

use super::support::{TRUTH, sweep};

fn error(samples: &CurveSamples, change: impl Fn(&mut CurveFitProblem)) -> FitError {
    let mut problem = CurveFitProblem::new(samples);
    change(&mut problem);
    least_squares(&problem, &FitOptions::default()).expect_err("an error")
}

#[test]
fn samples_that_make_no_fit_are_refused_with_a_way_out() {
    let good = sweep(&TRUTH, [0.0, 0.75], 100, 0.05, 1);
    let message_of = |samples: &CurveSamples| error(samples, |_| {}).to_string();
    assert!(message_of(&CurveSamples::default()).contains("no samples"));
    let few = sweep(&TRUTH, [0.0, 0.75], 4, 0.05, 1);
    let message = message_of(&few);
    assert!(
        message.contains("4 samples") && message.contains("at least 5") && message.contains("hold"),
        "{message}"
    );
    let mut none = good.clone();
    none.weight.fill(0.0);
    assert_eq!(error(&none, |_| {}), FitError::TooFew { found: 0, free: 4 });
    let mut broken = good.clone();
    broken.force[17] = f64::NAN;
    let message = message_of(&broken);
    assert!(message.contains("force[17]") && message.contains("remove"), "{message}");
    let mut negative = good.clone();
    negative.weight[3] = -1.0;
    assert_eq!(error(&negative, |_| {}), FitError::Weight { row: 3, value: -1.0 });
    let same = CurveSamples::new(vec![0.03; 50], good.force[..50].to_vec());
    assert!(message_of(&same).contains("0.03") && message_of(&same).contains("other slips"));
    let mut short = good;
    short.weight.pop();
    assert!(matches!(error(&short, |_| {}), FitError::Columns { weight: 99, .. }));
}

#[test]
fn settings_that_make_no_sense_are_named() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 100, 0.05, 1);
    assert!(matches!(error(&samples, |p| p.bounds.lower[2] = 0.0), FitError::Bounds { name: "D", .. }));
    assert!(matches!(error(&samples, |p| p.bounds.lower[3] = 2.0), FitError::Bounds { name: "E", .. }));
    assert!(matches!(
        error(&samples, |p| (p.free[1], p.held[1]) = (false, 0.0)),
        FitError::Held { name: "C", .. }
    ));
    assert_eq!(error(&samples, |p| p.free = [false; 6]), FitError::NothingFree);
    let setting = |change: fn(&mut CurveFitProblem)| match error(&samples, change) {
        FitError::Setting { setting, .. } => setting,
        other => panic!("{other}"),
    };
    assert_eq!(setting(|p| p.loss = Loss::Huber { threshold: 0.0 }), "loss");
    assert_eq!(setting(|p| p.constraints.stiffness = Some([60.0, 50.0])), "constraints.stiffness");
    assert_eq!(setting(|p| p.constraints.peak_slip = Some([0.2, 0.1])), "constraints.peak_slip");
    assert_eq!(setting(|p| p.slip_noise = Some(SlipNoise::new(-1.0))), "slip_noise.std");
}

#[test]
fn constraints_against_the_bounds_are_found_out() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 100, 0.05, 1);
    let constraints = CurveConstraints { stiffness: Some([500.0, 600.0]), peak_slip: None };
    let found = error(&samples, |p| (p.constraints, p.bounds) = (constraints, Bounds::GOBLIRSCH));
    // The box reaches B C D = 240.
    let FitError::Infeasible { violation } = found else { panic!("{found}") };
    assert!((violation - (500.0_f64 / 240.0).ln()).abs() < 1e-6, "{violation}");
}
