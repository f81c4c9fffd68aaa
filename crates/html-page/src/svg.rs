//! Draws a plot as SVG. Colours and sizes are the page's CSS.

use std::fmt::Write;

use crate::axis::{AxisTick, PlotAxis};
use crate::escape::escape_xml;
use crate::plot::{Plot, PlotLabel, PlotLayer, PlotLayerShape};
use crate::{Markup, STYLE, Safe};

/// Space for the labels of the axes [px]: left at least, right, top, bottom.
pub(crate) const MARGIN: [f64; 4] = [70.0, 24.0, 10.0, 44.0];
/// Width of a digit, height of a line, and space for the label of the upward axis [px].
const DIGIT: f64 = 7.0;
const LINE: f64 = 12.0;
const LABEL: f64 = 30.0;
/// Usual space between ticks, to the right and upwards [px].
const SPACING: [f64; 2] = [55.0, 30.0];

/// Width of a number [px].
fn number_text_width(text: &str) -> f64 {
    DIGIT * text.chars().count() as f64
}

/// Ticks of an upward axis of a height [px].
pub(crate) fn upward_ticks(axis: &PlotAxis, height: f64) -> Vec<AxisTick> {
    axis.ticks(height, SPACING[1], |_| LINE)
}

/// Space for the numbers of an upward axis and its label [px].
pub(crate) fn left_margin(upward_ticks: &[AxisTick]) -> f64 {
    let widths = upward_ticks.iter().map(|(_, text)| LABEL + number_text_width(text));
    widths.fold(MARGIN[0], f64::max)
}

/// A plot with what its drawing rests on: the upward ticks, and from their width the place of the drawing area.
struct SvgDrawing<'a> {
    plot: &'a Plot,
    y_ticks: Vec<AxisTick>,
    /// Space for the numbers of the upward axis and its label [px].
    left: f64,
    /// Size of the drawing area [px].
    area: [f64; 2],
}

impl<'a> SvgDrawing<'a> {
    fn new(plot: &'a Plot) -> Self {
        let [full_width, full_height] = plot.size;
        let height = full_height - MARGIN[2] - MARGIN[3];
        let y_ticks = upward_ticks(&plot.y, height);
        let left = left_margin(&y_ticks);
        Self { plot, y_ticks, left, area: [full_width - left - MARGIN[1], height] }
    }

    /// Position in the drawing area [px]. Far outside is cut: browsers lose digits of large coordinates.
    fn pixel_position(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let [width, height] = self.area;
        let (x, y) =
            (self.plot.x.relative_position(x) * width, (1.0 - self.plot.y.relative_position(y)) * height);
        (x.is_finite() && y.is_finite()).then(|| (x.clamp(-1e4, 1e4), y.clamp(-1e4, 1e4)))
    }

    fn write_path(
        &self,
        svg: &mut String,
        points: impl Iterator<Item = (f64, f64)>,
        kind: &str,
        class: &str,
    ) {
        let mut path = String::new();
        let mut pen_down = false;
        for (x, y) in points {
            match self.pixel_position(x, y) {
                Some((x, y)) => {
                    let _ = write!(path, "{}{x:.1} {y:.1}", if pen_down { "L" } else { "M" });
                    pen_down = true;
                }
                None => pen_down = false,
            }
        }
        if !path.is_empty() {
            let _ = writeln!(svg, r#"<path class="{kind} {class}" d="{path}"/>"#);
        }
    }

    fn write_layer(&self, svg: &mut String, layer: &PlotLayer) {
        let PlotLayer { shape, class, points, .. } = layer;
        let lower = || points.iter().map(|&(x, ends)| (x, ends[0]));
        match shape {
            PlotLayerShape::Line => self.write_path(svg, lower(), "line", class),
            PlotLayerShape::Dash => self.write_path(svg, lower(), "dash", class),
            PlotLayerShape::Band => {
                let upper = points.iter().map(|&(x, ends)| (x, ends[1]));
                let outline = upper.chain(lower().rev());
                let inside = outline.filter(|&(x, y)| self.pixel_position(x, y).is_some());
                self.write_path(svg, inside, "band", class);
            }
            PlotLayerShape::Dot(radius) => {
                for (x, y) in lower().filter_map(|(x, y)| self.pixel_position(x, y)) {
                    let _ = writeln!(
                        svg,
                        r#"<circle class="dot {class}" cx="{x:.1}" cy="{y:.1}" r="{radius}"/>"#
                    );
                }
            }
        }
    }

    /// Above its point, or below where that is at the upper end; towards the middle at both sides.
    fn write_label(&self, svg: &mut String, label: &PlotLabel) {
        let Some((x, y)) = self.pixel_position(label.at.0, label.at.1) else { return };
        let below = y < 2.0 * LINE;
        let half = 0.5 * number_text_width(&label.text);
        let x = x.clamp(half.min(0.5 * self.area[0]), (self.area[0] - half).max(0.5 * self.area[0]));
        let y = if below { y + LINE + 6.0 } else { y - 8.0 };
        let _ =
            writeln!(svg, r#"<text class="value" x="{x:.1}" y="{y:.1}">{}</text>"#, escape_xml(&label.text));
    }

    fn write_plot(&self, svg: &mut String) {
        let (left, top) = (self.left, MARGIN[2]);
        let [width, height] = self.area;
        self.write_axes(svg);
        // An inner svg cuts off what leaves the drawing area.
        let _ = writeln!(svg, r#"<svg x="{left}" y="{top}" width="{width}" height="{height}">"#);
        self.plot.layers.iter().for_each(|layer| self.write_layer(svg, layer));
        self.plot.labels.iter().for_each(|label| self.write_label(svg, label));
        svg.push_str("</svg>\n");
    }

    fn write_axes(&self, svg: &mut String) {
        let (left, top) = (self.left, MARGIN[2]);
        let [width, height] = self.area;
        let bottom = top + height;
        for (value, text) in self.plot.x.ticks(width, SPACING[0], self::number_text_width) {
            let x = left + self.plot.x.relative_position(value) * width;
            let _ = writeln!(svg, r#"<path class="grid" d="M{x:.1} {top}V{bottom}"/>"#);
            let _ = writeln!(
                svg,
                r#"<text class="tick" x="{x:.1}" y="{:.1}">{}</text>"#,
                bottom + 16.0,
                escape_xml(&text)
            );
        }
        for (value, text) in &self.y_ticks {
            let y = top + (1.0 - self.plot.y.relative_position(*value)) * height;
            let _ = writeln!(svg, r#"<path class="grid" d="M{left} {y:.1}H{:.1}"/>"#, left + width);
            let _ = writeln!(
                svg,
                r#"<text class="tick end" x="{:.1}" y="{:.1}">{text}</text>"#,
                left - 7.0,
                y + 4.0
            );
        }
        let _ = writeln!(svg, r#"<path class="frame" d="M{left} {top}V{bottom}H{:.1}"/>"#, left + width);
        let (x, y) = (left + 0.5 * width, self.plot.size[1] - 8.0);
        let _ = writeln!(
            svg,
            r#"<text class="label" x="{x:.1}" y="{y:.1}">{}</text>"#,
            escape_xml(self.plot.x.label())
        );
        let middle = top + 0.5 * height;
        let _ = writeln!(
            svg,
            r#"<text class="label" transform="translate(13 {middle:.1}) rotate(-90)">{}</text>"#,
            escape_xml(self.plot.y.label())
        );
    }
}

impl Plot {
    /// The legend, for several plots together.
    pub fn legend_markup(&self) -> Markup {
        let key = |PlotLayer { shape, class, name, .. }: &PlotLayer| {
            let mark = match shape {
                PlotLayerShape::Line => "line",
                PlotLayerShape::Dash => "dash",
                PlotLayerShape::Band => "band",
                PlotLayerShape::Dot(_) => "dot",
            };
            format!(r#"<span class="key"><i class="{mark} {class}"></i>{}</span> "#, escape_xml(name))
        };
        Safe(self.layers.iter().filter(|layer| !layer.name.is_empty()).map(key).collect())
    }

    /// The plot with a title and its legend, as a `figure`.
    pub fn figure_with_legend(&self, title: &str) -> Markup {
        self.figure_markup(title, &self.legend_markup().0)
    }

    /// The plot with a title alone, for one of several with the same legend.
    pub fn figure_without_legend(&self, title: &str) -> Markup {
        self.figure_markup(title, "")
    }

    fn figure_markup(&self, title: &str, keys: &str) -> Markup {
        let [full_width, full_height] = self.size;
        let title = escape_xml(title);
        // On a narrow screen the figure scrolls before its texts get too small.
        let least = 0.6 * full_width;
        let mut svg = format!(
            "<figure><svg viewBox=\"0 0 {full_width} {full_height}\" style=\"min-width: {least:.0}px\" role=\"img\" aria-label=\"{title}\">\n"
        );
        SvgDrawing::new(self).write_plot(&mut svg);
        let _ = write!(svg, "</svg>\n<figcaption><b>{title}</b> {keys}</figcaption></figure>\n");
        Safe(svg)
    }
}

/// Plots below each other, each with its title, as an SVG file of its own.
pub fn plots_to_svg_file(plots: &[(String, Plot)]) -> String {
    const TITLE: f64 = 26.0;
    let width = plots.iter().map(|(_, plot)| plot.size[0]).fold(0.0, f64::max);
    let height: f64 = plots.iter().map(|(_, plot)| plot.size[1] + TITLE).sum();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\">\n\
         <style>\n{STYLE}</style>\n<rect width=\"100%\" height=\"100%\" style=\"fill: var(--paper)\"/>\n"
    );
    let mut below = 0.0;
    for (title, plot) in plots {
        let _ = writeln!(svg, "<g transform=\"translate(0 {})\">", below + TITLE);
        let _ = writeln!(
            svg,
            r#"<text class="label" x="{}" y="-6">{}</text>"#,
            0.5 * plot.size[0],
            escape_xml(title)
        );
        SvgDrawing::new(plot).write_plot(&mut svg);
        svg.push_str("</g>\n");
        below += plot.size[1] + TITLE;
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::PlotAxis;

    fn plot() -> Plot {
        Plot::new(
            [300.0, 200.0],
            PlotAxis::linear("x <s>", 0.0, 1.0),
            PlotAxis::around_values("y", [-1.0, 1.0]),
        )
    }

    #[test]
    fn what_is_no_number_is_left_out() {
        let mut plot = plot();
        plot.add_line(&[(0.0, 0.0), (0.5, f64::NAN), (1.0, 0.0), (1.0, 1.0)], "c0", "");
        plot.add_dots(&[(f64::INFINITY, 0.0), (0.5, 0.0)], 2.0, "c0", "");
        plot.add_band(&[(0.0, [f64::NAN, 1.0]), (1.0, [-1.0, 1e300])], "c0", "");
        let drawn = plot.figure_with_legend("t").0;
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"));
        assert_eq!(drawn.matches("<circle").count(), 1);
        assert_eq!(drawn.matches('M').count() - drawn.matches("class=\"grid\"").count() - 1, 3);
    }

    #[test]
    fn points_are_where_their_numbers_are() {
        let mut plot = plot();
        plot.add_dots(&[(0.0, 0.0), (1.0, 1.1)], 2.0, "c0", "n <1>");
        let drawn = plot.figure_with_legend("a & b").0;
        // The drawing area is 206 px wide and 146 px high; y reaches from −1.1 to 1.1.
        assert!(
            drawn.contains(r#"cx="0.0" cy="73.0""#) && drawn.contains(r#"cx="206.0" cy="0.0""#),
            "{drawn}"
        );
        assert!(
            drawn.contains("n &lt;1&gt;") && drawn.contains("a &amp; b") && drawn.contains("x &lt;s&gt;")
        );
    }
}
