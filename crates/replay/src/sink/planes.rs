//! Draws diagrams of one quantity over another, which the viewer has no view for: curves, and points that move.

use recording::view::{Function, Plane};
use recording::{Recorded, Row};
use rerun::{
    EntityPath, LineStrips2D, Points2D, Radius, RecordingStream, RecordingStreamResult, TimeColumn,
};

use super::LIMIT;
use super::contender::Contender;
use super::frame::{Frame, Strip};
use super::moments::{Moment, Moments};
use super::palette::{Palette, faded};

/// Width by height of a diagram without a circle; with one, both axes have the same scale.
const ASPECT: f64 = 1.1;
/// Pieces that a curve is drawn in.
const PIECES: usize = 160;
/// Height of a line of text in a diagram of height 1.
const LINE: f32 = 0.05;
/// Spaces between ticks of an axis at most.
const TICKS: f64 = 6.0;
/// Curves that depend on signals are drawn anew after this time [ns].
const REDRAW: i64 = 100_000_000;

/// The diagrams, with what was not sent yet.
pub(super) struct Planes(Vec<Drawing>);

struct Drawing {
    contender: Contender,
    plane: Plane,
    frame: Frame,
    /// Places of each point.
    points: Vec<Vec<[f32; 2]>>,
    /// Curves that depend on signals: which, when, and how they run.
    curves: Vec<(usize, Moments, Vec<Strip>)>,
    drawn: Option<i64>,
    /// The numbers of a row with room for the x of a curve behind them.
    numbers: Vec<f64>,
}

/// What a layout needs of a diagram.
pub(super) struct Shown {
    pub title: String,
    pub root: String,
    /// Width of a diagram of height 1.
    pub width: f64,
    /// Height of a line of text.
    pub line: f32,
    /// Entities that leave a trail, and for how long [s].
    pub trails: Vec<EntityPath>,
    pub trail: f64,
}

impl Planes {
    /// Diagrams of rows that have so many numbers.
    pub fn new(planes: &[Plane], numbers: usize, contender: &Contender) -> Self {
        Self::numbered(planes, numbers, contender, 1)
    }

    /// The same behind others, from this number on.
    pub fn numbered(planes: &[Plane], numbers: usize, contender: &Contender, first: usize) -> Self {
        let drawing = |(index, plane): (usize, &Plane)| {
            // Of another run there are the points; more would hide those of the first one.
            let shown = |(_, it): &(usize, &Function)| it.moves && contender.is_first();
            let moving = plane.curves.iter().enumerate().filter(shown);
            Drawing {
                contender: contender.clone(),
                points: vec![Vec::new(); plane.points.len()],
                curves: moving.map(|(it, _)| (it, Moments::default(), Vec::new())).collect(),
                frame: frame(first + index, plane),
                plane: plane.clone(),
                drawn: None,
                numbers: vec![0.0; numbers + 1],
            }
        };
        Self(planes.iter().enumerate().map(drawing).collect())
    }

    /// The entity that a diagram is below.
    pub fn root(&self, diagram: usize) -> String {
        self.0[diagram].frame.root.clone()
    }

    /// Where coordinates are in a diagram's view.
    pub fn place(&self, diagram: usize, coordinates: [f64; 2]) -> [f32; 2] {
        self.0[diagram].frame.place(coordinates)
    }

    /// What the layout needs.
    pub fn shown(&self) -> Vec<Shown> {
        let shown = |it: &Drawing| Shown {
            title: it.plane.title.clone(),
            root: it.frame.root.clone(),
            width: it.frame.width,
            line: LINE,
            trails: (0..it.points.len()).map(|point| it.path("trails", point)).collect(),
            trail: it.plane.trail,
        };
        self.0.iter().map(shown).collect()
    }

    /// The same with the points of another run in each diagram.
    pub fn shown_with(&self, other: &Planes) -> Vec<Shown> {
        let mut shown = self.shown();
        for (shown, other) in shown.iter_mut().zip(other.shown()) {
            shown.trails.extend(other.trails);
        }
        shown
    }

    /// Sends what does not move.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.0.iter().try_for_each(|it| it.describe(stream))
    }

    pub fn push(&mut self, moment: Moment, time: f64, row: &Row<Recorded>) {
        for it in &mut self.0 {
            for point in 0..it.points.len() {
                let [x, y] = it.plane.points[point].place.each_ref().map(|of| of.value(time, row));
                let place = it.frame.place([x, y]);
                it.points[point].push(place);
            }
            if !it.curves.is_empty() && it.drawn.is_none_or(|drawn| moment.time >= drawn + REDRAW) {
                it.drawn = Some(moment.time);
                it.redraw(moment, time, row);
            }
        }
    }

    /// Sends what was collected, against the given time axes, and forgets it.
    pub fn send(
        &mut self,
        stream: &RecordingStream,
        axes: &[TimeColumn],
    ) -> RecordingStreamResult<()> {
        for it in &mut self.0 {
            for point in 0..it.points.len() {
                let places = std::mem::take(&mut it.points[point]);
                let points = Points2D::update_fields().with_positions(places);
                // The same points twice: where they are, and the trail that they leave.
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
            for ((_, moments, strips), path) in it.curves.iter_mut().zip(paths) {
                let lines = LineStrips2D::update_fields().with_strips(strips.drain(..));
                let axes = moments.axes();
                moments.clear();
                stream.send_columns(path, axes, lines.columns_of_unit_batches()?)?;
            }
        }
        Ok(())
    }
}

impl Drawing {
    fn path(&self, what: &str, number: usize) -> EntityPath {
        self.contender.below(&self.frame.root, &format!("{what}/{}", number + 1))
    }

    fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        // Axes, circle and curves are there once for all runs.
        let first = self.contender.is_first();
        if first {
            self.frame.describe(stream)?;
        }
        let Plane { points, curves, circle, .. } = &self.plane;
        let mut palette = Palette::default();
        let mut legend = Vec::new();
        for (number, point) in points.iter().enumerate() {
            let color = self.contender.color(palette.color(point.role, &point.label));
            legend.push((color, self.contender.label(&point.label)));
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
                let strips = self.curve(curve, 0.0, &mut self.numbers.clone(), &[]);
                stream.log_static(path, &LineStrips2D::update_fields().with_strips([strips]))?;
            }
        }
        if let Some(radius) = circle.filter(|_| first) {
            let angles = (0..=72).map(|it| f64::from(it) * std::f64::consts::TAU / 72.0);
            let points = angles.map(|it| self.frame.place([radius * it.cos(), radius * it.sin()]));
            let circle = LineStrips2D::new([points.collect::<Vec<_>>()])
                .with_colors([LIMIT])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(10.0);
            stream.log_static(format!("{}/circle", self.frame.root), &circle)?;
        }
        // Below that of the first run.
        let above = match first {
            true => 0,
            false => self.plane.points.len() + self.plane.curves.len(),
        };
        let path = self.contender.below(&self.frame.root, "legend");
        self.frame.describe_legend(stream, path, above, &legend)
    }

    fn redraw(&mut self, moment: Moment, time: f64, row: &Row<Recorded>) {
        let (mut curves, mut numbers) =
            (std::mem::take(&mut self.curves), std::mem::take(&mut self.numbers));
        numbers[..row.numbers().len()].copy_from_slice(row.numbers());
        for (curve, moments, strips) in &mut curves {
            let curve = &self.plane.curves[*curve];
            moments.push(moment);
            strips.push(self.curve(curve, time, &mut numbers, row.texts()));
        }
        (self.curves, self.numbers) = (curves, numbers);
    }

    /// The curve within the axes; the last of `numbers` becomes its x.
    fn curve(
        &self,
        curve: &Function,
        time: f64,
        numbers: &mut [f64],
        texts: &[String],
    ) -> Vec<[f32; 2]> {
        let [[x0, x1], [y0, y1]] = self.plane.ranges;
        let within = y0.min(y1)..=y0.max(y1);
        let mut strip = Vec::new();
        for piece in 0..=PIECES {
            let x = x0 + (x1 - x0) * piece as f64 / PIECES as f64;
            if let Some(last) = numbers.last_mut() {
                *last = x;
            }
            let y = curve.y.value(time, numbers, texts);
            if within.contains(&y) {
                strip.push(self.frame.place([x, y]));
            }
        }
        strip
    }
}

fn frame(number: usize, plane: &Plane) -> Frame {
    let [x, y] = plane.ranges.map(|[from, to]| (to - from).abs());
    Frame {
        root: format!("planes/{number}"),
        labels: plane.labels.clone(),
        ranges: plane.ranges,
        width: if plane.circle.is_some() { x / y } else { ASPECT },
        line: LINE,
        ticks: TICKS,
    }
}
