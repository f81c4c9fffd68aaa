//! Draws the edges of the road.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::LineStrips3D;
use recording::view::{TrackEdges, road_edges};
use recording::{RecordedVariables, Row, ThinnedSamples};

const EDGE: [u8; 3] = [205, 205, 205];
/// Half the width of the line that marks an edge [m].
const RADIUS: f32 = 0.08;

/// The known part of the road.
pub(super) struct RoadEdges {
    track: TrackEdges,
    /// Points from rows: of the left and the right edge, or of the centre line and zeros [m].
    points: ThinnedSamples<[[f64; 2]; 2]>,
}

impl RoadEdges {
    pub fn new(track: TrackEdges) -> Self {
        Self { track, points: ThinnedSamples::default() }
    }

    pub fn push_row(&mut self, time: f64, row: &Row<RecordedVariables>) {
        let point = |of: &[recording::view::RowQuantity; 2]| of.each_ref().map(|it| it.evaluate(time, row));
        let points = match &self.track {
            TrackEdges::Edges(_) => return,
            TrackEdges::Sides([left, right]) => [point(left), point(right)],
            TrackEdges::Center(center, _) => [point(center), [0.0; 2]],
        };
        if points.as_flattened().iter().all(|it| it.is_finite()) {
            self.points.push(points);
        }
    }

    /// Sends the known edges.
    pub fn send_edges(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let points = self.points.samples().iter();
        let edges = match &self.track {
            TrackEdges::Edges(edges) => edges.clone(),
            TrackEdges::Sides(_) => [0, 1].map(|side| points.clone().map(|it| it[side]).collect()),
            TrackEdges::Center(_, widths) => {
                let center: Vec<_> = points.map(|it| it[0]).collect();
                road_edges(&center, &vec![*widths; center.len()])
            }
        };
        // As high above the ground as the driven line.
        let strips = edges.map(|edge| edge.iter().map(ground_point).collect::<Vec<_>>());
        let edges = LineStrips3D::new(strips).with_colors([EDGE]).with_radii([RADIUS]);
        stream.log_static("world/road", &edges)
    }
}

fn ground_point([x, y]: &[f64; 2]) -> [f32; 3] {
    [*x as f32, *y as f32, 0.02]
}
