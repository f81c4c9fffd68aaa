//! Extrapolates an input within a step: by the polynomial through its last values.

use std::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::clock::StepBoundary;

/// Extrapolation of an input within a step: on from its last values, which are those at the start of this step and the ones before it, with
/// `at = "end"` that at its end, too. An FMU that takes no slopes gets the mean over each step of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Extrapolate")]
#[non_exhaustive]
pub enum ExtrapolationOrder {
    /// A straight line through the last two values.
    Linear,
    /// A parabola through the last three values.
    Quadratic,
}

impl ExtrapolationOrder {
    /// The degree of the polynomial.
    #[must_use]
    pub fn degree(self) -> usize {
        match self {
            ExtrapolationOrder::Linear => 1,
            ExtrapolationOrder::Quadratic => 2,
        }
    }
}

/// An extrapolation of an input: the polynomial `c_0 + c_1 (t - t_0) + c_2 (t - t_0)^2` of the time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExtrapolationPolynomial {
    /// `t_0` [s].
    origin: f64,
    coefficients: [f64; 3],
}

impl ExtrapolationPolynomial {
    /// The value at a time [s].
    #[must_use]
    pub fn value_at(&self, time: f64) -> f64 {
        let ([c0, c1, c2], t) = (self.coefficients, time - self.origin);
        c0 + t * (c1 + t * c2)
    }

    /// The mean between two times [s].
    #[must_use]
    pub fn mean_over(&self, span: &Range<f64>) -> f64 {
        let [c0, c1, c2] = self.coefficients;
        let (a, b) = (span.start - self.origin, span.end - self.origin);
        c0 + c1 * (a + b) / 2.0 + c2 * (a * a + a * b + b * b) / 3.0
    }

    /// The first and the second derivative at a time [s].
    #[must_use]
    pub fn derivatives(&self, time: f64) -> [f64; 2] {
        let ([_, c1, c2], t) = (self.coefficients, time - self.origin);
        [c1 + 2.0 * c2 * t, 2.0 * c2]
    }

    /// Its degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.coefficients.iter().rposition(|it| *it != 0.0).unwrap_or(0)
    }
}

/// The last values of an input with their times [s], newest first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct InputHistory {
    points: [(f64, f64); 3],
    count: usize,
}

impl InputHistory {
    /// Adds a value, or replaces that of the same time.
    fn push_value(&mut self, time: f64, value: f64) {
        if self.count == 0 || self.points[0].0 != time {
            self.points.rotate_right(1);
            self.count = (self.count + 1).min(self.points.len());
        }
        self.points[0] = (time, value);
    }

    /// The polynomial through the last values, of this degree if there are enough.
    fn fit_polynomial(&self, degree: usize) -> ExtrapolationPolynomial {
        let [(t0, u0), (t1, u1), (t2, u2)] = self.points;
        let slope = || (u0 - u1) / (t0 - t1);
        let coefficients = match degree.min(self.count.saturating_sub(1)) {
            0 => [u0, 0.0, 0.0],
            1 => [u0, slope(), 0.0],
            // Newton's divided differences, with the parabola's slope at the newest point.
            _ => {
                let bend = (slope() - (u1 - u2) / (t1 - t2)) / (t0 - t2);
                [u0, slope() + bend * (t0 - t1), bend]
            }
        };
        ExtrapolationPolynomial { origin: t0, coefficients }
    }
}

/// An input that is extrapolated within a step, with its last values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExtrapolatedInput {
    /// Its place among the inputs of its node that are numbers.
    pub place: usize,
    degree: usize,
    at_end: bool,
    history: InputHistory,
}

impl ExtrapolatedInput {
    /// An input that takes its value at this end of a step.
    #[must_use]
    pub fn new(place: usize, order: ExtrapolationOrder, at: StepBoundary) -> Self {
        let history = InputHistory::default();
        ExtrapolatedInput { place, degree: order.degree(), at_end: at == StepBoundary::End, history }
    }

    /// Whether its value at the end of the step is known.
    #[must_use]
    pub fn knows_end(&self) -> bool {
        self.at_end
    }

    /// Adds its new value in a step between two times [s]; `before` is the one that it had at the start.
    pub fn push_step_values(&mut self, span: &Range<f64>, before: f64, value: f64) {
        if self.at_end && self.history.count == 0 {
            self.history.push_value(span.start, before);
        }
        self.history.push_value(if self.at_end { span.end } else { span.start }, value);
    }

    /// Goes on with the values of another input with such a polynomial.
    pub fn restore_history_if_compatible(&mut self, other: &Self) {
        if (self.degree, self.at_end) == (other.degree, other.at_end) {
            self.history = other.history;
        }
    }

    /// Its polynomial within the step.
    #[must_use]
    pub fn step_polynomial(&self) -> ExtrapolationPolynomial {
        self.history.fit_polynomial(self.degree)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_continued_exactly() {
        let parabola = |t: f64| 3.0 - 2.0 * t + 0.5 * t * t;
        let mut input = ExtrapolatedInput::new(0, ExtrapolationOrder::Quadratic, StepBoundary::Start);
        // The steps need not be equal.
        for t in [0.0, 0.5, 0.75, 1.0] {
            input.push_step_values(&(t..t + 0.25), f64::NAN, parabola(t));
        }
        let polynomial = input.step_polynomial();
        for t in [1.0, 1.1, 1.25] {
            assert!((polynomial.value_at(t) - parabola(t)).abs() < 1e-14);
            assert!((polynomial.derivatives(t)[0] - (t - 2.0)).abs() < 1e-13);
        }
        assert!((polynomial.derivatives(1.0)[1] - 1.0).abs() < 1e-13);
        let antiderivative = |t: f64| 3.0 * t - t * t + t * t * t / 6.0;
        let mean = (antiderivative(1.25) - antiderivative(1.0)) / 0.25;
        assert!((polynomial.mean_over(&(1.0..1.25)) - mean).abs() < 1e-14);
        assert_eq!(polynomial.degree(), 2);
    }

    #[test]
    fn an_input_that_knows_the_end_goes_there_evenly() {
        let mut input = ExtrapolatedInput::new(0, ExtrapolationOrder::Linear, StepBoundary::End);
        input.push_step_values(&(2.0..3.0), 10.0, 12.0);
        assert_eq!([2.0, 2.5, 3.0].map(|t| input.step_polynomial().value_at(t)), [10.0, 11.0, 12.0]);
        assert_eq!(input.step_polynomial().mean_over(&(2.0..3.0)), 11.0);
        // The step is done again, with another value.
        input.push_step_values(&(2.0..3.0), 10.0, 14.0);
        assert_eq!(input.step_polynomial().value_at(2.5), 12.0);
        assert!(input.knows_end());
    }

    #[test]
    fn a_first_value_holds() {
        let mut input = ExtrapolatedInput::new(0, ExtrapolationOrder::Quadratic, StepBoundary::Start);
        input.push_step_values(&(0.0..1.0), f64::NAN, 5.0);
        assert_eq!((input.step_polynomial().value_at(1.0), input.step_polynomial().degree()), (5.0, 0));
        input.push_step_values(&(1.0..2.0), f64::NAN, 6.0);
        assert_eq!((input.step_polynomial().value_at(2.0), input.step_polynomial().degree()), (7.0, 1));
    }
}
