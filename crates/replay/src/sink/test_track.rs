//! Draws the track of a test: its cones, those that the car hits in the colour of failure, and the line to follow.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips3D, Points3D};
use recording::TestTrackLayout;

const CONE: [u8; 3] = [240, 120, 20];
const HIT_CONE: [u8; 3] = [255, 60, 80];
/// Half the width of a cone [m]; those of ISO 3888 are wider at the ground.
const CONE_RADIUS: f32 = 0.15;
/// A cone that is hit stands out [m].
const HIT_CONE_RADIUS: f32 = 0.3;
const PATH: [u8; 3] = [120, 160, 220];
/// Half the width of the line to follow [m].
const PATH_RADIUS: f32 = 0.04;

/// Sends a track.
pub(super) fn send_test_track(
    stream: &RecordingStream,
    track: &TestTrackLayout,
) -> RecordingStreamResult<()> {
    let above_ground = |height: f32| move |[x, y]: &[f64; 2]| [*x as f32, *y as f32, height];
    let cones = Points3D::new(track.cones.iter().map(above_ground(CONE_RADIUS)));
    stream.log_static("world/cones", &cones.with_colors([CONE]).with_radii([CONE_RADIUS]))?;
    if !track.hit_cones.is_empty() {
        let hit = Points3D::new(track.hit_cones.iter().map(above_ground(HIT_CONE_RADIUS)))
            .with_colors([HIT_CONE])
            .with_radii([HIT_CONE_RADIUS])
            .with_labels(track.hit_cones.iter().map(|_| "hit"));
        stream.log_static("world/hit_cones", &hit)?;
    }
    // Below the driven line, so that this one is seen where both are the same.
    let line = LineStrips3D::new([track.path.iter().map(above_ground(0.01)).collect::<Vec<_>>()]);
    stream.log_static("world/line_to_follow", &line.with_colors([PATH]).with_radii([PATH_RADIUS]))
}
