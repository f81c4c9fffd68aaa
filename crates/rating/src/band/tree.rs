//! Finds the nearest part of a curve by boxes around parts in a row, so that most parts are never looked at.

use super::{ToleranceBandPoint, distance_per_tolerance, segment_deviation};

/// Lines of the curve in a box at the bottom.
const LINES: usize = 8;

/// The bounds of some points, and their largest tolerances.
#[derive(Debug, Clone, Copy)]
struct CurveBounds {
    x: [f64; 2],
    y: [f64; 2],
    dx: f64,
    dy: f64,
}

impl CurveBounds {
    const NONE: Self = CurveBounds {
        x: [f64::INFINITY, f64::NEG_INFINITY],
        y: [f64::INFINITY, f64::NEG_INFINITY],
        dx: 0.0,
        dy: 0.0,
    };

    fn union(self, other: Self) -> Self {
        let both = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        CurveBounds {
            x: both(self.x, other.x),
            y: both(self.y, other.y),
            dx: self.dx.max(other.dx),
            dy: self.dy.max(other.dy),
        }
    }

    fn of_point(point: &ToleranceBandPoint) -> Self {
        CurveBounds { x: [point.x; 2], y: [point.y; 2], dx: point.dx, dy: point.dy }
    }

    /// No point inside has a smaller deviation.
    fn min_deviation(&self, [x, y]: [f64; 2]) -> f64 {
        let outside = |[low, high]: [f64; 2], at: f64| (low - at).max(at - high).max(0.0);
        distance_per_tolerance(outside(self.x, x), self.dx)
            .max(distance_per_tolerance(outside(self.y, y), self.dy))
    }
}

/// Boxes of boxes. Each level has half as many as the one before, the last one has one.
#[derive(Debug, Clone)]
pub(super) struct BoundsTree {
    levels: Vec<Vec<CurveBounds>>,
}

impl BoundsTree {
    /// That of a curve with at least one point.
    pub(super) fn from_curve(curve: &[ToleranceBandPoint]) -> Self {
        let joined = |all: &[CurveBounds]| all.iter().copied().fold(CurveBounds::NONE, CurveBounds::union);
        let lines = curve.len().saturating_sub(1).max(1);
        let bottom = (0..lines).step_by(LINES).map(|first| {
            let points = &curve[first..curve.len().min(first + LINES + 1)];
            points.iter().map(CurveBounds::of_point).fold(CurveBounds::NONE, CurveBounds::union)
        });
        let mut levels = vec![bottom.collect::<Vec<_>>()];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            let above = below.chunks(2).map(joined).collect();
            levels.push(above);
        }
        Self { levels }
    }

    /// The least deviation of a point from the curve that it was made of, if it is less than `best`, which some point of it has. One
    /// that is `enough` need not be the least.
    pub(super) fn min_deviation(
        &self,
        curve: &[ToleranceBandPoint],
        at: [f64; 2],
        best: f64,
        enough: f64,
    ) -> f64 {
        let mut search = NearestSegmentSearch { tree: self, curve, at, best, enough };
        search.search_box(self.levels.len() - 1, 0);
        search.best
    }
}

struct NearestSegmentSearch<'a> {
    tree: &'a BoundsTree,
    curve: &'a [ToleranceBandPoint],
    at: [f64; 2],
    best: f64,
    enough: f64,
}

impl NearestSegmentSearch<'_> {
    fn search_box(&mut self, level: usize, place: usize) {
        if self.best <= self.enough || self.box_min_deviation(level, place) >= self.best {
            return;
        }
        let Some(next) = level.checked_sub(1) else { return self.visit_segments(place) };
        let (one, other) = (2 * place, 2 * place + 1);
        if other == self.tree.levels[next].len() {
            return self.search_box(next, one);
        }
        let in_order = self.box_min_deviation(next, one) <= self.box_min_deviation(next, other);
        for nearer_first in if in_order { [one, other] } else { [other, one] } {
            self.search_box(next, nearer_first);
        }
    }

    fn box_min_deviation(&self, level: usize, place: usize) -> f64 {
        self.tree.levels[level][place].min_deviation(self.at)
    }

    fn visit_segments(&mut self, place: usize) {
        let lines = self.curve.len().saturating_sub(1).max(1);
        for line in place * LINES..lines.min((place + 1) * LINES) {
            self.best = self.best.min(segment_deviation(self.curve, line, self.at));
        }
    }
}
