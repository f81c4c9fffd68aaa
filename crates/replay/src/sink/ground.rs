//! Draws the ground below the moving body.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips3D, Transform3D};
use re_sdk_types::components::Color;

use super::moments::{Moment, Moments};

/// Line spacing [m].
const SPACING: f32 = 10.0;
/// It moves along in jumps of this length [m]; every line at a multiple of it is brighter.
const JUMP: f32 = 50.0;
/// Half its edge [m].
const REACH: f32 = 250.0;

/// A patch of ground that follows the car in jumps of whole squares, which looks like an endless plane.
#[derive(Default)]
pub(super) struct Ground {
    moments: Moments,
    places: Vec<[f32; 3]>,
    last: Option<[f32; 3]>,
}

impl Ground {
    /// Sends what does not move in its own frame.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
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

    pub fn push(&mut self, moment: Moment, position: [f32; 3]) {
        let place = position.map(|it| (it / JUMP).round() * JUMP);
        if self.last != Some(place) {
            self.moments.push(moment);
            self.places.push(place);
            self.last = Some(place);
        }
    }

    /// Sends where it is and forgets it.
    pub fn send(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        if self.places.is_empty() {
            return Ok(());
        }
        let axes = self.moments.axes();
        self.moments.clear();
        let motion = Transform3D::update_fields().with_many_translation(self.places.drain(..));
        stream.send_columns("world/ground", axes, motion.columns_of_unit_batches()?)
    }
}
