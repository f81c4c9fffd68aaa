//! Learns the bank of a closed road from a drive of several laps.

use super::bank::{BankMap, distance};
use super::filter::speed_of;
use super::fit::Fit;
use super::setup::Setup;
use super::signals::{Channel, Signals};
use super::track::smoothed;

/// Shortest lap [m], and the correlation of curvature a lap apart that makes it one.
const SHORTEST: usize = 300;
const ALIKE: f64 = 0.9;

impl BankMap {
    /// The map of signals of a closed road, with a fit of them; none where no lap repeats.
    #[must_use]
    pub fn learn(setup: &Setup, fit: &Fit, signals: &Signals) -> Option<Self> {
        let signals = signals.thinned();
        let distance = distance(&signals);
        let lap = lap(&signals, &distance)? as f64;
        let bank = smoothed(setup, fit, &signals, None).bank;
        Some(Self::mean(lap, &distance, &bank))
    }
}

/// The length of a lap [m]: the distance after which curvature repeats best.
fn lap(signals: &Signals, distance: &[f64]) -> Option<usize> {
    let (mut curvature, mut last) = (Vec::new(), 0.0);
    for (row, s) in signals.measured.iter().zip(distance) {
        let ratio = row[Channel::YawRate as usize] / speed_of(row).unwrap_or(f64::NAN);
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
