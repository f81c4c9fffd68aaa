//! Smooths tables by uniform cubic B-splines, so that the search for a lap has second derivatives everywhere.

use std::array;

use tire::Number;

/// Equidistant points of a quantity.
#[derive(Clone, Debug)]
struct UniformAxis {
    first: f64,
    spacing: f64,
    last: usize,
}

impl UniformAxis {
    fn new([low, high]: [f64; 2], intervals: usize) -> Self {
        UniformAxis { first: low, spacing: (high - low) / intervals as f64, last: intervals }
    }

    /// An axis along which nothing changes.
    fn single(value: f64) -> Self {
        UniformAxis { first: value, spacing: 1.0, last: 0 }
    }

    fn points(&self) -> impl Iterator<Item = f64> {
        (0..=self.last).map(|i| self.first + self.spacing * i as f64)
    }

    /// The four points around a value, those beyond an end being the end, and their weights. These have continuous second
    /// derivatives, are not negative, and add up to 1.
    #[inline]
    fn basis<T: Number>(&self, x: T) -> ([usize; 4], [T; 4]) {
        let last = self.last as f64;
        let u = (x - self.first) / self.spacing;
        // Beyond these the four points are one.
        let u = if u.re() < -2.0 {
            T::from(-2.0)
        } else if u.re() > last + 2.0 {
            T::from(last + 2.0)
        } else {
            u
        };
        let before = u.re().floor();
        let t = u - before;
        let (t_2, rest) = (t * t, -t + 1.0);
        let t_3 = t_2 * t;
        let weights = [
            rest * rest * rest / 6.0,
            (t_3 * 3.0 - t_2 * 6.0 + 4.0) / 6.0,
            (t_3 * -3.0 + t_2 * 3.0 + t * 3.0 + 1.0) / 6.0,
            t_3 / 6.0,
        ];
        let points = array::from_fn(|k| (before + k as f64 - 1.0).clamp(0.0, last) as usize);
        (points, weights)
    }
}

/// A curve near a function of one quantity: straight lines stay as they are, a kink is rounded over two intervals to both sides. It is
/// constant outside of its range.
#[derive(Clone, Debug)]
pub struct BSplineCurve {
    axis: UniformAxis,
    values: Vec<f64>,
}

impl BSplineCurve {
    /// The curve near a function within a range.
    pub fn near(range: [f64; 2], intervals: usize, function: impl Fn(f64) -> f64) -> Self {
        let axis = UniformAxis::new(range, intervals);
        let values = axis.points().map(function).collect();
        BSplineCurve { axis, values }
    }

    /// Its value at `x`.
    #[inline]
    pub fn value<T: Number>(&self, x: T) -> T {
        let (points, weights) = self.axis.basis(x);
        points.iter().zip(weights).fold(T::zero(), |sum, (i, weight)| sum + weight * self.values[*i])
    }

    /// Its largest value.
    pub fn maximum(&self) -> f64 {
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// N surfaces near functions of two quantities, as [`BSplineCurve`].
#[derive(Clone, Debug)]
pub struct BSplineSurfaces<const N: usize> {
    axes: [UniformAxis; 2],
    /// Row by row: the values at the first x over all y come first.
    values: Vec<[f64; N]>,
}

impl<const N: usize> BSplineSurfaces<N> {
    /// The surfaces near functions within these ranges; along a quantity without a range nothing changes.
    pub fn near(
        ranges: [Option<[f64; 2]>; 2],
        intervals: usize,
        functions: impl Fn(f64, f64) -> [f64; N],
    ) -> Self {
        let axes = ranges
            .map(|range| range.map_or(UniformAxis::single(0.0), |range| UniformAxis::new(range, intervals)));
        let values = axes[0].points().flat_map(|x| axes[1].points().map(move |y| [x, y]));
        let values = values.map(|[x, y]| functions(x, y)).collect();
        BSplineSurfaces { axes, values }
    }

    /// The values at (`x`, `y`).
    #[inline]
    pub fn values<T: Number>(&self, [x, y]: [T; 2]) -> [T; N] {
        let (rows, over_x) = self.axes[0].basis(x);
        let (columns, over_y) = self.axes[1].basis(y);
        let width = self.axes[1].last + 1;
        array::from_fn(|n| {
            let row = |i: usize| {
                let value = |k: usize| over_y[k] * self.values[i * width + columns[k]][n];
                value(0) + value(1) + value(2) + value(3)
            };
            (0..4).fold(T::zero(), |sum, k| sum + over_x[k] * row(rows[k]))
        })
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use num_dual::{Dual2_64, second_derivative};

    use super::*;

    #[test]
    fn a_straight_line_is_kept_and_a_kink_is_rounded() {
        let kink = |x: f64| if x < 1.0 { 2.0 + x } else { 4.0 - x };
        let curve = BSplineCurve::near([-1.0, 3.0], 40, kink);
        for x in [-0.7, 0.33, 0.79, 1.21, 2.7] {
            assert_relative_eq!(curve.value(x), kink(x), max_relative = 1e-14);
        }
        assert!((2.9..3.0).contains(&curve.value(1.0)));
        for x in [-9.0, 9.0] {
            assert_relative_eq!(curve.value(x), 1.0, max_relative = 1e-14);
        }
        assert_eq!(curve.maximum(), 3.0);
    }

    #[test]
    fn second_derivatives_are_continuous_even_at_the_ends() {
        let curve = BSplineCurve::near([0.0, 1.0], 10, |x| (6.0 * x).sin());
        for i in -20..=120 {
            let knot = 0.1 * f64::from(i);
            let at = |x: f64| second_derivative(|x: Dual2_64| curve.value(x), x);
            let (before, behind) = (at(knot - 1e-9), at(knot + 1e-9));
            assert!((before.1 - behind.1).abs() < 1e-6, "at {knot}: {before:?} {behind:?}");
            assert!((before.2 - behind.2).abs() < 1e-4, "at {knot}: {before:?} {behind:?}");
        }
    }

    #[test]
    fn surfaces_keep_planes_and_what_changes_along_one_quantity_alone() {
        let planes = |x: f64, y: f64| [2.0 * x - y + 0.5, 3.0 * y];
        let surfaces = BSplineSurfaces::near([Some([0.0, 2.0]), Some([-1.0, 1.0])], 16, planes);
        for (x, y) in [(0.4, 0.1), (1.7, -0.6), (1.0, 0.0)] {
            for (value, expected) in surfaces.values([x, y]).into_iter().zip(planes(x, y)) {
                assert_relative_eq!(value, expected, epsilon = 1e-13);
            }
        }
        let along_y = BSplineSurfaces::near([None, Some([-1.0, 1.0])], 16, planes);
        assert_relative_eq!(along_y.values([77.0, 0.25])[1], 0.75, epsilon = 1e-13);
    }
}
