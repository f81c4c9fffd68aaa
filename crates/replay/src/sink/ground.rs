//! Draws the ground below the moving body.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips3D, Transform3D};
use re_sdk_types::components::Color;

use super::timeline::{TimePoint, TimePoints};

/// Line spacing [m].
const SPACING: f32 = 10.0;
/// It moves along in jumps of this length [m]; every line at a multiple of it is brighter.
const JUMP: f32 = 50.0;
/// Half its edge [m].
const REACH: f32 = 250.0;

/// A patch of ground that follows the car in jumps of whole squares, which looks like an endless plot.
#[derive(Default)]
pub(super) struct GroundPatch {
    time_points: TimePoints,
    positions: Vec<[f32; 3]>,
    last: Option<[f32; 3]>,
}

impl GroundPatch {
    /// Sends the parts that are fixed in its frame.
    pub fn send_static(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let half = (REACH / SPACING) as i32;
        let per_jump = (JUMP / SPACING) as i32;
        let (mut strips, mut colors) = (Vec::new(), Vec::new());
        for line in -half..=half {
            let at = line as f32 * SPACING;
            strips.push([[-REACH, at, 0.0], [REACH, at, 0.0]]);
            strips.push([[at, -REACH, 0.0], [at, REACH, 0.0]]);
            let level = if line % per_jump == 0 { 92 } else { 52 };
            colors.extend([Color::from_rgb(level, level, level + 6); 2]);
        }
        let ground = LineStrips3D::new(strips).with_colors(colors).with_radii([0.05]);
        stream.log_static("world/ground", &ground)
    }

    pub fn push_position(&mut self, time_point: TimePoint, position: [f32; 3]) {
        let center = position.map(|it| (it / JUMP).round() * JUMP);
        if self.last != Some(center) {
            self.time_points.push(time_point);
            self.positions.push(center);
            self.last = Some(center);
        }
    }

    /// Sends its positions and forgets them.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.positions.is_empty() {
            return Ok(());
        }
        let axes = self.time_points.time_columns();
        self.time_points.clear();
        let motion = Transform3D::update_fields().with_many_translation(self.positions.drain(..));
        stream.send_columns("world/ground", axes, motion.columns_of_unit_batches()?)
    }
}
