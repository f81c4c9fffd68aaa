//! The bank of a road that is driven again and again: lateral gravity over the distance of a lap, learnt from earlier laps.

use super::filter::measured_speed;
use super::signals::{CHANNELS, SensorSignals};

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

impl BankMap {
    /// The mean over all laps of what was seen at each distance driven [m].
    pub(super) fn mean_over_laps(lap: f64, distance: &[f64], bank: &[f64]) -> Self {
        let places = (lap / SPACING).round().max(1.0) as usize;
        let spacing = lap / places as f64;
        let (mut sums, mut weights) = (vec![0.0; places], vec![0.0; places]);
        let reach = (4.0 * REACH / spacing).ceil() as isize;
        for (s, bank) in distance.iter().zip(bank) {
            let place = (s / spacing).round() as isize;
            for k in place - reach..=place + reach {
                let away = (s - k as f64 * spacing) / REACH;
                let weight = (-0.5 * away * away).exp();
                let k = k.rem_euclid(places as isize) as usize;
                sums[k] += weight * bank;
                weights[k] += weight;
            }
        }
        let values = sums.iter().zip(&weights).map(|(sum, weight)| sum / weight.max(1e-9)).collect();
        Self { lap, values }
    }

    /// Lateral gravity in every row of a drive [m/s²].
    pub(super) fn bank_along_drive(&self, signals: &SensorSignals) -> Vec<f64> {
        let places = self.values.len();
        let at = |s: &f64| {
            let place = s.rem_euclid(self.lap) / self.lap * places as f64;
            let (below, share) = (place.floor() as usize % places, place.fract());
            self.values[below] * (1.0 - share) + self.values[(below + 1) % places] * share
        };
        driven_distance(signals).iter().map(at).collect()
    }
}

/// The distance driven at each row [m]; a speed that is missing stays as it was.
pub(super) fn driven_distance(signals: &SensorSignals) -> Vec<f64> {
    let (mut speed, mut sum) = (0.0, 0.0);
    let next = |row: &[f64; CHANNELS]| {
        speed = measured_speed(row).unwrap_or(speed);
        sum += speed * signals.step;
        sum
    };
    signals.measured.iter().map(next).collect()
}
