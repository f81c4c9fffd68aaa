//! Smooths the signals stretch by stretch and brings them to common instants.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vehicle::G;

use crate::drive_log::Signal;
use crate::filter::ZeroPhaseFilter;
use crate::resample::Interpolation;
use crate::span::TimeInterval;

/// The car's motion at one instant. ISO 8855 axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionSample {
    /// Time [s].
    pub time: f64,
    /// Number of the stretch that it is in.
    pub stretch: usize,
    /// Forward velocity of the centre of gravity [m/s].
    pub v_x: f64,
    /// Velocity of the centre of gravity to the left [m/s].
    pub v_y: f64,
    /// Time derivative of `v_x` [m/s²].
    pub v_x_dot: f64,
    /// Time derivative of `v_y` [m/s²].
    pub v_y_dot: f64,
    /// Longitudinal acceleration [m/s²].
    pub a_x: f64,
    /// Lateral acceleration [m/s²].
    pub a_y: f64,
    /// Vertical specific force [m/s²]; standard gravity unless measured.
    pub a_z: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
    /// Yaw acceleration [rad/s²].
    pub r_dot: f64,
    /// Steering angle of the front wheels [rad].
    pub delta: f64,
    /// Speeds of the left and the right wheel [rad/s], of the front and the rear axle.
    pub omega: [Option<[f64; 2]>; 2],
}

/// Filters of the signals, by sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SignalFilters {
    /// Filter of the velocities.
    pub velocity: ZeroPhaseFilter,
    /// Filter of the accelerations.
    pub acceleration: ZeroPhaseFilter,
    /// Filter of the yaw rate; the yaw acceleration is the slope of the same polynomials.
    pub yaw_rate: ZeroPhaseFilter,
    /// Filter of the steering angle.
    pub steering: ZeroPhaseFilter,
    /// Filter of the wheel speeds.
    pub wheels: ZeroPhaseFilter,
}

impl SignalFilters {
    /// All of them, by their names in the configuration.
    pub fn named_filters(&self) -> [(&'static str, ZeroPhaseFilter); 5] {
        [
            ("smooth.velocity", self.velocity),
            ("smooth.acceleration", self.acceleration),
            ("smooth.yaw_rate", self.yaw_rate),
            ("smooth.steering", self.steering),
            ("smooth.wheels", self.wheels),
        ]
    }

    fn filter_for_signal(&self, name: &str) -> ZeroPhaseFilter {
        match name {
            "v_x" | "v_y" => self.velocity,
            "a_x" | "a_y" | "a_z" => self.acceleration,
            "r" => self.yaw_rate,
            "delta" => self.steering,
            _ => self.wheels,
        }
    }
}

/// Signals of which the time derivative is needed, and what it is called.
const DERIVATIVES: [(&str, &str); 3] = [("v_x", "v_x_dot"), ("v_y", "v_y_dot"), ("r", "r_dot")];

/// Signals, with what is computed from them, by name.
pub type SignalMap<'a> = BTreeMap<&'static str, Signal<'a>>;

/// The part of each signal that is in a stretch, but for the gear.
pub fn cut_to_stretch<'a>(signals: &'a SignalMap, stretch: &TimeInterval) -> SignalMap<'a> {
    let part = |s: &'a Signal| {
        let rows = stretch.row_range(&s.time);
        Signal::new(&s.time[rows.clone()], &s.value[rows])
    };
    signals.iter().filter(|(n, _)| **n != "gear").map(|(n, s)| (*n, part(s))).collect()
}

/// Smoothed signals of one stretch and their derivatives, at the signals' own time stamps.
pub fn smooth_signals<'a>(signals: &SignalMap<'a>, smoothing: &SignalFilters) -> SignalMap<'a> {
    let mut smoothed = SignalMap::new();
    for (&name, Signal { time, value }) in signals {
        let filter = smoothing.filter_for_signal(name);
        smoothed.insert(name, Signal::new(time.clone(), filter.smooth(time, value)));
        if let Some((_, rate)) = DERIVATIVES.iter().find(|d| d.0 == name) {
            smoothed.insert(rate, Signal::new(time.clone(), filter.derivative(time, value)));
        }
    }
    smoothed
}

/// The instants `origin` + k / `rate` that all signals of a stretch reach [s].
pub fn common_instants(signals: &SignalMap, origin: f64, rate: f64) -> Vec<f64> {
    let ends = signals.values().filter_map(|s| Some((*s.time.first()?, *s.time.last()?)));
    let Some((start, end)) = ends.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1))) else {
        return vec![];
    };
    // Stamps that are instants but for rounding count as such.
    let slack = 1e-6;
    let first = ((start - origin) * rate - slack).ceil() as i64;
    let last = ((end - origin) * rate + slack).floor() as i64;
    (first..=last).map(|k| (origin + k as f64 / rate).clamp(start, end)).collect()
}

/// The signals of one stretch at common instants.
pub fn resample_signals<'a>(
    signals: &SignalMap,
    at: &'a [f64],
    interpolation: Interpolation,
) -> SignalMap<'a> {
    let bring = |s: &Signal| Signal::new(at, interpolation.resample(&s.time, &s.value, at));
    signals.iter().map(|(name, s)| (*name, bring(s))).collect()
}

/// Rows of one stretch from signals at the common instants `at`.
pub fn motion_samples(signals: &SignalMap, at: &[f64], stretch: usize) -> Vec<MotionSample> {
    let value = |name: &str, i: usize| signals.get(name).map(|s| s.value[i]);
    let row = |(i, &time): (usize, &f64)| {
        let of = |name| value(name, i).unwrap_or(0.0);
        let pair = |left, right| Some([value(left, i)?, value(right, i)?]);
        MotionSample {
            time,
            stretch,
            v_x: of("v_x"),
            v_y: of("v_y"),
            v_x_dot: of("v_x_dot"),
            v_y_dot: of("v_y_dot"),
            a_x: of("a_x"),
            a_y: of("a_y"),
            a_z: value("a_z", i).unwrap_or(G),
            r: of("r"),
            r_dot: of("r_dot"),
            delta: of("delta"),
            omega: [pair("omega_fl", "omega_fr"), pair("omega_rl", "omega_rr")],
        }
    };
    at.iter().enumerate().map(row).collect()
}
