//! Symmetries of least squares, robust losses, two axles, and whether the covariance is the spread of repeated fits.

use approx::assert_relative_eq;
use numerics::loss::Loss;
use preparation::samples::CurveSamples;
use tire_inference::fit::{CurveFitProblem, FitOptions, joint_least_squares, least_squares};
use tire_inference::parameters::{Normal, Parameter, Theta};
use tire_inference::regularisation::{AxleCoupling, Regularisation};

use super::support::{ALL, TRUTH, sweep};

fn fit(samples: &CurveSamples) -> Theta {
    least_squares(&CurveFitProblem::new(samples), &FitOptions::default()).expect("a fit").theta
}

fn assert_close(a: &Theta, b: &Theta, tolerance: f64) {
    for k in 0..6 {
        assert_relative_eq!(a[k], b[k], epsilon = tolerance, max_relative = tolerance);
    }
}

#[test]
fn without_noise_the_truth_comes_back() {
    let truth: Theta = [18.0, 1.6, 1.2, 0.3, 0.004, 0.02];
    let samples = sweep(&truth, [-0.5, 0.5], 400, 0.0, 0);
    let problem = CurveFitProblem { free: ALL, ..CurveFitProblem::new(&samples) };
    let solution = least_squares(&problem, &FitOptions::default()).expect("a fit");
    assert_close(&solution.theta, &truth, 1e-9);
    assert!(solution.noise_std < 1e-12);
}

#[test]
fn the_order_of_the_samples_does_not_matter() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 7);
    let mut order: Vec<usize> = (0..1000).map(|i| (i * 389) % 1000).collect();
    order.reverse();
    let pick = |column: &[f64]| order.iter().map(|&i| column[i]).collect();
    assert_close(&fit(&CurveSamples::new(pick(&samples.slip), pick(&samples.force))), &fit(&samples), 1e-9);
}

#[test]
fn units_of_slip_and_force_only_scale_the_result() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 7);
    let scaled = |by: f64, column: &[f64]| column.iter().map(|x| by * x).collect();
    let other = CurveSamples::new(scaled(100.0, &samples.slip), scaled(2.0, &samples.force));
    let mut problem = CurveFitProblem::new(&other);
    (problem.bounds.lower[0], problem.bounds.upper[0]) = (0.05, 0.4);
    (problem.bounds.lower[2], problem.bounds.upper[2]) = (0.2, 4.0);
    let mut theta = least_squares(&problem, &FitOptions::default()).expect("a fit").theta;
    (theta[0], theta[2]) = (theta[0] * 100.0, theta[2] / 2.0);
    assert_close(&theta, &fit(&samples), 1e-8);
}

#[test]
fn a_weight_counts_a_sample_as_often() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 500, 0.05, 7);
    let (mut weighted, mut repeated) = (samples.clone(), CurveSamples::default());
    for i in 0..samples.len() {
        weighted.weight[i] = (i % 3) as f64;
        (0..i % 3).for_each(|_| repeated.push(samples.slip[i], samples.force[i], 1.0));
    }
    assert_close(&fit(&weighted), &fit(&repeated), 1e-9);
}

#[test]
fn the_same_seed_gives_the_same_bits_with_any_number_of_threads() {
    let samples = sweep(&TRUTH, [0.0, 0.08], 30_000, 0.05, 7);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            least_squares(&CurveFitProblem::new(&samples), &FitOptions::default()).expect("a fit")
        })
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn robust_losses_ignore_outliers_that_squares_follow() {
    let mut samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.02, 5);
    samples.force.iter_mut().step_by(10).for_each(|f| *f += 1.0);
    let error = |loss: Loss| {
        let problem = CurveFitProblem { loss, ..CurveFitProblem::new(&samples) };
        let solution = least_squares(&problem, &FitOptions::default()).expect("a fit");
        ((solution.theta[2] - TRUTH[2]).abs(), solution.noise_std)
    };
    let (square, _) = error(Loss::Square);
    let (huber, _) = error(Loss::Huber { threshold: 0.03 });
    let (student, noise) = error(Loss::StudentT { freedom: 3.0, scale: 0.02 });
    assert!(square > 0.05 && huber < 0.01 && student < 0.005, "{square} {huber} {student}");
    assert!((0.018..0.025).contains(&noise), "{noise}");
}

#[test]
fn a_prior_decides_what_the_data_leave_open_and_no_more() {
    let samples = sweep(&TRUTH, [0.0, 0.08], 1000, 0.05, 7);
    let with = |weight: f64| {
        let std = [5.0, 0.3, 0.3, 0.5, 1.0, 1.0];
        let towards = Normal::diagonal([14.0, 1.8, 1.3, 0.6, 0.0, 0.0], std);
        let regularisation = vec![Regularisation { towards, weight }];
        least_squares(
            &CurveFitProblem { regularisation, ..CurveFitProblem::new(&samples) },
            &FitOptions::default(),
        )
        .expect("a fit")
        .theta
    };
    assert_close(&with(0.0), &fit(&samples), 1e-7);
    assert_close(&with(1e9), &[14.0, 1.8, 1.3, 0.6, 0.0, 0.0], 1e-4);
    let [b, c, d, e, ..] = with(0.0025);
    // The stiffness is what the data know, E what the prior knows.
    assert!((b * c * d / 45.0 - 1.0).abs() < 0.05 && (e - 0.6).abs() < 0.3);
}

#[test]
fn axles_are_apart_without_coupling_and_one_with_all_of_it() {
    let front = sweep(&TRUTH, [0.0, 0.75], 800, 0.05, 1);
    let rear = sweep(&[18.0, 1.8, 1.4, 0.7, 0.0, 0.0], [0.0, 0.5], 600, 0.05, 2);
    let both =
        CurveSamples::new([&front.slip[..], &rear.slip].concat(), [&front.force[..], &rear.force].concat());
    let problems = [CurveFitProblem::new(&front), CurveFitProblem::new(&rear)];
    let with = |weight: f64| {
        let coupling = AxleCoupling { weight, unit: [10.0, 1.0, 1.0, 1.0, 1.0, 1.0] };
        joint_least_squares([&problems[0], &problems[1]], coupling, &FitOptions::default()).expect("a fit")
    };
    let apart = with(0.0);
    assert_close(&apart[0].theta, &fit(&front), 1e-7);
    assert_close(&apart[1].theta, &fit(&rear), 1e-7);
    let alone = least_squares(&problems[0], &FitOptions::default()).expect("a fit");
    let std = |solution: &tire_inference::fit::FitSolution| {
        solution.parameter_std(Parameter::B).expect("B is free")
    };
    assert_relative_eq!(std(&apart[0]), std(&alone), max_relative = 1e-5);
    let one = with(1e7);
    assert_close(&one[0].theta, &one[1].theta, 1e-5);
    assert_close(&one[0].theta, &fit(&both), 1e-4);
    let between = with(10.0);
    let distance = |pair: &[tire_inference::fit::FitSolution; 2]| (pair[0].theta[0] - pair[1].theta[0]).abs();
    assert!(distance(&one) < distance(&between) && distance(&between) < distance(&apart));
}

#[test]
fn the_covariance_is_the_spread_of_repeated_fits() {
    let repeats = 300;
    let solutions: Vec<_> = (0..repeats)
        .map(|seed| {
            let samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 1000 + seed);
            least_squares(&CurveFitProblem::new(&samples), &FitOptions::from_start(TRUTH)).expect("a fit")
        })
        .collect();
    for (k, parameter) in [Parameter::B, Parameter::C, Parameter::D, Parameter::E].into_iter().enumerate() {
        let mean = solutions.iter().map(|s| s.theta[k]).sum::<f64>() / repeats as f64;
        let spread = (solutions.iter().map(|s| (s.theta[k] - mean).powi(2)).sum::<f64>()
            / (repeats - 1) as f64)
            .sqrt();
        let reported =
            (solutions.iter().filter_map(|s| s.parameter_std(parameter)).map(|s| s * s).sum::<f64>()
                / repeats as f64)
                .sqrt();
        // The standard deviation of a standard deviation of 300 values is 4 %.
        assert!((reported / spread - 1.0).abs() < 0.15, "{parameter:?}: reported {reported}, found {spread}");
    }
}
