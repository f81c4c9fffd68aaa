//! Hands plots over as diagrams for the replay.

use html_page::{CssClass, Plot, PlotAxis};
use plugin::{AnalysisServices, Diagram, DiagramLayer, DiagramLayerRole, DiagramLayerShape};

/// A dashed line of two points is drawn in so many pieces; and how many dashes a line has.
const PIECES: usize = 60;
const DASHES: usize = 12;

/// Columns of a layer.
struct LayerColumns {
    x: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

/// Hands a plot over, whose colours `c0`, `c1` .. are those of `methods`. What the viewer has no axis for, logarithms, is
/// computed before.
pub fn show_plot(plot: &Plot, group: &str, title: &str, methods: &[&str], host: &mut dyn AnalysisServices) {
    let columns: Vec<LayerColumns> = plot.layers.iter().map(|layer| layer_columns(plot, layer)).collect();
    let layers = plot.layers.iter().zip(&columns).map(|(layer, columns)| {
        let (role, name) = layer_role_and_label(layer.class, methods);
        let shape = match layer.shape {
            html_page::PlotLayerShape::Line | html_page::PlotLayerShape::Dash => DiagramLayerShape::Line,
            html_page::PlotLayerShape::Band => DiagramLayerShape::Band,
            html_page::PlotLayerShape::Dot(_) => DiagramLayerShape::Points,
        };
        let LayerColumns { x, lower, upper } = columns;
        DiagramLayer { name, shape, role, x, y: lower, upper }
    });
    let labels = [&plot.x, &plot.y].map(|axis| axis.linear_label());
    let ends = |axis: &PlotAxis| [axis.low(), axis.high()].map(|end| axis.to_linear_scale(end));
    host.add_diagram(
        group,
        &Diagram {
            title,
            axes: [&labels[0], &labels[1]],
            ranges: [ends(&plot.x), ends(&plot.y)],
            layers: layers.collect(),
        },
    );
}

fn layer_columns(plot: &Plot, layer: &html_page::PlotLayer) -> LayerColumns {
    let mut points: Vec<(f64, [f64; 2])> = layer
        .points
        .iter()
        .map(|&(x, ends)| (plot.x.to_linear_scale(x), ends.map(|end| plot.y.to_linear_scale(end))))
        .collect();
    if layer.shape == html_page::PlotLayerShape::Dash {
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
    LayerColumns {
        x: points.iter().map(|point| point.0).collect(),
        lower: points.iter().map(|point| point.1[0]).collect(),
        upper: points.iter().map(|point| point.1[1]).collect(),
    }
}

fn layer_role_and_label<'a>(class: CssClass, methods: &[&'a str]) -> (DiagramLayerRole, &'a str) {
    match class.strip_prefix('c').and_then(|index| index.parse::<usize>().ok()) {
        Some(place) => (DiagramLayerRole::Estimate, methods.get(place).copied().unwrap_or("")),
        None => (DiagramLayerRole::Measurement, "measured"),
    }
}
