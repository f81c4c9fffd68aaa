//! Cuts across a road at a station: the reference line, and both edges of the lanes for driving.

use xodr::{LaneId, LanePosition, Point, RoadNetwork, RoadPosition};

use crate::road_stretch::RoadStretch;

/// A cut across the road, seen in the direction of the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrossSection {
    /// Left and right edge: x, y, z [m].
    pub edges: [[f64; 3]; 2],
    /// The reference line [m].
    pub reference: [f64; 3],
}

impl CrossSection {
    /// Cuts a stretch at a station of its road [m]; none where a lane does not reach.
    pub fn at(network: &RoadNetwork, stretch: &RoadStretch, s: f64) -> Option<Self> {
        let edge = |lane: LaneId, side: f64| {
            let centre = LanePosition { lane, s, offset: 0.0 };
            let width = f64::from(network.lane(lane)?.width_at(network.centerline_s(centre)?));
            network.lane_point(LanePosition { offset: 0.5 * side * width, ..centre }).map(coordinates)
        };
        let mut edges = [edge(stretch.leftmost, 1.0)?, edge(stretch.rightmost, -1.0)?];
        if !stretch.forward {
            edges.reverse();
        }
        let reference =
            network.road_point(RoadPosition { road: stretch.road, s, t: 0.0 }).map(coordinates)?;
        Some(CrossSection { edges, reference })
    }

    /// The middle between both edges [m].
    pub fn middle(&self) -> [f64; 3] {
        let [left, right] = self.edges;
        [0, 1, 2].map(|i| 0.5 * (left[i] + right[i]))
    }

    /// Ways in the plane from a point on the cut to the left and the right edge [m]; negative beyond an edge.
    pub fn widths_from(&self, point: [f64; 3]) -> [f64; 2] {
        let [left, right] = self.edges;
        let across = [left[0] - right[0], left[1] - right[1]];
        let width = across[0].hypot(across[1]);
        if width == 0.0 {
            return [0.0; 2];
        }
        let way = |from: [f64; 3], to: [f64; 3]| {
            ((to[0] - from[0]) * across[0] + (to[1] - from[1]) * across[1]) / width
        };
        [way(point, left), way(right, point)]
    }

    /// Slope across the road [rad]; positive where the left side is higher.
    pub fn bank(&self) -> f64 {
        let [left, right] = self.edges;
        (left[2] - right[2]).atan2((left[0] - right[0]).hypot(left[1] - right[1]))
    }
}

fn coordinates(point: Point) -> [f64; 3] {
    point.to_array().map(f64::from)
}

/// First and last station of a stretch on its road [m].
///
/// A lane is asked for at stations, as its network does not tell them: it begins and ends where it has no more points.
pub fn station_range(network: &RoadNetwork, stretch: &RoadStretch) -> Option<[f64; 2]> {
    /// Halvings: of 100 km a tenth of a millimetre is left after 30.
    const HALVINGS: usize = 40;
    let has_points =
        |s: f64| network.lane_point(LanePosition { lane: stretch.leftmost, s, offset: 0.0 }).is_some();
    let points = network.lane(stretch.leftmost)?.center.points();
    let within = [points.len() / 2, 0, points.len() - 1]
        .into_iter()
        .filter_map(|i| network.road_position_on(stretch.road, points[i]))
        .map(|at| at.s)
        .find(|s| has_points(*s))?;
    let end = |mut outside: f64| {
        let mut inside = within;
        if has_points(outside) {
            return outside;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if has_points(middle) { inside = middle } else { outside = middle }
        }
        inside
    };
    Some([end(0.0), end(network.road(stretch.road)?.length())])
}

/// The cut at the end of a stretch, or at its begin.
pub fn end_section(network: &RoadNetwork, stretch: &RoadStretch, at_end: bool) -> Option<CrossSection> {
    let [first, last] = station_range(network, stretch)?;
    CrossSection::at(network, stretch, if at_end == stretch.forward { last } else { first })
}

/// Distance of two points in space [m].
pub fn space_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2])
}
