//! Draws diagrams of one quantity over another: curves and moving points. The viewer has no such view of its own.

use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::Radius;
use recording::view::{Function, XyPlot};
use recording::{Recorded, Row};

use super::LIMIT;
use super::frame::{Frame, Strip};
use super::palette::{Palette, faded};
use super::run_slot::RunSlot;
use super::timeline::{TimePoint, TimePoints};

/// Width by height of a diagram without a circle; with one, both axes have the same scale.
const ASPECT: f64 = 1.1;
/// Straight pieces of a curve.
const PIECES: usize = 160;
/// Height of a line of text in a diagram of height 1.
const LINE: f32 = 0.05;
/// Spaces between ticks of an axis at most.
const TICKS: f64 = 6.0;
/// Curves over signals are drawn again after this time [ns].
const REDRAW: i64 = 100_000_000;

/// The diagrams, with their unsent changes.
pub(super) struct XyPlots(Vec<Drawing>);

struct Drawing {
    slot: RunSlot,
    plot: XyPlot,
    frame: Frame,
    /// Positions of each point.
    points: Vec<Vec<[f32; 2]>>,
    /// Curves over signals: index, time points and lines.
    curves: Vec<(usize, TimePoints, Vec<Strip>)>,
    drawn: Option<i64>,
}

/// A diagram, as the layout needs it.
pub(super) struct Shown {
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
    pub fn new(xy_plots: &[XyPlot], slot: &RunSlot) -> Self {
        Self::numbered(xy_plots, slot, 1)
    }

    /// Diagrams that count from `first`.
    pub fn numbered(xy_plots: &[XyPlot], slot: &RunSlot, first: usize) -> Self {
        let drawing = |(index, plot): (usize, &XyPlot)| {
            // Of the second run only the points are drawn; more would hide those of the first one.
            let shown = |(_, it): &(usize, &Function)| it.moves && slot.is_first();
            let moving = plot.curves.iter().enumerate().filter(shown);
            Drawing {
                slot: slot.clone(),
                points: vec![Vec::new(); plot.points.len()],
                curves: moving.map(|(it, _)| (it, TimePoints::default(), Vec::new())).collect(),
                frame: frame(first + index, plot),
                plot: plot.clone(),
                drawn: None,
            }
        };
        Self(xy_plots.iter().enumerate().map(drawing).collect())
    }

    /// The root entity of a diagram.
    pub fn root(&self, diagram: usize) -> String {
        self.0[diagram].frame.root.clone()
    }

    /// The position of coordinates in a diagram's view.
    pub fn position(&self, diagram: usize, coordinates: [f64; 2]) -> [f32; 2] {
        self.0[diagram].frame.position(coordinates)
    }

    /// The diagrams, as the layout needs them.
    pub fn shown(&self) -> Vec<Shown> {
        let shown = |it: &Drawing| Shown {
            title: it.plot.title.clone(),
            root: it.frame.root.clone(),
            width: it.frame.width,
            line: LINE,
            trails: (0..it.points.len()).map(|point| it.path("trails", point)).collect(),
            trail: it.plot.trail,
        };
        self.0.iter().map(shown).collect()
    }

    /// The diagrams with the points of a second run.
    pub fn shown_with(&self, other: &XyPlots) -> Vec<Shown> {
        let mut shown = self.shown();
        for (shown, other) in shown.iter_mut().zip(other.shown()) {
            shown.trails.extend(other.trails);
        }
        shown
    }

    /// Sends the static parts.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.0.iter().try_for_each(|it| it.describe(stream))
    }

    pub fn push(&mut self, time_point: TimePoint, time: f64, row: &Row<Recorded>) {
        for it in &mut self.0 {
            for point in 0..it.points.len() {
                let [x, y] =
                    it.plot.points[point].coordinates.each_ref().map(|of| of.value(time, row));
                let position = it.frame.position([x, y]);
                it.points[point].push(position);
            }
            if !it.curves.is_empty()
                && it.drawn.is_none_or(|drawn| time_point.time >= drawn + REDRAW)
            {
                it.drawn = Some(time_point.time);
                it.redraw(time_point, time, row);
            }
        }
    }

    /// Sends the collected rows over these time axes, and forgets them.
    pub fn send(
        &mut self,
        stream: &RecordingStream,
        axes: &[TimeColumn],
    ) -> RecordingStreamResult<()> {
        for it in &mut self.0 {
            for point in 0..it.points.len() {
                let positions = std::mem::take(&mut it.points[point]);
                let points = Points2D::update_fields().with_positions(positions);
                // The same points twice: as themselves and as their trail.
                for path in [it.path("points", point), it.path("trails", point)] {
                    stream.send_columns(
                        path,
                        axes.to_vec(),
                        points.clone().columns_of_unit_batches()?,
                    )?;
                }
            }
            let paths: Vec<_> =
                it.curves.iter().map(|(curve, ..)| it.path("curves", *curve)).collect();
            for ((_, time_points, strips), path) in it.curves.iter_mut().zip(paths) {
                let lines = LineStrips2D::update_fields().with_strips(strips.drain(..));
                let axes = time_points.axes();
                time_points.clear();
                stream.send_columns(path, axes, lines.columns_of_unit_batches()?)?;
            }
        }
        Ok(())
    }
}

impl Drawing {
    fn path(&self, what: &str, number: usize) -> EntityPath {
        self.slot.below(&self.frame.root, &format!("{what}/{}", number + 1))
    }

    fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        // Axes, circle and curves are drawn once for both runs.
        let first = self.slot.is_first();
        if first {
            self.frame.describe(stream)?;
        }
        let XyPlot { points, curves, circle, .. } = &self.plot;
        let mut palette = Palette::default();
        let mut legend = Vec::new();
        for (number, point) in points.iter().enumerate() {
            let color = self.slot.color(palette.color(point.role, &point.label));
            legend.push((color, self.slot.label(&point.label)));
            for (what, radius, opacity) in [("points", 5.0, 255), ("trails", 2.0, 110)] {
                let look = Points2D::update_fields()
                    .with_colors([faded(color, opacity)])
                    .with_radii([Radius::new_ui_points(radius)])
                    .with_draw_order(if what == "points" { 40.0 } else { 30.0 });
                stream.log_static(self.path(what, number), &look)?;
            }
        }
        for (number, curve) in curves.iter().enumerate().filter(|_| first) {
            let color = palette.color(curve.role, &curve.label);
            legend.push((color, curve.label.clone()));
            let path = self.path("curves", number);
            let look = LineStrips2D::update_fields()
                .with_colors([color])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(20.0);
            stream.log_static(path.clone(), &look)?;
            if !curve.moves {
                let strips = self.curve(curve, 0.0, &Row::default());
                stream.log_static(path, &LineStrips2D::update_fields().with_strips([strips]))?;
            }
        }
        if let Some(radius) = circle.filter(|_| first) {
            let angles = (0..=72).map(|it| f64::from(it) * std::f64::consts::TAU / 72.0);
            let points =
                angles.map(|it| self.frame.position([radius * it.cos(), radius * it.sin()]));
            let circle = LineStrips2D::new([points.collect::<Vec<_>>()])
                .with_colors([LIMIT])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(10.0);
            stream.log_static(format!("{}/circle", self.frame.root), &circle)?;
        }
        // Below that of the first run.
        let above = match first {
            true => 0,
            false => self.plot.points.len() + self.plot.curves.len(),
        };
        let path = self.slot.below(&self.frame.root, "legend");
        self.frame.describe_legend(stream, path, above, &legend)
    }

    fn redraw(&mut self, time_point: TimePoint, time: f64, row: &Row<Recorded>) {
        let mut curves = std::mem::take(&mut self.curves);
        for (curve, time_points, strips) in &mut curves {
            let curve = &self.plot.curves[*curve];
            time_points.push(time_point);
            strips.push(self.curve(curve, time, row));
        }
        self.curves = curves;
    }

    /// The curve within the axes.
    fn curve(&self, curve: &Function, time: f64, row: &Row<Recorded>) -> Vec<[f32; 2]> {
        let [[x0, x1], [y0, y1]] = self.plot.ranges;
        let within = y0.min(y1)..=y0.max(y1);
        let mut strip = Vec::new();
        for piece in 0..=PIECES {
            let x = x0 + (x1 - x0) * piece as f64 / PIECES as f64;
            let y = curve.value(time, row, x);
            if within.contains(&y) {
                strip.push(self.frame.position([x, y]));
            }
        }
        strip
    }
}

fn frame(number: usize, plot: &XyPlot) -> Frame {
    let [x, y] = plot.ranges.map(|[from, to]| (to - from).abs());
    Frame {
        root: format!("xy_plots/{number}"),
        labels: plot.labels.clone(),
        ranges: plot.ranges,
        width: if plot.circle.is_some() { x / y } else { ASPECT },
        line: LINE,
        ticks: TICKS,
    }
}
