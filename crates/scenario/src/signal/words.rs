//! Holds the description of a signal as a scenario writes it.

use recording::table::Interpolation;
use serde::Deserialize;
use toml::Spanned;

/// A signal of the scenario, or one of the parts that add up to it: one shape in a window of time.
/// Outside `[from, until)` it is 0; inside, its time is counted from `from`.
///
/// ```toml
/// [[signal]]
/// name = "driver.steer"
/// unit = "rad"
/// from = 1.0        # [s], 0 when absent
/// until = 9.0       # [s], never when absent
/// fade_in = 0.5     # [s], linear from zero at `from`
/// fade_out = 0.5    # [s], linear to zero at `until`, or at the end of the run
/// sine = { amplitude = 0.05, frequency = 0.5 }
///
/// [[signal]]
/// name = "driver.torque"
/// part = [
///     { constant = 20.0 },
///     { from = 3.0, step = { at = 0.5, after = 100.0 } },
/// ]
/// ```
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// The signal's name; a part of a signal has none.
    pub name: Option<Spanned<String>>,
    /// The signal's unit; a part of a signal has none.
    pub unit: Option<Spanned<String>>,
    /// Beginning of the window [s].
    pub from: Option<Spanned<f64>>,
    /// End of the window [s].
    pub until: Option<Spanned<f64>>,
    /// How long it rises linearly from zero [s].
    pub fade_in: Option<Spanned<f64>>,
    /// How long it falls linearly to zero [s].
    pub fade_out: Option<Spanned<f64>>,
    /// The same value throughout: `constant = 2.5`.
    pub constant: Option<Spanned<f64>>,
    /// A jump.
    pub step: Option<Spanned<Step>>,
    /// A straight line between two levels.
    pub ramp: Option<Spanned<Ramp>>,
    /// One frequency.
    pub sine: Option<Spanned<Sine>>,
    /// Several frequencies at once.
    pub multisine: Option<Spanned<Multisine>>,
    /// A frequency that rises or falls.
    pub chirp: Option<Spanned<Chirp>>,
    /// Two levels in turn.
    pub square: Option<Spanned<Square>>,
    /// Values at given times.
    pub table: Option<Spanned<Samples>>,
    /// The parts that add up to the signal, instead of a shape.
    #[serde(default)]
    pub part: Vec<Spanned<Part>>,
}

/// `step = { at = 0.5, before = 0.0, after = 100.0 }`
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// When it jumps [s].
    pub at: f64,
    /// Value before.
    #[serde(default)]
    pub before: f64,
    /// Value from then on.
    pub after: f64,
}

/// `ramp = { start = 1.0, end = 3.0, before = 0.0, after = 0.1 }`
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ramp {
    /// When it leaves `before` [s].
    pub start: f64,
    /// When it reaches `after` [s].
    pub end: f64,
    /// Value until `start`.
    #[serde(default)]
    pub before: f64,
    /// Value from `end` on.
    pub after: f64,
}

/// `sine = { amplitude = 0.05, frequency = 0.5, phase = 0.0, offset = 0.0 }`
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sine {
    /// Largest distance to `offset`.
    pub amplitude: f64,
    /// Frequency [Hz].
    pub frequency: f64,
    /// Phase at its beginning [rad].
    #[serde(default)]
    pub phase: f64,
    /// Mean value.
    #[serde(default)]
    pub offset: f64,
}

/// `multisine = { peak = 0.05, frequencies = [0.2, 0.5, 1.1], weights = [1.0, 1.0, 0.5] }`
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Multisine {
    /// Largest absolute value in the window, fades included.
    pub peak: f64,
    /// Frequencies [Hz].
    pub frequencies: Vec<f64>,
    /// Relative amplitudes, 1 when absent.
    pub weights: Option<Vec<f64>>,
    /// Phases at the beginning [rad], random when absent.
    pub phases: Option<Vec<f64>>,
    /// Fixes the random phases independently of the scenario's seed.
    pub seed: Option<u64>,
}

/// `chirp = { amplitude = 0.05, f_start = 0.2, f_end = 4.0, duration = 20.0, phase = 0.0 }`;
/// the frequency changes linearly and stays at `f_end` afterwards.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chirp {
    /// Largest absolute value.
    pub amplitude: f64,
    /// Frequency at its beginning [Hz].
    pub f_start: f64,
    /// Frequency after `duration` [Hz].
    pub f_end: f64,
    /// How long the frequency changes [s].
    pub duration: f64,
    /// Phase at its beginning [rad].
    #[serde(default)]
    pub phase: f64,
}

/// `square = { amplitude = 100.0, period = 4.0, phase = 0.0, sharpness = 20.0, offset = 0.0 }`
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Square {
    /// Distance of both levels to `offset`.
    pub amplitude: f64,
    /// Period [s]; the first half is the upper level.
    pub period: f64,
    /// Phase at its beginning [rad].
    #[serde(default)]
    pub phase: f64,
    /// Rounds the edges: `amplitude * tanh(sharpness * sin(...))`.
    pub sharpness: Option<f64>,
    /// Mean value.
    #[serde(default)]
    pub offset: f64,
}

/// `table = { time = [0.0, 1.0, 4.0], value = [0.0, 2.0, 0.0], interpolation = "linear" }`;
/// before the first and after the last time it has their values.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Samples {
    /// Times [s], increasing.
    pub time: Vec<f64>,
    /// One value per time.
    pub value: Vec<f64>,
    /// What is between the times.
    #[serde(default)]
    pub interpolation: Interpolation,
}
