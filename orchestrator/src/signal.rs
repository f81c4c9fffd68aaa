//! Generates input signals from the shapes that a scenario describes.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Deserialize;
use toml::Spanned;

use crate::effects::stream_seed;
use crate::table::Interpolation;

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

/// What is wrong with the description of a signal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SignalError {
    /// What was expected, what was found and what to do.
    pub message: String,
    /// The bytes of the scenario that it is about, when a key that is there is.
    pub span: Option<Range<usize>>,
}

/// A signal that can be asked for its value at any time.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    parts: Vec<(Window, Shape)>,
}

#[derive(Debug, Clone, PartialEq)]
struct Window {
    from: f64,
    until: f64,
    fade_in: f64,
    fade_out: f64,
    /// Where the fade-out ends [s]: `until`, or the end of the run.
    end: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Constant(f64),
    Step(Step),
    Ramp(Ramp),
    Sine(Sine),
    /// Amplitude, frequency [Hz] and phase [rad] of each component.
    Multisine(Vec<[f64; 3]>),
    Chirp(Chirp),
    Square(Square),
    Table(Samples),
}

/// Communication points are multiples of a decimal step, which rounding puts just before an edge
/// that they should meet [s].
const EDGE: f64 = 1e-9;

/// Points at which the peak of a multisine is searched for at most.
const MOST_POINTS: f64 = 1e6;

type Checked<T> = Result<T, SignalError>;

fn error<T>(span: Option<Range<usize>>, message: impl Into<String>) -> Checked<T> {
    let message = message.into();
    Err(SignalError { message, span })
}

/// A rule for the numbers of one shape; the error says which one breaks it.
struct Rules<'a> {
    shape: &'a str,
    span: &'a Range<usize>,
}

impl Rules<'_> {
    fn finite(&self, numbers: &[(&str, f64)]) -> Checked<()> {
        self.all(numbers, "a finite number", |_| true)
    }

    fn positive(&self, key: &str, number: f64) -> Checked<()> {
        self.all(&[(key, number)], "a number above 0", |x| x > 0.0)
    }

    fn frequencies(&self, numbers: &[(&str, f64)]) -> Checked<()> {
        self.all(numbers, "a frequency [Hz] of at least 0", |x| x >= 0.0)
    }

    fn all(&self, numbers: &[(&str, f64)], what: &str, rule: fn(f64) -> bool) -> Checked<()> {
        match numbers.iter().find(|(_, x)| !(x.is_finite() && rule(*x))) {
            Some((key, x)) => self.broken(format!("expected {what} for `{key}`, found {x}")),
            None => Ok(()),
        }
    }

    fn list(&self, key: &str, numbers: &[f64]) -> Checked<()> {
        numbers.iter().try_for_each(|x| self.finite(&[(key, *x)]))
    }

    fn lengths(&self, key: &str, found: usize, other: &str, expected: usize) -> Checked<()> {
        if found == expected {
            return Ok(());
        }
        self.broken(format!(
            "expected as many numbers in `{key}` as in `{other}`, found {found} and {expected}"
        ))
    }

    fn broken<T>(&self, message: String) -> Checked<T> {
        error(Some(self.span.clone()), format!("{}: {message}", self.shape))
    }
}

impl Part {
    /// Checks the description and prepares it for a run that ends at `stop` [s]; `seed` and the
    /// signal's name fix the phases that are random.
    ///
    /// # Errors
    /// When there is not exactly one shape, or a number that the shape cannot have.
    pub fn build(&self, seed: u64, stop: f64) -> Result<Signal, SignalError> {
        let seed = self.name.as_ref().map_or(seed, |name| stream_seed(seed, name.get_ref()));
        if self.part.is_empty() {
            let span = self.name.as_ref().map(Spanned::span);
            let piece = self.piece(span, seed, stop)?;
            return Ok(Signal { parts: vec![piece] });
        }
        if let Some((key, span)) = self.own_keys().into_iter().next() {
            return error(
                Some(span),
                format!("a signal with parts has no `{key}` of its own: move it into the parts"),
            );
        }
        let parts = self.part.iter().enumerate().map(|(index, part)| {
            let (span, part) = (part.span(), part.get_ref());
            if let Some(name) = part.name.as_ref().or(part.unit.as_ref()) {
                let message = "a part has neither name nor unit: give them to the signal";
                return error(Some(name.span()), message);
            }
            if let Some(inner) = part.part.first() {
                let message = "a part has no parts: list them all in the signal";
                return error(Some(inner.span()), message);
            }
            // Multisines of the same signal must not share their phases.
            part.piece(Some(span), seed.wrapping_add(index as u64), stop)
        });
        Ok(Signal { parts: parts.collect::<Result<_, _>>()? })
    }

    /// The window and the shapes that are given.
    fn own_keys(&self) -> Vec<(&'static str, Range<usize>)> {
        let numbers = [
            ("from", &self.from),
            ("until", &self.until),
            ("fade_in", &self.fade_in),
            ("fade_out", &self.fade_out),
        ];
        let given = numbers
            .into_iter()
            .filter_map(|(key, number)| number.as_ref().map(|number| (key, number.span())));
        given.chain(self.shapes()).collect()
    }

    fn shapes(&self) -> Vec<(&'static str, Range<usize>)> {
        let span = |key, span: Option<Range<usize>>| span.map(|span| (key, span));
        let all = [
            span("constant", self.constant.as_ref().map(Spanned::span)),
            span("step", self.step.as_ref().map(Spanned::span)),
            span("ramp", self.ramp.as_ref().map(Spanned::span)),
            span("sine", self.sine.as_ref().map(Spanned::span)),
            span("multisine", self.multisine.as_ref().map(Spanned::span)),
            span("chirp", self.chirp.as_ref().map(Spanned::span)),
            span("square", self.square.as_ref().map(Spanned::span)),
            span("table", self.table.as_ref().map(Spanned::span)),
        ];
        all.into_iter().flatten().collect()
    }

    fn piece(&self, place: Option<Range<usize>>, seed: u64, stop: f64) -> Checked<(Window, Shape)> {
        let shapes = self.shapes();
        let span = match shapes.as_slice() {
            [(_, span)] => span,
            [] => {
                return error(
                    place,
                    "no shape: expected one of constant, step, ramp, sine, multisine, chirp, \
                     square, table, or a list of parts",
                );
            }
            [(first, _), (second, span), ..] => {
                return error(
                    Some(span.clone()),
                    format!(
                        "expected one shape, found `{first}` and `{second}`: \
                         to add them up, give each a part of its own"
                    ),
                );
            }
        };
        let window = self.window(stop)?;
        let shape = self.shape(&window, seed, span)?;
        Ok((window, shape))
    }

    fn window(&self, stop: f64) -> Checked<Window> {
        let number = |key: &str, given: &Option<Spanned<f64>>, absent: f64| match given {
            None => Ok(absent),
            Some(number) if number.get_ref().is_finite() => Ok(*number.get_ref()),
            Some(number) => error(
                Some(number.span()),
                format!("expected a finite time [s] for `{key}`, found {}", number.get_ref()),
            ),
        };
        let window = Window {
            from: number("from", &self.from, 0.0)?,
            until: number("until", &self.until, f64::INFINITY)?,
            fade_in: number("fade_in", &self.fade_in, 0.0)?,
            fade_out: number("fade_out", &self.fade_out, 0.0)?,
            end: number("until", &self.until, stop)?,
        };
        let until = self.until.as_ref().map(Spanned::span);
        if window.until <= window.from {
            let (from, until_value) = (window.from, window.until);
            let message =
                format!("expected `until` after `from` at {from} s, found {until_value} s");
            return error(until, message);
        }
        self.check_fades(&window)?;
        Ok(window)
    }

    fn check_fades(&self, window: &Window) -> Checked<()> {
        let length = window.end - window.from;
        let both = window.fade_in + window.fade_out;
        for (key, given) in [("fade_in", &self.fade_in), ("fade_out", &self.fade_out)] {
            let Some(fade) = given else { continue };
            let (span, fade) = (Some(fade.span()), fade.get_ref());
            if *fade < 0.0 {
                let message =
                    format!("expected a time [s] of at least 0 for `{key}`, found {fade}");
                return error(span, message);
            }
            if both > length + EDGE {
                let message =
                    format!("expected fades within the window of {length} s, found {both} s");
                return error(span, message);
            }
        }
        Ok(())
    }

    fn shape(&self, window: &Window, seed: u64, span: &Range<usize>) -> Checked<Shape> {
        let rules = |shape| Rules { shape, span };
        if let Some(constant) = &self.constant {
            let value = *constant.get_ref();
            rules("constant").finite(&[("constant", value)])?;
            return Ok(Shape::Constant(value));
        }
        if let Some(step) = &self.step {
            return step.get_ref().checked(&rules("step"));
        }
        if let Some(ramp) = &self.ramp {
            return ramp.get_ref().checked(&rules("ramp"));
        }
        if let Some(sine) = &self.sine {
            return sine.get_ref().checked(&rules("sine"));
        }
        if let Some(multisine) = &self.multisine {
            let rules = rules("multisine");
            return multisine.get_ref().checked(&rules, window, seed);
        }
        if let Some(chirp) = &self.chirp {
            return chirp.get_ref().checked(&rules("chirp"));
        }
        if let Some(square) = &self.square {
            return square.get_ref().checked(&rules("square"));
        }
        match &self.table {
            Some(table) => table.get_ref().checked(&rules("table")),
            None => error(Some(span.clone()), "no shape"),
        }
    }
}

impl Step {
    fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.finite(&[("at", self.at), ("before", self.before), ("after", self.after)])?;
        Ok(Shape::Step(self.clone()))
    }
}

impl Ramp {
    fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.finite(&[
            ("start", self.start),
            ("end", self.end),
            ("before", self.before),
            ("after", self.after),
        ])?;
        if self.end <= self.start {
            let (start, end) = (self.start, self.end);
            return rules.broken(format!(
                "expected `end` after `start` at {start} s, found {end} s; a `step` jumps"
            ));
        }
        Ok(Shape::Ramp(self.clone()))
    }
}

impl Sine {
    fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.finite(&[
            ("amplitude", self.amplitude),
            ("phase", self.phase),
            ("offset", self.offset),
        ])?;
        rules.frequencies(&[("frequency", self.frequency)])?;
        Ok(Shape::Sine(self.clone()))
    }
}

impl Chirp {
    fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.finite(&[("amplitude", self.amplitude), ("phase", self.phase)])?;
        rules.frequencies(&[("f_start", self.f_start), ("f_end", self.f_end)])?;
        rules.positive("duration", self.duration)?;
        Ok(Shape::Chirp(self.clone()))
    }

    fn value(&self, time: f64) -> f64 {
        let rising = time.min(self.duration);
        let turns = self.f_start * rising
            + (self.f_end - self.f_start) * rising * rising / (2.0 * self.duration)
            + self.f_end * (time - rising);
        self.amplitude * (TAU * turns + self.phase).sin()
    }
}

impl Square {
    fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.finite(&[
            ("amplitude", self.amplitude),
            ("phase", self.phase),
            ("offset", self.offset),
        ])?;
        rules.positive("period", self.period)?;
        if let Some(sharpness) = self.sharpness {
            rules.positive("sharpness", sharpness)?;
        }
        Ok(Shape::Square(self.clone()))
    }

    fn value(&self, time: f64) -> f64 {
        let level = match self.sharpness {
            Some(sharpness) => (sharpness * (TAU * time / self.period + self.phase).sin()).tanh(),
            None => {
                let turn = (time + EDGE) / self.period + self.phase / TAU;
                if turn.rem_euclid(1.0) < 0.5 { 1.0 } else { -1.0 }
            }
        };
        self.offset + self.amplitude * level
    }
}

impl Samples {
    fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.lengths("value", self.value.len(), "time", self.time.len())?;
        if self.time.is_empty() {
            return rules.broken("expected at least one time and value, found none".to_owned());
        }
        rules.list("time", &self.time)?;
        rules.list("value", &self.value)?;
        if let Some(pair) = self.time.windows(2).find(|pair| pair[1] <= pair[0]) {
            let (before, found) = (pair[0], pair[1]);
            return rules.broken(format!(
                "expected increasing numbers in `time`, found {found} after {before}"
            ));
        }
        Ok(Shape::Table(self.clone()))
    }

    fn value(&self, time: f64) -> f64 {
        let after = self.time.partition_point(|t| *t <= time + EDGE);
        let here = after.saturating_sub(1);
        let is_outside = after == 0 || after == self.time.len();
        if is_outside || self.interpolation == Interpolation::Hold {
            return self.value[here];
        }
        let share = (time - self.time[here]) / (self.time[after] - self.time[here]);
        self.value[here] + share.max(0.0) * (self.value[after] - self.value[here])
    }
}

impl Multisine {
    fn checked(&self, rules: &Rules, window: &Window, seed: u64) -> Checked<Shape> {
        let count = self.frequencies.len();
        if count == 0 {
            return rules.broken("expected at least one of `frequencies`, found none".to_owned());
        }
        rules.finite(&[("peak", self.peak)])?;
        for frequency in &self.frequencies {
            rules.frequencies(&[("frequencies", *frequency)])?;
        }
        let weights = self.weights.clone().unwrap_or_else(|| vec![1.0; count]);
        let mut random = Pcg64::seed_from_u64(self.seed.unwrap_or(seed));
        let phases = self
            .phases
            .clone()
            .unwrap_or_else(|| (0..count).map(|_| random.random_range(-PI..PI)).collect());
        rules.lengths("weights", weights.len(), "frequencies", count)?;
        rules.lengths("phases", phases.len(), "frequencies", count)?;
        rules.list("weights", &weights)?;
        rules.list("phases", &phases)?;
        let waves = self.frequencies.iter().zip(weights).zip(phases);
        let mut waves: Vec<[f64; 3]> =
            waves.map(|((frequency, weight), phase)| [weight, *frequency, phase]).collect();
        let peak = peak(&waves, window);
        if peak < 1e-12 {
            return rules.broken(
                "expected a sum that can be scaled to `peak`, found zero in the whole window"
                    .to_owned(),
            );
        }
        for wave in &mut waves {
            wave[0] *= self.peak / peak;
        }
        Ok(Shape::Multisine(waves))
    }
}

fn sum_of(waves: &[[f64; 3]], time: f64) -> f64 {
    let wave = |[amplitude, frequency, phase]: &[f64; 3]| {
        amplitude * (TAU * frequency * time + phase).sin()
    };
    waves.iter().map(wave).sum()
}

/// The largest absolute value in the window: the largest of 32 points per period of the fastest
/// wave, refined by the parabola through its neighbours.
fn peak(waves: &[[f64; 3]], window: &Window) -> f64 {
    let length = (window.end - window.from).max(0.0);
    let fastest = waves.iter().map(|wave| wave[1]).fold(0.0, f64::max);
    let points = (length * fastest * 32.0).ceil().clamp(256.0, MOST_POINTS);
    let size = |index: f64| {
        let time = length * index / points;
        (window.fade(window.from + time) * sum_of(waves, time)).abs()
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

impl Window {
    /// 0 outside, 1 inside, and between them while it fades.
    fn weight(&self, time: f64) -> f64 {
        if time + EDGE < self.from || time + EDGE >= self.until {
            return 0.0;
        }
        self.fade(time)
    }

    fn fade(&self, time: f64) -> f64 {
        let mut weight = 1.0_f64;
        if self.fade_in > 0.0 {
            weight = weight.min((time - self.from) / self.fade_in);
        }
        if self.fade_out > 0.0 {
            weight = weight.min((self.end - time) / self.fade_out);
        }
        weight.max(0.0)
    }
}

impl Shape {
    fn value(&self, time: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Step(step) if time + EDGE >= step.at => step.after,
            Self::Step(step) => step.before,
            Self::Ramp(ramp) => {
                let share = (time - ramp.start) / (ramp.end - ramp.start);
                ramp.before + share.clamp(0.0, 1.0) * (ramp.after - ramp.before)
            }
            Self::Sine(sine) => {
                sine.offset + sine.amplitude * (TAU * sine.frequency * time + sine.phase).sin()
            }
            Self::Multisine(waves) => sum_of(waves, time),
            Self::Chirp(chirp) => chirp.value(time),
            Self::Square(square) => square.value(time),
            Self::Table(table) => table.value(time),
        }
    }
}

impl Signal {
    /// The value at a time of the scenario [s].
    #[must_use]
    pub fn value(&self, time: f64) -> f64 {
        let value = |(window, shape): &(Window, Shape)| match window.weight(time) {
            0.0 => 0.0,
            weight => weight * shape.value(time - window.from),
        };
        self.parts.iter().map(value).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(text: &str) -> Result<Signal, SignalError> {
        let part: Part = toml::from_str(text).unwrap_or_else(|error| panic!("{text}\n{error}"));
        part.build(1, 10.0)
    }

    fn signal(text: &str) -> Signal {
        build(text).unwrap_or_else(|error| panic!("{text}\n{error}"))
    }

    #[test]
    fn shapes_have_their_values() {
        let sine_of_1 = 1_f64.sin();
        #[rustfmt::skip]
        let cases: &[(&str, &[(f64, f64)])] = &[
            ("constant = 2.5", &[(0.0, 2.5), (10.0, 2.5), (-1.0, 0.0)]),
            ("from = 1.0\nuntil = 2.0\nconstant = 3.0", &[(0.99, 0.0), (1.0, 3.0), (1.99, 3.0), (2.0, 0.0)]),
            ("from = 1.0\nuntil = 5.0\nfade_in = 2.0\nfade_out = 1.0\nconstant = 4.0", &[(1.0, 0.0), (2.0, 2.0), (3.0, 4.0), (4.0, 4.0), (4.75, 1.0), (5.0, 0.0)]),
            ("fade_out = 2.0\nconstant = 4.0", &[(8.0, 4.0), (9.0, 2.0), (10.0, 0.0), (11.0, 0.0)]),
            ("step = { at = 2.0, after = 5.0 }", &[(1.99, 0.0), (2.0, 5.0), (9.0, 5.0)]),
            ("from = 3.0\nstep = { at = 2.0, before = 1.0, after = 5.0 }", &[(2.0, 0.0), (3.0, 1.0), (4.9, 1.0), (5.0, 5.0)]),
            ("ramp = { start = 1.0, end = 3.0, before = 2.0, after = -2.0 }", &[(0.0, 2.0), (1.0, 2.0), (1.5, 1.0), (3.0, -2.0), (9.0, -2.0)]),
            ("sine = { amplitude = 2.0, frequency = 0.25, offset = 1.0 }", &[(0.0, 1.0), (1.0, 3.0), (2.0, 1.0), (3.0, -1.0)]),
            ("from = 1.0\nsine = { amplitude = 2.0, frequency = 0.0, phase = 1.0 }", &[(1.0, 2.0 * sine_of_1), (0.0, 0.0)]),
            ("chirp = { amplitude = 1.0, f_start = 0.0, f_end = 2.0, duration = 4.0 }", &[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (4.125, 1.0), (4.5, 0.0)]),
            ("square = { amplitude = 2.0, period = 4.0, offset = 1.0 }", &[(0.0, 3.0), (1.9, 3.0), (2.0, -1.0), (3.9, -1.0), (4.0, 3.0)]),
            ("square = { amplitude = 2.0, period = 4.0, sharpness = 50.0 }", &[(0.0, 0.0), (1.0, 2.0), (3.0, -2.0)]),
            ("table = { time = [1.0, 2.0, 4.0], value = [5.0, 1.0, 3.0] }", &[(0.0, 5.0), (1.0, 5.0), (1.5, 3.0), (2.0, 1.0), (3.0, 2.0), (9.0, 3.0)]),
            ("table = { time = [1.0, 2.0], value = [5.0, 1.0], interpolation = \"hold\" }", &[(0.0, 5.0), (1.99, 5.0), (2.0, 1.0), (9.0, 1.0)]),
            ("part = [{ constant = 1.0 }, { from = 2.0, until = 3.0, constant = 10.0 }]", &[(1.0, 1.0), (2.0, 11.0), (3.0, 1.0)]),
        ];
        for (text, points) in cases {
            let signal = signal(text);
            for (time, expected) in *points {
                let value = signal.value(*time);
                assert!((value - expected).abs() < 1e-9, "{text}\n{time}: {value}");
            }
        }
    }

    #[test]
    fn a_multisine_reaches_its_peak_and_no_more() {
        for window in ["", "from = 1.0\nuntil = 4.0", "from = 2.0\nfade_in = 3.0\nfade_out = 4.0"] {
            for sine in [
                "peak = 0.5, frequencies = [0.3, 0.7, 1.9, 4.1]",
                "peak = 0.5, frequencies = [0.3, 0.7], weights = [1.0, 3.0], phases = [0.0, 1.0]",
                "peak = 0.5, frequencies = [0.05], phases = [0.0]",
            ] {
                let signal = signal(&format!("{window}\nmultisine = {{ {sine} }}"));
                let times = (0..100_000).map(|i| f64::from(i) * 1e-4);
                let peak = times.map(|t| signal.value(t).abs()).fold(0.0, f64::max);
                assert!((peak - 0.5).abs() < 2e-4, "{window} {sine}: {peak}");
            }
        }
    }

    #[test]
    fn random_phases_depend_on_the_seed_and_the_name_alone() {
        let text = "multisine = { peak = 1.0, frequencies = [0.3, 0.7, 1.9] }";
        let part: Part = toml::from_str(text).expect(text);
        let fixed = text.replace(" }", ", seed = 4 }");
        let fixed: Part = toml::from_str(&fixed).expect(text);
        let build = |part: &Part, seed| part.build(seed, 10.0).expect(text);
        assert_eq!(build(&part, 4), build(&part, 4));
        assert_ne!(build(&part, 4), build(&part, 5));
        let named = |name| toml::from_str(&format!("name = \"{name}\"\n{text}")).expect(text);
        assert_ne!(build(&named("a.x"), 4), build(&named("a.y"), 4));
        assert_eq!(build(&fixed, 1), build(&fixed, 2));
        assert_eq!(build(&fixed, 1), build(&part, 4));
        let wave = "{ multisine = { peak = 1.0, frequencies = [0.3, 0.7] } }";
        let two: Part = toml::from_str(&format!("part = [{wave}, {wave}]")).expect(wave);
        let two = build(&two, 4);
        assert_ne!(two.parts[0], two.parts[1]);
    }

    #[test]
    fn edges_are_met_at_every_multiple_of_a_decimal_step() {
        let signal =
            signal("from = 0.3\nuntil = 0.7\nstep = { at = 0.2, before = 1.0, after = 2.0 }");
        for (step, expected) in [(29, 0.0), (30, 1.0), (49, 1.0), (50, 2.0), (69, 2.0), (70, 0.0)] {
            for rounding in [-1e-12, 0.0, 1e-12] {
                let time = f64::from(step) * 0.01 + rounding;
                assert_eq!(signal.value(time), expected, "{time}");
            }
        }
    }

    #[test]
    fn errors_show_the_place() {
        #[rustfmt::skip]
        let cases = [
            ("name = \"a\"", "\"a\"", "no shape: expected one of constant"),
            ("name = \"a\"\nconstant = 1.0\nsine = { amplitude = 1.0, frequency = 1.0 }", "{ amplitude = 1.0, frequency = 1.0 }", "found `constant` and `sine`"),
            ("part = [{ from = 1.0 }]", "{ from = 1.0 }", "no shape"),
            ("part = [{ name = \"b\", constant = 1.0 }]", "\"b\"", "neither name nor unit"),
            ("part = [{ unit = \"m\", constant = 1.0 }]", "\"m\"", "neither name nor unit"),
            ("part = [{ part = [{ constant = 1.0 }] }]", "{ constant = 1.0 }", "a part has no parts"),
            ("constant = 2.0\npart = [{ constant = 1.0 }]", "2.0", "no `constant` of its own"),
            ("until = 2.0\npart = [{ constant = 1.0 }]", "2.0", "no `until` of its own"),
            ("constant = inf", "inf", "finite number for `constant`, found inf"),
            ("from = nan\nconstant = 1.0", "nan", "finite time [s] for `from`"),
            ("from = 2.0\nuntil = 1.5\nconstant = 1.0", "1.5", "after `from` at 2 s, found 1.5 s"),
            ("fade_in = -1.0\nconstant = 1.0", "-1.0", "`fade_in`, found -1"),
            ("until = 2.0\nfade_in = 1.5\nfade_out = 1.0\nconstant = 1.0", "1.5", "window of 2 s, found 2.5 s"),
            ("from = 9.0\nfade_out = 2.0\nconstant = 1.0", "2.0", "window of 1 s, found 2 s"),
            ("step = { at = nan, after = 1.0 }", "{ at = nan, after = 1.0 }", "step: expected a finite number for `at`"),
            ("ramp = { start = 2.0, end = 2.0, after = 1.0 }", "{ start = 2.0, end = 2.0, after = 1.0 }", "`end` after `start`"),
            ("sine = { amplitude = 1.0, frequency = -1.0 }", "{ amplitude = 1.0, frequency = -1.0 }", "at least 0 for `frequency`"),
            ("square = { amplitude = 1.0, period = -1.0 }", "{ amplitude = 1.0, period = -1.0 }", "above 0 for `period`, found -1"),
            ("chirp = { amplitude = 1.0, f_start = 1.0, f_end = 2.0, duration = 0.0 }", "{ amplitude = 1.0, f_start = 1.0, f_end = 2.0, duration = 0.0 }", "above 0 for `duration`"),
            ("table = { time = [], value = [] }", "{ time = [], value = [] }", "at least one"),
            ("table = { time = [1.0], value = [] }", "{ time = [1.0], value = [] }", "found 0 and 1"),
            ("table = { time = [1.0, 1.0], value = [1.0, 2.0] }", "{ time = [1.0, 1.0], value = [1.0, 2.0] }", "found 1 after 1"),
            ("multisine = { peak = 1.0, frequencies = [] }", "{ peak = 1.0, frequencies = [] }", "at least one of `frequencies`"),
            ("multisine = { peak = 1.0, frequencies = [1.0], weights = [] }", "{ peak = 1.0, frequencies = [1.0], weights = [] }", "in `weights` as in `frequencies`"),
            ("multisine = { peak = 1.0, frequencies = [0.0], phases = [0.0] }", "{ peak = 1.0, frequencies = [0.0], phases = [0.0] }", "zero in the whole window"),
        ];
        for (text, place, message) in cases {
            let error = build(text).expect_err(text);
            assert!(error.message.contains(message), "{text}\n{error:?}");
            let span = error.span.expect(text);
            assert_eq!(&text[span], place, "{text}\n{}", error.message);
        }
        for text in ["sine = { amplitude = 1.0, freq = 1.0 }", "konstant = 1.0"] {
            assert!(toml::from_str::<Part>(text).is_err(), "{text}");
        }
    }
}
