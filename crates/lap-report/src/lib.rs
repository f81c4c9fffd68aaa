//! Writes the page of a fastest lap: its time, a map, curves along the track, corners, and what parameters are worth.
#![forbid(unsafe_code)]

mod curves;
mod map;
mod page;
mod phase;
mod texts;

#[cfg(test)]
mod tests;

use lap::{Corner, LapOptimum, LapTimeInterval, ParameterWorth};
use track::TrackLine;

pub use page::lap_page;

/// What the page of a lap shows.
#[derive(Clone, Copy)]
pub struct LapPage<'a> {
    /// Name of the car's file.
    pub car: &'a str,
    /// Name of the track's file.
    pub track: &'a str,
    /// The line that stations and deviations are counted from.
    pub line: &'a TrackLine,
    /// The lap.
    pub optimum: &'a LapOptimum,
    /// Its corners, numbered from 1 on.
    pub corners: &'a [Corner],
    /// What the parameters of the car are worth, those that matter most first.
    pub worth: &'a [ParameterWorth],
    /// Lap times of cars drawn from what is known of this one.
    pub interval: Option<&'a LapTimeInterval>,
    /// Notes and warnings about the car and its tires.
    pub messages: &'a [String],
}

impl LapPage<'_> {
    /// The draws, if one of them was solved.
    fn solved_interval(&self) -> Option<&LapTimeInterval> {
        self.interval.filter(|interval| !interval.lap_times.is_empty())
    }

    /// Values of the nodes over their stations [m]; on a closed line up to where it begins again.
    fn values_over_station<T: Copy>(&self, value: impl Fn(usize) -> T) -> Vec<(f64, T)> {
        let nodes = &self.optimum.nodes;
        let mut points: Vec<_> = nodes.iter().enumerate().map(|(k, node)| (node.s, value(k))).collect();
        if let Some(first) = points.first().filter(|_| self.line.is_closed()) {
            points.push((self.line.length(), first.1));
        }
        points
    }
}
