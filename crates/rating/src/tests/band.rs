//! Checks bands around curves whose edges geometry knows.

use std::f64::consts::{PI, SQRT_2};

use crate::{LinearTolerance, RatingError, ToleranceBand};

const fn constant(offset: f64) -> LinearTolerance {
    LinearTolerance { offset, gain: 0.0 }
}

fn line(slope: f64, from: f64, to: f64, count: u32) -> (Vec<f64>, Vec<f64>) {
    let x = |k| from + (to - from) * f64::from(k) / f64::from(count - 1);
    (0..count).map(|k| (x(k), slope * x(k))).unzip()
}

fn circle(radius: f64, count: u32) -> (Vec<f64>, Vec<f64>) {
    let at = |k| 2.0 * PI * f64::from(k) / f64::from(count);
    (0..=count).map(|k| (radius * at(k).cos(), radius * at(k).sin())).unzip()
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
}

/// The edge of y = k x is k x + dy + |k| dx: the corners of the rectangles, not what is above.
#[test]
fn a_straight_line_has_parallel_edges() {
    for slope in [0.0, 0.3, -2.0, 50.0] {
        for count in [2, 3, 400] {
            let (x, y) = line(slope, -10.0, 10.0, count);
            let band = ToleranceBand::around_curve(&x, &y, constant(0.2), constant(0.5)).expect("a band");
            for at in [-3.0, 0.1, 7.0] {
                let half = 0.5 + f64::abs(slope) * 0.2;
                for (share, side) in [(0.0, 1.0), (0.4, 1.0), (1.0, -1.0), (3.0, 1.0)] {
                    close(band.normalised_deviation(at, slope * at + side * share * half), share);
                }
            }
        }
    }
}

/// The tolerances of ISO 19364 for the steering-wheel angle [deg] over the lateral acceleration [m/s2] on y = 10 x: the edge of x > 0
/// goes through x - 0.1 - 0.06 x and y + 5 + 0.03 y.
#[test]
fn tolerances_grow_with_the_quantity() {
    let [of_x, of_y] =
        [LinearTolerance { offset: 0.1, gain: 0.06 }, LinearTolerance { offset: 5.0, gain: 0.03 }];
    let (x, y) = line(10.0, 0.0, 8.0, 41);
    let band = ToleranceBand::around_curve(&x, &y, of_x, of_y).expect("a band");
    for at in [1.0, 3.03, 5.5] {
        close(band.normalised_deviation(0.94 * at - 0.1, 10.3 * at + 5.0), 1.0);
        close(band.normalised_deviation(1.06 * at + 0.1, 9.7 * at - 5.0), 1.0);
        close(
            band.normalised_deviation(at - 3.0 * (0.1 + 0.06 * at), 10.0 * at + 3.0 * (5.0 + 0.3 * at)),
            3.0,
        );
    }
}

#[test]
fn a_mirrored_axis_mirrors_the_band() {
    let (x, y) = line(3.0, 0.0, 2.0, 21);
    let [of_x, of_y] =
        [LinearTolerance { offset: 0.1, gain: 0.1 }, LinearTolerance { offset: 0.3, gain: 0.05 }];
    let minus = |values: &[f64]| values.iter().map(|value| -value).collect::<Vec<_>>();
    let plain = ToleranceBand::around_curve(&x, &y, of_x, of_y).expect("a band");
    let mirrored = ToleranceBand::around_curve(&x, &minus(&y), of_x, of_y).expect("a band");
    let backwards = {
        let (mut x, mut y) = (minus(&x), y.clone());
        x.reverse();
        y.reverse();
        ToleranceBand::around_curve(&x, &y, of_x, of_y).expect("a band")
    };
    for (at, height) in [(0.3, 1.7), (1.9, 4.0), (-0.4, -1.0), (2.6, 7.0)] {
        let expected = plain.normalised_deviation(at, height);
        close(mirrored.normalised_deviation(at, -height), expected);
        close(backwards.normalised_deviation(-at, height), expected);
    }
}

#[test]
fn a_vertical_part_has_an_edge_beside_it() {
    let band =
        ToleranceBand::around_curve(&[1.0, 1.0], &[0.0, 5.0], constant(0.1), constant(2.0)).expect("a band");
    close(band.normalised_deviation(1.1, 3.0), 1.0);
    close(band.normalised_deviation(0.8, 3.0), 2.0);
    close(band.normalised_deviation(1.0, 8.0), 1.5);
}

/// Squares along a circle: the band is wide by d along the axes and by sqrt(2) d between them.
#[test]
fn a_circle_is_a_ring_whose_middle_is_outside() {
    let (x, y) = circle(4.0, 4000);
    let band = ToleranceBand::around_curve(&x, &y, constant(0.5), constant(0.5)).expect("a band");
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    near(band.normalised_deviation(4.5, 0.0), 1.0);
    near(band.normalised_deviation(0.0, -5.0), 2.0);
    let diagonal = 4.0 / SQRT_2 + 0.5;
    near(band.normalised_deviation(diagonal, -diagonal), 1.0);
    // The nearest square to the middle touches it with a corner.
    near(band.normalised_deviation(0.0, 0.0), 4.0 / SQRT_2 / 0.5);
}

#[test]
fn a_curve_that_crosses_itself_has_both_branches() {
    // A hysteresis loop, an eight, of two values at most x.
    let (x, y): (Vec<_>, Vec<_>) = (0..=2000)
        .map(|k| PI * f64::from(k) / 1000.0)
        .map(|angle| (3.0 * angle.cos(), (2.0 * angle).sin()))
        .unzip();
    let band = ToleranceBand::around_curve(&x, &y, constant(0.01), constant(0.05)).expect("a band");
    let inside = band.judge_points(&x, &y).expect("judged");
    assert_eq!((inside.share, inside.first_outside, inside.deviation), (1.0, None, 0.0));
    let height = (2.0 * f64::acos(2.0 / 3.0)).sin();
    assert!(band.normalised_deviation(2.0, height) < 1e-3 && band.normalised_deviation(2.0, -height) < 1e-3);
    assert!(band.normalised_deviation(2.0, 0.0) > 10.0);
}

#[test]
fn boxes_find_what_a_look_at_all_lines_finds() {
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1_u32 << 24)
    };
    for count in [1, 2, 8, 9, 10, 17, 100] {
        let mut series = || (0..count).map(|_| random()).collect::<Vec<_>>();
        let [x, y] = [series(), series()];
        let [dx, dy] = [series(), series()].map(|of| of.iter().map(|it| it + 0.1).collect::<Vec<_>>());
        let band = ToleranceBand::new(&x, &y, &dx, &dy).expect("a band");
        for _ in 0..50 {
            let (at, height) = (3.0 * random() - 1.0, 3.0 * random() - 1.0);
            let found = band.normalised_deviation(at, height);
            // Points of the curve close together, none of which may be nearer.
            let fine =
                (0..count.max(2) - 1).flat_map(|k| (0..=2000).map(move |u| (k, f64::from(u) / 2000.0)));
            let least = fine.fold(f64::INFINITY, |least: f64, (k, u)| {
                let along = |values: &[f64]| values[k] + u * (values[(k + 1).min(count - 1)] - values[k]);
                let across = (at - along(&x)).abs() / along(&dx);
                least.min(across.max((height - along(&y)).abs() / along(&dy)))
            });
            // A step is at most 1/2000 of a distance or tolerance, and tolerances are at least 0.1.
            assert!(
                found <= least + 1e-12 && found > least - 0.005 * (1.0 + least),
                "{count}: {found} {least}"
            );
        }
    }
}

#[test]
fn the_first_and_the_worst_point_outside_are_told() {
    let (x, y) = line(1.0, 0.0, 10.0, 11);
    let band = ToleranceBand::around_curve(&x, &y, constant(0.0), constant(1.0)).expect("a band");
    let mut other = y.clone();
    (other[3], other[6], other[8]) = (4.5, 8.0, 7.1);
    let inside = band.judge_points(&x, &other).expect("judged");
    assert_eq!((inside.first_outside, inside.worst), (Some(3), 6));
    close(inside.share, 9.0 / 11.0);
    // Without a tolerance of x the distance is that of y.
    close(inside.deviation, 2.0);
    other[9] = f64::NAN;
    let inside = band.judge_points(&x, &other).expect("judged");
    assert_eq!((inside.worst, inside.deviation), (9, f64::INFINITY));
    close(inside.share, 8.0 / 11.0);
}

/// What is left out to be fast changes nothing.
#[test]
fn a_judgement_is_that_of_each_point() {
    let wave = |k: u32, phase: f64| 3.0 * (0.37 * f64::from(k) + phase).sin();
    for shift in [0.0, 0.02, 0.3] {
        let [x, y] = [0.0, 1.3].map(|phase| (0..500).map(|k| wave(k, phase)).collect::<Vec<_>>());
        let [other_x, other_y] =
            [shift, 1.3 + 2.0 * shift].map(|phase| (0..600).map(|k| wave(7 * k, phase)).collect::<Vec<_>>());
        let band = ToleranceBand::around_curve(&x, &y, constant(0.1), constant(0.2)).expect("a band");
        let each: Vec<_> =
            other_x.iter().zip(&other_y).map(|(x, y)| band.normalised_deviation(*x, *y)).collect();
        let judged = band.judge_points(&other_x, &other_y).expect("judged");
        let largest = each.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert_eq!((judged.deviation, each[judged.worst]), (largest, largest));
        assert_eq!(judged.first_outside, each.iter().position(|it| *it > 1.0));
        let inside = each.iter().filter(|it| **it <= 1.0).count();
        close(judged.share, inside as f64 / 600.0);
    }
}

#[test]
fn edges_go_through_the_corners_and_both_corners_of_a_turn() {
    let band = ToleranceBand::around_curve(
        &[0.0, 1.0, 2.0, 2.0],
        &[0.0, 2.0, 0.0, 0.0],
        constant(0.1),
        constant(0.5),
    )
    .expect("a band");
    let [left, right] = band.band_edges();
    assert_eq!(left, [[-0.1, 0.5], [0.9, 2.5], [1.1, 2.5], [2.1, 0.5]]);
    assert_eq!(right, [[0.1, -0.5], [1.1, 1.5], [0.9, 1.5], [1.9, -0.5]]);
    let [upper, lower] = ToleranceBand::around_curve(&[0.0, 1.0], &[3.0, 3.0], constant(0.1), constant(0.5))
        .expect("a band")
        .band_edges();
    assert_eq!((upper, lower), (vec![[0.0, 3.5], [1.0, 3.5]], vec![[0.0, 2.5], [1.0, 2.5]]));
}

#[test]
fn what_makes_no_band_is_refused() {
    let two = [0.0, 1.0];
    let band = |x: &[f64], y: &[f64], dx: &[f64]| ToleranceBand::new(x, y, dx, &[1.0, 1.0]).map(|_| ());
    assert_eq!(
        band(&two, &two, &[0.0, -1.0]),
        Err(RatingError::Negative { what: "the tolerance of x", index: 1 })
    );
    assert_eq!(band(&[0.0, f64::NAN], &two, &two), Err(RatingError::NotFinite { what: "x", index: 1 }));
    assert_eq!(band(&two, &[f64::INFINITY, 0.0], &two), Err(RatingError::NotFinite { what: "y", index: 0 }));
    assert_eq!(band(&two, &[0.0], &two), Err(RatingError::Lengths { what: "y", reference: 2, found: 1 }));
    assert_eq!(band(&[], &[], &[]), Err(RatingError::Short { least: 1, found: 0 }));
    let good = ToleranceBand::new(&two, &two, &two, &two).expect("a band");
    assert!(good.judge_points(&two, &[1.0]).is_err() && good.judge_points(&[], &[]).is_err());
    assert!(good.normalised_deviation(f64::NAN, 0.0).is_nan());
    assert_eq!(good.normalised_deviation(f64::INFINITY, 0.0), f64::INFINITY);
}
