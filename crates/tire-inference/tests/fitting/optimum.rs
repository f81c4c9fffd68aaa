//! Every fitter on every problem of one table, judged by conditions of optimality that dual numbers give.

use approx::assert_relative_eq;
use numerics::convergence::OptimisationStatus;
use numerics::loss::Loss;
use preparation::samples::CurveSamples;
use tire_inference::bounds::Bounds;
use tire_inference::fit::{CurveConstraints, CurveFitProblem, FitOptions, least_squares, nelder_mead};
use tire_inference::parameters::{Normal, Parameter, Theta, magic_formula_from_theta};
use tire_inference::regularisation::Regularisation;

use super::support::{ALL, TRUTH, cost_and_gradient, slope, sweep};

struct Case {
    name: &'static str,
    samples: CurveSamples,
    change: fn(&mut CurveFitProblem),
    at_bound: &'static [Parameter],
    /// Whether a simplex without derivatives can be expected to find the optimum.
    easy: bool,
}

fn plain(name: &'static str, range: [f64; 2], easy: bool) -> Case {
    Case { name, samples: sweep(&TRUTH, range, 1000, 0.05, 7), change: |_| {}, at_bound: &[], easy }
}

fn cases() -> Vec<Case> {
    let shifted: Theta = [15.0, 2.0, 1.5, 0.8, 0.006, -0.03];
    let two_sided = sweep(&shifted, [-0.5, 0.6], 1000, 0.05, 3);
    let mut outliers = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 5);
    outliers.force.iter_mut().step_by(20).for_each(|f| *f += 1.0);
    vec![
        Case { at_bound: &[Parameter::E], ..plain("8 %", [0.0, 0.08], false) },
        plain("30 %", [0.0, 0.3], false),
        plain("75 %", [0.0, 0.75], true),
        plain("two sides", [-0.4, 0.4], false),
        Case {
            name: "shifts",
            samples: two_sided.clone(),
            change: |p| p.free = ALL,
            at_bound: &[],
            easy: false,
        },
        Case {
            name: "at a bound",
            change: |p| (p.bounds.upper[2], p.bounds.lower[1]) = (1.4, 2.1),
            at_bound: &[Parameter::C, Parameter::D],
            ..plain("", [0.0, 0.75], true)
        },
        Case { name: "flat ridge", at_bound: &[Parameter::C, Parameter::D], ..plain("", [0.0, 0.02], false) },
        Case {
            name: "first parameter held",
            change: |p| (p.free[0], p.held[0]) = (false, 15.0),
            ..plain("", [0.0, 0.75], true)
        },
        Case {
            name: "prior",
            change: |p| {
                let std = [5.0, 0.2, 0.5, 0.1, 1.0, 1.0];
                let towards = Normal::diagonal([12.0, 1.5, 1.0, 0.3, 0.0, 0.0], std);
                p.regularisation = vec![Regularisation { towards, weight: 0.0025 }];
            },
            ..plain("", [0.0, 0.08], false)
        },
        Case {
            name: "Huber",
            samples: outliers.clone(),
            change: |p| p.loss = Loss::Huber { threshold: 0.07 },
            at_bound: &[],
            easy: true,
        },
        Case {
            name: "Student",
            samples: outliers,
            change: |p| p.loss = Loss::StudentT { freedom: 4.0, scale: 0.05 },
            at_bound: &[],
            easy: true,
        },
    ]
}

#[test]
fn least_squares_ends_where_the_conditions_of_optimality_hold() {
    for case in cases() {
        let mut problem =
            CurveFitProblem { bounds: Bounds::GOBLIRSCH, ..CurveFitProblem::new(&case.samples) };
        (case.change)(&mut problem);
        let solution = least_squares(&problem, &FitOptions::default()).expect(case.name);
        assert_eq!(solution.convergence.status, OptimisationStatus::Converged, "{}", case.name);
        assert!(solution.convergence.kkt_residual.is_some_and(|k| k <= 1e-8), "{}", case.name);
        assert_eq!(solution.at_bound, case.at_bound, "{}: {:?}", case.name, solution.theta);
        let slope = slope(&problem, &solution.theta);
        assert!(slope <= 1e-8, "{}: slope {slope:e}", case.name);
        let (cost, _) = cost_and_gradient(&problem, &solution.theta);
        assert_relative_eq!(solution.cost, cost, max_relative = 1e-12);
        assert!(
            solution.optima.iter().all(|(_, other)| *other >= solution.cost * (1.0 - 1e-12)),
            "{}",
            case.name
        );
    }
}

#[test]
fn nelder_mead_finds_the_same_where_it_can_and_never_anything_better() {
    for case in cases() {
        let mut problem =
            CurveFitProblem { bounds: Bounds::GOBLIRSCH, ..CurveFitProblem::new(&case.samples) };
        (case.change)(&mut problem);
        // On a bound on purpose: a simplex that is clipped there has no extent in E.
        let start = FitOptions::from_start([10.0, 1.65, 1.5, -1.0, 0.0, 0.0]);
        let simplex = nelder_mead::fit_nelder_mead(&problem, &start).expect(case.name);
        let best = least_squares(&problem, &FitOptions::default()).expect(case.name);
        assert!(
            simplex.cost >= best.cost * (1.0 - 1e-9),
            "{}: {} below {}",
            case.name,
            simplex.cost,
            best.cost
        );
        assert_eq!(simplex.convergence.status, OptimisationStatus::Converged, "{}", case.name);
        for k in (0..6).filter(|&k| !problem.free[k]) {
            assert_eq!(simplex.theta[k], problem.held[k], "{}", case.name);
        }
        if case.easy {
            let (found, cost) = (simplex.cost, best.cost);
            assert!(found <= cost * (1.0 + 1e-8), "{}: {found} above {cost}", case.name);
            assert_eq!(simplex.at_bound, best.at_bound, "{}", case.name);
        }
    }
}

#[test]
fn an_active_stiffness_limit_is_met_exactly_and_costs_least() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 7);
    for (limits, expected) in [([50.0, 60.0], 50.0), ([30.0, 40.0], 40.0)] {
        let constraints = CurveConstraints { stiffness: Some(limits), peak_slip: None };
        let problem = CurveFitProblem { constraints, ..CurveFitProblem::new(&samples) };
        let solution = least_squares(&problem, &FitOptions::default()).expect("a fit");
        let [b, c, d, ..] = solution.theta;
        assert_relative_eq!(b * c * d, expected, max_relative = 1e-14);
        assert_eq!(solution.convergence.status, OptimisationStatus::Converged);
        // Along the constraint, ln B + ln C + ln D = const, the slopes of the cost by the logarithms are equal; E is free.
        let (cost, g) = cost_and_gradient(&problem, &solution.theta);
        let pull = [g[0] * b, g[1] * c, g[2] * d];
        let noise = 1e-7 * pull[0].abs();
        assert!(
            (pull[0] - pull[1]).abs() < noise
                && (pull[0] - pull[2]).abs() < noise
                && g[3].abs() < 1e-5 * cost
        );
        // Outwards it would fall: the limit is what holds it.
        assert_eq!(pull[0] > 0.0, expected == 50.0);
        assert!(solution.covariance[(0, 0)] > 0.0);
        let log = nalgebra::Vector4::new(1.0 / b, 1.0 / c, 1.0 / d, 0.0);
        let spread = log.dot(&(&solution.covariance * log)).abs().sqrt();
        assert!(spread < 1e-6, "the stiffness is certain, found {spread}");
    }
}

#[test]
fn a_limit_that_the_optimum_meets_anyway_changes_nothing() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 7);
    let free = least_squares(&CurveFitProblem::new(&samples), &FitOptions::default()).expect("a fit");
    let constraints = CurveConstraints { stiffness: Some([30.0, 60.0]), peak_slip: Some([0.01, 0.3]) };
    let held = least_squares(
        &CurveFitProblem { constraints, ..CurveFitProblem::new(&samples) },
        &FitOptions::default(),
    )
    .expect("a fit");
    for k in 0..4 {
        assert_relative_eq!(free.theta[k], held.theta[k], max_relative = 1e-8);
    }
}

#[test]
fn the_peak_stays_where_the_constraint_wants_it() {
    let samples = sweep(&TRUTH, [0.0, 0.75], 1000, 0.05, 7);
    for (limits, expected) in [([0.12, 0.2], 0.12), ([0.0, 0.07], 0.07), ([0.12, f64::INFINITY], 0.12)] {
        let constraints = CurveConstraints { stiffness: None, peak_slip: Some(limits) };
        let problem = CurveFitProblem { constraints, ..CurveFitProblem::new(&samples) };
        let solution = least_squares(&problem, &FitOptions::default()).expect("a fit");
        let peak = magic_formula_from_theta(&solution.theta).peak_slip().expect("a peak");
        assert_relative_eq!(peak, expected, max_relative = 1e-8);
        assert_eq!(
            solution.convergence.status,
            OptimisationStatus::Converged,
            "{limits:?} {:?}",
            solution.convergence
        );
        // D is not in the constraint: the cost must be flat in it.
        let (_, gradient) = cost_and_gradient(&problem, &solution.theta);
        assert!(gradient[2].abs() < 1e-6, "{gradient:?}");
    }
}

#[test]
fn several_starts_find_what_a_single_one_misses() {
    let samples = sweep(&TRUTH, [0.0, 0.3], 1000, 0.05, 7);
    let problem = CurveFitProblem::new(&samples);
    let many = least_squares(&problem, &FitOptions { starts: 64, ..FitOptions::default() }).expect("a fit");
    let usual = least_squares(&problem, &FitOptions::default()).expect("a fit");
    assert_relative_eq!(usual.cost, many.cost, max_relative = 1e-10);
    assert!(usual.convergence.optima >= 1 && usual.optima.len() == usual.convergence.optima);
}
