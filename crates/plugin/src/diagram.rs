//! Describes a diagram of y over x that an analysis hands over, and lends it across the boundary.
#![allow(unsafe_code, reason = "pointers of the other side become slices here")]

#[cfg(feature = "load")]
use crate::abi::slice;
use crate::abi::{self, Text};

/// A diagram of y over x.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagram<'a> {
    /// Its title.
    pub title: &'a str,
    /// What the axes show, x and y, with units: `slip angle [rad]`.
    pub axes: [&'a str; 2],
    /// The ends of the axes, x and y. An end that is no number lies where the layers end.
    pub ranges: [[f64; 2]; 2],
    /// What is drawn, from back to front.
    pub layers: Vec<Layer<'a>>,
}

/// One thing that a diagram shows. Its columns are of the same length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer<'a> {
    /// Its name in the legend; layers without a name are not in it.
    pub name: &'a str,
    /// How it is drawn.
    pub shape: Shape,
    /// What it stands for, which decides its colour.
    pub role: Role,
    /// Where its points are; what is no number interrupts a line.
    pub x: &'a [f64],
    /// The height of its points, or the lower end of a band.
    pub y: &'a [f64],
    /// The upper end of a band; lines and points have none.
    pub upper: &'a [f64],
}

/// How a layer is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Shape {
    /// Points that are connected.
    Line,
    /// Points.
    Points,
    /// The area between two lines.
    Band,
}

/// What a layer stands for, as in a scenario's `[view]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Role {
    /// Nothing in particular.
    Other,
    /// A set point.
    Reference,
    /// The truth.
    Plant,
    /// What a sensor says.
    Measurement,
    /// What was estimated.
    Estimate,
    /// A limit.
    Limit,
}

#[cfg(feature = "load")]
impl Shape {
    const ALL: [Self; 3] = [Self::Line, Self::Points, Self::Band];
}

#[cfg(feature = "load")]
impl Role {
    const ALL: [Self; 6] =
        [Self::Other, Self::Reference, Self::Plant, Self::Measurement, Self::Estimate, Self::Limit];
}

/// Lends a diagram; columns may differ in length only by a mistake, and then the rest is left out.
pub(crate) fn lend<T>(diagram: &Diagram, work: impl FnOnce(&abi::Diagram) -> T) -> T {
    let layers: Vec<_> = diagram.layers.iter().map(layer).collect();
    work(&abi::Diagram {
        title: Text::new(diagram.title),
        axes: diagram.axes.map(Text::new),
        ranges: diagram.ranges,
        layers: layers.as_ptr(),
        count: layers.len(),
    })
}

fn layer(layer: &Layer) -> abi::Layer {
    let len = layer.x.len().min(layer.y.len());
    let band = layer.shape == Shape::Band;
    abi::Layer {
        name: Text::new(layer.name),
        shape: layer.shape as u32,
        role: layer.role as u32,
        x: layer.x.as_ptr(),
        y: layer.y.as_ptr(),
        upper: if band { layer.upper.as_ptr() } else { std::ptr::null() },
        len: if band { len.min(layer.upper.len()) } else { len },
    }
}

/// Calls `work` with a diagram of the other side. Shapes that are not known are lines.
///
/// # Safety
/// All that is pointed to lives as long as the call.
#[cfg(feature = "load")]
pub(crate) unsafe fn with_diagram<T>(
    diagram: &abi::Diagram,
    work: impl FnOnce(&Diagram) -> T,
) -> T {
    // SAFETY: as the caller promises; so below.
    let text = |text: Text| unsafe { text.get() };
    // SAFETY: see above.
    let lent = unsafe { slice(diagram.layers, diagram.count) };
    let (title, axes) = (text(diagram.title), diagram.axes.map(text));
    let names: Vec<_> = lent.iter().map(|layer| text(layer.name)).collect();
    let layers = lent.iter().zip(&names).map(|(layer, name)| Layer {
        name,
        shape: Shape::ALL.get(layer.shape as usize).copied().unwrap_or(Shape::Line),
        role: Role::ALL.get(layer.role as usize).copied().unwrap_or(Role::Other),
        // SAFETY: see above.
        x: unsafe { slice(layer.x, layer.len) },
        // SAFETY: see above.
        y: unsafe { slice(layer.y, layer.len) },
        // SAFETY: see above; of what is no band it is null.
        upper: unsafe { slice(layer.upper, layer.len) },
    });
    let axes = [&*axes[0], &*axes[1]];
    let layers = layers.collect();
    work(&Diagram { title: &title, axes, ranges: diagram.ranges, layers })
}
