//! Checks the shapes that a signal can have, and gives their values over time.

use std::f64::consts::TAU;
use std::ops::Range;

use recording::table::Interpolation;

use super::words::{Chirp, Ramp, Samples, Sine, Square, Step};
use super::{Checked, EDGE, error, multisine};

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
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

/// A rule for the numbers of one shape; the error says which one breaks it.
pub(super) struct Rules<'a> {
    pub(super) shape: &'a str,
    pub(super) span: &'a Range<usize>,
}

impl Rules<'_> {
    pub(super) fn finite(&self, numbers: &[(&str, f64)]) -> Checked<()> {
        self.all(numbers, "a finite number", |_| true)
    }

    pub(super) fn positive(&self, key: &str, number: f64) -> Checked<()> {
        self.all(&[(key, number)], "a number above 0", |x| x > 0.0)
    }

    pub(super) fn frequencies(&self, numbers: &[(&str, f64)]) -> Checked<()> {
        self.all(numbers, "a frequency [Hz] of at least 0", |x| x >= 0.0)
    }

    fn all(&self, numbers: &[(&str, f64)], what: &str, rule: fn(f64) -> bool) -> Checked<()> {
        match numbers.iter().find(|(_, x)| !(x.is_finite() && rule(*x))) {
            Some((key, x)) => self.broken(format!("expected {what} for `{key}`, found {x}")),
            None => Ok(()),
        }
    }

    pub(super) fn list(&self, key: &str, numbers: &[f64]) -> Checked<()> {
        numbers.iter().try_for_each(|x| self.finite(&[(key, *x)]))
    }

    pub(super) fn lengths(
        &self,
        key: &str,
        found: usize,
        other: &str,
        expected: usize,
    ) -> Checked<()> {
        if found == expected {
            return Ok(());
        }
        self.broken(format!(
            "expected as many numbers in `{key}` as in `{other}`, found {found} and {expected}"
        ))
    }

    pub(super) fn broken<T>(&self, message: String) -> Checked<T> {
        error(Some(self.span.clone()), format!("{}: {message}", self.shape))
    }
}

impl Step {
    pub(super) fn checked(&self, rules: &Rules) -> Checked<Shape> {
        rules.finite(&[("at", self.at), ("before", self.before), ("after", self.after)])?;
        Ok(Shape::Step(self.clone()))
    }
}

impl Ramp {
    pub(super) fn checked(&self, rules: &Rules) -> Checked<Shape> {
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
    pub(super) fn checked(&self, rules: &Rules) -> Checked<Shape> {
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
    pub(super) fn checked(&self, rules: &Rules) -> Checked<Shape> {
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
    pub(super) fn checked(&self, rules: &Rules) -> Checked<Shape> {
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
    pub(super) fn checked(&self, rules: &Rules) -> Checked<Shape> {
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

impl Shape {
    pub(super) fn value(&self, time: f64) -> f64 {
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
            Self::Multisine(waves) => multisine::sum_of(waves, time),
            Self::Chirp(chirp) => chirp.value(time),
            Self::Square(square) => square.value(time),
            Self::Table(table) => table.value(time),
        }
    }
}
