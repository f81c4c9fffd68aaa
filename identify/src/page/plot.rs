//! Draws a plot as SVG: lines, bands and points between axes. Colours and sizes are the page's CSS.

use std::fmt::Write;

use super::axis::Axis;
use crate::text::escape;

/// Space for the labels of the axes [px]: left, right, top, bottom.
const MARGIN: [f64; 4] = [58.0, 14.0, 10.0, 44.0];

/// What a key of the legend shows.
#[derive(Clone, Copy, Debug)]
enum Mark {
    Line,
    Dash,
    Band,
    Dot,
}

/// A plot that is being drawn. Points that are no numbers are left out.
#[derive(Clone, Debug)]
pub struct Plot {
    x: Axis,
    y: Axis,
    width: f64,
    height: f64,
    body: String,
    keys: String,
}

/// Classes of the page's CSS: colours by the role of what is drawn.
pub type Class = &'static str;

impl Plot {
    /// An empty plot of a size [px].
    pub fn new(size: [f64; 2], x: Axis, y: Axis) -> Self {
        Self { x, y, width: size[0], height: size[1], body: String::new(), keys: String::new() }
    }

    fn area(&self) -> [f64; 2] {
        [self.width - MARGIN[0] - MARGIN[1], self.height - MARGIN[2] - MARGIN[3]]
    }

    /// Position in the drawing area [px]. Far outside is cut: browsers lose digits of large coordinates.
    fn at(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let [width, height] = self.area();
        let (x, y) = (self.x.share(x) * width, (1.0 - self.y.share(y)) * height);
        (x.is_finite() && y.is_finite()).then(|| (x.clamp(-1e4, 1e4), y.clamp(-1e4, 1e4)))
    }

    fn key(&mut self, mark: Mark, class: Class, name: &str) {
        if !name.is_empty() {
            let mark = format!("{mark:?}").to_lowercase();
            let _ = write!(
                self.keys,
                r#"<span class="key"><i class="{mark} {class}"></i>{}</span> "#,
                escape(name)
            );
        }
    }

    fn path(&mut self, points: &[(f64, f64)], class: &str) {
        let mut path = String::new();
        let mut pen_down = false;
        for &(x, y) in points {
            match self.at(x, y) {
                Some((x, y)) => {
                    let _ = write!(path, "{}{x:.1} {y:.1}", if pen_down { "L" } else { "M" });
                    pen_down = true;
                }
                None => pen_down = false,
            }
        }
        if !path.is_empty() {
            let _ = writeln!(self.body, r#"<path class="{class}" d="{path}"/>"#);
        }
    }

    /// A line; a key in the legend if it has a name.
    pub fn line(&mut self, points: &[(f64, f64)], class: Class, name: &str) {
        self.path(points, &format!("line {class}"));
        self.key(Mark::Line, class, name);
    }

    /// A dashed line.
    pub fn dashes(&mut self, points: &[(f64, f64)], class: Class, name: &str) {
        self.path(points, &format!("dash {class}"));
        self.key(Mark::Dash, class, name);
    }

    /// The area between two lines: x, lower and upper end.
    pub fn band(&mut self, points: &[(f64, [f64; 2])], class: Class, name: &str) {
        let upper = points.iter().map(|&(x, ends)| (x, ends[1]));
        let lower = points.iter().rev().map(|&(x, ends)| (x, ends[0]));
        let outline: Vec<_> =
            upper.chain(lower).filter(|&(x, y)| self.at(x, y).is_some()).collect();
        self.path(&outline, &format!("band {class}"));
        self.key(Mark::Band, class, name);
    }

    /// Points.
    pub fn dots(&mut self, points: &[(f64, f64)], radius: f64, class: Class, name: &str) {
        for &(x, y) in points {
            if let Some((x, y)) = self.at(x, y) {
                let _ = writeln!(
                    self.body,
                    r#"<circle class="dot {class}" cx="{x:.1}" cy="{y:.1}" r="{radius}"/>"#
                );
            }
        }
        self.key(Mark::Dot, class, name);
    }

    /// A dashed line through the whole plot at a height.
    pub fn level(&mut self, y: f64, class: Class, name: &str) {
        self.dashes(&[(self.x.low(), y), (self.x.high(), y)], class, name);
    }

    /// A dashed line through the whole plot at a place.
    pub fn mark(&mut self, x: f64, class: Class, name: &str) {
        self.dashes(&[(x, self.y.low()), (x, self.y.high())], class, name);
    }

    /// The legend, for several plots together.
    pub fn keys(&self) -> &str {
        &self.keys
    }

    /// The plot with a title and its legend, as a `figure`.
    pub fn figure(&self, title: &str) -> String {
        self.captioned(title, &self.keys)
    }

    /// The plot with a title alone, for one of several with the same legend.
    pub fn figure_of_many(&self, title: &str) -> String {
        self.captioned(title, "")
    }

    fn captioned(&self, title: &str, keys: &str) -> String {
        let [left, _, top, _] = MARGIN;
        let [width, height] = self.area();
        let title = escape(title);
        let mut svg = format!(
            "<figure><svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{title}\">\n",
            self.width, self.height
        );
        self.axes(&mut svg);
        // An inner svg cuts off what leaves the drawing area.
        let _ = writeln!(svg, r#"<svg x="{left}" y="{top}" width="{width}" height="{height}">"#);
        let _ = write!(
            svg,
            "{}</svg>\n</svg>\n<figcaption><b>{title}</b> {keys}</figcaption></figure>\n",
            self.body
        );
        svg
    }

    fn axes(&self, svg: &mut String) {
        let [left, _, top, _] = MARGIN;
        let [width, height] = self.area();
        let bottom = top + height;
        for (value, text) in self.x.ticks(width / 55.0) {
            let x = left + self.x.share(value) * width;
            let _ = writeln!(svg, r#"<path class="grid" d="M{x:.1} {top}V{bottom}"/>"#);
            let _ = writeln!(
                svg,
                r#"<text class="tick" x="{x:.1}" y="{:.1}">{text}</text>"#,
                bottom + 16.0
            );
        }
        for (value, text) in self.y.ticks(height / 40.0) {
            let y = top + (1.0 - self.y.share(value)) * height;
            let _ = writeln!(svg, r#"<path class="grid" d="M{left} {y:.1}H{:.1}"/>"#, left + width);
            let _ = writeln!(
                svg,
                r#"<text class="tick end" x="{:.1}" y="{:.1}">{text}</text>"#,
                left - 7.0,
                y + 4.0
            );
        }
        let _ = writeln!(
            svg,
            r#"<path class="frame" d="M{left} {top}V{bottom}H{:.1}"/>"#,
            left + width
        );
        let (x, y) = (left + 0.5 * width, self.height - 8.0);
        let _ = writeln!(
            svg,
            r#"<text class="label" x="{x:.1}" y="{y:.1}">{}</text>"#,
            escape(self.x.label())
        );
        let middle = top + 0.5 * height;
        let _ = writeln!(
            svg,
            r#"<text class="label" transform="translate(13 {middle:.1}) rotate(-90)">{}</text>"#,
            escape(self.y.label())
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot() -> Plot {
        Plot::new([300.0, 200.0], Axis::linear("x <s>", 0.0, 1.0), Axis::about("y", [-1.0, 1.0]))
    }

    #[test]
    fn what_is_no_number_is_left_out() {
        let mut plot = plot();
        plot.line(&[(0.0, 0.0), (0.5, f64::NAN), (1.0, 0.0), (1.0, 1.0)], "c0", "");
        plot.dots(&[(f64::INFINITY, 0.0), (0.5, 0.0)], 2.0, "c0", "");
        plot.band(&[(0.0, [f64::NAN, 1.0]), (1.0, [-1.0, 1e300])], "c0", "");
        let drawn = plot.figure("t");
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"));
        assert_eq!(drawn.matches("<circle").count(), 1);
        assert_eq!(drawn.matches('M').count() - drawn.matches("class=\"grid\"").count() - 1, 3);
    }

    #[test]
    fn points_are_where_their_numbers_are() {
        let mut plot = plot();
        plot.dots(&[(0.0, 0.0), (1.0, 1.1)], 2.0, "c0", "n <1>");
        let drawn = plot.figure("a & b");
        // The drawing area is 228 px wide and 146 px high; y reaches from −1.1 to 1.1.
        assert!(
            drawn.contains(r#"cx="0.0" cy="73.0""#) && drawn.contains(r#"cx="228.0" cy="0.0""#),
            "{drawn}"
        );
        assert!(
            drawn.contains("n &lt;1&gt;")
                && drawn.contains("a &amp; b")
                && drawn.contains("x &lt;s&gt;")
        );
    }
}
