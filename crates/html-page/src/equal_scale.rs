//! Makes plots in which a unit is as long to the right as upwards.

use crate::axis::PlotAxis;
use crate::plot::Plot;
use crate::svg::{MARGIN, left_margin, upward_ticks};

/// The size of such a plot [px].
#[derive(Clone, Copy)]
pub struct EqualScale {
    /// Its width, with the axes.
    pub width: f64,
    /// Least and largest height of the drawing, without the axes.
    pub heights: [f64; 2],
    /// Space around the points.
    pub space: f64,
}

/// A plot with its scale.
pub struct ScaledPlot {
    /// The plot, empty.
    pub plot: Plot,
    /// Pixels for a unit.
    pub scale: f64,
}

impl EqualScale {
    /// An empty plot around points, the labels those of the axes to the right and upwards.
    pub fn plot_around(self, labels: [&str; 2], points: &[(f64, f64)]) -> ScaledPlot {
        let [(x, x_extent), (y, y_extent)] = [
            middle_and_extent(points.iter().map(|it| it.0)),
            middle_and_extent(points.iter().map(|it| it.1)),
        ];
        let around = |label: &str, middle: f64, length: f64| {
            PlotAxis::linear(label, middle - 0.5 * length, middle + 0.5 * length)
        };
        let [least_left, right, above, below] = MARGIN;
        let mut left = least_left;
        loop {
            let width = self.width - left - right;
            let inside = width - 2.0 * self.space;
            let wanted = inside * y_extent / x_extent + 2.0 * self.space;
            let height = wanted.clamp(self.heights[0], self.heights[1]).round();
            let scale = (inside / x_extent).min((height - 2.0 * self.space) / y_extent);
            let y_axis = around(labels[1], y, height / scale);
            let needed = left_margin(&upward_ticks(&y_axis, height));
            if needed <= left {
                let x_axis = around(labels[0], x, width / scale);
                let plot = Plot::new([self.width, height + above + below], x_axis, y_axis);
                return ScaledPlot { plot, scale };
            }
            left = needed;
        }
    }
}

/// The middle of finite values, and from the least to the largest; never 0.
fn middle_and_extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low <= high { (0.5 * (low + high), (high - low).max(1e-3)) } else { (0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width and height of the drawing within the axes [px].
    fn drawn_size(plot: &Plot) -> [f64; 2] {
        let drawn = plot.figure_without_legend("").0;
        let inner = drawn.split("<svg x=").nth(1).expect("a drawing");
        ["width", "height"].map(|name| {
            let value = inner.split(&format!("{name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
            value.and_then(|text| text.parse().ok()).expect("a number")
        })
    }

    #[test]
    fn a_unit_is_as_long_to_the_right_as_upwards() {
        let sizes = EqualScale { width: 1000.0, heights: [200.0, 600.0], space: 30.0 };
        let shapes = [[400.0, 100.0], [100.0, 900.0], [3e4, 200.0], [0.0, 0.0], [2.0, 1.5]];
        // The numbers of the last place need more room than usual.
        for (shape, place) in shapes.into_iter().flat_map(|shape| [0.0, 5.4e6].map(|place| (shape, place))) {
            let points = [(0.0, place), (shape[0], place + shape[1])];
            let ScaledPlot { plot, scale } = sizes.plot_around(["X [m]", "Y [m]"], &points);
            let [width, height] = drawn_size(&plot);
            let scales = [width / (plot.x.high() - plot.x.low()), height / (plot.y.high() - plot.y.low())];
            assert!(scales.iter().all(|it| (it / scale - 1.0).abs() < 1e-6), "{shape:?} {scales:?} {scale}");
            for (axis, ends) in [(&plot.x, [0.0, shape[0]]), (&plot.y, [place, place + shape[1]])] {
                let most = 29.9 / scale;
                assert!(axis.low() <= ends[0] - most && axis.high() >= ends[1] + most, "{axis:?}");
            }
        }
    }
}
