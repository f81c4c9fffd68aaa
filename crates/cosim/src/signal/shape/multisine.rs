//! Adds up several frequencies, scaled to a peak.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::rules;
use crate::signal::window::SignalWindow;

/// The search for the peak of a multisine takes at most this many points.
const MOST_POINTS: f64 = 1e6;

/// Shape: several frequencies at once, `multisine = { peak = 0.05, frequencies = [0.2, 0.5, 1.1] }`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Multisine {
    /// Largest absolute value in the window, fades included.
    #[schemars(example = 0.05, extend("x-unit" = "of the table"))]
    pub peak: f64,
    /// Frequencies [Hz].
    #[schemars(example = [0.2, 0.5, 1.1])]
    pub frequencies: Vec<f64>,
    /// Relative amplitudes [1]; all equal without it.
    #[schemars(example = [1.0, 1.0, 0.5])]
    pub weights: Option<Vec<f64>>,
    /// Phases at the beginning of the window [rad]; random without it.
    #[schemars(example = [0.0, 1.5, 3.0])]
    pub phases: Option<Vec<f64>>,
    /// Seed of the random phases. Without it, they depend on the scenario's `seed` and the signal's name.
    #[schemars(example = 4)]
    pub seed: Option<u64>,
}

impl ShapeParameters for Multisine {
    fn build_shape(&self, window: &SignalWindow, seed: u64) -> Result<Arc<dyn SignalShape>, String> {
        let count = self.frequencies.len();
        if count == 0 {
            return Err("expected at least one of `frequencies`, found none".to_owned());
        }
        rules::check_finite(&[("peak", self.peak)])?;
        for frequency in &self.frequencies {
            rules::check_frequencies(&[("frequencies", *frequency)])?;
        }
        let weights = self.weights.clone().unwrap_or_else(|| vec![1.0; count]);
        let mut random = Pcg64::seed_from_u64(self.seed.unwrap_or(seed));
        let phases =
            self.phases.clone().unwrap_or_else(|| (0..count).map(|_| random.random_range(-PI..PI)).collect());
        rules::check_equal_lengths("weights", weights.len(), "frequencies", count)?;
        rules::check_equal_lengths("phases", phases.len(), "frequencies", count)?;
        rules::check_finite_list("weights", &weights)?;
        rules::check_finite_list("phases", &phases)?;
        let waves = self.frequencies.iter().zip(weights).zip(phases);
        let mut waves: Vec<[f64; 3]> =
            waves.map(|((frequency, weight), phase)| [weight, *frequency, phase]).collect();
        let peak = peak_amplitude(&waves, window);
        if peak < 1e-12 {
            return Err(
                "expected a sum that can be scaled to `peak`, found zero in the whole window".to_owned()
            );
        }
        for wave in &mut waves {
            wave[0] *= self.peak / peak;
        }
        Ok(Arc::new(SineComponents(waves)))
    }
}

/// Amplitude, frequency [Hz] and phase [rad] of each component.
#[derive(Debug)]
struct SineComponents(Vec<[f64; 3]>);

impl SignalShape for SineComponents {
    fn value_at(&self, time: f64) -> f64 {
        sum_of(&self.0, time)
    }
}

/// The waves at a time [s].
fn sum_of(waves: &[[f64; 3]], time: f64) -> f64 {
    let wave = |[amplitude, frequency, phase]: &[f64; 3]| amplitude * (TAU * frequency * time + phase).sin();
    waves.iter().map(wave).sum()
}

/// The largest absolute value in the window: the largest of 32 points per period of the fastest
/// wave, refined by the parabola through its neighbours.
fn peak_amplitude(waves: &[[f64; 3]], window: &SignalWindow) -> f64 {
    let length = (window.end - window.from).max(0.0);
    let fastest = waves.iter().map(|wave| wave[1]).fold(0.0, f64::max);
    let points = (length * fastest * 32.0).ceil().clamp(256.0, MOST_POINTS);
    let size = |index: f64| {
        let time = length * index / points;
        (window.fade_weight(window.from + time) * sum_of(waves, time)).abs()
    };
    let (mut before, mut here) = (size(0.0), size(1.0));
    let mut largest = before;
    for index in 2..=points as u32 {
        let after = size(f64::from(index));
        if here >= before && here >= after {
            let curvature = before - 2.0 * here + after;
            let slope = after - before;
            let is_bent = curvature < -1e-12 * here;
            let top = if is_bent { -slope * slope / (8.0 * curvature) } else { 0.0 };
            largest = largest.max(here + top);
        }
        (before, here) = (here, after);
    }
    largest.max(here)
}
