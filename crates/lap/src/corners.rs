//! Divides a lap into its corners: each from a fastest point to the next, around a slowest one.

use crate::optimum::{LapNode, LapOptimum};

/// Least difference of speed between a corner and its ends [m/s].
const PROMINENCE: f64 = 1.5;

/// A corner with the straights on both of its sides, up to where the car is fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Node where it begins.
    pub first: usize,
    /// Node where the car is slowest.
    pub apex: usize,
    /// Node behind its last one; on a closed track it may be before the first.
    pub end: usize,
}

impl Corner {
    /// Its nodes.
    pub fn nodes(&self, count: usize) -> impl Iterator<Item = usize> {
        let length = (self.end + count - self.first - 1) % count + 1;
        let first = self.first;
        (0..length).map(move |i| (first + i) % count)
    }

    /// The time in it [s], of the time at each of so many nodes, from 0 on, to the time of the lap. It may go on behind the end of a closed
    /// line.
    pub fn duration(&self, count: usize, time_at: impl Fn(usize) -> f64, lap_time: f64) -> f64 {
        let begin = time_at(self.first);
        let end = if self.end < count { time_at(self.end) } else { lap_time };
        if self.end > self.first { end - begin } else { lap_time - begin + end }
    }
}

impl LapOptimum {
    /// The corners of a lap, in the order of their apexes; none where the speed hardly changes.
    pub fn corners(&self, is_closed: bool) -> Vec<Corner> {
        let speeds: Vec<f64> = self.nodes.iter().map(|node: &LapNode| node.variables.v_x).collect();
        let count = speeds.len();
        let fastest = (0..count).max_by(|a, b| speeds[*a].total_cmp(&speeds[*b])).unwrap_or(0);
        let begin = if is_closed { fastest } else { 0 };
        let at = |i: usize| (begin + i) % count;
        let last = if is_closed { count } else { count - 1 };
        // Alternates between looking for a low and for a high, each told from noise by its prominence.
        let mut corners = Vec::new();
        let (mut first, mut low, mut high) = (0, 0, 0);
        let mut is_falling = true;
        for i in 1..=last {
            let speed = speeds[at(i)];
            if is_falling {
                if speed < speeds[at(low)] {
                    low = i;
                }
                if speed > speeds[at(high)] && low == first {
                    (first, low, high) = (i, i, i);
                } else if speed > speeds[at(low)] + PROMINENCE
                    && speeds[at(first)] > speeds[at(low)] + PROMINENCE
                {
                    (is_falling, high) = (false, i);
                }
            } else {
                if speed > speeds[at(high)] {
                    high = i;
                }
                if speed < speeds[at(high)] - PROMINENCE {
                    corners.push(Corner { first: at(first), apex: at(low), end: at(high) });
                    (is_falling, first, low) = (true, high, i);
                }
            }
        }
        if !is_falling {
            let end = if is_closed { at(0) } else { count };
            corners.push(Corner { first: at(first), apex: at(low), end });
        }
        corners.sort_by_key(|corner| corner.apex);
        corners
    }
}
