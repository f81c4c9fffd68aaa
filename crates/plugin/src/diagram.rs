//! Describes a diagram of y over x.

/// A diagram of y over x.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagram<'a> {
    /// Its title.
    pub title: &'a str,
    /// Labels of the axes, x and y, with units: `slip angle [rad]`.
    pub axes: [&'a str; 2],
    /// The ends of the axes, x and y. NaN stands for the end of the layers.
    pub ranges: [[f64; 2]; 2],
    /// The layers, from back to front.
    pub layers: Vec<DiagramLayer<'a>>,
}

/// A curve, points or a band of a diagram. Its columns have the same length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiagramLayer<'a> {
    /// Its name in the legend; layers without a name are not in it.
    pub name: &'a str,
    /// Its shape.
    pub shape: DiagramLayerShape,
    /// Its meaning, which decides its colour.
    pub role: DiagramLayerRole,
    /// Abscissas of its points; NaN interrupts a line.
    pub x: &'a [f64],
    /// Ordinates of its points, or lower ends of a band.
    pub y: &'a [f64],
    /// Upper ends of a band; lines and points have none.
    pub upper: &'a [f64],
}

/// Shape of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum DiagramLayerShape {
    /// Connected points.
    Line,
    /// Points.
    Points,
    /// The area between two lines.
    Band,
}

/// Meaning of a layer, as in a scenario's `[view]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum DiagramLayerRole {
    /// None of the others.
    Other,
    /// A set point.
    Reference,
    /// A quantity of the plant.
    Plant,
    /// A measurement.
    Measurement,
    /// An estimate.
    Estimate,
    /// A limit.
    Limit,
}

#[cfg(feature = "load")]
impl DiagramLayerShape {
    /// All shapes by their index.
    pub(crate) const ALL: [Self; 3] = [Self::Line, Self::Points, Self::Band];
}

#[cfg(feature = "load")]
impl DiagramLayerRole {
    /// All roles by their index.
    pub(crate) const ALL: [Self; 6] =
        [Self::Other, Self::Reference, Self::Plant, Self::Measurement, Self::Estimate, Self::Limit];
}
