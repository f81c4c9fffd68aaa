//! The kernel against dual numbers through the plant's own curve.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use approx::assert_relative_eq;
use num_dual::second_derivative;
use numerics::loss::Loss;
use numerics::scalar::SmoothFunction;
use preparation::samples::CurveSamples;
use proptest::prelude::*;
use tire_inference::fit::CurveFitProblem;
use tire_inference::kernel::{self, ValueAndSlope, curve_derivatives};
use tire_inference::parameters::{Theta, magic_formula_from_theta};

use super::support::{ALL, TRUTH, cost_and_gradient, sweep};

fn thetas() -> impl Strategy<Value = Theta> {
    (5.0..40.0, 1.0..3.0, 0.1..2.0, -1.0..1.0, -0.02..0.02, -0.1..0.1)
        .prop_map(|(B, C, D, E, h, v)| [B, C, D, E, h, v])
}

proptest! {
    #[test]
    fn values_and_gradients_are_those_of_dual_numbers(theta in thetas(), slip in -1.0..1.0) {
        let samples = CurveSamples::new(vec![slip], vec![0.0]);
        let (cost, gradient) = cost_and_gradient(&CurveFitProblem::new(&samples), &theta);
        let (value, by_theta) = kernel::friction_and_gradient(&theta, slip);
        assert_relative_eq!(value, kernel::friction_coefficient(&theta, slip), epsilon = 1e-14);
        assert_relative_eq!(0.5 * value * value, cost, epsilon = 1e-14, max_relative = 1e-13);
        for k in 0..6 {
            assert_relative_eq!(by_theta[k] * value, gradient[k], epsilon = 1e-12, max_relative = 1e-11);
        }
    }

    #[test]
    fn slope_and_curvature_are_those_of_dual_numbers(theta in thetas(), slip in -1.0..1.0) {
        let tire = magic_formula_from_theta(&theta);
        let (value, slope, curvature) = second_derivative(|x| tire.cast().friction_coefficient(x), slip);
        let here = curve_derivatives(&tire, slip);
        assert_relative_eq!(here.value, value, epsilon = 1e-14);
        assert_relative_eq!(here.slope, slope, epsilon = 1e-11, max_relative = 1e-11);
        assert_relative_eq!(here.curvature, curvature, epsilon = 1e-9, max_relative = 1e-10);
    }

    #[test]
    fn value_and_slope_for_filters_are_those_of_dual_numbers(theta in thetas(), slip in -1.0..1.0) {
        let [B, C, D, E, ..] = theta;
        let [(value, value_by), (slope, slope_by)] = ValueAndSlope::values_and_derivatives([slip, B, C, D, E]);
        prop_assert_eq!(ValueAndSlope::values([slip, B, C, D, E]), [value, slope]);
        let expected = |x: [f64; 5]| {
            let [slip, B, C, D, E] = x;
            let tire = magic_formula_from_theta(&[B, C, D, E, 0.0, 0.0]);
            let (value, slope, _) = second_derivative(|x| tire.cast().friction_coefficient(x), slip);
            [value, slope]
        };
        let at = [slip, B, C, D, E];
        let [by_value, by_slope] = expected(at);
        assert_relative_eq!(value, by_value, epsilon = 1e-12);
        assert_relative_eq!(slope, by_slope, epsilon = 1e-11, max_relative = 1e-11);
        for k in 0..5 {
            let moved = |step: f64| {
                let mut x = at;
                x[k] += step;
                expected(x)
            };
            let h = 1e-5 * at[k].abs().max(0.1);
            let (more, less) = (moved(h), moved(-h));
            let by = [0, 1].map(|m| (more[m] - less[m]) / (2.0 * h));
            assert_relative_eq!(value_by[k], by[0], epsilon = 1e-4, max_relative = 1e-4);
            assert_relative_eq!(slope_by[k], by[1], epsilon = 2e-2, max_relative = 1e-3);
        }
    }
}

#[test]
fn a_pass_sums_what_the_samples_give_one_by_one() {
    // Lengths around the ends of blocks and chunks.
    for count in [1, 7, 127, 128, 129, 4096, 4097, 20_000] {
        let mut samples = sweep(&TRUTH, [-0.3, 0.7], count, 0.05, 1);
        samples.weight.iter_mut().enumerate().for_each(|(i, w)| *w = 0.5 + (i % 3) as f64);
        let theta = [12.0, 1.7, 1.4, 0.5, 0.01, -0.02];
        for loss in
            [Loss::Square, Loss::Huber { threshold: 0.06 }, Loss::StudentT { freedom: 4.0, scale: 0.05 }]
        {
            let problem = CurveFitProblem { loss, ..CurveFitProblem::new(&samples) };
            let (cost, gradient) = cost_and_gradient(&problem, &theta);
            let pass = kernel::cost_derivatives(&samples, &theta, &ALL, loss);
            assert_relative_eq!(pass.cost, cost, max_relative = 1e-12);
            assert_relative_eq!(kernel::curve_cost(&samples, &theta, loss), cost, max_relative = 1e-12);
            let rounding = 1e-12 * count as f64;
            for (found, expected) in pass.gradient.iter().zip(gradient) {
                assert_relative_eq!(*found, expected, epsilon = rounding, max_relative = 1e-10);
            }
            let mut hessian = [[0.0; 6]; 6];
            for ((slip, force), weight) in samples.slip.iter().zip(&samples.force).zip(&samples.weight) {
                let (value, by_theta) = kernel::friction_and_gradient(&theta, *slip);
                for (i, row) in hessian.iter_mut().enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        *entry += weight * loss.weight(value - force) * by_theta[i] * by_theta[j];
                    }
                }
            }
            let found = pass.hessian.as_flattened().iter();
            for (found, expected) in found.zip(hessian.as_flattened()) {
                assert_relative_eq!(found, expected, epsilon = 10.0 * rounding, max_relative = 1e-10);
            }
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let samples = sweep(&TRUTH, [-0.3, 0.7], 50_001, 0.05, 2);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            kernel::cost_derivatives(&samples, &[12.0, 1.7, 1.4, 0.5, 0.0, 0.0], &ALL, Loss::Square)
        })
    };
    let one = with(1);
    assert!(one.cost > 0.0);
    assert_eq!(one, with(2));
    assert_eq!(one, with(7));
}
