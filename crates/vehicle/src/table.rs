//! Interpolates tables: curves over one quantity, and maps over two.

use serde::{Deserialize, Serialize};

use tire::Number;

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BadTable {
    /// Nothing to interpolate.
    #[error("expected at least one point, found none")]
    Empty,
    /// A value is missing, or one too many.
    #[error("expected {expected} values, found {found}")]
    Count {
        /// Points of the axes.
        expected: usize,
        /// Values.
        found: usize,
    },
    /// A point of an axis does not follow the one before it.
    #[error("expected rising points, found {after} after {before}")]
    NotRising {
        /// The point before.
        before: f64,
        /// The point that is not above it.
        after: f64,
    },
    /// A value that is not a finite number.
    #[error("expected finite numbers, found {0}")]
    NotFinite(f64),
}

/// A curve: straight lines between points, constant outside of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PiecewiseLinearCurve {
    x: Vec<f64>,
    y: Vec<f64>,
}

/// Values over a grid of two quantities, each linear between points (bilinear), constant outside of them; N of them at each point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BilinearMap<const N: usize = 1> {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Row by row: the values at the first x over all y come first, all N of a point together.
    z: Vec<f64>,
}

impl From<f64> for PiecewiseLinearCurve {
    /// A constant.
    fn from(value: f64) -> Self {
        Self { x: vec![0.0], y: vec![value] }
    }
}

impl PiecewiseLinearCurve {
    /// A curve through points.
    ///
    /// # Errors
    /// When the points do not rise, are none, are not as many as the values, or are not finite.
    pub fn new(x: Vec<f64>, y: Vec<f64>) -> Result<Self, BadTable> {
        check_axis(&x)?;
        check_values(x.len(), &y)?;
        Ok(Self { x, y })
    }

    /// Its value if it has only one.
    #[inline]
    pub fn constant_value(&self) -> Option<f64> {
        if let [value] = self.y[..] { Some(value) } else { None }
    }

    /// The first and the last point; `None` of a constant, which has no end.
    pub fn argument_range(&self) -> Option<[f64; 2]> {
        if self.x.len() > 1 { axis_range(&self.x) } else { None }
    }

    /// The values at its points.
    pub fn values(&self) -> &[f64] {
        &self.y
    }

    /// The steepest slope, without its sign.
    pub fn steepest_slope(&self) -> f64 {
        let lines = self.x.windows(2).zip(self.y.windows(2));
        lines.map(|(x, y)| ((y[1] - y[0]) / (x[1] - x[0])).abs()).fold(0.0, f64::max)
    }

    /// The same curve higher by a value.
    #[must_use]
    pub fn offset_by(mut self, by: f64) -> Self {
        self.y.iter_mut().for_each(|value| *value += by);
        self
    }

    /// The value at `x`. At a point, the slope is that of the line behind it.
    #[inline]
    pub fn interpolate<T: Number>(&self, x: T) -> T {
        if self.x.len() == 1 {
            return self.y[0].into();
        }
        let (i, share) = interval_and_share(&self.x, x);
        share * (self.y[i + 1] - self.y[i]) + self.y[i]
    }
}

impl<const N: usize> BilinearMap<N> {
    /// A map over a grid; `z` has the values row by row, one row for each x, with all N values of a point together.
    ///
    /// # Errors
    /// When the points of an axis do not rise or are none, or values are missing or not finite.
    pub fn new(x: Vec<f64>, y: Vec<f64>, z: Vec<f64>) -> Result<Self, BadTable> {
        check_axis(&x)?;
        check_axis(&y)?;
        check_values(N * x.len() * y.len(), &z)?;
        Ok(Self { x, y, z })
    }

    /// The first and the last point of both axes; `None` of one with a single point, along which nothing changes.
    pub fn argument_ranges(&self) -> [Option<[f64; 2]>; 2] {
        [&self.x, &self.y].map(|axis| if axis.len() > 1 { axis_range(axis) } else { None })
    }

    /// The values at its points, all N of a point together.
    pub fn values(&self) -> impl Iterator<Item = &[f64]> {
        self.z.chunks_exact(N)
    }

    /// The steepest slope along x of all values, without its sign.
    pub fn steepest_slope(&self) -> f64 {
        let row = N * self.y.len();
        let rows = self.z.chunks_exact(row).zip(self.z.chunks_exact(row).skip(1));
        let slopes = self.x.windows(2).zip(rows).flat_map(|(x, (low, high))| {
            low.iter().zip(high).map(move |(low, high)| ((high - low) / (x[1] - x[0])).abs())
        });
        slopes.fold(0.0, f64::max)
    }

    /// The values at (`x`, `y`).
    #[inline]
    pub fn interpolate<T: Number>(&self, x: T, y: T) -> [T; N] {
        let (i, over_x) = interval_and_share(&self.x, x);
        let (j, over_y) = interval_and_share(&self.y, y);
        let next = ((i + 1).min(self.x.len() - 1), (j + 1).min(self.y.len() - 1));
        let value = |i: usize, j: usize, k: usize| self.z[(i * self.y.len() + j) * N + k];
        std::array::from_fn(|k| {
            let row = |i: usize| {
                let low = value(i, j, k);
                over_y * (value(i, next.1, k) - low) + low
            };
            let low = row(i);
            low + over_x * (row(next.0) - low)
        })
    }
}

fn axis_range(axis: &[f64]) -> Option<[f64; 2]> {
    Some([*axis.first()?, *axis.last()?])
}

/// The interval that a value is in, and its share of the interval that lies below the value: 0 to 1.
#[inline]
fn interval_and_share<T: Number>(axis: &[f64], x: T) -> (usize, T) {
    let last = axis.len() - 1;
    let i = axis.partition_point(|point| x >= *point).saturating_sub(1);
    if i >= last {
        return (last.saturating_sub(1), if last == 0 { T::zero() } else { T::one() });
    }
    if x < axis[0] {
        return (0, T::zero());
    }
    (i, (x - axis[i]) / (axis[i + 1] - axis[i]))
}

fn check_axis(axis: &[f64]) -> Result<(), BadTable> {
    if axis.is_empty() {
        return Err(BadTable::Empty);
    }
    if let Some(value) = axis.iter().find(|value| !value.is_finite()) {
        return Err(BadTable::NotFinite(*value));
    }
    match axis.windows(2).find(|pair| pair[1] <= pair[0]) {
        Some(pair) => Err(BadTable::NotRising { before: pair[0], after: pair[1] }),
        None => Ok(()),
    }
}

fn check_values(expected: usize, values: &[f64]) -> Result<(), BadTable> {
    if values.len() != expected {
        return Err(BadTable::Count { expected, found: values.len() });
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(BadTable::NotFinite(*value)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use num_dual::{Dual64, first_derivative};

    use super::*;

    #[test]
    fn curve_is_straight_between_points_and_constant_outside() {
        let curve = PiecewiseLinearCurve::new(vec![-1.0, 0.0, 2.0], vec![3.0, 1.0, 5.0]).expect("a curve");
        let expected =
            [(-9.0, 3.0), (-1.0, 3.0), (-0.5, 2.0), (0.0, 1.0), (1.5, 4.0), (2.0, 5.0), (9.0, 5.0)];
        for (x, y) in expected {
            assert_eq!(curve.interpolate(x), y, "at {x}");
        }
        assert!(curve.interpolate(f64::NAN).is_nan());
        assert_eq!(PiecewiseLinearCurve::from(4.0).interpolate(-7.0), 4.0);
        let (_, slope) = first_derivative(|x: Dual64| curve.interpolate(x), 1.0);
        assert_eq!(slope, 2.0);
    }

    #[test]
    fn map_is_bilinear() {
        let (x, y) = (vec![0.0, 1.0, 3.0], vec![10.0, 20.0]);
        let plane = |x: f64, y: f64| 2.0 * x - 0.5 * y + 0.25 * x * y;
        let z = x.iter().flat_map(|x| y.iter().map(move |y| plane(*x, *y))).collect();
        let map = BilinearMap::<1>::new(x, y, z).expect("a map");
        for (x, y) in [(0.0, 10.0), (0.5, 12.0), (1.0, 20.0), (2.5, 15.0), (3.0, 20.0)] {
            assert!((map.interpolate(x, y)[0] - plane(x, y)).abs() < 1e-12, "at {x}, {y}");
        }
        assert_eq!(map.interpolate(9.0, 0.0), [plane(3.0, 10.0)]);
        assert_eq!(map.interpolate(-9.0, 99.0), [plane(0.0, 20.0)]);
        assert_eq!(map.argument_ranges(), [Some([0.0, 3.0]), Some([10.0, 20.0])]);
        let row = BilinearMap::<1>::new(vec![5.0], vec![0.0, 1.0], vec![1.0, 3.0]);
        let row = row.expect("a map of one row");
        assert_eq!((row.interpolate(7.0, 0.5), row.argument_ranges()), ([2.0], [None, Some([0.0, 1.0])]));
    }

    #[test]
    fn several_values_share_a_grid() {
        let z = vec![1.0, 10.0, 2.0, 20.0, 3.0, 30.0, 6.0, 60.0];
        let map = BilinearMap::<2>::new(vec![0.0, 1.0], vec![0.0, 1.0], z).expect("a map");
        for (x, y, value) in [(0.0, 0.0, 1.0), (0.0, 0.5, 1.5), (0.5, 0.0, 2.0), (1.0, 1.0, 6.0)] {
            assert_eq!(map.interpolate(x, y), [value, 10.0 * value]);
        }
        assert_eq!(map.steepest_slope(), 40.0);
        assert_eq!(map.values().map(|it| it[0]).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 6.0]);
    }

    #[test]
    fn a_curve_knows_its_ends_and_its_steepest_line() {
        let curve = PiecewiseLinearCurve::new(vec![-1.0, 0.0, 2.0], vec![3.0, 1.0, 2.0]).expect("a curve");
        assert_eq!((curve.argument_range(), curve.steepest_slope()), (Some([-1.0, 2.0]), 2.0));
        assert_eq!(curve.offset_by(0.5).values(), [3.5, 1.5, 2.5]);
        assert_eq!(
            (
                PiecewiseLinearCurve::from(4.0).argument_range(),
                PiecewiseLinearCurve::from(4.0).steepest_slope()
            ),
            (None, 0.0)
        );
    }

    #[test]
    fn bad_tables_are_refused() {
        assert_eq!(PiecewiseLinearCurve::new(vec![], vec![]), Err(BadTable::Empty));
        let error = PiecewiseLinearCurve::new(vec![0.0, 0.0], vec![1.0, 2.0]).expect_err("not rising");
        assert_eq!(error.to_string(), "expected rising points, found 0 after 0");
        let error =
            BilinearMap::<1>::new(vec![0.0], vec![0.0, 1.0], vec![1.0]).expect_err("a value is missing");
        assert_eq!(error.to_string(), "expected 2 values, found 1");
        assert!(matches!(PiecewiseLinearCurve::new(vec![0.0], vec![f64::NAN]), Err(BadTable::NotFinite(_))));
    }
}
