//! The bank of a road that is driven again and again: lateral gravity over the distance of a lap, learnt from earlier laps.

use super::filter::speed_of;
use super::fit::Fit;
use super::setup::Setup;
use super::signals::{CHANNELS, Channel, Signals};
use super::track::smoothed;

/// Lateral gravity over the distance of a lap, from where the signals begin that it was learnt from. Other signals must begin at the same place.
#[derive(Clone, Debug, PartialEq)]
pub struct BankMap {
    /// Length of a lap [m].
    pub lap: f64,
    /// Lateral gravity, upwards to the left as in ISO 8855 [m/s²], at places [`SPACING`] apart.
    values: Vec<f64>,
}

/// Distance between places [m].
const SPACING: f64 = 5.0;
/// Reach of what was seen at a place [m].
const REACH: f64 = 20.0;
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
        let places = (lap / SPACING).round().max(1.0) as usize;
        let spacing = lap / places as f64;
        let (mut sums, mut weights) = (vec![0.0; places], vec![0.0; places]);
        let reach = (4.0 * REACH / spacing).ceil() as isize;
        for (s, bank) in distance.iter().zip(&bank) {
            let place = (s / spacing).round() as isize;
            for k in place - reach..=place + reach {
                let away = (s - k as f64 * spacing) / REACH;
                let weight = (-0.5 * away * away).exp();
                let k = k.rem_euclid(places as isize) as usize;
                sums[k] += weight * bank;
                weights[k] += weight;
            }
        }
        let values =
            sums.iter().zip(&weights).map(|(sum, weight)| sum / weight.max(1e-9)).collect();
        Some(Self { lap, values })
    }

    /// Lateral gravity in every row of a drive [m/s²].
    pub(super) fn along(&self, signals: &Signals) -> Vec<f64> {
        let places = self.values.len();
        let at = |s: &f64| {
            let place = s.rem_euclid(self.lap) / self.lap * places as f64;
            let (below, share) = (place.floor() as usize % places, place.fract());
            self.values[below] * (1.0 - share) + self.values[(below + 1) % places] * share
        };
        distance(signals).iter().map(at).collect()
    }
}

/// The distance driven at each row [m]; a speed that is missing stays as it was.
fn distance(signals: &Signals) -> Vec<f64> {
    let (mut speed, mut sum) = (0.0, 0.0);
    let next = |row: &[f64; CHANNELS]| {
        speed = speed_of(row).unwrap_or(speed);
        sum += speed * signals.step;
        sum
    };
    signals.measured.iter().map(next).collect()
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
