//! The smoothed signals of a log that the relations of its motion are made of.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use preparation::difference_noise;

use crate::motion::ResampledChannels;

/// Narrowest filter [s].
const FILTER: f64 = 0.06;

/// Smoothed signals: the number is the order of the derivative.
pub(super) struct SmoothedSignals {
    pub v_x: [Vec<f64>; 2],
    /// v_y' and v_y''.
    pub v_y: [Vec<f64>; 2],
    /// v_x r and its derivative.
    pub turn: [Vec<f64>; 2],
    /// r, r' and r''.
    pub r: [Vec<f64>; 3],
    pub a_y: [Vec<f64>; 2],
    /// v_y/v_x and its derivative.
    pub sideslip: [Vec<f64>; 2],
    /// r/v_x and its derivative.
    pub curvature: [Vec<f64>; 2],
    pub delta: [Vec<f64>; 2],
    /// Standard deviation of a_y within the filter, beyond the noise of its sensor [m/s²].
    pub quick: Vec<f64>,
}

/// The relations, each of which is 0 for true signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionRelation {
    /// a_y − v_x r − v_y'.
    RigidBody,
    /// (v_y − l_r r)/v_x less what the rear slip is by its force.
    Rear,
    /// delta − (v_y + l_f r)/v_x less what the front slip is by its force.
    Front,
}

impl MotionRelation {
    /// Whether slip goes with force as that of a tire does, by the t-value of its coefficient.
    pub fn is_tire_like(self, t: f64) -> bool {
        match self {
            MotionRelation::RigidBody => true,
            MotionRelation::Rear => t < -4.0,
            MotionRelation::Front => t > 4.0,
        }
    }
}

impl SmoothedSignals {
    /// Signals under a filter that is `times` wider than needed; the name of a channel that is mostly noise, if there is one.
    pub fn new(motion: &ResampledChannels, times: f64) -> Result<Self, &'static str> {
        let filter = |name| motion.narrowest_filter_width(name, FILTER).ok_or(name);
        let filter = times * filter("r")?.max(filter("v_y")?);
        let both = |column: &[f64]| [0, 1].map(|order| motion.gaussian_filter(column, filter, order));
        let [v_y, r] = ["v_y", "r"].map(|name| motion.channel_values(name));
        let ratio = |name| motion.combine_channels(name, "v_x", |a, v_x| a / v_x);
        let lateral = motion.channel_values("a_y");
        let a_y = both(&lateral);
        Ok(Self {
            quick: quick_motion(motion, &lateral, &a_y[0], filter),
            a_y,
            v_x: both(&motion.channel_values("v_x")),
            v_y: [1, 2].map(|order| motion.gaussian_filter(&v_y, filter, order)),
            turn: both(&motion.combine_channels("v_x", "r", |v_x, r| v_x * r)),
            r: [0, 1, 2].map(|order| motion.gaussian_filter(&r, filter, order)),
            sideslip: both(&ratio("v_y")),
            curvature: both(&ratio("r")),
            delta: both(&motion.channel_values("delta")),
        })
    }
}

/// What moves so quickly that a filter leaves it out: its standard deviation within the filter, beyond noise.
fn quick_motion(motion: &ResampledChannels, column: &[f64], smooth: &[f64], filter: f64) -> Vec<f64> {
    let squares: Vec<f64> = column.iter().zip(smooth).map(|(x, mean)| (x - mean).powi(2)).collect();
    let noise = difference_noise(column).powi(2);
    let spread = motion.gaussian_filter(&squares, filter, 0);
    spread.into_iter().map(|square| (square - noise).max(0.0).sqrt()).collect()
}
