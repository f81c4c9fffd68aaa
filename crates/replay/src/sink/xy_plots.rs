//! Draws diagrams of one quantity over another: curves and moving points. The viewer has no such view of its own.

use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::Radius;
use recording::view::{XyPlot, XyPlotFunction};
use recording::{RecordedVariables, Row};
use units::display::label_text;

use super::LIMIT;
use super::frame::{DiagramFrame, LineStrip};
use super::palette::{CurvePalette, with_opacity};
use super::run_slot::RunNamespace;
use super::timeline::{TimePoint, TimePoints};

/// Width by height of the place for all diagrams of a run, one below the other.
const PLACE: f64 = 0.46;
/// Straight pieces of a curve.
const PIECES: usize = 160;
/// Height of a line of text in a place of height 1.
const LINE: f64 = 0.026;
/// Spaces between ticks of an axis at most.
const TICKS: f64 = 6.0;
/// Entities of a diagram: the points, and the same points for their trails.
const POINTS: &str = "points";
const TRAILS: &str = "trails";
/// Curves over signals are drawn again after this time [ns].
const REDRAW: i64 = 100_000_000;

/// The diagrams, with their unsent changes.
pub(super) struct XyPlots(Vec<PlotDrawing>);

struct PlotDrawing {
    slot: RunNamespace,
    plot: XyPlot,
    frame: DiagramFrame,
    /// Positions of the points, row by row.
    points: Vec<[f32; 2]>,
    /// Curves over signals: index, time points and lines.
    curves: Vec<(usize, TimePoints, Vec<LineStrip>)>,
    drawn: Option<i64>,
}

/// A diagram, as the layout needs it.
pub(super) struct DiagramView {
    pub title: String,
    pub root: String,
    /// Width of a diagram of height 1.
    pub width: f64,
    /// Height of a line of text.
    pub line: f32,
    /// Entities with a trail, and its duration [s].
    pub trails: Vec<EntityPath>,
    pub trail: f64,
}

impl XyPlots {
    /// Diagrams that count from 1.
    pub fn from_plots(xy_plots: &[XyPlot], slot: &RunNamespace) -> Self {
        Self::from_plots_numbered(xy_plots, slot, 1)
    }

    /// Diagrams that count from `first`.
    pub fn from_plots_numbered(xy_plots: &[XyPlot], slot: &RunNamespace, first: usize) -> Self {
        let drawing = |(index, plot): (usize, &XyPlot)| {
            // Of the second run only the points are drawn; more would hide those of the first one.
            let shown = |(_, it): &(usize, &XyPlotFunction)| it.moves && slot.is_first();
            let moving = plot.curves.iter().enumerate().filter(shown);
            PlotDrawing {
                slot: slot.clone(),
                points: Vec::new(),
                curves: moving.map(|(it, _)| (it, TimePoints::default(), Vec::new())).collect(),
                frame: plot_frame(first + index, plot, xy_plots.len()),
                plot: plot.clone(),
                drawn: None,
            }
        };
        Self(xy_plots.iter().enumerate().map(drawing).collect())
    }

    /// The root entity of a diagram.
    pub fn root_entity(&self, diagram: usize) -> String {
        self.0[diagram].frame.root.clone()
    }

    /// The position of coordinates in a diagram's view.
    pub fn view_position(&self, diagram: usize, coordinates: [f64; 2]) -> [f32; 2] {
        self.0[diagram].frame.view_position(coordinates)
    }

    /// The diagrams, as the layout needs them.
    pub fn diagram_views(&self) -> Vec<DiagramView> {
        let view = |it: &PlotDrawing| DiagramView {
            title: it.plot.title.clone(),
            root: it.frame.root.clone(),
            width: it.frame.width,
            line: it.frame.line,
            trails: vec![it.entity_path_below(TRAILS)],
            trail: it.plot.trail,
        };
        self.0.iter().map(view).collect()
    }

    /// The diagrams with the points of a second run.
    pub fn views_with(&self, other: &XyPlots) -> Vec<DiagramView> {
        let mut views = self.diagram_views();
        for (view, other) in views.iter_mut().zip(other.diagram_views()) {
            view.trails.extend(other.trails);
        }
        views
    }

    /// Sends the static parts.
    pub fn send_static(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.0.iter().try_for_each(|it| it.send_static(stream))
    }

    pub fn push_row(&mut self, time_point: TimePoint, time: f64, row: &Row<RecordedVariables>) {
        for it in &mut self.0 {
            for point in &it.plot.points {
                let coordinates = point.coordinates.each_ref().map(|of| of.evaluate(time, row));
                it.points.push(it.frame.view_position(coordinates));
            }
            if !it.curves.is_empty() && it.drawn.is_none_or(|drawn| time_point.time >= drawn + REDRAW) {
                it.drawn = Some(time_point.time);
                it.evaluate_curves(time_point, time, row);
            }
        }
    }

    /// Sends the collected rows over these time axes, and forgets them.
    pub fn send(&mut self, stream: &RecordingStream, axes: &[TimeColumn]) -> RecordingStreamResult<()> {
        for it in &mut self.0 {
            let count = it.plot.points.len();
            let rows = it.points.len() / count.max(1);
            let points = Points2D::update_fields().with_positions(it.points.drain(..));
            // The same points twice: as themselves and as their trails.
            for what in [POINTS, TRAILS].into_iter().filter(|_| rows > 0) {
                let columns = points.clone().columns(std::iter::repeat_n(count, rows))?;
                stream.send_columns(it.entity_path_below(what), axes.to_vec(), columns)?;
            }
            let paths: Vec<_> = it.curves.iter().map(|(curve, ..)| it.curve_path(*curve)).collect();
            for ((_, time_points, strips), path) in it.curves.iter_mut().zip(paths) {
                let lines = LineStrips2D::update_fields().with_strips(strips.drain(..));
                let axes = time_points.time_columns();
                time_points.clear();
                stream.send_columns(path, axes, lines.columns_of_unit_batches()?)?;
            }
        }
        Ok(())
    }
}

impl PlotDrawing {
    fn entity_path_below(&self, what: &str) -> EntityPath {
        self.slot.entity_path_below(&self.frame.root, what)
    }

    fn curve_path(&self, number: usize) -> EntityPath {
        self.entity_path_below(&format!("curves/{}", number + 1))
    }

    fn send_static(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        // Axes, ellipse and curves are drawn once for both runs.
        let first = self.slot.is_first();
        if first {
            self.frame.send_grid_and_labels(stream)?;
        }
        let XyPlot { points, curves, ellipse, .. } = &self.plot;
        let mut palette = CurvePalette::default();
        let mut legend = Vec::new();
        for point in points {
            let color = self.slot.run_color(palette.curve_color(point.role, &point.label));
            legend.push((color, self.slot.run_label(&point.label)));
        }
        let looks = [(TRAILS, 2.5, 150, 30.0), (POINTS, 5.0, 255, 40.0)];
        for (what, radius, opacity, order) in looks {
            let look = Points2D::update_fields()
                .with_colors(legend.iter().map(|(color, _)| with_opacity(*color, opacity)))
                .with_radii([Radius::new_ui_points(radius)])
                .with_draw_order(order);
            stream.log_static(self.entity_path_below(what), &look)?;
        }
        for (number, curve) in curves.iter().enumerate().filter(|_| first) {
            let color = palette.curve_color(curve.role, &curve.label);
            legend.push((color, curve.label.clone()));
            let path = self.curve_path(number);
            let look = LineStrips2D::update_fields()
                .with_colors([color])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(20.0);
            stream.log_static(path.clone(), &look)?;
            if !curve.moves {
                let strips = self.evaluate_curve(curve, 0.0, &Row::default());
                stream.log_static(path, &LineStrips2D::update_fields().with_strips([strips]))?;
            }
        }
        if let Some([x, y]) = ellipse.filter(|_| first) {
            let angles = (0..=72).map(|it| f64::from(it) * std::f64::consts::TAU / 72.0);
            let points = angles.map(|it| self.frame.view_position([x * it.cos(), y * it.sin()]));
            let ellipse = LineStrips2D::new([points.collect::<Vec<_>>()])
                .with_colors([LIMIT])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(10.0);
            stream.log_static(format!("{}/limit", self.frame.root), &ellipse)?;
        }
        // Below that of the first run.
        let above = match first {
            true => 0,
            false => self.plot.points.len() + self.plot.curves.len(),
        };
        let path = self.slot.entity_path_below(&self.frame.root, "legend");
        self.frame.send_legend(stream, path, above, &legend)
    }

    fn evaluate_curves(&mut self, time_point: TimePoint, time: f64, row: &Row<RecordedVariables>) {
        let mut curves = std::mem::take(&mut self.curves);
        for (curve, time_points, strips) in &mut curves {
            let curve = &self.plot.curves[*curve];
            time_points.push(time_point);
            strips.push(self.evaluate_curve(curve, time, row));
        }
        self.curves = curves;
    }

    /// The curve within the axes.
    fn evaluate_curve(
        &self,
        curve: &XyPlotFunction,
        time: f64,
        row: &Row<RecordedVariables>,
    ) -> Vec<[f32; 2]> {
        let [[x0, x1], [y0, y1]] = self.plot.ranges;
        let within = y0.min(y1)..=y0.max(y1);
        let mut strip = Vec::new();
        for piece in 0..=PIECES {
            let x = x0 + (x1 - x0) * piece as f64 / PIECES as f64;
            let y = curve.evaluate_at(time, row, x);
            if within.contains(&y) {
                strip.push(self.frame.view_position([x, y]));
            }
        }
        strip
    }
}

/// The frame of one of `count` diagrams. It fills its place, unless both axes have one scale.
fn plot_frame(number: usize, plot: &XyPlot, count: usize) -> DiagramFrame {
    let line = LINE * count as f64;
    // Around the axes there are six lines of text in width and eight in height.
    let width = PLACE * count as f64 * (1.0 + 8.0 * line) - 6.0 * line;
    let [x, y] = plot.ranges.map(|[from, to]| (to - from).abs());
    DiagramFrame {
        root: format!("xy_plots/{number}"),
        labels: plot.labels.each_ref().map(|label| label_text(label)),
        ranges: plot.ranges,
        width: if plot.has_equal_scales() { x / y } else { width },
        line: line as f32,
        ticks: TICKS,
    }
}
