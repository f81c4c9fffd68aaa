//! Draws the moving body, the ground below it, the road and the driven line.

use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Arrows3D, Boxes3D, LineStrips3D, Points3D, Transform3D, ViewCoordinates};
use re_sdk_types::components::{Color, FillMode, Radius};
use re_sdk_types::datatypes::Quaternion;
use recording::view::{PoseColumns, ReplayView};
use recording::{AnalysisColumns, RecordedVariables, RoadSamples, Row};

use super::arrows::VectorArrows;
use super::ground::GroundPatch;
use super::palette::with_opacity;
use super::road::send_road_edges;
use super::run_slot::RunNamespace;
use super::timeline::{TimePoint, TimePoints};
use super::trace::{
    ColouredStrips, DistanceMarks, DrivenLine, MapBounds, STRIP_SAMPLES, SpeedRange, speed_color,
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

/// Where a second body is, at each of its times.
pub(super) struct GhostPath<'a> {
    /// Position east [m].
    x: &'a [f64],
    /// Position north [m].
    y: &'a [f64],
    /// Heading [rad], counter-clockwise from x.
    heading: &'a [f64],
}

impl<'a> GhostPath<'a> {
    /// The path of columns `X` and `Y` in m and `psi` in rad, if they are among those of an analysis.
    pub fn among(derived: &AnalysisColumns<'a>) -> Option<Self> {
        let column = |name, unit| {
            let it = derived.columns.iter().find(|it| (it.name, it.unit) == (name, unit))?;
            it.values.iter().all(|value| value.is_finite()).then_some(it.values)
        };
        Some(Self { x: column("X", "m")?, y: column("Y", "m")?, heading: column("psi", "rad")? })
    }
}

/// The three-dimensional part of a recording.
pub(super) struct VehicleScene {
    slot: RunNamespace,
    pose: PoseColumns,
    positions: Vec<[f32; 3]>,
    headings: Vec<Quaternion>,
    steers: Vec<Quaternion>,
    arrows: VectorArrows,
    ground: Option<GroundPatch>,
    road: Option<RoadSamples>,
    trace: DrivenLine,
    /// Rows of the driven line at the viewer.
    drawn: usize,
}

impl VehicleScene {
    /// The scene of a scenario that has a moving body.
    pub fn new(view: &ReplayView, slot: &RunNamespace) -> Option<Self> {
        let mut scene = Self::of_body(slot.clone(), view.pose.clone()?);
        // Of the second run only the body and its line are drawn; more would hide the first one.
        if slot.is_first() {
            scene.arrows = VectorArrows::new(view.arrows.clone());
            scene.road = view.track.clone().map(RoadSamples::new);
            scene.ground = Some(GroundPatch::default());
        }
        Some(scene)
    }

    /// A body and its line, and nothing around them.
    fn of_body(slot: RunNamespace, pose: PoseColumns) -> Self {
        Self {
            slot,
            pose,
            arrows: VectorArrows::new(Vec::new()),
            road: None,
            positions: Vec::new(),
            headings: Vec::new(),
            steers: Vec::new(),
            ground: None,
            trace: DrivenLine::default(),
            drawn: 0,
        }
    }

    /// Sends the parts that are fixed in their frames.
    pub fn send_static(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        self.send_body(stream)?;
        self.send_wheels(stream)?;
        self.send_static_car_marker(stream)?;
        self.send_heading_arrow(stream, HEADING_LEAST)?;
        if !self.slot.is_first() {
            return Ok(());
        }
        stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Z_UP())?;
        self.arrows.send_static(stream)?;
        self.road.as_ref().map_or(Ok(()), |road| send_road_edges(stream, road))?;
        send_chase_camera_frame(stream)?;
        self.ground.as_ref().map_or(Ok(()), |ground| ground.send_static(stream))
    }

    /// Draws a second body along a path that an analysis gives, under this name: its line, and the body itself at these time points. It steers
    /// no wheel and has no arrows.
    pub fn send_ghost(
        &self,
        stream: &RecordingStream,
        name: &str,
        path: &GhostPath,
        time_points: &TimePoints,
    ) -> RecordingStreamResult<()> {
        let pose = PoseColumns { steer: None, speed: None, ..self.pose.clone() };
        let mut ghost = Self::of_body(RunNamespace(Some(name.to_owned())), pose);
        ghost.headings.extend(path.heading.iter().copied().map(yaw_quaternion));
        for (x, y) in path.x.iter().zip(path.y) {
            let position = [*x as f32, *y as f32, 0.0];
            ghost.positions.push(position);
            ghost.trace.push(position, 0.0);
        }
        ghost.send_static(stream)?;
        ghost.send(stream, &time_points.time_columns())?;
        ghost.send_driven_line(stream)
    }

    /// The position of the body [m].
    pub fn body_position(&self, row: &Row<RecordedVariables>) -> [f64; 2] {
        [self.pose.x, self.pose.y].map(|index| row[index])
    }

    /// Takes one row.
    pub fn push_row(&mut self, time_point: TimePoint, time: f64, row: &Row<RecordedVariables>) {
        let position = [row[self.pose.x] as f32, row[self.pose.y] as f32, 0.0];
        self.positions.push(position);
        self.headings.push(yaw_quaternion(row[self.pose.heading]));
        if let Some(steer) = self.pose.steer {
            self.steers.push(yaw_quaternion(row[steer]));
        }
        self.arrows.push_row(time, row);
        if let Some(road) = &mut self.road {
            road.push_row(time, row);
        }
        if let Some(ground) = &mut self.ground {
            ground.push_position(time_point, position);
        }
        let speed = self.pose.speed.map_or(0.0, |it| row[it] as f32);
        self.trace.push(position, speed);
    }

    /// Sends the collected rows over these time axes, and forgets them.
    pub fn send(&mut self, stream: &RecordingStream, axes: &[TimeColumn]) -> RecordingStreamResult<()> {
        let motion = Transform3D::update_fields()
            .with_many_translation(self.positions.drain(..))
            .with_many_quaternion(self.headings.drain(..));
        stream.send_columns(self.entity_path("car"), axes.to_vec(), motion.columns_of_unit_batches()?)?;
        if self.pose.steer.is_some() {
            // One rotation per row turns both boxes, each about its own centre.
            let steers = Boxes3D::update_fields().with_quaternions(self.steers.drain(..));
            stream.send_columns(
                self.entity_path("car/front_wheels"),
                axes.to_vec(),
                steers.columns_of_unit_batches()?,
            )?;
        }
        self.arrows.send(stream, axes)?;
        self.ground.as_mut().map_or(Ok(()), |ground| ground.send(stream))
    }

    /// Sends the driven line whenever it has grown by 3 %: in total some 30 times the line, not its
    /// square.
    pub fn send_grown_driven_line(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.trace.row_count() < self.drawn + self.drawn * 3 / 100 + STRIP_SAMPLES {
            return Ok(());
        }
        self.drawn = self.trace.row_count();
        self.send_driven_line(stream)
    }

    /// Sends the whole driven line and the distances along it.
    pub fn send_final_driven_line(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if let Some(bounds) = self.driven_line_bounds() {
            let size = (bounds.high[0] - bounds.low[0]).max(bounds.high[1] - bounds.low[1]);
            // A twentieth of any map is visible.
            self.send_heading_arrow(stream, HEADING_LEAST.max(0.05 * size))?;
        }
        self.send_driven_line(stream)?;
        if !self.slot.is_first() {
            return Ok(());
        }
        let DistanceMarks { points, labels } = self.trace.distance_marks();
        let marks = Points3D::new(points)
            .with_labels(labels)
            .with_show_labels(true)
            .with_colors([MARK])
            .with_radii([Radius::new_ui_points(2.5)]);
        stream.log_static("world/path/marks", &marks)?;
        self.send_speed_scale(stream)
    }

    /// Draws the scale of the driven line's colours below the line.
    fn send_speed_scale(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let (Some(SpeedRange { slow, fast }), Some(bounds)) = (self.speed_range(), self.driven_line_bounds())
        else {
            return Ok(());
        };
        let [from, to] = bounds.scale_line_ends();
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

    fn send_driven_line(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let colored = self.pose.speed.is_some() && self.slot.is_first();
        let ColouredStrips { strips, mut colors } = self.trace.colored_strips(colored);
        let mut radius = Radius::new_ui_points(2.0);
        if !self.slot.is_first() {
            // Where the lines coincide, both stay visible.
            (colors, radius) = (vec![self.marker_color()], Radius::new_ui_points(1.0));
        }
        let line = LineStrips3D::new(strips).with_colors(colors).with_radii([radius]);
        stream.log_static(self.entity_path("path/line"), &line)?;
        self.road.as_ref().map_or(Ok(()), |road| send_road_edges(stream, road))
    }

    /// An entity of this run.
    fn entity_path(&self, name: &str) -> EntityPath {
        self.slot.entity_path_below("world", name)
    }

    /// The colour of a part of the body; the first run has it in `color`.
    fn body_color(&self, color: [u8; 3]) -> Color {
        match self.slot.is_first() {
            true => Color::from(color),
            false => with_opacity(self.slot.run_color(PLANT.into()), GHOST),
        }
    }

    fn send_body(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let (length, width) = (self.pose.length as f32, self.pose.width as f32);
        // Half sizes and centres are shares of the car that look like a car; nothing depends on them.
        let body = Boxes3D::from_centers_and_half_sizes(
            [(0.0, 0.0, 0.50), (0.46 * length, 0.0, 0.42)],
            [(0.46 * length, 0.42 * width, 0.22), (0.04 * length, 0.40 * width, 0.14)],
        )
        .with_colors([self.body_color(PLANT)])
        .with_fill_mode(FillMode::Solid);
        stream.log_static(self.entity_path("car/body"), &body)?;
        let cabin = Boxes3D::from_centers_and_half_sizes(
            [(-0.08 * length, 0.0, 0.95)],
            [(0.22 * length, 0.34 * width, 0.22)],
        )
        .with_colors([self.body_color(GLASS)])
        .with_fill_mode(FillMode::Solid);
        stream.log_static(self.entity_path("car/cabin"), &cabin)
    }

    fn send_wheels(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let pose = &self.pose;
        let (side, radius) = (0.46 * pose.width as f32, 0.33);
        for (name, x) in ["front_wheels", "rear_wheels"].into_iter().zip(pose.axles) {
            let x = x as f32;
            let wheels = Boxes3D::from_centers_and_half_sizes(
                [(x, side, radius), (x, -side, radius)],
                [(radius, 0.12, radius)],
            )
            .with_colors([self.body_color(TIRE)])
            .with_fill_mode(FillMode::Solid);
            stream.log_static(self.entity_path(&format!("car/{name}")), &wheels)?;
        }
        Ok(())
    }

    /// The marker on a map, in place of the car.
    fn send_static_car_marker(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let marker = Points3D::new([(0.0, 0.0, 2.0)])
            .with_labels(self.slot.0.as_deref())
            .with_show_labels(true)
            .with_colors([self.marker_color()])
            .with_radii([Radius::new_ui_points(6.0)]);
        stream.log_static(self.entity_path("car/marker"), &marker)
    }

    fn marker_color(&self) -> Color {
        match self.slot.is_first() {
            true => Color::from(WHITE),
            false => self.slot.run_color(PLANT.into()),
        }
    }

    fn send_heading_arrow(&self, stream: &RecordingStream, length: f32) -> RecordingStreamResult<()> {
        let arrow = Arrows3D::from_vectors([(length, 0.0, 0.0)])
            .with_origins([(0.0, 0.0, 2.0)])
            .with_colors([self.marker_color()])
            .with_radii([Radius::new_ui_points(2.0)]);
        stream.log_static(self.entity_path("car/heading"), &arrow)
    }

    /// The rectangle around the driven line.
    pub fn driven_line_bounds(&self) -> Option<MapBounds> {
        self.trace.bounds()
    }

    /// The lowest and the highest speed of the driven line [m/s].
    pub fn speed_range(&self) -> Option<SpeedRange> {
        self.pose.speed.and_then(|_| self.trace.speed_range())
    }
}

fn yaw_quaternion(angle: f64) -> Quaternion {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Quaternion::from_xyzw([0.0, 0.0, sin as f32, cos as f32])
}

/// The geometry for a following camera.
fn send_chase_camera_frame(stream: &RecordingStream) -> RecordingStreamResult<()> {
    // The distance of a following camera is 1.5 times the bounding sphere of what it follows; a
    // transform without geometry is not followed at all.
    let frame = Points3D::new([(-60.0, -60.0, 0.0), (60.0, 60.0, 0.0)]).with_radii([0.001]);
    stream.log_static("world/car/frame", &frame)
}
