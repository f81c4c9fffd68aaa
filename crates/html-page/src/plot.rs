//! Holds what a plot shows: lines, bands and points between axes. Who draws it decides how it looks.

use crate::axis::Axis;

/// A plot. Points that are no numbers are left out.
#[derive(Clone, Debug)]
pub struct Plot {
    /// The axis to the right.
    pub x: Axis,
    /// The axis upwards.
    pub y: Axis,
    /// On the page [px]: width, height.
    pub size: [f64; 2],
    /// From back to front.
    pub layers: Vec<Layer>,
}

/// Classes of the page's CSS: colours by the role of what is drawn.
pub type Class = &'static str;

/// One thing that a plot shows.
#[derive(Clone, Debug)]
pub struct Layer {
    /// How it is drawn.
    pub shape: Shape,
    /// Its colour.
    pub class: Class,
    /// In the legend, unless it is empty.
    pub name: String,
    /// x, and the lower and the upper end of y, which are the same but for bands.
    pub points: Vec<(f64, [f64; 2])>,
}

/// How a layer is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
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
    pub fn new(size: [f64; 2], x: Axis, y: Axis) -> Self {
        Self { x, y, size, layers: Vec::new() }
    }

    fn add(&mut self, shape: Shape, points: &[(f64, f64)], class: Class, name: &str) {
        let points = points.iter().map(|&(x, y)| (x, [y; 2])).collect();
        self.layers.push(Layer { shape, class, name: name.to_owned(), points });
    }

    /// A line; a key in the legend if it has a name.
    pub fn line(&mut self, points: &[(f64, f64)], class: Class, name: &str) {
        self.add(Shape::Line, points, class, name);
    }

    /// A dashed line.
    pub fn dashes(&mut self, points: &[(f64, f64)], class: Class, name: &str) {
        self.add(Shape::Dash, points, class, name);
    }

    /// The area between two lines: x, lower and upper end.
    pub fn band(&mut self, points: &[(f64, [f64; 2])], class: Class, name: &str) {
        let (name, points) = (name.to_owned(), points.to_vec());
        self.layers.push(Layer { shape: Shape::Band, class, name, points });
    }

    /// Points.
    pub fn dots(&mut self, points: &[(f64, f64)], radius: f64, class: Class, name: &str) {
        self.add(Shape::Dot(radius), points, class, name);
    }

    /// A dashed line through the whole plot at a height.
    pub fn level(&mut self, y: f64, class: Class, name: &str) {
        self.dashes(&[(self.x.low(), y), (self.x.high(), y)], class, name);
    }

    /// A dashed line through the whole plot at a place.
    pub fn mark(&mut self, x: f64, class: Class, name: &str) {
        self.dashes(&[(x, self.y.low()), (x, self.y.high())], class, name);
    }
}
