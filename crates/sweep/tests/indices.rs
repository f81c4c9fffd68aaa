//! Tests Sobol's indices on functions whose indices are known.

use std::f64::consts::PI;

use sweep::design::{DesignAxis, DesignMethod, ExperimentDesign};
use sweep::distribution::Distribution;
use sweep::statistics::{Estimate, SobolIndices, sobol_indices};

/// Values of a function of uniform numbers in the order of a Saltelli design.
fn values(low: f64, high: f64, axes: usize, blocks: u64, f: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let axis =
        |index| DesignAxis { name: format!("x{index}"), distribution: Distribution::Uniform { low, high } };
    let design = ExperimentDesign {
        method: DesignMethod::Saltelli,
        axes: (0..axes).map(axis).collect(),
        variants: blocks * (axes as u64 + 2),
        seed: 3,
        correlations: Vec::new(),
    };
    let points = design.design_points().expect("a design");
    (0..points.point_count()).map(|index| f(&points.point(index))).collect()
}

fn ishigami(x: &[f64]) -> f64 {
    x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
}

fn agree(found: &[Estimate], expected: &[f64], near: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found.value - expected).abs() < near, "{found:?} {expected}");
        let [low, high] = found.interval;
        assert!(low <= found.value && found.value <= high && high - low < 0.3, "{found:?}");
    }
}

/// Of Ishigami and Homma (1990) with a = 7, b = 0.1: first, total.
fn known() -> [[f64; 3]; 2] {
    let (a, b) = (7.0, 0.1);
    let one = 0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2);
    let two = a * a / 8.0;
    let both = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
    let all = one + two + both;
    [[one / all, two / all, 0.0], [(one + both) / all, two / all, both / all]]
}

#[test]
fn indices_of_ishigami_are_found() {
    let values = values(-PI, PI, 3, 4096, ishigami);
    let SobolIndices { first, total, blocks, left_out } = sobol_indices(&values, 3, 1).expect("it changes");
    agree(&first, &known()[0], 0.01);
    agree(&total, &known()[1], 0.01);
    assert_eq!((blocks, left_out), (4096, 0));
}

#[test]
fn indices_of_the_g_function_are_found() {
    let a = [0.0, 1.0, 4.5, 9.0, 99.0];
    let g = |x: &[f64]| -> f64 {
        x.iter().zip(a).map(|(x, a)| ((4.0 * x - 2.0).abs() + a) / (1.0 + a)).product()
    };
    let parts = a.map(|a| 1.0 / (3.0 * (1.0 + a) * (1.0 + a)));
    let all = parts.iter().map(|part| 1.0 + part).product::<f64>() - 1.0;
    let first = parts.map(|part| part / all);
    let total = parts.map(|part| part * (all + 1.0) / (1.0 + part) / all);
    // Far from 0, where products of values that are not centred lose their digits.
    let values = values(0.0, 1.0, 5, 4096, |x| 1e4 + g(x));
    let found = sobol_indices(&values, 5, 1).expect("it changes");
    agree(&found.first, &first, 0.01);
    agree(&found.total, &total, 0.01);
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let (mut inside, mut of) = (0, 0);
    let few = values(-PI, PI, 3, 256 * 64, ishigami);
    for part in few.chunks(256 * 5) {
        let found = sobol_indices(part, 3, 9).expect("it changes");
        for (found, known) in [found.first, found.total].iter().zip(known()) {
            for (found, known) in found.iter().zip(known) {
                of += 1;
                inside += usize::from(found.interval[0] <= known && known <= found.interval[1]);
            }
        }
    }
    // Points that are spread evenly are better than the random ones that the intervals take them for.
    assert!(inside as f64 > 0.93 * of as f64, "{inside} of {of}");
}

#[test]
fn blocks_with_a_missing_result_are_left_out_and_told() {
    let mut values = values(-PI, PI, 3, 1024, ishigami);
    for block in (0..1024).step_by(10) {
        values[5 * block + block % 5] = f64::NAN;
    }
    let found = sobol_indices(&values, 3, 1).expect("it changes");
    assert_eq!((found.blocks, found.left_out), (921, 103));
    agree(&found.total, &known()[1], 0.05);
    // The last block of a sweep that is not over.
    values.truncate(5 * 1024 - 2);
    assert_eq!(sobol_indices(&values, 3, 1).expect("it changes").left_out, 104);
}

#[test]
fn what_never_changes_has_no_indices_and_the_same_seed_gives_the_same_intervals() {
    assert_eq!(sobol_indices(&[0.1; 50], 3, 1), None);
    assert_eq!(sobol_indices(&[], 3, 1), None);
    assert_eq!(sobol_indices(&[1.0, 2.0, 3.0, 4.0, 5.0], 3, 1), None);
    let values = values(-PI, PI, 3, 64, ishigami);
    assert_eq!(sobol_indices(&values, 3, 1), sobol_indices(&values, 3, 1));
    assert_ne!(sobol_indices(&values, 3, 1), sobol_indices(&values, 3, 2));
}
