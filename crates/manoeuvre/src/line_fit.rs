//! Recursive least-squares fit of a straight line, point by point.

use serde::{Deserialize, Serialize};

/// The sums of a least-squares line through the points so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LineFit {
    count: f64,
    mean: [f64; 2],
    xx: f64,
    xy: f64,
}

impl LineFit {
    /// The line through points.
    pub fn through_points(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut line = LineFit::default();
        points.into_iter().for_each(|(x, y)| line.add_point(x, y));
        line
    }

    /// Takes one more point (Welford's update, which loses no digits to large means).
    pub fn add_point(&mut self, x: f64, y: f64) {
        self.count += 1.0;
        let before = x - self.mean[0];
        self.mean[0] += before / self.count;
        self.mean[1] += (y - self.mean[1]) / self.count;
        self.xx += before * (x - self.mean[0]);
        self.xy += before * (y - self.mean[1]);
    }

    /// How many points there are.
    #[must_use]
    pub fn point_count(&self) -> f64 {
        self.count
    }

    /// The slope; none when all points have one x.
    #[must_use]
    pub fn slope(&self) -> Option<f64> {
        (self.count > 1.0 && self.xx > 0.0).then(|| self.xy / self.xx)
    }

    /// The value at x.
    #[must_use]
    pub fn value_at(&self, x: f64) -> Option<f64> {
        self.slope().map(|slope| self.mean[1] + slope * (x - self.mean[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::LineFit;

    #[test]
    fn the_line_of_points_on_a_line_is_that_line() {
        let line = LineFit::through_points((0..9).map(|k| (f64::from(k), 3.0 - 0.5 * f64::from(k))));
        assert_eq!((line.slope(), line.value_at(10.0)), (Some(-0.5), Some(-2.0)));
        assert_eq!(LineFit::through_points([(1.0, 2.0), (1.0, 3.0)]).slope(), None);
    }
}
