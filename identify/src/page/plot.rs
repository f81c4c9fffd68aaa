//! Draws a plot as SVG: axes with round ticks, lines, bands, points and bars. Colours and sizes are the page's CSS.

use std::fmt::Write;

use crate::text::{escape, significant};

/// Space for the labels of the axes [px]: left, right, top, bottom.
const MARGIN: [f64; 4] = [58.0, 14.0, 10.0, 44.0];

/// An axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    /// A linear axis. Ends that are no numbers, or in the wrong order, become 0 to 1.
    pub fn linear(label: &str, low: f64, high: f64) -> Self {
        let (low, high) =
            if low < high && (high - low).is_finite() { (low, high) } else { (0.0, 1.0) };
        Self { label: label.into(), low, high, logarithmic: false }
    }

    /// A logarithmic axis of positive numbers.
    pub fn logarithmic(label: &str, low: f64, high: f64) -> Self {
        let (low, high) =
            if 0.0 < low && low < high && high.is_finite() { (low, high) } else { (0.1, 1.0) };
        Self { label: label.into(), low, high, logarithmic: true }
    }

    /// A linear axis about values, a twentieth wider than they are.
    pub fn about(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let (low, high) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let space = 0.05 * (high - low).max(1e-9 * high.abs());
        Self::linear(label, low - space, high + space)
    }

    /// Lower end.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Upper end.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Position between the ends, 0 to 1 inside.
    fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Round values from end to end, with their text.
    fn ticks(&self, about: f64) -> Vec<(f64, String)> {
        if self.logarithmic {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            let round = decades.flat_map(|decade| {
                [1.0, 2.0, 5.0].map(|mantissa| mantissa * 10.0_f64.powi(decade))
            });
            let inside = round.filter(|tick| (self.low * 0.999..=self.high * 1.001).contains(tick));
            return inside.map(|tick| (tick, significant(tick, 1))).collect();
        }
        let rough = (self.high - self.low) / about;
        let decade = 10.0_f64.powf(rough.log10().floor());
        let step = decade
            * [1.0, 2.0, 5.0].into_iter().find(|&step| step * decade >= rough).unwrap_or(10.0);
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last)
            .map(|k| k as f64 * step)
            .map(|tick| (tick, format!("{tick:.decimals$}")))
            .collect()
    }
}

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
        self.dashes(&[(self.x.low, y), (self.x.high, y)], class, name);
    }

    /// A dashed line through the whole plot at a place.
    pub fn mark(&mut self, x: f64, class: Class, name: &str) {
        self.dashes(&[(x, self.y.low), (x, self.y.high)], class, name);
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
            escape(&self.x.label)
        );
        let middle = top + 0.5 * height;
        let _ = writeln!(
            svg,
            r#"<text class="label" transform="translate(13 {middle:.1}) rotate(-90)">{}</text>"#,
            escape(&self.y.label)
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
    fn ticks_are_round_and_inside() {
        let texts = |axis: Axis| axis.ticks(5.0).into_iter().map(|tick| tick.1).collect::<Vec<_>>();
        assert_eq!(texts(Axis::linear("", 0.0, 1.0)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(texts(Axis::linear("", -130.0, 210.0)), ["-100", "0", "100", "200"]);
        assert_eq!(texts(Axis::linear("", 1.4981, 1.5024)), ["1.499", "1.500", "1.501", "1.502"]);
        assert_eq!(
            texts(Axis::logarithmic("", 1.0, 100.0)),
            ["1", "2", "5", "10", "20", "50", "100"]
        );
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
        for axis in
            [Axis::about("", []), Axis::linear("", f64::NAN, 1.0), Axis::logarithmic("", -1.0, 1.0)]
        {
            assert!(axis.low < axis.high);
        }
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
