//! Holds what a plot shows: lines, bands and points between axes. Who draws it decides how it looks.

use crate::axis::PlotAxis;

/// A plot. Points that are no numbers are left out.
#[derive(Clone, Debug)]
pub struct Plot {
    /// The axis to the right.
    pub x: PlotAxis,
    /// The axis upwards.
    pub y: PlotAxis,
    /// On the page [px]: width, height.
    pub size: [f64; 2],
    /// From back to front.
    pub layers: Vec<PlotLayer>,
    /// Texts above points.
    pub labels: Vec<PlotLabel>,
}

/// A text above a point.
#[derive(Clone, Debug)]
pub struct PlotLabel {
    /// The point.
    pub at: (f64, f64),
    /// What stands there.
    pub text: String,
}

/// Classes of the page's CSS: colours by the role of what is drawn.
pub type CssClass = &'static str;

/// One thing that a plot shows.
#[derive(Clone, Debug)]
pub struct PlotLayer {
    /// How it is drawn.
    pub shape: PlotLayerShape,
    /// Its colour.
    pub class: CssClass,
    /// In the legend, unless it is empty.
    pub name: String,
    /// x, and the lower and the upper end of y, which are the same but for bands.
    pub points: Vec<(f64, [f64; 2])>,
}

/// How a layer is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlotLayerShape {
    /// A line.
    Line,
    /// A dashed line.
    Dash,
    /// The area between two lines.
    Band,
    /// Points of this radius on the page [px].
    Dot(f64),
}

impl Plot {
    /// An empty plot of a size [px].
    pub fn new(size: [f64; 2], x: PlotAxis, y: PlotAxis) -> Self {
        Self { x, y, size, layers: Vec::new(), labels: Vec::new() }
    }

    fn add_layer(&mut self, shape: PlotLayerShape, points: &[(f64, f64)], class: CssClass, name: &str) {
        let points = points.iter().map(|&(x, y)| (x, [y; 2])).collect();
        self.layers.push(PlotLayer { shape, class, name: name.to_owned(), points });
    }

    /// A line; a key in the legend if it has a name.
    pub fn add_line(&mut self, points: &[(f64, f64)], class: CssClass, name: &str) {
        self.add_layer(PlotLayerShape::Line, points, class, name);
    }

    /// A dashed line.
    pub fn add_dashed_line(&mut self, points: &[(f64, f64)], class: CssClass, name: &str) {
        self.add_layer(PlotLayerShape::Dash, points, class, name);
    }

    /// The area between two lines: x, lower and upper end.
    pub fn add_band(&mut self, points: &[(f64, [f64; 2])], class: CssClass, name: &str) {
        let (name, points) = (name.to_owned(), points.to_vec());
        self.layers.push(PlotLayer { shape: PlotLayerShape::Band, class, name, points });
    }

    /// Points.
    pub fn add_dots(&mut self, points: &[(f64, f64)], radius: f64, class: CssClass, name: &str) {
        self.add_layer(PlotLayerShape::Dot(radius), points, class, name);
    }

    /// A text above a point.
    pub fn add_label(&mut self, at: (f64, f64), text: &str) {
        self.labels.push(PlotLabel { at, text: text.to_owned() });
    }

    /// A dashed line through the whole plot at a height.
    pub fn add_horizontal_line(&mut self, y: f64, class: CssClass, name: &str) {
        self.add_dashed_line(&[(self.x.low(), y), (self.x.high(), y)], class, name);
    }

    /// A dashed line through the whole plot at a place.
    pub fn add_vertical_line(&mut self, x: f64, class: CssClass, name: &str) {
        self.add_dashed_line(&[(x, self.y.low()), (x, self.y.high())], class, name);
    }
}
