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
pub struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A map over two quantities: bilinear between points, constant outside of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Map {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Row by row: the values at the first x over all y come first.
    z: Vec<f64>,
}

impl From<f64> for Curve {
    /// A constant.
    fn from(value: f64) -> Self {
        Self { x: vec![0.0], y: vec![value] }
    }
}

impl Curve {
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
    pub fn constant(&self) -> Option<f64> {
        if let [value] = self.y[..] { Some(value) } else { None }
    }

    /// The value at `x`. At a point, the slope is that of the line behind it.
    #[inline]
    pub fn at<T: Number>(&self, x: T) -> T {
        if self.x.len() == 1 {
            return self.y[0].into();
        }
        let (i, share) = place(&self.x, x);
        share * (self.y[i + 1] - self.y[i]) + self.y[i]
    }
}

impl Map {
    /// A map over a grid; `z` has the values row by row, one row for each x.
    ///
    /// # Errors
    /// When the points of an axis do not rise or are none, or values are missing or not finite.
    pub fn new(x: Vec<f64>, y: Vec<f64>, z: Vec<f64>) -> Result<Self, BadTable> {
        check_axis(&x)?;
        check_axis(&y)?;
        check_values(x.len() * y.len(), &z)?;
        Ok(Self { x, y, z })
    }

    /// The value at (`x`, `y`).
    #[inline]
    pub fn at<T: Number>(&self, x: T, y: T) -> T {
        let (i, over_x) = place(&self.x, x);
        let (j, over_y) = place(&self.y, y);
        let row = |i: usize| {
            let values = &self.z[i * self.y.len()..][..self.y.len()];
            let next = values[(j + 1).min(values.len() - 1)];
            over_y * (next - values[j]) + values[j]
        };
        let low = row(i);
        low + over_x * (row((i + 1).min(self.x.len() - 1)) - low)
    }
}

/// The interval that a value is in, and its share of the interval that lies below the value: 0 to 1.
#[inline]
fn place<T: Number>(axis: &[f64], x: T) -> (usize, T) {
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
        let curve = Curve::new(vec![-1.0, 0.0, 2.0], vec![3.0, 1.0, 5.0]).expect("a curve");
        let expected =
            [(-9.0, 3.0), (-1.0, 3.0), (-0.5, 2.0), (0.0, 1.0), (1.5, 4.0), (2.0, 5.0), (9.0, 5.0)];
        for (x, y) in expected {
            assert_eq!(curve.at(x), y, "at {x}");
        }
        assert!(curve.at(f64::NAN).is_nan());
        assert_eq!(Curve::from(4.0).at(-7.0), 4.0);
        let (_, slope) = first_derivative(|x: Dual64| curve.at(x), 1.0);
        assert_eq!(slope, 2.0);
    }

    #[test]
    fn map_is_bilinear() {
        let (x, y) = (vec![0.0, 1.0, 3.0], vec![10.0, 20.0]);
        let plane = |x: f64, y: f64| 2.0 * x - 0.5 * y + 0.25 * x * y;
        let z = x.iter().flat_map(|x| y.iter().map(move |y| plane(*x, *y))).collect();
        let map = Map::new(x, y, z).expect("a map");
        for (x, y) in [(0.0, 10.0), (0.5, 12.0), (1.0, 20.0), (2.5, 15.0), (3.0, 20.0)] {
            assert!((map.at(x, y) - plane(x, y)).abs() < 1e-12, "at {x}, {y}");
        }
        assert_eq!(map.at(9.0, 0.0), plane(3.0, 10.0));
        assert_eq!(map.at(-9.0, 99.0), plane(0.0, 20.0));
        let row = Map::new(vec![5.0], vec![0.0, 1.0], vec![1.0, 3.0]).expect("a map of one row");
        assert_eq!(row.at(7.0, 0.5), 2.0);
    }

    #[test]
    fn bad_tables_are_refused() {
        assert_eq!(Curve::new(vec![], vec![]), Err(BadTable::Empty));
        let error = Curve::new(vec![0.0, 0.0], vec![1.0, 2.0]).expect_err("not rising");
        assert_eq!(error.to_string(), "expected rising points, found 0 after 0");
        let error = Map::new(vec![0.0], vec![0.0, 1.0], vec![1.0]).expect_err("a value is missing");
        assert_eq!(error.to_string(), "expected 2 values, found 1");
        assert!(matches!(Curve::new(vec![0.0], vec![f64::NAN]), Err(BadTable::NotFinite(_))));
    }
}
