//! Tests lines against circles and straight lines.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use approx::assert_relative_eq;

use super::*;
use crate::wrap_angle;

fn circle(radius: f64, count: usize) -> TrackLine {
    let point = |i: usize| {
        let angle = TAU * i as f64 / count as f64;
        [radius * angle.cos(), radius * angle.sin()]
    };
    let points = (0..count).map(point).collect();
    TrackLine::from_survey(&TrackSurvey { points, closed: true, ..TrackSurvey::default() }).expect("a line")
}

#[test]
fn a_circle_has_its_length_and_curvature_everywhere() {
    let line = circle(50.0, 60);
    assert_relative_eq!(line.length(), TAU * 50.0, max_relative = 1e-6);
    for i in 0..500 {
        let s = 1.37 * f64::from(i);
        let place = line.point_at(s);
        assert_relative_eq!(place.kappa, 0.02, max_relative = 2e-3);
        assert_relative_eq!(place.kappa, line.curvature_at(s), max_relative = 1e-12);
        assert_relative_eq!(place.point[0].hypot(place.point[1]), 50.0, max_relative = 1e-6);
        let psi = s * TAU / line.length() + FRAC_PI_2;
        assert!(wrap_angle(place.psi - psi).abs() < 1e-4, "{s}");
    }
    // Twice as many points, a quarter of the error.
    let error = |count| (circle(50.0, count).point_at(3.3).kappa - 0.02).abs();
    assert!(error(120) < 0.3 * error(60));
}

#[test]
fn curvature_has_no_jumps() {
    let text = "x,y\n0,0\n60,-5\n120,10\n100,60\n60,40\n20,70\n-20,40\n";
    let line = TrackLine::from_table_text(text).expect("a line");
    let ends = (line.curvature_at(-1e-7), line.curvature_at(1e-7));
    assert_relative_eq!(ends.0, ends.1, epsilon = 1e-6);
    for i in 0..(line.length() * 100.0) as usize {
        let s = i as f64 * 0.01;
        let change = (line.curvature_at(s + 0.01) - line.curvature_at(s)).abs();
        assert!(change < 2e-3, "{change} at {s}");
    }
    let turned: f64 = line.knot_stations().map(|s| line.curvature_at(s) * line.knot_spacing()).sum();
    assert_relative_eq!(turned, TAU, epsilon = 1e-3);
}

#[test]
fn stations_are_lengths_although_points_are_unequal() {
    let text = "x,y\n0,0\n1,0\n30,0\n31,0\n100,0\n";
    let line = TrackLine::from_table_text(text).expect("a line");
    assert!(!line.is_closed());
    assert_relative_eq!(line.length(), 100.0, max_relative = 1e-12);
    for s in [-5.0, 0.0, 17.3, 99.9, 100.0, 123.0] {
        let place = line.point_at(s);
        assert_relative_eq!(place.point[0], s, epsilon = 1e-9);
        assert_relative_eq!(place.kappa, 0.0, epsilon = 1e-9);
    }
    assert_eq!(line.widths_at(3.0), None);
}

#[test]
fn an_arc_with_ends_keeps_its_curvature_there() {
    let point = |i: i32| {
        let angle = f64::from(i) * 0.1;
        [40.0 * angle.sin(), 40.0 - 40.0 * angle.cos()]
    };
    let points = (0..20).map(point).collect();
    let line = TrackLine::from_survey(&TrackSurvey { points, ..TrackSurvey::default() }).expect("a line");
    for s in [0.0, 1.0, 38.0, line.length()] {
        assert_relative_eq!(line.curvature_at(s), 0.025, max_relative = 0.02);
    }
    // Behind its ends it goes on straight.
    let (end, beyond) = (line.point_at(line.length()), line.point_at(line.length() + 10.0));
    assert_relative_eq!(point_distance(end.point, beyond.point), 10.0, max_relative = 1e-4);
    assert_eq!(beyond.kappa, 0.0);
}

#[test]
fn widths_bank_and_grade_go_along() {
    let text = "x,y,left,right,bank,z\n0,0,4,5,0,0\n100,0,6,5,-0.2,10\n200,0,6,5,-0.2,20\n300,0,6,5,0,30\n";
    let line = TrackLine::from_table_text(text).expect("a line");
    let widths = line.widths_at(50.0).expect("widths");
    assert_relative_eq!(widths[0], 5.0, max_relative = 1e-9);
    assert_relative_eq!(widths[1], 5.0, max_relative = 1e-9);
    let road = line.road_at(250.0);
    assert_relative_eq!(road.bank, -0.1, max_relative = 1e-9);
    assert_relative_eq!(road.grade, 0.1_f64.atan(), max_relative = 1e-9);
}

#[test]
fn heights_of_a_closed_line_give_grades_across_its_beginning() {
    let text = "x,y,z\n0,0,1\n100,0,0\n100,100,-1\n0,100,0\n";
    let line = TrackLine::from_table_text(text).expect("a line");
    let quarter = 0.25 * line.length();
    // Knots of 1 m cut the corners of the grade at the points.
    assert_relative_eq!(line.road_at(0.0).grade, 0.0, epsilon = 1e-12);
    assert_relative_eq!(line.road_at(quarter).grade, (-1.0 / quarter).atan(), max_relative = 5e-3);
    assert_relative_eq!(line.road_at(3.0 * quarter).grade, (1.0 / quarter).atan(), max_relative = 5e-3);
    assert!(wrap_angle(3.0 * PI).abs() - PI < 1e-12);
}
