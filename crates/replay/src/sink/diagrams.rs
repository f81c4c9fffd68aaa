//! Draws the static diagrams of analyses.

use plugin::{Diagram, DiagramLayer, DiagramLayerShape};
use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::{Color, Radius};
use recording::view::CurveRole;
use units::display::label_text;

use super::frame::{DiagramFrame, LineStrip};
use super::palette::{CurvePalette, dimmed_color, with_opacity};
use super::signals::escaped_entity_path;
use super::xy_plots::DiagramView;

/// Of the first diagram of a group, and of the others: width by height, height of a line of text, and spaces between ticks.
const FIRST: (f64, f32, f64) = (2.8, 0.065, 6.0);
const OTHERS: (f64, f32, f64) = (1.3, 0.12, 3.5);
/// So few points are marks, each with its name; more are a cloud.
const MOST_MARKS: usize = 8;
/// Radii of a mark and of a point of a cloud, and half the width of a line and of a limit [ui points].
const MARK_RADIUS: f32 = 5.0;
const CLOUD_RADIUS: f32 = 1.5;
const LINE_RADIUS: f32 = 1.0;
const LIMIT_RADIUS: f32 = 2.0;
/// The viewer fills no areas: vertical lines side by side stand in.
const COLUMNS: usize = 240;

/// Groups of diagrams, in the order of their arrival.
#[derive(Default)]
pub(super) struct AnalysisDiagrams(Vec<DiagramGroup>);

/// Diagrams that belong together.
pub(super) struct DiagramGroup {
    pub analysis: String,
    pub name: String,
    /// The first one is the largest, and has the legend.
    pub views: Vec<DiagramView>,
    /// Colours in use: one label has one colour in all diagrams of the group.
    known: Vec<(CurveRole, String)>,
}

impl AnalysisDiagrams {
    /// The groups of each analysis.
    pub fn groups_by_analysis(&self) -> Vec<(&str, Vec<&DiagramGroup>)> {
        let mut analyses: Vec<(&str, Vec<&DiagramGroup>)> = Vec::new();
        for group in &self.0 {
            match analyses.iter_mut().find(|(name, _)| *name == group.analysis) {
                Some((_, groups)) => groups.push(group),
                None => analyses.push((&group.analysis, vec![group])),
            }
        }
        analyses
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Sends a diagram.
    pub fn send_diagram(
        &mut self,
        stream: &RecordingStream,
        analysis: &str,
        name: &str,
        diagram: &Diagram,
    ) -> RecordingStreamResult<()> {
        let known = self.0.iter().position(|it| it.analysis == analysis && it.name == name);
        let index = known.unwrap_or_else(|| {
            let (analysis, name) = (analysis.to_owned(), name.to_owned());
            self.0.push(DiagramGroup { analysis, name, views: Vec::new(), known: Vec::new() });
            self.0.len() - 1
        });
        self.0[index].send_diagram(stream, diagram)
    }
}

impl DiagramGroup {
    fn send_diagram(&mut self, stream: &RecordingStream, diagram: &Diagram) -> RecordingStreamResult<()> {
        let number = self.views.len() + 1;
        let (width, line, ticks) = if number == 1 { FIRST } else { OTHERS };
        let root = escaped_entity_path(["diagrams", &self.analysis, &self.name, &number.to_string()]);
        let frame = DiagramFrame {
            root: root.to_string().trim_start_matches('/').to_owned(),
            labels: diagram.axes.map(label_text),
            ranges: [0, 1].map(|axis| diagram_axis_range(diagram, axis)),
            width,
            line,
            ticks,
        };
        for layer in &diagram.layers {
            let entry = (role_from_plugin(layer.role), layer.name.to_owned());
            if !self.known.contains(&entry) {
                self.known.push(entry);
            }
        }
        let mut palette = CurvePalette::default();
        self.known.iter().for_each(|(role, name)| {
            palette.curve_color(*role, name);
        });
        frame.send_grid_and_labels(stream)?;
        let mut legend: Vec<(Color, &str)> = Vec::new();
        for (rank, layer) in diagram.layers.iter().enumerate() {
            let color = palette.curve_color(role_from_plugin(layer.role), layer.name);
            let path = format!("{}/{:02}", frame.root, rank + 1);
            match layer.shape {
                DiagramLayerShape::Line => {
                    stream.log_static(path, &layer_line(&frame, layer, color, rank))?
                }
                DiagramLayerShape::Points => {
                    stream.log_static(path, &layer_points(&frame, layer, color, rank))?
                }
                DiagramLayerShape::Band => {
                    stream.log_static(path, &layer_band(&frame, layer, color, rank))?
                }
            }
            if !layer.name.is_empty() && !legend.iter().any(|(_, name)| *name == layer.name) {
                legend.push((color, layer.name));
            }
        }
        if number == 1 {
            frame.send_legend(stream, format!("{}/legend", frame.root).into(), 0, &legend)?;
        }
        let (title, root) = (diagram.title, frame.root);
        let title = if number == 1 { format!("{}: {title}", self.name) } else { title.to_owned() };
        self.views.push(DiagramView { title, root, width, line, trails: Vec::new(), trail: 0.0 });
        Ok(())
    }
}

/// The ends of an axis; an end that is no number is that of the layers.
fn diagram_axis_range(diagram: &Diagram, axis: usize) -> [f64; 2] {
    let values = diagram.layers.iter().flat_map(|layer| match axis {
        0 => layer.x.iter().chain(&[]),
        _ => layer.y.iter().chain(layer.upper),
    });
    let finite = || values.clone().copied().filter(|it| it.is_finite());
    let found = [finite().fold(f64::INFINITY, f64::min), finite().fold(-f64::INFINITY, f64::max)];
    let [from, to] = [0, 1].map(|end| {
        let given = diagram.ranges[axis][end];
        if given.is_finite() { given } else { found[end] }
    });
    match (to - from).is_finite() && from != to {
        true => [from, to],
        // No point, or all of them at one coordinate.
        false if from.is_finite() => [from - 0.5, from + 0.5],
        false => [0.0, 1.0],
    }
}

fn layer_line(frame: &DiagramFrame, layer: &DiagramLayer, color: Color, rank: usize) -> LineStrips2D {
    let radius = match layer.role {
        plugin::DiagramLayerRole::Limit => LIMIT_RADIUS,
        _ => LINE_RADIUS,
    };
    LineStrips2D::new(clipped_line_strips(frame, layer.x, layer.y))
        .with_colors([color])
        .with_radii([Radius::new_ui_points(radius)])
        .with_draw_order(10.0 + rank as f32)
}

fn layer_points(frame: &DiagramFrame, layer: &DiagramLayer, color: Color, rank: usize) -> Points2D {
    let shares = layer.x.iter().zip(layer.y).map(|(&x, &y)| frame.relative_position([x, y]));
    let inside = shares.filter(|it| it.iter().all(|share| (0.0..=1.0).contains(share)));
    let points: Vec<_> = inside.map(|it| frame.view_position_of_relative(it)).collect();
    let order = 10.0 + rank as f32;
    if points.len() > MOST_MARKS {
        return Points2D::new(points)
            .with_colors([with_opacity(color, 170)])
            .with_radii([Radius::new_ui_points(CLOUD_RADIUS)])
            .with_draw_order(order);
    }
    let marks = Points2D::new(points)
        .with_colors([color])
        .with_radii([Radius::new_ui_points(MARK_RADIUS)])
        .with_draw_order(order);
    if layer.name.is_empty() { marks } else { marks.with_labels([layer.name]).with_show_labels(true) }
}

/// Behind the grid.
fn layer_band(frame: &DiagramFrame, layer: &DiagramLayer, color: Color, rank: usize) -> LineStrips2D {
    let half = 0.5 / COLUMNS as f64;
    // Twice as wide as need be: they overlap, so that no gap shows.
    let radius = Radius::new_scene_units((2.0 * half * frame.width) as f32);
    let columns = (0..COLUMNS).filter_map(|column| {
        let share = (2 * column + 1) as f64 * half;
        let [from, to] = frame.ranges[0];
        let ends = band_ends_at(layer, from + share * (to - from))?;
        let [low, high] = ends.map(|y| frame.relative_position([from, y])[1].clamp(0.0, 1.0));
        (low != high).then(|| [low, high].map(|y| frame.view_position_of_relative([share, y])))
    });
    LineStrips2D::new(columns.map(Vec::from))
        .with_colors([dimmed_color(color)])
        .with_radii([radius])
        .with_draw_order(-100.0 + rank as f32)
}

/// The ends of a band at one x, interpolated linearly; the x of its points rise.
fn band_ends_at(layer: &DiagramLayer, x: f64) -> Option<[f64; 2]> {
    let after = layer.x.partition_point(|it| *it <= x).min(layer.x.len().saturating_sub(1));
    let before = after.checked_sub(1)?;
    let share = (x - layer.x[before]) / (layer.x[after] - layer.x[before]);
    let ends = [layer.y, layer.upper].map(|y| y[before] + share * (y[after] - y[before]));
    let inside = (0.0..=1.0).contains(&share) && ends.iter().all(|end| end.is_finite());
    inside.then_some(ends)
}

/// The parts of a line that lie within the axes.
fn clipped_line_strips(frame: &DiagramFrame, x: &[f64], y: &[f64]) -> Vec<LineStrip> {
    let points: Vec<_> = x.iter().zip(y).map(|(&x, &y)| frame.relative_position([x, y])).collect();
    let mut strips: Vec<LineStrip> = Vec::new();
    let mut end = None;
    for pair in points.windows(2) {
        let Some([from, to]) = clip_to_unit_square([pair[0], pair[1]]) else {
            end = None;
            continue;
        };
        match strips.last_mut().filter(|_| end == Some(from)) {
            Some(strip) => strip.push(frame.view_position_of_relative(to)),
            None => {
                strips.push(vec![frame.view_position_of_relative(from), frame.view_position_of_relative(to)])
            }
        }
        end = Some(to);
    }
    strips
}

/// The part of a line from `a` to `b` that lies in the unit square (Liang and Barsky 1984).
fn clip_to_unit_square([a, b]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    if !a.iter().chain(&b).all(|it| it.is_finite()) {
        return None;
    }
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for axis in [0, 1] {
        let length = b[axis] - a[axis];
        for (room, outward) in [(a[axis], -length), (1.0 - a[axis], length)] {
            if outward > 0.0 {
                to = to.min(room / outward);
            } else if outward < 0.0 {
                from = from.max(room / outward);
            } else if room < 0.0 {
                return None;
            }
        }
    }
    let at = |share: f64| match share {
        0.0 => a,
        1.0 => b,
        _ => [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis])),
    };
    (from < to).then(|| [at(from), at(to)])
}

fn role_from_plugin(role: plugin::DiagramLayerRole) -> CurveRole {
    match role {
        plugin::DiagramLayerRole::Other => CurveRole::Other,
        plugin::DiagramLayerRole::Reference => CurveRole::Reference,
        plugin::DiagramLayerRole::Plant => CurveRole::Plant,
        plugin::DiagramLayerRole::Measurement => CurveRole::Measurement,
        plugin::DiagramLayerRole::Estimate => CurveRole::Estimate,
        plugin::DiagramLayerRole::Limit => CurveRole::Limit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: DiagramLayer = DiagramLayer {
        name: "",
        shape: DiagramLayerShape::Line,
        role: plugin::DiagramLayerRole::Other,
        x: &[0.0, 1.0, 2.0, 3.0],
        y: &[0.0, 20.0, f64::NAN, 5.0],
        upper: &[],
    };

    fn diagram(ranges: [[f64; 2]; 2], layer: DiagramLayer<'static>) -> Diagram<'static> {
        Diagram { title: "", axes: ["x", "y"], ranges, layers: vec![layer] }
    }

    #[test]
    fn an_axis_ends_at_its_range_or_at_the_ends_of_the_layers() {
        let given = diagram([[f64::NAN, 4.0], [f64::NAN; 2]], LINE);
        assert_eq!([0, 1].map(|axis| diagram_axis_range(&given, axis)), [[0.0, 4.0], [0.0, 20.0]]);
        let empty = diagram([[f64::NAN; 2]; 2], DiagramLayer { x: &[], y: &[], ..LINE });
        assert_eq!(diagram_axis_range(&empty, 0), [0.0, 1.0]);
        let single = diagram([[f64::NAN; 2]; 2], DiagramLayer { x: &[7.0], y: &[7.0], ..LINE });
        assert_eq!(diagram_axis_range(&single, 1), [6.5, 7.5]);
    }

    #[test]
    fn lines_end_at_the_edge_and_where_there_is_no_number() {
        let frame = DiagramFrame {
            root: String::new(),
            labels: [String::new(), String::new()],
            ranges: [[0.0, 2.0], [0.0, 10.0]],
            width: 2.0,
            line: 0.1,
            ticks: 6.0,
        };
        assert_eq!(clipped_line_strips(&frame, LINE.x, LINE.y), [vec![[0.0, 1.0], [0.5, 0.0]]]);
        assert_eq!(clipped_line_strips(&frame, &[0.0, 1.0, 2.0], &[5.0, 5.0, 10.0])[0].len(), 3);
        let band = DiagramLayer { y: &[1.0, 2.0, 3.0, f64::NAN], upper: &[2.0, 4.0, 6.0, 8.0], ..LINE };
        assert_eq!(band_ends_at(&band, 1.5), Some([2.5, 5.0]));
        assert_eq!([-0.1, 2.5, 3.1].map(|x| band_ends_at(&band, x)), [None; 3]);
    }
}
