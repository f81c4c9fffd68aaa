//! Tests speed profiles against closed forms.

use std::f64::consts::TAU;

use approx::assert_relative_eq;
use vehicle::G;

use super::*;
use crate::{AccelerationLimits, TrackSurvey};

fn straight(length: f64) -> TrackLine {
    let points = (0..=10).map(|i| [0.1 * length * f64::from(i), 0.0]).collect();
    TrackLine::from_survey(&TrackSurvey { points, ..TrackSurvey::default() }).expect("a line")
}

fn circle(radius: f64) -> TrackLine {
    let point = |i: i32| {
        let angle = TAU * f64::from(i) / 400.0;
        [radius * angle.cos(), radius * angle.sin()]
    };
    let points = (0..400).map(point).collect();
    TrackLine::from_survey(&TrackSurvey { points, closed: true, ..TrackSurvey::default() }).expect("a line")
}

fn table(row: impl Fn(f64) -> AccelerationLimits) -> GgvDiagram {
    GgvDiagram::new((0..=200).map(|i| row(0.5 * f64::from(i))).collect(), 2.0).expect("limits")
}

const STOP: SpeedBounds = SpeedBounds { top: f64::INFINITY, start: Some(0.0), end: Some(0.0) };

#[test]
fn a_circle_is_driven_at_the_limit_of_the_tires() {
    let ggv = table(|v| AccelerationLimits {
        lateral: 9.0,
        drive: 5.0,
        brake: 9.0,
        ..AccelerationLimits::at_speed(v)
    });
    let profile =
        SpeedProfile::fastest_on_line(&circle(100.0), &ggv, &SpeedBounds::default()).expect("a profile");
    let [low, high] = profile.speed_range();
    assert_relative_eq!(low, 30.0, max_relative = 1e-4);
    assert_relative_eq!(high, 30.0, max_relative = 1e-4);
    assert_relative_eq!(profile.travel_time(), TAU * 100.0 / 30.0, max_relative = 1e-4);
}

#[test]
fn speeds_of_the_table_are_taken_by_a_share_and_up_to_the_top() {
    let points = (0..=300).map(|i| [f64::from(i), 0.0]).collect();
    // v² = 100 + 2 · 2 s: an acceleration of 2 m/s².
    let speeds: Vec<f64> = (0..=300).map(|i| (100.0 + 4.0 * f64::from(i)).sqrt()).collect();
    let survey = TrackSurvey { points, speed: Some(speeds), ..TrackSurvey::default() };
    let line = TrackLine::from_survey(&survey).expect("a line");
    let profile = SpeedProfile::from_line(&line, 0.5, 100.0).expect("a profile");
    assert_relative_eq!(profile.speed_at(150.0), 0.5 * 700.0_f64.sqrt(), max_relative = 1e-9);
    assert_relative_eq!(profile.acceleration_at(150.5), 0.25 * 2.0, max_relative = 1e-9);
    let limited = SpeedProfile::from_line(&line, 1.0, 20.0).expect("a profile");
    assert_relative_eq!(limited.speed_range()[1], 20.0);
    let message = |line: &TrackLine| SpeedProfile::from_line(line, 1.0, 20.0).expect_err("no").to_string();
    assert!(message(&straight(300.0)).contains("expected a column of speeds"));
    let survey = TrackSurvey { speed: Some(vec![f64::NAN; 301]), ..survey };
    let unknown = TrackLine::from_survey(&survey).expect("a line");
    assert!(message(&unknown).contains("expected a speed above 0 m/s"), "{}", message(&unknown));
}

#[test]
fn on_a_circle_the_grip_for_driving_against_drag_is_missing_laterally() {
    let (lateral, drive, c) = (9.0, 5.0, 0.004);
    let row = |v: f64| AccelerationLimits {
        lateral,
        drive,
        brake: 9.0,
        drag: c * v * v,
        ..AccelerationLimits::at_speed(v)
    };
    let profile = SpeedProfile::fastest_on_line(&circle(100.0), &table(row), &SpeedBounds::default())
        .expect("a profile");
    // (v² / (R a_y))² + (c v² / a_x)² = 1
    let square = 1.0 / (1.0 / (100.0 * lateral)).hypot(c / drive);
    let [low, high] = profile.speed_range();
    assert_relative_eq!(low, square.sqrt(), max_relative = 1e-4);
    assert_relative_eq!(high, square.sqrt(), max_relative = 1e-4);
}

#[test]
fn a_straight_between_two_stops_is_two_parabolas() {
    let (drive, brake, length) = (4.0, 8.0, 600.0);
    let ggv = table(|v| AccelerationLimits { lateral: 9.0, drive, brake, ..AccelerationLimits::at_speed(v) });
    let line = straight(length);
    let profile = SpeedProfile::fastest_on_line(&line, &ggv, &STOP).expect("a profile");
    let top = (2.0 * length * drive * brake / (drive + brake)).sqrt();
    let turn = top * top / (2.0 * drive);
    assert_relative_eq!(profile.speed_range()[1], top, max_relative = 1e-3);
    assert_relative_eq!(profile.speed_at(100.0), (2.0 * drive * 100.0_f64).sqrt(), max_relative = 1e-9);
    assert_relative_eq!(profile.acceleration_at(turn - 5.0), drive, max_relative = 1e-9);
    assert_relative_eq!(profile.acceleration_at(turn + 5.0), -brake, max_relative = 1e-9);
    assert_relative_eq!(profile.travel_time(), top / drive + top / brake, max_relative = 1e-3);
    assert_eq!(profile.speed_at(length), 0.0);
    let held =
        SpeedProfile::fastest_on_line(&line, &ggv, &SpeedBounds { top: 20.0, ..STOP }).expect("a profile");
    assert_relative_eq!(held.speed_range()[1], 20.0);
}

#[test]
fn power_alone_gives_the_cube_root_of_the_way() {
    let power = 150.0;
    let row = |v: f64| AccelerationLimits {
        lateral: 9.0,
        drive: 1e3,
        engine: power / v,
        ..AccelerationLimits::at_speed(v)
    };
    let bounds = SpeedBounds { start: Some(10.0), ..SpeedBounds::default() };
    let profile = SpeedProfile::fastest_on_line(&straight(400.0), &table(row), &bounds).expect("a profile");
    for s in [50.0, 200.0, 400.0] {
        let wanted = (1e3 + 3.0 * power * s).cbrt();
        assert_relative_eq!(profile.speed_at(s), wanted, max_relative = 1e-3);
    }
}

#[test]
fn drag_ends_the_acceleration_exponentially() {
    let (drive, c) = (4.0, 0.002);
    let row = |v: f64| AccelerationLimits {
        lateral: 9.0,
        drive,
        drag: c * v * v,
        ..AccelerationLimits::at_speed(v)
    };
    let bounds = SpeedBounds { start: Some(0.0), ..SpeedBounds::default() };
    let profile = SpeedProfile::fastest_on_line(&straight(2000.0), &table(row), &bounds).expect("a profile");
    for s in [100.0, 500.0, 2000.0] {
        let wanted = (drive / c * (1.0 - (-2.0 * c * s).exp())).sqrt();
        assert_relative_eq!(profile.speed_at(s), wanted, max_relative = 1e-4);
    }
}

#[test]
fn a_grade_acts_besides_the_tires() {
    let text = "x,y,grade\n0,0,0.1\n100,0,0.1\n200,0,0.1\n300,0,0.1\n";
    let line = TrackLine::from_table_text(text).expect("a line");
    let ggv = table(|v| AccelerationLimits {
        lateral: 9.0,
        drive: 4.0,
        brake: 8.0,
        ..AccelerationLimits::at_speed(v)
    });
    let profile = SpeedProfile::fastest_on_line(&line, &ggv, &STOP).expect("a profile");
    let (sin, cos) = 0.1_f64.sin_cos();
    assert_relative_eq!(profile.acceleration_at(20.0), 4.0 * cos - G * sin, max_relative = 1e-9);
    assert_relative_eq!(profile.acceleration_at(280.0), -8.0 * cos - G * sin, max_relative = 1e-9);
    let weak = table(|v| AccelerationLimits { lateral: 9.0, drive: 0.5, ..AccelerationLimits::at_speed(v) });
    let message = SpeedProfile::fastest_on_line(&line, &weak, &STOP).expect_err("too steep").to_string();
    assert!(message.contains("a grade of 5.7 degrees"), "{message}");
}

#[test]
fn nothing_on_a_lap_asks_for_more_than_the_car_has() {
    let text = "x,y\n0,0\n80,0\n160,0\n240,30\n240,90\n180,110\n120,70\n60,110\n-20,100\n-60,50\n";
    let line = TrackLine::from_table_text(text).expect("a line");
    let row = |v: f64| AccelerationLimits {
        lateral: 12.0 + 0.002 * v * v,
        drive: 6.0,
        brake: 12.0,
        engine: 200.0 / v.max(1.0),
        drag: 0.001 * v * v,
        downforce: 0.001 * v * v,
        ..AccelerationLimits::at_speed(v)
    };
    let ggv = table(row);
    let profile = SpeedProfile::fastest_on_line(&line, &ggv, &SpeedBounds::default()).expect("a profile");
    let mut fastest: f64 = 0.0;
    for s in line.knot_stations() {
        let (v, a, road) = (profile.speed_at(s), profile.acceleration_at(s), line.road_at(s));
        let [low, high] = ggv.acceleration_range(v, &road);
        let after = ggv.acceleration_range(
            profile.speed_at(s + line.knot_spacing()),
            &line.road_at(s + line.knot_spacing()),
        );
        // Steps take the mean of both ends.
        assert!(a <= high.max(after[1]) + 1e-6 && a >= low.min(after[0]) - 1e-6, "{a} at {s}");
        assert!(road.lateral_acceleration(v).abs() <= ggv.limits_at_speed(v).lateral * (1.0 + 1e-9));
        fastest = fastest.max(v);
    }
    assert!(fastest > 20.0, "{fastest}");
    // Speeds go on across the beginning of the lap.
    assert_relative_eq!(profile.speed_at(0.0), profile.speed_at(line.length()), epsilon = 1e-9);
}

#[test]
fn finer_knots_change_little() {
    let shape = |count: i32| {
        let point = |i: i32| {
            let angle = TAU * f64::from(i) / f64::from(count);
            let radius = 100.0 + 25.0 * (3.0 * angle).cos();
            [radius * angle.cos(), radius * angle.sin()]
        };
        let points = (0..count).map(point).collect();
        TrackLine::from_survey(&TrackSurvey { points, closed: true, ..TrackSurvey::default() })
            .expect("a line")
    };
    let ggv = table(|v| AccelerationLimits {
        lateral: 9.0,
        drive: 4.0,
        brake: 9.0,
        ..AccelerationLimits::at_speed(v)
    });
    let time = |count| {
        SpeedProfile::fastest_on_line(&shape(count), &ggv, &SpeedBounds::default())
            .expect("one")
            .travel_time()
    };
    assert_relative_eq!(time(150), time(600), max_relative = 2e-3);
}
