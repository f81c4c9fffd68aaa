//! Measures EM: time of a step and of an iteration, evaluations with and without extrapolation.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

mod problem;

use std::time::Instant;

use kalman::{EmEstimate, EmSettings, filter_forward, smooth_recording};

/// Median time of one of `rounds` calls [s].
fn median(rounds: usize, mut call: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..rounds)
        .map(|_| {
            let begun = Instant::now();
            call();
            begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[rounds / 2]
}

fn speed() {
    const STEPS: usize = 10_000;
    let (steps, parameters) = (problem::record(STEPS, 1), problem::truth());
    let per_step = |seconds: f64| 1e6 * seconds / STEPS as f64;
    let filtered = filter_forward(&steps, &parameters).expect("a recording");
    let mut full = parameters;
    full.R[(0, 1)] = 1e-12;
    full.R[(1, 0)] = 1e-12;
    let filter = median(11, || drop(filter_forward(&steps, &parameters)));
    let joint = median(11, || drop(filter_forward(&steps, &full)));
    let smoother = median(11, || drop(smooth_recording(&steps, &filtered)));
    let em = EmSettings { max_evaluations: 20, accelerate: false, tolerance: 0.0, ..EmSettings::default() };
    let iteration = median(5, || drop(em.fit(&steps, &problem::guess()))) / 20.0;
    println!("time per step [us], median, {STEPS} steps of 6 states and 4 measurements");
    println!("  forward, R diagonal         {:6.2}", per_step(filter));
    println!("  forward, R full             {:6.2}", per_step(joint));
    println!("  smoother with lag one       {:6.2}", per_step(smoother));
    println!("  iteration of EM, in all     {:6.2}", per_step(iteration));
}

fn evaluations() {
    let steps = problem::record(5_000, 1);
    let fit = |accelerate| {
        let em = EmSettings { accelerate, max_evaluations: 5000, ..EmSettings::default() };
        em.fit(&steps, &problem::guess()).expect("a recording")
    };
    println!("\nten variances, 5000 steps, Q 30 times too large, R 20 times too small");
    println!("              evaluations  taken back  violations  log-likelihood  status");
    let line = |name: &str, found: &EmEstimate<6, 4>| {
        println!(
            "  {name:<10} {:12} {:11} {:11} {:15.5}  {:?}",
            found.evaluations,
            found.rejected,
            found.violations.len(),
            found.log_likelihood.last().expect("a guess"),
            found.status
        );
    };
    let (plain, ahead) = (fit(false), fit(true));
    line("EM", &plain);
    line("SQUAREM", &ahead);
    let ratio = ahead.evaluations as f64 / plain.evaluations as f64;
    println!("  ratio      {ratio:12.3}");
    let truth = problem::truth();
    let over = ahead.parameters.Q.diagonal().component_div(&truth.Q.diagonal());
    println!("  Q / truth  {:.3?}", over.as_slice());
    let over = ahead.parameters.R.diagonal().component_div(&truth.R.diagonal());
    println!("  R / truth  {:.3?}", over.as_slice());
}

fn main() {
    speed();
    evaluations();
}
