//! Learns the bank of a closed road from a drive of several laps.

use super::bank::{BankMap, driven_distance};
use super::filter::measured_speed;
use super::fit::SideslipFit;
use super::setup::EstimatorSetup;
use super::signals::{SensorChannel, SensorSignals};
use super::track::smooth_sideslip;

/// Shortest lap [m], and the correlation of curvature a lap apart that makes it one.
const SHORTEST: usize = 300;
const ALIKE: f64 = 0.9;

impl BankMap {
    /// The map of signals of a closed road, with a fit of them; none where no lap repeats.
    #[must_use]
    pub fn learn(setup: &EstimatorSetup, fit: &SideslipFit, signals: &SensorSignals) -> Option<Self> {
        let signals = signals.averaged_over_blocks();
        let distance = driven_distance(&signals);
        let lap = lap_length(&signals, &distance)? as f64;
        let bank = smooth_sideslip(setup, fit, &signals, None).bank;
        Some(Self::mean_over_laps(lap, &distance, &bank))
    }
}

/// The length of a lap [m]: the distance after which curvature repeats best.
fn lap_length(signals: &SensorSignals, distance: &[f64]) -> Option<usize> {
    let (mut curvature, mut last) = (Vec::new(), 0.0);
    for (row, s) in signals.measured.iter().zip(distance) {
        let ratio = row[SensorChannel::YawRate as usize] / measured_speed(row).unwrap_or(f64::NAN);
        if ratio.is_finite() {
            last = ratio;
        }
        // One value for each metre.
        while curvature.len() as f64 <= *s {
            curvature.push(last);
        }
    }
    let longest = (2 * curvature.len()) / 3;
    let mut best = (ALIKE, None);
    for lag in (SHORTEST..longest).step_by(2) {
        let found = correlation(&curvature[lag..], &curvature);
        if found > best.0 {
            best = (found, Some(lag));
        }
    }
    best.1
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len()) as f64;
    let mut sums = [0.0; 5];
    for (a, b) in a.iter().zip(b) {
        for (sum, it) in sums.iter_mut().zip([*a, *b, a * a, b * b, a * b]) {
            *sum += it;
        }
    }
    let [a, b, aa, bb, ab] = sums;
    (ab - a * b / n) / ((aa - a * a / n) * (bb - b * b / n)).sqrt()
}
