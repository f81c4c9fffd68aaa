//! Draws the driven way from above as SVG, for pages whose script does not run and for paper.

use std::fmt::Write;

use html_page::{Markup, PlotAxis, Safe};
use recording::overview::PoseSample;

/// Width of the map, its least and its greatest height, and the space for numbers on its left and below [px].
const WIDTH: f64 = 1080.0;
const HEIGHTS: [f64; 2] = [150.0, 520.0];
const MARGIN: [f64; 4] = [64.0, 16.0, 12.0, 44.0];
/// Points of the way at most.
const MOST_POINTS: usize = 1_500;
/// Usual space between numbers [px], and width of a letter.
const SPACING: f64 = 70.0;
const LETTER: f64 = 7.0;
/// Space around the way, as a share of its extent.
const AROUND: f64 = 0.04;

/// What the map shows, east and north [m].
pub struct DrivenMap<'a> {
    /// The way of the car.
    pub poses: &'a [PoseSample],
    /// The edges of the road.
    pub road: &'a [Vec<[f64; 2]>; 2],
    /// Cones that the car did not touch, and those that it hit.
    pub cones: &'a [[f64; 2]],
    pub hit_cones: &'a [[f64; 2]],
    /// The line to follow.
    pub course: &'a [[f64; 2]],
}

/// So many of the points at even distances, and the last one.
pub fn thinned_points<T: Copy>(points: &[T], limit: usize) -> Vec<T> {
    let stride = points.len().div_ceil(limit).max(1);
    let last = points.last().filter(|_| !(points.len() - 1).is_multiple_of(stride));
    points.iter().step_by(stride).chain(last).copied().collect()
}

/// The map, a metre as long to the right as upwards.
pub fn driven_map(shown: &DrivenMap) -> Markup {
    let way: Vec<[f64; 2]> = shown.poses.iter().map(|pose| pose.position).collect();
    let all = way.iter().chain(shown.cones).chain(shown.hit_cones).chain(shown.course);
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for point in all.filter(|point| point.iter().all(|it| it.is_finite())) {
        for axis in [0, 1] {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    let [left, right, top, bottom] = MARGIN;
    let width = WIDTH - left - right;
    // A car that stands has a place, too.
    let extent = [0, 1].map(|axis: usize| (1.0 + 2.0 * AROUND) * (high[axis] - low[axis]).max(0.0) + 5.0);
    let height = (extent[1] * width / extent[0]).clamp(HEIGHTS[0], HEIGHTS[1]);
    let scale = (width / extent[0]).min(height / extent[1]);
    let center =
        [0, 1].map(|axis: usize| if low[axis] <= high[axis] { 0.5 * (low[axis] + high[axis]) } else { 0.0 });
    let axis = |label, center: f64, length: f64| {
        PlotAxis::linear(label, center - 0.5 * length / scale, center + 0.5 * length / scale)
    };
    let (x_axis, y_axis) = (axis("X [m]", center[0], width), axis("Y [m]", center[1], height));
    let full = height + top + bottom;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {full:.0}\" style=\"min-width: {:.0}px\" role=\"img\" aria-label=\"the driven way from above\">\n",
        0.6 * WIDTH
    );
    for (value, text) in x_axis.ticks(width, SPACING, |text| LETTER * text.chars().count() as f64) {
        let x = left + x_axis.relative_position(value) * width;
        let _ = writeln!(svg, r#"<path class="grid" d="M{x:.1} {top}V{:.1}"/>"#, top + height);
        let _ =
            writeln!(svg, r#"<text class="tick" x="{x:.1}" y="{:.1}">{text}</text>"#, top + height + 16.0);
    }
    for (value, text) in y_axis.ticks(height, 0.5 * SPACING, |_| 12.0) {
        let y = top + (1.0 - y_axis.relative_position(value)) * height;
        let _ = writeln!(svg, r#"<path class="grid" d="M{left} {y:.1}H{:.1}"/>"#, left + width);
        let _ =
            writeln!(svg, r#"<text class="tick end" x="{:.1}" y="{:.1}">{text}</text>"#, left - 7.0, y + 4.0);
    }
    let (middle, below) = (left + 0.5 * width, full - 8.0);
    let _ = writeln!(svg, r#"<text class="label" x="{middle:.1}" y="{below:.1}">X [m]</text>"#);
    let beside = top + 0.5 * height;
    let _ = writeln!(
        svg,
        r#"<text class="label" transform="translate(13 {beside:.1}) rotate(-90)">Y [m]</text>"#
    );
    let _ = writeln!(svg, r#"<svg x="{left}" y="{top}" width="{width}" height="{height:.1}">"#);
    let place = |[x, y]: [f64; 2]| {
        [x_axis.relative_position(x) * width, (1.0 - y_axis.relative_position(y)) * height]
    };
    let mut line = |points: &[[f64; 2]], class: &str| {
        let mut path = String::new();
        for point in thinned_points(points, MOST_POINTS) {
            let [x, y] = place(point);
            if x.is_finite() && y.is_finite() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
            }
        }
        if !path.is_empty() {
            let _ = writeln!(svg, r#"<path class="{class}" d="{path}"/>"#);
        }
    };
    shown.road.iter().for_each(|edge| line(edge, "line data"));
    line(shown.course, "dash data");
    line(&way, "line c0");
    for (cones, class, radius) in [(shown.cones, "c1", 2.5), (shown.hit_cones, "poor", 4.0)] {
        for [x, y] in cones.iter().map(|cone| place(*cone)) {
            let _ = writeln!(svg, r#"<circle class="dot {class}" cx="{x:.1}" cy="{y:.1}" r="{radius}"/>"#);
        }
    }
    if let Some([x, y]) =
        way.first().map(|point| place(*point)).filter(|it| it.iter().all(|it| it.is_finite()))
    {
        let _ = writeln!(svg, r#"<circle class="dot c2" cx="{x:.1}" cy="{y:.1}" r="4.5"/>"#);
    }
    Safe(format!("{svg}</svg>\n</svg>\n"))
}
