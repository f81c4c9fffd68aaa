//! Holds the log under examination, as the checks so far correct it, with what they found.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::collections::BTreeMap;

use preparation::{DriveLog, Signal};

use crate::finding::{Examination, Finding, NotTold};

/// Channels that are looked at, with their units. ISO 8855 axes: x forward, y left, z up; left turns are positive.
pub const CHANNELS: [(&str, &str); 11] = [
    ("v_x", "m/s"),
    ("v_y", "m/s"),
    ("r", "rad/s"),
    ("a_x", "m/s2"),
    ("a_y", "m/s2"),
    ("delta", "rad"),
    ("F_x", "N"),
    ("omega_fl", "rad/s"),
    ("omega_fr", "rad/s"),
    ("omega_rl", "rad/s"),
    ("omega_rr", "rad/s"),
];

/// The unit of a channel.
pub(crate) fn unit(name: &str) -> &'static str {
    CHANNELS.iter().find(|(of, _)| *of == name).map_or("1", |(_, unit)| unit)
}

/// What is known of the car; each of it makes more checks possible.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownCar {
    /// Distance between the axles [m].
    pub wheelbase: Option<f64>,
    /// Distances of the centre of gravity to the front and the rear axle [m].
    pub axles: Option<[f64; 2]>,
    /// Mass [kg].
    pub m: Option<f64>,
}

impl KnownCar {
    /// Distance between the axles [m].
    pub fn wheelbase(&self) -> Option<f64> {
        self.wheelbase.or(self.axles.map(|[l_f, l_r]| l_f + l_r))
    }
}

/// A log under examination.
#[derive(Debug)]
pub(crate) struct Case {
    pub signals: BTreeMap<&'static str, Signal>,
    pub car: KnownCar,
    pub found: Examination,
    /// Whether the car turns to one side only, or not at all.
    pub is_one_sided: bool,
    /// Sensors whose end cuts the motion off.
    pub cut_off: Vec<&'static str>,
    /// Whether the steering ratio was found, and so is known roughly only.
    pub is_ratio_rough: bool,
}

impl Case {
    pub fn new(log: &DriveLog, car: KnownCar) -> Self {
        let names = CHANNELS.into_iter().map(|(name, _)| name);
        let signals = names.filter_map(|name| Some((name, log.get(name)?.clone()))).collect();
        Self {
            signals,
            car,
            found: Examination::default(),
            is_one_sided: false,
            cut_off: Vec::new(),
            is_ratio_rough: false,
        }
    }

    pub fn has(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.signals.contains_key(name))
    }

    pub fn report(&mut self, finding: Finding) {
        self.found.findings.push(finding);
    }

    pub fn cannot_tell(&mut self, check: &'static str, reason: String, advice: &'static str) {
        self.found.not_told.push(NotTold { check, reason, advice });
    }

    /// Divides a channel by a factor and brings it `delay` [s] forward, for the checks that follow.
    pub fn correct(&mut self, name: &str, factor: f64, delay: f64) {
        if let Some(signal) = self.signals.get_mut(name) {
            signal.value.iter_mut().for_each(|value| *value /= factor);
            signal.time.iter_mut().for_each(|time| *time -= delay);
        }
    }

    pub fn close(mut self) -> Examination {
        self.found.sort();
        self.found
    }
}
