//! A tolerance band around a curve in both directions, as ISO 19364:2016 has around a cross plot: its edges, and which points
//! are inside.
//!
//! Each point (x, y) of the curve has a rectangle, x ± dx and y ± dy. Between two points of the curve all four change linearly. The
//! band is what these rectangles cover. Its edges are the lines through their corners. So the curve may be steep, turn back and
//! cross itself, and a vertical part has an edge as any other.

mod tree;

use crate::{RatingError, check_finite, check_length};
use tree::BoundsTree;

/// A tolerance that grows with the quantity: offset + gain |x|.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearTolerance {
    /// In the unit of the quantity.
    pub offset: f64,
    /// As a share of the quantity.
    pub gain: f64,
}

impl LinearTolerance {
    /// The tolerance of a value.
    #[must_use]
    pub fn at_value(self, value: f64) -> f64 {
        self.offset + self.gain * value.abs()
    }
}

/// A point of the curve with its tolerances.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ToleranceBandPoint {
    x: f64,
    y: f64,
    dx: f64,
    dy: f64,
}

/// A band around a curve.
#[derive(Debug, Clone)]
pub struct ToleranceBand {
    curve: Vec<ToleranceBandPoint>,
    tree: BoundsTree,
}

/// Which points of another curve are inside a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandCoverage {
    /// The share of the points that are inside, from 0 to 1.
    pub share: f64,
    /// The index of the first point outside.
    pub first_outside: Option<usize>,
    /// The index of the point with the largest deviation.
    pub worst: usize,
    /// Its [deviation](ToleranceBand::normalised_deviation).
    pub deviation: f64,
}

impl ToleranceBand {
    /// The band around the curve through the points (x, y), in their order, with the tolerances dx and dy of each.
    ///
    /// # Errors
    /// When there is no point, lengths differ, numbers are not finite, or tolerances are negative.
    pub fn new(x: &[f64], y: &[f64], dx: &[f64], dy: &[f64]) -> Result<Self, RatingError> {
        if x.is_empty() {
            return Err(RatingError::Short { least: 1, found: 0 });
        }
        let series = [("x", x), ("y", y), ("the tolerance of x", dx), ("the tolerance of y", dy)];
        for (what, values) in series {
            check_length(what, values, x.len())?;
            check_finite(what, values)?;
        }
        for (what, values) in &series[2..] {
            if let Some(index) = values.iter().position(|value| *value < 0.0) {
                return Err(RatingError::Negative { what, index });
            }
        }
        let corner = |k: usize| ToleranceBandPoint { x: x[k], y: y[k], dx: dx[k], dy: dy[k] };
        let curve: Vec<_> = (0..x.len()).map(corner).collect();
        Ok(Self { tree: BoundsTree::from_curve(&curve), curve })
    }

    /// The band around the curve through the points (x, y), in their order.
    ///
    /// # Errors
    /// As those of [`new`](Self::new).
    pub fn around_curve(
        x: &[f64],
        y: &[f64],
        tolerance_x: LinearTolerance,
        tolerance_y: LinearTolerance,
    ) -> Result<Self, RatingError> {
        let of = |tolerance: LinearTolerance, values: &[f64]| -> Vec<f64> {
            values.iter().map(|value| tolerance.at_value(*value)).collect()
        };
        Self::new(x, y, &of(tolerance_x, x), &of(tolerance_y, y))
    }

    /// How far a point is from the curve, in tolerances: 0 on the curve, 1 on the edge of the band, less inside, more outside. With
    /// tolerances so many times larger the point is on the edge. NaN for a point that is not a number.
    #[must_use]
    pub fn normalised_deviation(&self, x: f64, y: f64) -> f64 {
        match x.is_nan() || y.is_nan() {
            true => f64::NAN,
            false => self.tree.min_deviation(&self.curve, [x, y], f64::INFINITY, 0.0),
        }
    }

    /// Judges the points (x, y). One that is not a number is outside, by more than any other.
    ///
    /// # Errors
    /// When there is no point, or lengths differ.
    pub fn judge_points(&self, x: &[f64], y: &[f64]) -> Result<BandCoverage, RatingError> {
        check_length("y", y, x.len())?;
        if x.is_empty() {
            return Err(RatingError::Short { least: 1, found: 0 });
        }
        let mut inside = 0_usize;
        let mut first_outside = None;
        let mut worst = (0, f64::NEG_INFINITY);
        for (index, (x, y)) in x.iter().zip(y).enumerate() {
            let deviation = match x.is_nan() || y.is_nan() {
                true => f64::INFINITY,
                false => {
                    // Both curves are often at the same place at the same time. One inside is not looked at any longer than it
                    // could be the worst, as at a stand, where noise puts all points into all boxes.
                    let line = index.min(self.curve.len().saturating_sub(2));
                    let same_time = segment_deviation(&self.curve, line, [*x, *y]);
                    self.tree.min_deviation(&self.curve, [*x, *y], same_time, worst.1.min(1.0))
                }
            };
            if deviation <= 1.0 {
                inside += 1;
            } else {
                first_outside.get_or_insert(index);
            }
            if deviation > worst.1 {
                worst = (index, deviation);
            }
        }
        let (share, (worst, deviation)) = (inside as f64 / x.len() as f64, worst);
        Ok(BandCoverage { share, first_outside, worst, deviation })
    }

    /// The edges of the band on the left and on the right of the curve, seen along it, as points (x, y) to be joined by lines: of a
    /// curve to the right the upper and the lower one. Where the curve turns, an edge has the corners for both directions.
    #[must_use]
    pub fn band_edges(&self) -> [Vec<[f64; 2]>; 2] {
        let mut edges = [Vec::new(), Vec::new()];
        for pair in self.curve.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            // The sign of nothing is nothing: a level part has the points right above and below.
            let sign = |value: f64| if value == 0.0 { 0.0 } else { value.signum() };
            let (right, up) = (sign(to.x - from.x), sign(to.y - from.y));
            if (right, up) == (0.0, 0.0) {
                continue;
            }
            for point in [from, to] {
                for (edge, side) in edges.iter_mut().zip([1.0, -1.0]) {
                    let corner = [point.x - side * up * point.dx, point.y + side * right * point.dy];
                    if edge.last() != Some(&corner) {
                        edge.push(corner);
                    }
                }
            }
        }
        edges
    }
}

/// A distance in tolerances; nothing is within any tolerance.
fn distance_per_tolerance(distance: f64, tolerance: f64) -> f64 {
    if distance == 0.0 { 0.0 } else { distance / tolerance }
}

/// The least deviation of a point on the line behind a point of the curve, or of the only point.
fn segment_deviation(curve: &[ToleranceBandPoint], line: usize, at: [f64; 2]) -> f64 {
    let to = curve.get(line + 1).unwrap_or(&curve[line]);
    deviation_between(curve[line], *to, at)
}

/// The least of max(|X - x| / dx, |Y - y| / dy) on the part between two points of the curve.
///
/// Both ratios fall to a zero and rise behind it. So the least of the larger one is at an end, at a zero of one of them, or where
/// they are equal.
fn deviation_between(from: ToleranceBandPoint, to: ToleranceBandPoint, [x, y]: [f64; 2]) -> f64 {
    let at = |u: f64| {
        let along = |from: f64, to: f64| (1.0 - u) * from + u * to;
        let across = distance_per_tolerance((x - along(from.x, to.x)).abs(), along(from.dx, to.dx));
        across.max(distance_per_tolerance((y - along(from.y, to.y)).abs(), along(from.dy, to.dy)))
    };
    // Constant and slope over u of the distances and the tolerances.
    let [a, b] = [(x - from.x, from.x - to.x), (y - from.y, from.y - to.y)];
    let [p, q] = [(from.dx, to.dx - from.dx), (from.dy, to.dy - from.dy)];
    let times = |a: (f64, f64), b: (f64, f64)| [a.1 * b.1, a.0 * b.1 + a.1 * b.0, a.0 * b.0];
    let (left, right) = (times(a, q), times(b, p));
    let equal = |sign: f64| quadratic_roots(std::array::from_fn(|k| left[k] + sign * right[k]));
    let inner = [-a.0 / a.1, -b.0 / b.1].into_iter().chain(equal(1.0)).chain(equal(-1.0));
    inner.filter(|u| *u > 0.0 && *u < 1.0).chain([0.0, 1.0]).map(at).fold(f64::INFINITY, f64::min)
}

/// The roots of a u^2 + b u + c without cancellation; what is none is not finite or NaN.
fn quadratic_roots([a, b, c]: [f64; 3]) -> [f64; 2] {
    let larger = -0.5 * (b + (b * b - 4.0 * a * c).sqrt().copysign(b));
    [larger / a, c / larger]
}
