//! Draws the edges of the road.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::LineStrips3D;
use recording::RoadSamples;

const EDGE: [u8; 3] = [205, 205, 205];
/// Half the width of the line that marks an edge [m].
const RADIUS: f32 = 0.08;

/// Sends the known edges.
pub(super) fn send_road_edges(stream: &RecordingStream, road: &RoadSamples) -> RecordingStreamResult<()> {
    // As high above the ground as the driven line.
    let strips = road.edges().map(|edge| edge.iter().map(ground_point).collect::<Vec<_>>());
    let edges = LineStrips3D::new(strips).with_colors([EDGE]).with_radii([RADIUS]);
    stream.log_static("world/road", &edges)
}

fn ground_point([x, y]: &[f64; 2]) -> [f32; 3] {
    [*x as f32, *y as f32, 0.02]
}
