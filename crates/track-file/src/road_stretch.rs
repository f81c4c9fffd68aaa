//! Describes a part of a road as it is driven.

use xodr::{LaneId, RoadId};

/// A lane section of a road, driven in one direction, with the lanes beside one another on which a car can drive.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadStretch {
    /// The road.
    pub road: RoadId,
    /// Number of the lane section.
    pub section: usize,
    /// Whether the drive goes along the road's reference line, or against it.
    pub forward: bool,
    /// The lane on the left of the reference line that is farthest out, or the one nearest to it on the right.
    pub leftmost: LaneId,
    /// The lane on its right.
    pub rightmost: LaneId,
    /// Those that are driven in this direction.
    pub driven: Vec<LaneId>,
}

impl RoadStretch {
    /// Whether both are of one section.
    pub fn is_same_section(&self, other: &RoadStretch) -> bool {
        (self.road, self.section) == (other.road, other.section)
    }
}
