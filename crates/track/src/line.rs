//! Represents a line by splines over its own length: position, heading and curvature at any station.

use serde::{Deserialize, Serialize};

use crate::spline::{evaluate_segment, spline_moments};
use crate::survey::{TrackSurvey, point_distance};
use crate::{Error, RoadGeometry};

/// Distance between the knots of a line [m], where it is long enough.
const STEP: f64 = 1.0;
/// Least number of knots of a line.
const FEWEST: f64 = 200.0;
/// Most knots of a line.
const MOST: f64 = 2e6;

/// Nodes and weights of the Gauss-Legendre rule of five points on 0 .. 1 (Abramowitz and Stegun, table 25.4).
const GAUSS: [[f64; 2]; 5] = [
    [0.046_910_077_030_668, 0.118_463_442_528_094_5],
    [0.230_765_344_947_158_5, 0.239_314_335_249_683_2],
    [0.5, 0.284_444_444_444_444_4],
    [0.769_234_655_052_841_5, 0.239_314_335_249_683_2],
    [0.953_089_922_969_332, 0.118_463_442_528_094_5],
];

/// A line in the plane: cubic splines x(s), y(s) through its points, with continuous curvature, closed or with ends. Behind
/// its ends an open line goes on straight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrackLine {
    closed: bool,
    step: f64,
    length: f64,
    knots: Vec<LineKnot>,
    has_widths: bool,
    has_speeds: bool,
}

/// What a line knows at one of its equidistant knots.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct LineKnot {
    point: [f64; 2],
    moment: [f64; 2],
    widths: [f64; 2],
    bank: f64,
    grade: f64,
    speed: f64,
}

/// A place on the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinePoint {
    /// Position [m].
    pub point: [f64; 2],
    /// Heading of the line [rad], counter-clockwise from the X axis, within -pi .. pi.
    pub psi: f64,
    /// Curvature [1/m], positive in left turns.
    pub kappa: f64,
}

impl TrackLine {
    /// Reads a line from the text of a table, as [`TrackSurvey::from_table_text`] does.
    ///
    /// # Errors
    /// As [`TrackSurvey::from_table_text`] and [`TrackLine::from_survey`].
    pub fn from_table_text(text: &str) -> Result<Self, Error> {
        Self::from_survey(&TrackSurvey::from_table_text(text)?)
    }

    /// The line through these points. Their order is that of the direction of travel.
    ///
    /// A first spline over the lengths of the chords gives the length of the line, a second one through equidistant points of
    /// the first is over that length (|r'| = 1 but for the fourth order of the distance of its knots): a station is found
    /// without a search. Widths, bank, grade and speed are linear between the points.
    ///
    /// # Errors
    /// When there are fewer than four points, two consecutive ones are the same, or one is not finite.
    pub fn from_survey(survey: &TrackSurvey) -> Result<Self, Error> {
        let chords = ChordSpline::from_survey(survey)?;
        let length = chords.ends.last().copied().unwrap_or_default();
        let most = (length / STEP).clamp(FEWEST, MOST).ceil();
        let (step, intervals) = (length / most, most as usize);
        let count = if survey.closed { intervals } else { intervals + 1 };
        let mut segment = 0;
        let knots = (0..count).map(|i| {
            let s = step * i as f64;
            while segment + 1 < chords.ends.len() && chords.ends[segment] < s {
                segment += 1;
            }
            chords.knot_at(survey, segment, s)
        });
        let mut knots: Vec<LineKnot> = knots.collect();
        let spacing = vec![step; intervals];
        for axis in 0..2 {
            let values: Vec<f64> = knots.iter().map(|it| it.point[axis]).collect();
            for (knot, moment) in knots.iter_mut().zip(spline_moments(&spacing, &values)) {
                knot.moment[axis] = moment;
            }
        }
        let (has_widths, has_speeds) = (survey.widths.is_some(), survey.speed.is_some());
        Ok(TrackLine { closed: survey.closed, step, length, knots, has_widths, has_speeds })
    }

    /// Whether the end is the beginning.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Length [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Distance between two knots [m].
    #[must_use]
    pub fn knot_spacing(&self) -> f64 {
        self.step
    }

    /// The stations of the knots [m]; of an open line with its end, of a closed one without.
    pub fn knot_stations(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.knots.len()).map(|i| self.step * i as f64)
    }

    /// The station within 0 .. length of a closed line, the station itself of an open one.
    #[inline]
    #[must_use]
    pub fn wrap_station(&self, s: f64) -> f64 {
        if !self.closed || (0.0..self.length).contains(&s) {
            return s;
        }
        let wrapped = s.rem_euclid(self.length);
        if wrapped < self.length { wrapped } else { 0.0 }
    }

    /// Position, heading and curvature at a station [m]: κ = (x' y'' − y' x'') / |r'|³.
    #[inline]
    #[must_use]
    pub fn point_at(&self, s: f64) -> LinePoint {
        let [point, [dx, dy], [ddx, ddy]] = self.position_derivatives(s);
        let speed = dx.hypot(dy);
        LinePoint { point, psi: dy.atan2(dx), kappa: (dx * ddy - dy * ddx) / (speed * speed * speed) }
    }

    /// Curvature [1/m] at a station [m].
    #[inline]
    #[must_use]
    pub fn curvature_at(&self, s: f64) -> f64 {
        let [_, [dx, dy], [ddx, ddy]] = self.position_derivatives(s);
        let square = dx * dx + dy * dy;
        (dx * ddy - dy * ddx) / (square * square.sqrt())
    }

    /// Curvature, bank and grade at a station [m].
    #[must_use]
    pub fn road_at(&self, s: f64) -> RoadGeometry {
        let (knot, next, t) = self.surrounding_knots(s);
        let mix = |a: f64, b: f64| a + t * (b - a);
        RoadGeometry {
            kappa: self.curvature_at(s),
            bank: mix(knot.bank, next.bank),
            grade: mix(knot.grade, next.grade),
        }
    }

    /// Distances to the left and the right edge [m] at a station [m]; none for a line without widths.
    #[must_use]
    pub fn widths_at(&self, s: f64) -> Option<[f64; 2]> {
        let (knot, next, t) = self.surrounding_knots(s);
        let side = |i: usize| knot.widths[i] + t * (next.widths[i] - knot.widths[i]);
        self.has_widths.then(|| [side(0), side(1)])
    }

    /// The speeds that the table of the line tells for its knots [m/s], NaN beside a point without a number; none for a table
    /// without speeds.
    pub(crate) fn knot_speeds(&self) -> Option<impl Iterator<Item = f64> + '_> {
        self.has_speeds.then(|| self.knots.iter().map(|it| it.speed))
    }

    /// Position and its first two derivatives by the station.
    #[inline]
    pub(crate) fn position_derivatives(&self, s: f64) -> [[f64; 2]; 3] {
        let (knot, next, t) = self.surrounding_knots(s);
        let axis = |i: usize| {
            evaluate_segment(self.step, t, [knot.point[i], next.point[i]], [knot.moment[i], next.moment[i]])
        };
        let ([x, dx, ddx], [y, dy, ddy]) = (axis(0), axis(1));
        let beyond = if self.closed { 0.0 } else { s - s.clamp(0.0, self.length) };
        if beyond == 0.0 {
            return [[x, y], [dx, dy], [ddx, ddy]];
        }
        [[x + beyond * dx, y + beyond * dy], [dx, dy], [0.0; 2]]
    }

    /// The positions of the knots [m].
    pub(crate) fn knot_positions(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.knots.iter().map(|it| it.point)
    }

    /// The knots around a station, and its share of the way between them.
    #[inline]
    fn surrounding_knots(&self, s: f64) -> (&LineKnot, &LineKnot, f64) {
        let count = self.knots.len();
        let place = match self.closed {
            true => self.wrap_station(s) / self.step,
            false => s.clamp(0.0, self.length) / self.step,
        };
        let last = if self.closed { count - 1 } else { count - 2 };
        let index = (place as usize).min(last);
        let next = if index + 1 == count { 0 } else { index + 1 };
        (&self.knots[index], &self.knots[next], place - index as f64)
    }
}

/// The spline over the lengths of the chords, with the lengths of its arcs.
struct ChordSpline {
    spacing: Vec<f64>,
    moments: [Vec<f64>; 2],
    /// Station at the end of each segment [m].
    ends: Vec<f64>,
    grades: Vec<f64>,
}

impl ChordSpline {
    fn from_survey(survey: &TrackSurvey) -> Result<Self, Error> {
        let points = &survey.points;
        let count = points.len();
        if count < 4 {
            return Err(Error::Table(format!("expected at least 4 points of a line, found {count}")));
        }
        let segments = if survey.closed { count } else { count - 1 };
        let pair = |i: usize| [points[i], points[(i + 1) % count]];
        let spacing: Vec<f64> = (0..segments).map(|i| point_distance(pair(i)[0], pair(i)[1])).collect();
        if let Some(i) = spacing.iter().position(|it| !(it.is_finite() && *it > 0.0)) {
            let [[x, y], _] = pair(i);
            let message = format!("expected another point after x = {x} m, y = {y} m");
            return Err(Error::Table(message));
        }
        let axis = |i: usize| points.iter().map(|it| it[i]).collect::<Vec<_>>();
        let moments = [axis(0), axis(1)].map(|values| spline_moments(&spacing, &values));
        let mut chords = ChordSpline { spacing, moments, ends: Vec::new(), grades: Vec::new() };
        let mut s = 0.0;
        for i in 0..segments {
            s += chords.arc_length(points, i, 1.0);
            chords.ends.push(s);
        }
        chords.grades = chords.point_grades(survey);
        Ok(chords)
    }

    fn derivatives_at(&self, points: &[[f64; 2]], i: usize, t: f64) -> [[f64; 3]; 2] {
        let j = (i + 1) % points.len();
        [0, 1].map(|axis| {
            let m = &self.moments[axis];
            evaluate_segment(self.spacing[i], t, [points[i][axis], points[j][axis]], [m[i], m[j]])
        })
    }

    /// Length of the arc of a segment up to the share `t` of it [m].
    fn arc_length(&self, points: &[[f64; 2]], i: usize, t: f64) -> f64 {
        let speed = |node: f64| {
            let [[_, dx, _], [_, dy, _]] = self.derivatives_at(points, i, node * t);
            dx.hypot(dy)
        };
        let sum: f64 = GAUSS.iter().map(|[node, weight]| weight * speed(*node)).sum();
        sum * t * self.spacing[i]
    }

    /// The grade at each point: as given, or the slope of the heights, which is that of the chords on both sides.
    fn point_grades(&self, survey: &TrackSurvey) -> Vec<f64> {
        let count = survey.points.len();
        match (&survey.grade, &survey.height) {
            (Some(grade), _) => grade.clone(),
            (None, Some(height)) => {
                let near = |i: usize| match survey.closed {
                    true => ((i + count - 1) % count, (i + 1) % count),
                    false => (i.saturating_sub(1), (i + 1).min(count - 1)),
                };
                let station = |i: usize| if i == 0 { 0.0 } else { self.ends[i - 1] };
                let length = self.ends.last().copied().unwrap_or_default();
                let slope = |i: usize| {
                    let (before, after) = near(i);
                    let way = station(after) - station(before);
                    let way = if way > 0.0 { way } else { way + length };
                    ((height[after] - height[before]) / way).atan()
                };
                (0..count).map(slope).collect()
            }
            (None, None) => vec![0.0; count],
        }
    }

    /// The line at a station within a segment, without its moments.
    fn knot_at(&self, survey: &TrackSurvey, i: usize, s: f64) -> LineKnot {
        let begin = if i == 0 { 0.0 } else { self.ends[i - 1] };
        let length = self.ends[i] - begin;
        // Newton's method for arc(t) = s - begin, which rises; it starts from equal speed.
        let mut t = (s - begin) / length;
        for _ in 0..20 {
            let [[_, dx, _], [_, dy, _]] = self.derivatives_at(&survey.points, i, t);
            let change =
                (s - begin - self.arc_length(&survey.points, i, t)) / (dx.hypot(dy) * self.spacing[i]);
            t = (t + change).clamp(0.0, 1.0);
            if change.abs() < 1e-14 {
                break;
            }
        }
        let [[x, ..], [y, ..]] = self.derivatives_at(&survey.points, i, t);
        let j = (i + 1) % survey.points.len();
        let share = (s - begin) / length;
        let mix = |of: &[f64]| of[i] + share * (of[j] - of[i]);
        let widths = survey
            .widths
            .as_ref()
            .map_or([0.0; 2], |of| [0, 1].map(|side| of[i][side] + share * (of[j][side] - of[i][side])));
        LineKnot {
            point: [x, y],
            moment: [0.0; 2],
            widths,
            bank: survey.bank.as_deref().map_or(0.0, mix),
            grade: mix(&self.grades),
            speed: survey.speed.as_deref().map_or(0.0, mix),
        }
    }
}

#[cfg(test)]
mod tests;
