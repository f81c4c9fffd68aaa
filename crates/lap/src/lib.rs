//! Finds the fastest lap of a car on a track: line, speed and controls together, by collocation and an interior-point method.
//!
//! Everything is in SI units and radians, in the axes of ISO 8855. A car is a body on four tires with combined slip; a track is a line with
//! widths, bank and grade.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod aero;
mod car;
mod corners;
mod draws;
mod driven_lap;
mod interior_point;
mod interval;
mod ldlt;
mod line_smoother;
mod logged_track;
mod newton_system;
mod node;
mod optimum;
mod parameters;
mod problem;
mod setup;
mod spline;
mod stages;
mod tires;
mod worth;

pub use aero::{AeroPlatform, LapAero};
pub use car::{ActuatorLimits, BrakeBalance, EnginePower, LapCar, LapDifferential};
pub use corners::Corner;
pub use draws::{ParameterDraw, check_draws_change_car, draw_from_ranges, parameter_draws};
pub use driven_lap::{DrivenLap, DrivenNode, PositionSample};
pub use interior_point::InteriorPointStatus;
pub use interval::LapTimeInterval;
pub use logged_track::{LoggedLapLine, LoggedTrack, LoggedTrackOptions};
pub use node::{BodyMotion, NodeVariables};
pub use optimum::{LapNode, LapOptimum};
pub use parameters::{CarParameters, PARAMETER_KEYS, ParameterKey, ParameterRange, TEXT_KEYS};
pub use setup::SetupOptimum;
pub use spline::BSplineCurve;
pub use tires::{LapTire, SlipDual, TireModel, TirePeaks};
pub use worth::ParameterWorth;

/// What can be chosen of a lap.
#[derive(Clone, Debug, PartialEq)]
pub struct LapOptions {
    /// Number of nodes; without it one every 4 m, 200 at least and 2000 at most.
    pub nodes: Option<usize>,
    /// Least way from the centre of gravity to an edge of the road [m].
    pub margin: f64,
    /// Way from the line to both edges [m] of a track without widths.
    pub half_width: Option<f64>,
    /// Whether the car keeps to the line, and its speed alone is free.
    pub keeps_line: bool,
    /// Highest speed at the beginning of an open line [m/s].
    pub start_speed: Option<f64>,
}

impl LapOptions {
    /// The margin of a car with these track widths [m], 0 where they are not known: half of the wider one and 0.15 m for the tires.
    pub fn usual_margin(track_widths: [f64; 2]) -> f64 {
        let wider = track_widths[0].max(track_widths[1]);
        if wider > 0.0 { 0.5 * wider + 0.15 } else { LapOptions::default().margin }
    }
}

impl Default for LapOptions {
    fn default() -> Self {
        LapOptions { nodes: None, margin: 0.9, half_width: None, keeps_line: false, start_speed: None }
    }
}

/// Why there is no lap.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The line or the car's limits on it.
    #[error(transparent)]
    Track(#[from] track::Error),
    /// The track has no widths.
    #[error("expected the ways from the line to its edges, found none")]
    NoWidths,
    /// The track is narrower than the car.
    #[error("at s = {s:.0} m the road is {width:.2} m wide, and the car keeps {margin:.2} m from both edges")]
    Narrow {
        /// Station [m].
        s: f64,
        /// Width of the road [m].
        width: f64,
        /// Least way to an edge [m].
        margin: f64,
    },
    /// The line bends within the width of the road.
    #[error("at s = {s:.0} m the line has a radius of {radius:.2} m, which lies within the road")]
    Tight {
        /// Station [m].
        s: f64,
        /// Radius [m].
        radius: f64,
    },
    /// An option.
    #[error("{0}")]
    Options(String),
    /// A log that does not fit the track.
    #[error("{0}")]
    Log(String),
}

#[cfg(test)]
mod tests;
