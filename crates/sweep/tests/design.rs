//! Tests that designs spread their points as they say, and refuse what they cannot do.

use sweep::design::{AxisCorrelation, DesignAxis, DesignMethod, ExperimentDesign};
use sweep::distribution::Distribution;

fn axes(distributions: &[Distribution]) -> Vec<DesignAxis> {
    let named = |(index, it): (usize, &Distribution)| DesignAxis {
        name: format!("plant.p{index}"),
        distribution: it.clone(),
    };
    distributions.iter().enumerate().map(named).collect()
}

fn design(method: DesignMethod, variants: u64, distributions: &[Distribution]) -> ExperimentDesign {
    ExperimentDesign { method, axes: axes(distributions), variants, seed: 7, correlations: Vec::new() }
}

fn all(design: &ExperimentDesign) -> Vec<Vec<f64>> {
    let points = design.design_points().expect("a design");
    (0..points.point_count()).map(|index| points.point(index)).collect()
}

fn unit(count: usize) -> Vec<Distribution> {
    vec![Distribution::Uniform { low: 0.0, high: 1.0 }; count]
}

fn refused(design: &ExperimentDesign) -> String {
    design.design_points().expect_err("no design").to_string()
}

/// The discrepancy of Warnock's formula, L2 about the origin, squared.
fn discrepancy(points: &[Vec<f64>]) -> f64 {
    let (count, dimensions) = (points.len() as f64, points[0].len() as i32);
    let single: f64 = points.iter().map(|x| x.iter().map(|x| (1.0 - x * x) / 2.0).product::<f64>()).sum();
    let pairs = points.iter().flat_map(|x| points.iter().map(move |y| (x, y)));
    let double: f64 =
        pairs.map(|(x, y)| x.iter().zip(y).map(|(x, y)| 1.0 - x.max(*y)).product::<f64>()).sum();
    3.0_f64.powi(-dimensions) - 2.0 / count * single + double / (count * count)
}

#[test]
fn a_grid_is_the_product_of_its_levels_with_the_last_axis_fastest() {
    let points = all(&design(DesignMethod::Grid, 0, &[Distribution::Values(2), Distribution::Values(3)]));
    let expected = [[0., 0.], [0., 1.], [0., 2.], [1., 0.], [1., 1.], [1., 2.]];
    assert_eq!(points, expected.map(Vec::from));
    let error = refused(&design(DesignMethod::Grid, 0, &unit(1)));
    assert!(error.contains("`plant.p0`: expected a list of values"), "{error}");
    let error = refused(&design(DesignMethod::Grid, 0, &vec![Distribution::Values(1000); 9]));
    assert!(error.contains("expected at most 4294967296 variants"), "{error}");
}

#[test]
fn corners_are_the_ends_of_all_axes() {
    let three = [
        Distribution::Uniform { low: -1.0, high: 2.0 },
        Distribution::Values(1),
        Distribution::Truncated { mean: 0.0, std: 1.0, low: 3.0, high: 4.0 },
    ];
    let points = all(&design(DesignMethod::Corners, 0, &three));
    let expected = [[-1., 0., 3.], [-1., 0., 4.], [2., 0., 3.], [2., 0., 4.]];
    assert_eq!(points, expected.map(Vec::from));
    assert_eq!(all(&design(DesignMethod::Corners, 0, &unit(20))).len(), 1 << 20);
    assert!(refused(&design(DesignMethod::Corners, 0, &unit(21))).contains("at most 1048576"));
    let endless = [Distribution::Normal { mean: 0.0, std: 1.0 }];
    let error = refused(&design(DesignMethod::Corners, 0, &endless));
    assert!(error.contains("`plant.p0`: expected two ends"), "{error}");
}

#[test]
fn each_share_of_each_axis_of_a_latin_hypercube_has_one_variant() {
    for count in [1, 2, 10, 1000] {
        let points = all(&design(DesignMethod::LatinHypercube, count, &unit(5)));
        for axis in 0..5 {
            let mut shares: Vec<u64> =
                points.iter().map(|point| (point[axis] * count as f64) as u64).collect();
            shares.sort_unstable();
            assert!(shares.into_iter().eq(0..count), "axis {axis} of {count}");
        }
    }
    // Lists are taken evenly.
    let points = all(&design(DesignMethod::LatinHypercube, 300, &[Distribution::Values(3)]));
    for level in 0..3 {
        assert_eq!(points.iter().filter(|point| point[0] == f64::from(level)).count(), 100);
    }
}

#[test]
fn sobol_points_have_a_lower_discrepancy_than_random_ones() {
    for dimensions in [2, 5, 8] {
        let of = |method| discrepancy(&all(&design(method, 1024, &unit(dimensions))));
        let [sobol, latin, random] =
            [DesignMethod::Sobol, DesignMethod::LatinHypercube, DesignMethod::MonteCarlo].map(of);
        assert!(sobol < 0.6 * random && latin < random, "{dimensions}: {sobol} {latin} {random}");
    }
}

#[test]
fn moments_are_those_of_the_distributions() {
    let normal = Distribution::Normal { mean: 3.0, std: 2.0 };
    let wide = Distribution::LogNormal { median: 1.0, std_log: 0.5 };
    let half = Distribution::Truncated { mean: 0.0, std: 1.0, low: 0.0, high: f64::INFINITY };
    let four = [normal, wide, half, Distribution::Uniform { low: 1.0, high: 2.0 }];
    // Mean and variance in closed form.
    let e = 0.25_f64.exp();
    let expected = [
        (3.0, 4.0),
        (0.125_f64.exp(), e * (e - 1.0)),
        ((2.0 / std::f64::consts::PI).sqrt(), 1.0 - 2.0 / std::f64::consts::PI),
        (1.5, 1.0 / 12.0),
    ];
    for (method, near) in
        [(DesignMethod::Sobol, 2e-3), (DesignMethod::LatinHypercube, 2e-2), (DesignMethod::MonteCarlo, 5e-2)]
    {
        let points = all(&design(method, 1 << 15, &four));
        for (axis, (mean, variance)) in expected.into_iter().enumerate() {
            let count = points.len() as f64;
            let found = points.iter().map(|it| it[axis]).sum::<f64>() / count;
            let spread = points.iter().map(|it| (it[axis] - found).powi(2)).sum::<f64>() / count;
            assert!((found / mean - 1.0).abs() < near, "{method:?} {axis}: mean {found}");
            assert!((spread / variance - 1.0).abs() < 2.0 * near, "{method:?} {axis}: {spread}");
        }
    }
}

#[test]
fn correlations_come_out_as_they_were_given() {
    let normal = |std| Distribution::Normal { mean: 1.0, std };
    let three = [normal(1.0), normal(5.0), normal(0.1)];
    for method in [DesignMethod::Sobol, DesignMethod::LatinHypercube, DesignMethod::MonteCarlo] {
        let mut design = design(method, 1 << 14, &three);
        design.correlations = vec![
            AxisCorrelation { first: 0, second: 2, coefficient: 0.8 },
            AxisCorrelation { first: 2, second: 1, coefficient: -0.4 },
        ];
        let points = all(&design);
        for (a, b, expected) in [(0, 2, 0.8), (1, 2, -0.4), (0, 1, 0.0)] {
            let moment =
                |f: &dyn Fn(&Vec<f64>) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
            let std = |i: usize| moment(&|x| (x[i] - 1.0).powi(2)).sqrt();
            let found = moment(&|x| (x[a] - 1.0) * (x[b] - 1.0)) / (std(a) * std(b));
            assert!((found - expected).abs() < 0.03, "{method:?} {a} {b}: {found}");
        }
    }
}

#[test]
fn correlations_of_nothing_name_the_pair() {
    let mut design = design(DesignMethod::Sobol, 10, &unit(3));
    design.axes.push(DesignAxis { name: "level".to_owned(), distribution: Distribution::Values(2) });
    let mut told = |pairs: &[(usize, usize, f64)]| {
        let pair = |&(first, second, coefficient): &_| AxisCorrelation { first, second, coefficient };
        design.correlations = pairs.iter().map(pair).collect();
        refused(&design)
    };
    for (pairs, expected) in [
        (&[(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)][..], "and `plant.p2`: expected a number that"),
        (&[(0, 1, 1.0)], "of `plant.p0` and `plant.p1`: expected a number between -1 and 1"),
        (&[(0, 1, f64::NAN)], "found NaN"),
        (&[(0, 1, 0.0), (1, 0, 0.3)], "expected one number, found 0 and 0.3"),
        (&[(1, 1, 0.3)], "expected two axes"),
        (&[(0, 3, 0.3)], "`level`: expected distributions, found a list"),
        (&[(0, 9, 0.3)], "found axis 9"),
    ] {
        let error = told(pairs);
        assert!(error.contains(expected), "{error}");
    }
    design.method = DesignMethod::Saltelli;
    assert!(refused(&design).contains("expected no correlations in a design `saltelli`"));
}

#[test]
fn a_block_of_saltelli_changes_one_value_at_a_time() {
    let design = design(DesignMethod::Saltelli, 104, &unit(3));
    let points = design.design_points().expect("a design");
    // 20 blocks of 5; 4 variants are left over.
    assert_eq!(points.point_count(), 100);
    for block in 0..20 {
        let member = |index| points.point(5 * block + index);
        let (a, b) = (member(0), member(1));
        for axis in 0..3 {
            let mut expected = a.clone();
            expected[axis] = b[axis];
            assert_eq!(member(2 + axis as u64), expected);
            assert_ne!(a[axis], b[axis]);
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_points_in_any_order() {
    for method in
        [DesignMethod::Sobol, DesignMethod::LatinHypercube, DesignMethod::MonteCarlo, DesignMethod::Saltelli]
    {
        let mut design = design(method, 64, &unit(4));
        let (first, points) = (all(&design), design.design_points().expect("a design"));
        let backwards: Vec<_> = (0..points.point_count()).rev().map(|it| points.point(it)).collect();
        assert!(first.iter().eq(backwards.iter().rev()), "{method:?}");
        assert!(first.iter().flatten().all(|u| 0.0 < *u && *u < 1.0));
        design.seed = 8;
        assert_ne!(all(&design), first, "{method:?}");
    }
}

#[test]
fn what_no_design_can_do_is_refused() {
    assert!(refused(&design(DesignMethod::Sobol, 0, &unit(2))).contains("expected between 1 and"));
    assert!(refused(&design(DesignMethod::Saltelli, 3, &unit(2))).contains("expected between 4 and"));
    let error = refused(&design(DesignMethod::Saltelli, 9999, &unit(200)));
    assert!(error.contains("at most 256 dimensions"), "{error}");
    // Its shares would not fit in memory.
    let error = refused(&design(DesignMethod::LatinHypercube, 1 << 31, &unit(4)));
    assert!(error.contains("expected between 1 and 67108864 variants"), "{error}");
    let wrong = [Distribution::Normal { mean: 0.0, std: 0.0 }];
    assert!(refused(&design(DesignMethod::Sobol, 5, &wrong)).contains("`plant.p0`: expected a positive"));
}

#[test]
fn a_million_points_in_twenty_dimensions_are_even_to_the_last() {
    let design = design(DesignMethod::Sobol, 1 << 20, &unit(20));
    let points = design.design_points().expect("a design");
    let mut cells = vec![vec![0_u8; 1 << 20]; 20];
    let mut point = [0.0; 20];
    for index in 0..points.point_count() {
        points.write_point(index, &mut point);
        for (cells, place) in cells.iter_mut().zip(point) {
            cells[(place * f64::from(1 << 20)) as usize] += 1;
        }
    }
    assert!(cells.iter().flatten().all(|&count| count == 1));
}
