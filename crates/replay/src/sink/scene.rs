//! Draws the moving body, the ground below it, the road and the driven line.

use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{
    Arrows3D, Boxes3D, LineStrips3D, Points3D, Transform3D, ViewCoordinates,
};
use re_sdk_types::components::{Color, FillMode, Radius};
use re_sdk_types::datatypes::Quaternion;
use recording::view::{Pose, View};
use recording::{Recorded, Row};

use super::arrows::Arrows;
use super::ground::Ground;
use super::palette::faded;
use super::road::Road;
use super::run_slot::RunSlot;
use super::timeline::TimePoint;
use super::trace::{
    Bounds, ColoredStrips, DistanceMarks, STRIP_SAMPLES, SpeedRange, Trace, speed_color,
};
use super::{PLANT, WHITE};

/// Length of the heading's arrow on a map that follows the car [m].
const HEADING_LEAST: f32 = 15.0;

const MARK: [u8; 3] = [190, 190, 195];
const TIRE: [u8; 3] = [78, 78, 84];
/// Colours of the scale.
const SCALE_PARTS: usize = 32;
/// How opaque the body of another run is, of 255.
const GHOST: u8 = 120;
const GLASS: [u8; 3] = [28, 44, 58];

/// The three-dimensional part of a recording.
pub(super) struct Scene {
    slot: RunSlot,
    pose: Pose,
    positions: Vec<[f32; 3]>,
    headings: Vec<Quaternion>,
    steers: Vec<Quaternion>,
    arrows: Arrows,
    ground: Option<Ground>,
    road: Option<Road>,
    trace: Trace,
    /// Rows of the driven line at the viewer.
    drawn: usize,
}

impl Scene {
    /// The scene of a scenario that has a moving body.
    pub fn new(view: &View, slot: &RunSlot) -> Option<Self> {
        // Of the second run only the body and its line are drawn; more would hide the first one.
        let (arrows, road) = match slot.is_first() {
            true => (view.arrows.clone(), view.track.clone()),
            false => (Vec::new(), None),
        };
        Some(Self {
            slot: slot.clone(),
            pose: view.pose.clone()?,
            arrows: Arrows::new(arrows),
            road: road.map(Road::new),
            positions: Vec::new(),
            headings: Vec::new(),
            steers: Vec::new(),
            ground: slot.is_first().then(Ground::default),
            trace: Trace::default(),
            drawn: 0,
        })
    }

    /// Sends the parts that are fixed in their frames.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.describe_body(stream)?;
        self.describe_wheels(stream)?;
        self.describe_marker(stream)?;
        self.describe_heading(stream, HEADING_LEAST)?;
        if !self.slot.is_first() {
            return Ok(());
        }
        stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        self.arrows.describe(stream)?;
        self.road.as_ref().map_or(Ok(()), |road| road.draw(stream))?;
        describe_frame(stream)?;
        self.ground.as_ref().map_or(Ok(()), |ground| ground.describe(stream))
    }

    /// The position of the body [m].
    pub fn position(&self, row: &Row<Recorded>) -> [f64; 2] {
        [self.pose.x, self.pose.y].map(|index| row[index])
    }

    /// Takes one row.
    pub fn push(&mut self, time_point: TimePoint, time: f64, row: &Row<Recorded>) {
        let position = [row[self.pose.x] as f32, row[self.pose.y] as f32, 0.0];
        self.positions.push(position);
        self.headings.push(turn(row[self.pose.heading]));
        if let Some(steer) = self.pose.steer {
            self.steers.push(turn(row[steer]));
        }
        self.arrows.push(time, row);
        if let Some(road) = &mut self.road {
            road.push(time, row);
        }
        if let Some(ground) = &mut self.ground {
            ground.push(time_point, position);
        }
        let speed = self.pose.speed.map_or(0.0, |it| row[it] as f32);
        self.trace.push(position, speed);
    }

    /// Sends the collected rows over these time axes, and forgets them.
    pub fn send(
        &mut self,
        stream: &RecordingStream,
        axes: &[TimeColumn],
    ) -> RecordingStreamResult<()> {
        let motion = Transform3D::update_fields()
            .with_many_translation(self.positions.drain(..))
            .with_many_quaternion(self.headings.drain(..));
        stream.send_columns(self.path("car"), axes.to_vec(), motion.columns_of_unit_batches()?)?;
        if self.pose.steer.is_some() {
            // One rotation per row turns both boxes, each about its own centre.
            let steers = Boxes3D::update_fields().with_quaternions(self.steers.drain(..));
            stream.send_columns(
                self.path("car/front_wheels"),
                axes.to_vec(),
                steers.columns_of_unit_batches()?,
            )?;
        }
        self.arrows.send(stream, axes)?;
        self.ground.as_mut().map_or(Ok(()), |ground| ground.send(stream))
    }

    /// Sends the driven line whenever it has grown by 3 %: in total some 30 times the line, not its
    /// square.
    pub fn draw(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.trace.rows() < self.drawn + self.drawn * 3 / 100 + STRIP_SAMPLES {
            return Ok(());
        }
        self.drawn = self.trace.rows();
        self.draw_line(stream)
    }

    /// Sends the whole driven line and the distances along it.
    pub fn finish(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if let Some(bounds) = self.bounds() {
            let size = (bounds.high[0] - bounds.low[0]).max(bounds.high[1] - bounds.low[1]);
            // A twentieth of any map is visible.
            self.describe_heading(stream, HEADING_LEAST.max(0.05 * size))?;
        }
        self.draw_line(stream)?;
        if !self.slot.is_first() {
            return Ok(());
        }
        let DistanceMarks { points, labels } = self.trace.marks();
        let marks = Points3D::new(points)
            .with_labels(labels)
            .with_show_labels(true)
            .with_colors([MARK])
            .with_radii([Radius::new_ui_points(2.5)]);
        stream.log_static("world/path/marks", &marks)?;
        self.draw_scale(stream)
    }

    /// Draws the scale of the driven line's colours below the line.
    fn draw_scale(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let (Some(SpeedRange { slow, fast }), Some(bounds)) = (self.speeds(), self.bounds()) else {
            return Ok(());
        };
        let [from, to] = bounds.below();
        let at = |share: f32| [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        let parts = (0..SCALE_PARTS).map(|part| part as f32 / SCALE_PARTS as f32);
        let strips = parts.clone().map(|share| [at(share), at(share + 1.0 / SCALE_PARTS as f32)]);
        let scale = LineStrips3D::new(strips)
            .with_colors(parts.map(speed_color))
            .with_radii([Radius::new_ui_points(4.0)]);
        stream.log_static("world/path/scale/colors", &scale)?;
        let digits = if fast - slow < 3.0 { 1 } else { 0 };
        let speed = |share: f32| format!("{:.digits$} km/h", 3.6 * (slow + share * (fast - slow)));
        let ends = [0.0, 1.0];
        let ends = Points3D::new(ends.map(at))
            .with_labels(ends.map(speed))
            .with_show_labels(true)
            .with_colors([MARK])
            .with_radii([Radius::new_ui_points(0.0)]);
        stream.log_static("world/path/scale/ends", &ends)
    }

    fn draw_line(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let colored = self.pose.speed.is_some() && self.slot.is_first();
        let ColoredStrips { strips, mut colors } = self.trace.strips(colored);
        let mut radius = Radius::new_ui_points(2.0);
        if !self.slot.is_first() {
            // Where the lines coincide, both stay visible.
            (colors, radius) = (vec![self.marker()], Radius::new_ui_points(1.0));
        }
        let line = LineStrips3D::new(strips).with_colors(colors).with_radii([radius]);
        stream.log_static(self.path("path/line"), &line)?;
        self.road.as_ref().map_or(Ok(()), |road| road.draw(stream))
    }

    /// An entity of this run.
    fn path(&self, name: &str) -> EntityPath {
        self.slot.below("world", name)
    }

    /// The colour of a part of the body; the first run has it in `color`.
    fn paint(&self, color: [u8; 3]) -> Color {
        match self.slot.is_first() {
            true => Color::from(color),
            false => faded(self.slot.color(PLANT.into()), GHOST),
        }
    }

    fn describe_body(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let (length, width) = (self.pose.length as f32, self.pose.width as f32);
        // Half sizes and centres are shares of the car that look like a car; nothing depends on them.
        let body = Boxes3D::from_centers_and_half_sizes(
            [(0.0, 0.0, 0.50), (0.46 * length, 0.0, 0.42)],
            [(0.46 * length, 0.42 * width, 0.22), (0.04 * length, 0.40 * width, 0.14)],
        )
        .with_colors([self.paint(PLANT)])
        .with_fill_mode(FillMode::Solid);
        stream.log_static(self.path("car/body"), &body)?;
        let cabin = Boxes3D::from_centers_and_half_sizes(
            [(-0.08 * length, 0.0, 0.95)],
            [(0.22 * length, 0.34 * width, 0.22)],
        )
        .with_colors([self.paint(GLASS)])
        .with_fill_mode(FillMode::Solid);
        stream.log_static(self.path("car/cabin"), &cabin)
    }

    fn describe_wheels(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let pose = &self.pose;
        let (side, radius) = (0.46 * pose.width as f32, 0.33);
        for (name, x) in ["front_wheels", "rear_wheels"].into_iter().zip(pose.axles) {
            let x = x as f32;
            let wheels = Boxes3D::from_centers_and_half_sizes(
                [(x, side, radius), (x, -side, radius)],
                [(radius, 0.12, radius)],
            )
            .with_colors([self.paint(TIRE)])
            .with_fill_mode(FillMode::Solid);
            stream.log_static(self.path(&format!("car/{name}")), &wheels)?;
        }
        Ok(())
    }

    /// The marker on a map, in place of the car.
    fn describe_marker(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let marker = Points3D::new([(0.0, 0.0, 2.0)])
            .with_labels(self.slot.0.as_deref())
            .with_show_labels(true)
            .with_colors([self.marker()])
            .with_radii([Radius::new_ui_points(6.0)]);
        stream.log_static(self.path("car/marker"), &marker)
    }

    fn marker(&self) -> Color {
        match self.slot.is_first() {
            true => Color::from(WHITE),
            false => self.slot.color(PLANT.into()),
        }
    }

    fn describe_heading(&self, stream: &RecordingStream, length: f32) -> RecordingStreamResult<()> {
        let arrow = Arrows3D::from_vectors([(length, 0.0, 0.0)])
            .with_origins([(0.0, 0.0, 2.0)])
            .with_colors([self.marker()])
            .with_radii([Radius::new_ui_points(2.0)]);
        stream.log_static(self.path("car/heading"), &arrow)
    }

    /// The rectangle around the driven line.
    pub fn bounds(&self) -> Option<Bounds> {
        self.trace.bounds()
    }

    /// The lowest and the highest speed of the driven line [m/s].
    pub fn speeds(&self) -> Option<SpeedRange> {
        self.pose.speed.and_then(|_| self.trace.speeds())
    }
}

fn turn(angle: f64) -> Quaternion {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Quaternion::from_xyzw([0.0, 0.0, sin as f32, cos as f32])
}

/// The geometry for a following camera.
fn describe_frame(stream: &RecordingStream) -> RecordingStreamResult<()> {
    // The distance of a following camera is 1.5 times the bounding sphere of what it follows; a
    // transform without geometry is not followed at all.
    let frame = Points3D::new([(-60.0, -60.0, 0.0), (60.0, 60.0, 0.0)]).with_radii([0.001]);
    stream.log_static("world/car/frame", &frame)
}
