//! Hands plots over as diagrams for the replay.

use html_page::{Axis, Class, Plot};
use plugin::{Diagram, Host, Layer, Role, Shape};

/// A dashed line of two points is drawn in so many pieces; and how many dashes a line has.
const PIECES: usize = 60;
const DASHES: usize = 12;

/// Columns of a layer.
struct Columns {
    x: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

/// Hands a plot over, whose colours `c0`, `c1` .. are those of `methods`. What the viewer has no axis for, logarithms, is
/// computed before.
pub fn show(plot: &Plot, group: &str, title: &str, methods: &[&str], host: &mut dyn Host) {
    let columns: Vec<Columns> = plot.layers.iter().map(|layer| columns(plot, layer)).collect();
    let layers = plot.layers.iter().zip(&columns).map(|(layer, columns)| {
        let (role, name) = meaning(layer.class, methods);
        let shape = match layer.shape {
            html_page::Shape::Line | html_page::Shape::Dash => Shape::Line,
            html_page::Shape::Band => Shape::Band,
            html_page::Shape::Dot(_) => Shape::Points,
        };
        let Columns { x, lower, upper } = columns;
        Layer { name, shape, role, x, y: lower, upper }
    });
    let labels = [&plot.x, &plot.y].map(|axis| axis.linear_label());
    let ends = |axis: &Axis| [axis.low(), axis.high()].map(|end| axis.on_linear(end));
    host.diagram(
        group,
        &Diagram {
            title,
            axes: [&labels[0], &labels[1]],
            ranges: [ends(&plot.x), ends(&plot.y)],
            layers: layers.collect(),
        },
    );
}

fn columns(plot: &Plot, layer: &html_page::Layer) -> Columns {
    let mut points: Vec<(f64, [f64; 2])> = layer
        .points
        .iter()
        .map(|&(x, ends)| (plot.x.on_linear(x), ends.map(|end| plot.y.on_linear(end))))
        .collect();
    if layer.shape == html_page::Shape::Dash {
        if let [(x0, [y0, _]), (x1, [y1, _])] = points[..] {
            let between = |i: usize| {
                let share = i as f64 / PIECES as f64;
                (x0 + share * (x1 - x0), [y0 + share * (y1 - y0); 2])
            };
            points = (0..=PIECES).map(between).collect();
        }
        // Two thirds of each period are drawn.
        let period = points.len().div_ceil(DASHES).max(4);
        let gaps = points.iter_mut().enumerate().filter(|(i, _)| 3 * (i % period) > 2 * period);
        gaps.for_each(|(_, point)| point.1 = [f64::NAN; 2]);
    }
    Columns {
        x: points.iter().map(|point| point.0).collect(),
        lower: points.iter().map(|point| point.1[0]).collect(),
        upper: points.iter().map(|point| point.1[1]).collect(),
    }
}

fn meaning<'a>(class: Class, methods: &[&'a str]) -> (Role, &'a str) {
    match class.strip_prefix('c').and_then(|index| index.parse::<usize>().ok()) {
        Some(place) => (Role::Estimate, methods.get(place).copied().unwrap_or("")),
        None => (Role::Measurement, "measured"),
    }
}
