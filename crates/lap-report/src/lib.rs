//! Writes a fastest lap as a page, a table and numbers: its time, a map, curves along the track, corners, and what parameters are worth.
#![forbid(unsafe_code)]

mod curves;
mod map;
mod numbers;
mod page;
mod phase;
mod table;
mod texts;

#[cfg(test)]
mod tests;

use lap::{
    Corner, DrivenLap, DrivenNode, LapOptimum, LapTimeInterval, ParameterRange, ParameterWorth, SetupOptimum,
};
use numerics::statistics::central_95_percent_interval;
use track::TrackLine;

pub use numbers::lap_numbers;
pub use page::lap_page;
pub use table::lap_table;
pub use texts::interval_text;

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
    /// The fastest set-up of the car.
    pub setup: Option<&'a FastestSetup>,
    /// A lap that was driven, beside the fastest one.
    pub driven: Option<&'a LoggedLap>,
    /// Notes and warnings about the car and its tires.
    pub messages: &'a [String],
}

/// The fastest set-up, beside that of the car.
pub struct FastestSetup {
    /// Ranges of its parameters.
    pub ranges: Vec<ParameterRange>,
    /// Their values in the car.
    pub before: Vec<f64>,
    /// The fastest set-up.
    pub setup: SetupOptimum,
    /// Lap times with it of the cars drawn from what is known of this one.
    pub interval: Option<LapTimeInterval>,
}

impl FastestSetup {
    /// How much faster the set-up is [s].
    pub fn seconds_faster(&self, optimum: &LapOptimum) -> f64 {
        optimum.lap_time - self.setup.lap.lap_time
    }

    /// The same in words, with the interval over the draws: `0.182 s faster [0.174, 0.190]`.
    pub fn gain_text(&self, page: &LapPage) -> String {
        let faster = self.seconds_faster(page.optimum);
        let size = format!("{:.3}", faster.abs());
        let words = match size.as_str() {
            "0.000" => "as fast as the car's own".to_owned(),
            _ if faster > 0.0 => format!("{size} s faster"),
            _ => format!("{size} s slower, as the car's own is out of the ranges"),
        };
        let interval = self.gain_interval(page.interval);
        words + &interval.map_or_else(String::new, |[low, high]| format!(" [{low:.3}, {high:.3}]"))
    }

    /// The 95 % interval of how much faster it is [s], over the draws that were solved with both set-ups.
    pub fn gain_interval(&self, before: Option<&LapTimeInterval>) -> Option<[f64; 2]> {
        let draws = before?.by_draw.iter().zip(&self.interval.as_ref()?.by_draw);
        let gains: Vec<f64> = draws.filter_map(|(before, now)| Some((*before)? - (*now)?)).collect();
        (!gains.is_empty()).then(|| central_95_percent_interval(gains))
    }
}

/// The fastest lap of a log.
pub struct LoggedLap {
    /// Name of the log's file.
    pub log: String,
    /// The lap.
    pub lap: DrivenLap,
}

impl LapPage<'_> {
    /// Values of the nodes of the driven lap, each with the time of the fastest lap there [s], over their stations [m], up to its end.
    fn driven_values_over_station(&self, value: impl Fn(&DrivenNode, f64) -> f64) -> Vec<(f64, f64)> {
        let Some(LoggedLap { lap, .. }) = self.driven else { return Vec::new() };
        let nodes = self.optimum.nodes.iter().zip(&lap.nodes);
        let mut points: Vec<_> = nodes.map(|(best, driven)| (best.s, value(driven, best.t))).collect();
        if self.line.is_closed() {
            points.push((self.line.length(), value(&lap.end, self.optimum.lap_time)));
        }
        points
    }

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
