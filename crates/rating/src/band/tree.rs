//! Finds the nearest part of a curve by boxes around parts in a row, so that most parts are never looked at.

use super::{Corner, least_between, over};

/// Lines of the curve in a box at the bottom.
const LINES: usize = 8;

/// The bounds of some points, and their largest tolerances.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    x: [f64; 2],
    y: [f64; 2],
    dx: f64,
    dy: f64,
}

impl Bounds {
    const NONE: Self = Bounds {
        x: [f64::INFINITY, f64::NEG_INFINITY],
        y: [f64::INFINITY, f64::NEG_INFINITY],
        dx: 0.0,
        dy: 0.0,
    };

    fn joined(self, other: Self) -> Self {
        let both = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Bounds {
            x: both(self.x, other.x),
            y: both(self.y, other.y),
            dx: self.dx.max(other.dx),
            dy: self.dy.max(other.dy),
        }
    }

    fn of(point: &Corner) -> Self {
        Bounds { x: [point.x; 2], y: [point.y; 2], dx: point.dx, dy: point.dy }
    }

    /// No point inside has a smaller deviation.
    fn least(&self, x: f64, y: f64) -> f64 {
        let outside = |[low, high]: [f64; 2], at: f64| (low - at).max(at - high).max(0.0);
        over(outside(self.x, x), self.dx).max(over(outside(self.y, y), self.dy))
    }
}

/// Boxes of boxes. Each level has half as many as the one before, the last one has one.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    levels: Vec<Vec<Bounds>>,
}

impl Tree {
    /// That of a curve with at least one point.
    pub(super) fn of(curve: &[Corner]) -> Self {
        let joined = |all: &[Bounds]| all.iter().copied().fold(Bounds::NONE, Bounds::joined);
        let lines = curve.len().saturating_sub(1).max(1);
        let bottom = (0..lines).step_by(LINES).map(|first| {
            let points = &curve[first..curve.len().min(first + LINES + 1)];
            points.iter().map(Bounds::of).fold(Bounds::NONE, Bounds::joined)
        });
        let mut levels = vec![bottom.collect::<Vec<_>>()];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            let above = below.chunks(2).map(joined).collect();
            levels.push(above);
        }
        Self { levels }
    }

    /// The least deviation of a point from the curve that it was made of.
    pub(super) fn least(&self, curve: &[Corner], x: f64, y: f64) -> f64 {
        let mut best = f64::INFINITY;
        self.search(curve, self.levels.len() - 1, 0, (x, y), &mut best);
        best
    }

    fn search(
        &self,
        curve: &[Corner],
        level: usize,
        at: usize,
        (x, y): (f64, f64),
        best: &mut f64,
    ) {
        if self.levels[level][at].least(x, y) >= *best {
            return;
        }
        let Some(below) = level.checked_sub(1) else {
            let points = &curve[at * LINES..curve.len().min((at + 1) * LINES + 1)];
            if let [only] = points {
                *best = best.min(least_between(*only, *only, x, y));
            }
            for pair in points.windows(2) {
                *best = best.min(least_between(pair[0], pair[1], x, y));
            }
            return;
        };
        let (one, other) = (2 * at, 2 * at + 1);
        let Some(bounds) = self.levels[below].get(other) else {
            return self.search(curve, below, one, (x, y), best);
        };
        let nearer_first = self.levels[below][one].least(x, y) <= bounds.least(x, y);
        for next in if nearer_first { [one, other] } else { [other, one] } {
            self.search(curve, below, next, (x, y), best);
        }
    }
}
