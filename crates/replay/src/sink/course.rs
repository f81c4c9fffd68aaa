//! Draws the course of a test: its cones, and the line to follow.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips3D, Points3D};

const CONE: [u8; 3] = [240, 120, 20];
/// Half the width of a cone [m]; those of ISO 3888 are wider at the ground.
const CONE_RADIUS: f32 = 0.15;
const PATH: [u8; 3] = [120, 160, 220];
/// Half the width of the line to follow [m].
const PATH_RADIUS: f32 = 0.04;

/// Sends where cones stand, and the line to follow, east and north [m].
pub(super) fn send_course(
    stream: &RecordingStream,
    cones: &[[f64; 2]],
    path: &[[f64; 2]],
) -> RecordingStreamResult<()> {
    let above_ground = |height: f32| move |[x, y]: &[f64; 2]| [*x as f32, *y as f32, height];
    let points = Points3D::new(cones.iter().map(above_ground(CONE_RADIUS)));
    stream.log_static("world/cones", &points.with_colors([CONE]).with_radii([CONE_RADIUS]))?;
    // Below the driven line, so that this one is seen where both are the same.
    let line = LineStrips3D::new([path.iter().map(above_ground(0.01)).collect::<Vec<_>>()]);
    stream.log_static("world/line_to_follow", &line.with_colors([PATH]).with_radii([PATH_RADIUS]))
}
