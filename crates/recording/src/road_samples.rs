//! Collects the edges of the road from the rows of a run.

use crate::row::{RecordedVariables, Row};
use crate::thinned_samples::ThinnedSamples;
use crate::view::{RowQuantity, TrackEdges, road_edges};

/// The part of the road that is known so far.
#[derive(Debug, Clone)]
pub struct RoadSamples {
    track: TrackEdges,
    /// Points from rows: of the left and the right edge, or of the centre line and zeros [m].
    points: ThinnedSamples<[[f64; 2]; 2]>,
}

impl RoadSamples {
    /// A road of which as many points are kept as [`ThinnedSamples`] keeps by default.
    #[must_use]
    pub fn new(track: TrackEdges) -> Self {
        Self { track, points: ThinnedSamples::default() }
    }

    /// A road of which at most `limit` points are kept, whose memory is there from the start.
    #[must_use]
    pub fn with_limit(track: TrackEdges, limit: usize) -> Self {
        Self { track, points: ThinnedSamples::with_limit(limit) }
    }

    /// Takes the points of a row; those that are no numbers are left out.
    pub fn push_row(&mut self, time: f64, row: &Row<RecordedVariables>) {
        let point = |of: &[RowQuantity; 2]| of.each_ref().map(|it| it.evaluate(time, row));
        let points = match &self.track {
            TrackEdges::Edges(_) => return,
            TrackEdges::Sides([left, right]) => [point(left), point(right)],
            TrackEdges::Center(center, _) => [point(center), [0.0; 2]],
        };
        if points.as_flattened().iter().all(|it| it.is_finite()) {
            self.points.push(points);
        }
    }

    /// The left and the right edge [m].
    #[must_use]
    pub fn edges(&self) -> [Vec<[f64; 2]>; 2] {
        let points = self.points.samples().iter();
        match &self.track {
            TrackEdges::Edges(edges) => edges.clone(),
            TrackEdges::Sides(_) => [0, 1].map(|side| points.clone().map(|it| it[side]).collect()),
            TrackEdges::Center(_, widths) => {
                let center: Vec<_> = points.map(|it| it[0]).collect();
                road_edges(&center, &vec![*widths; center.len()])
            }
        }
    }
}
