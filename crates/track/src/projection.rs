//! Projects points onto a line: anywhere on it at first, then onward from the last station.

use crate::TrackLine;
use crate::angle::wrap_angle;
use crate::survey::point_distance;

/// Where a point is, seen from the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineStation {
    /// Station [m]; of a closed line within 0 .. length.
    pub s: f64,
    /// Deviation of the point to the left of the line [m].
    pub lateral: f64,
    /// Heading of the line there [rad].
    pub psi: f64,
    /// Curvature of the line there [1/m].
    pub kappa: f64,
}

/// Detour that a heading against the line is worth when stations are compared [m].
const WRONG_WAY: f64 = 20.0;
/// Longest correction of one iteration [m].
const REACH: f64 = 5.0;

impl TrackLine {
    /// The station nearest to a point [m], anywhere on the line. Where the line comes near itself, the heading [rad] decides
    /// between its parts: one that is passed backwards counts as 20 m farther away.
    #[must_use]
    pub fn locate_point(&self, point: [f64; 2], heading: Option<f64>) -> LineStation {
        let cost = |s: f64, knot: [f64; 2]| {
            let turned = heading.map_or(0.0, |it| 1.0 - wrap_angle(it - self.point_at(s).psi).cos());
            point_distance(point, knot) + 0.5 * WRONG_WAY * turned
        };
        let costs = self.knot_stations().zip(self.knot_positions()).map(|(s, knot)| (cost(s, knot), s));
        let (_, s) = costs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
        self.follow_point(s, point)
    }

    /// The station of a point [m] near the last station `s` [m], by Newton's method for (p − r) · r' = 0. Parts of the line that cross
    /// there, or come near, are left alone. The effort does not depend on the length of the line.
    #[must_use]
    pub fn follow_point(&self, s: f64, point: [f64; 2]) -> LineStation {
        let mut s = s;
        for _ in 0..50 {
            let [[x, y], [dx, dy], [ddx, ddy]] = self.position_derivatives(s);
            let away = [point[0] - x, point[1] - y];
            let square = dx * dx + dy * dy;
            let along = away[0] * dx + away[1] * dy;
            // Beyond the centre of the bend the curvature term would turn the direction round.
            let slope = (square - away[0] * ddx - away[1] * ddy).max(0.2 * square);
            let change = (along / slope).clamp(-REACH, REACH);
            s += change;
            if change.abs() < 1e-9 {
                break;
            }
        }
        let s = self.wrap_station(s);
        let place = self.point_at(s);
        let (sin, cos) = place.psi.sin_cos();
        let away = [point[0] - place.point[0], point[1] - place.point[1]];
        let lateral = away[1] * cos - away[0] * sin;
        LineStation { s, lateral, psi: place.psi, kappa: place.kappa }
    }

    /// How far the station has moved from `from` to `to` [m], the shorter way round a closed line.
    #[must_use]
    pub fn station_change(&self, from: f64, to: f64) -> f64 {
        let way = to - from;
        if !self.is_closed() {
            return way;
        }
        way - self.length() * (way / self.length()).round()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;
    use crate::TrackSurvey;

    /// A lying eight (lemniscate of Gerono) that crosses itself in the origin.
    fn eight() -> TrackLine {
        let point = |i: i32| {
            let angle = TAU * f64::from(i) / 200.0;
            [100.0 * angle.sin(), 60.0 * angle.sin() * angle.cos()]
        };
        let points = (0..200).map(point).collect();
        TrackLine::from_survey(&TrackSurvey { points, closed: true, ..TrackSurvey::default() })
            .expect("a line")
    }

    #[test]
    fn crossing_lines_are_told_apart_by_the_last_station() {
        let line = eight();
        // Through the crossing at half the length, 0.4 m to the left of the line.
        let mut s = 0.4 * line.length();
        while s < 0.6 * line.length() {
            let next = line.point_at(s + 0.5);
            let (sin, cos) = next.psi.sin_cos();
            let point = [next.point[0] - 0.4 * sin, next.point[1] + 0.4 * cos];
            let station = line.follow_point(s, point);
            assert_relative_eq!(station.s, s + 0.5, epsilon = 1e-6);
            assert_relative_eq!(station.lateral, 0.4, epsilon = 1e-6);
            s = station.s;
        }
    }

    #[test]
    fn crossing_lines_are_told_apart_by_the_heading() {
        let line = eight();
        let half = 0.5 * line.length();
        for (wanted, psi) in [(0.0, line.point_at(0.0).psi), (half, line.point_at(half).psi)] {
            let station = line.locate_point([0.0, 0.0], Some(psi));
            assert_relative_eq!(line.station_change(wanted, station.s), 0.0, epsilon = 1e-3);
        }
    }

    #[test]
    fn a_lap_goes_on_across_its_beginning() {
        let line = eight();
        let (mut s, mut covered) = (0.0, 0.0);
        for i in 1..=1000 {
            let place = line.point_at(line.length() * f64::from(i) / 1000.0);
            let station = line.follow_point(s, place.point);
            covered += line.station_change(s, station.s);
            s = station.s;
        }
        assert_relative_eq!(covered, line.length(), epsilon = 1e-6);
        assert_relative_eq!(line.station_change(line.length() - 1.0, 2.0), 3.0, epsilon = 1e-9);
    }

    #[test]
    fn points_before_and_behind_an_open_line_lie_on_its_tangents() {
        let line = TrackLine::from_table_text("x,y\n0,0\n10,0\n20,0\n30,0\n").expect("a line");
        let before = line.locate_point([-7.0, 2.0], None);
        assert_relative_eq!(before.s, -7.0, epsilon = 1e-9);
        assert_relative_eq!(before.lateral, 2.0, epsilon = 1e-9);
        let behind = line.follow_point(28.0, [41.0, -3.0]);
        assert_relative_eq!(behind.s, 41.0, epsilon = 1e-9);
        assert_relative_eq!(behind.lateral, -3.0, epsilon = 1e-9);
    }

    proptest! {
        #[test]
        fn a_point_beside_the_line_is_found_again(share in 0.0..1.0f64, lateral in -8.0..8.0f64) {
            let line = eight();
            let s = share * line.length();
            let place = line.point_at(s);
            let (sin, cos) = place.psi.sin_cos();
            let point = [place.point[0] - lateral * sin, place.point[1] + lateral * cos];
            let near = line.wrap_station(s + 2.0);
            let station = line.follow_point(near, point);
            prop_assert!(line.station_change(s, station.s).abs() < 1e-6);
            prop_assert!((station.lateral - lateral).abs() < 1e-6);
        }

        #[test]
        fn any_point_has_a_finite_station(x in -1e4..1e4f64, y in -1e4..1e4f64, s in -1e3..1e3f64) {
            let line = eight();
            for station in [line.follow_point(s, [x, y]), line.locate_point([x, y], Some(s))] {
                prop_assert!(station.s.is_finite() && station.lateral.is_finite());
                prop_assert!((0.0..line.length()).contains(&station.s));
            }
        }
    }
}
