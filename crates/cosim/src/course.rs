//! Follows the values of an input over time, and continues them by a polynomial.

use scenario::document::{At, Extrapolate};
use serde::{Deserialize, Serialize};

/// The polynomial `c_0 + c_1 (t - t_0) + c_2 (t - t_0)^2` of the time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Course {
    /// `t_0` [s].
    origin: f64,
    coefficients: [f64; 3],
}

impl Course {
    /// The value at a time [s].
    #[must_use]
    pub fn at(&self, time: f64) -> f64 {
        let ([c0, c1, c2], t) = (self.coefficients, time - self.origin);
        c0 + t * (c1 + t * c2)
    }

    /// The mean between two times [s].
    #[must_use]
    pub fn mean(&self, (from, to): (f64, f64)) -> f64 {
        let ([c0, c1, c2], a, b) = (self.coefficients, from - self.origin, to - self.origin);
        c0 + c1 * (a + b) / 2.0 + c2 * (a * a + a * b + b * b) / 3.0
    }

    /// The first and the second derivative at a time [s].
    #[must_use]
    pub fn slopes(&self, time: f64) -> [f64; 2] {
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
struct History {
    points: [(f64, f64); 3],
    count: usize,
}

impl History {
    /// Adds a value, or replaces that of the same time.
    fn note(&mut self, time: f64, value: f64) {
        if self.count == 0 || self.points[0].0 != time {
            self.points.rotate_right(1);
            self.count = (self.count + 1).min(self.points.len());
        }
        self.points[0] = (time, value);
    }

    /// The polynomial through the last values, of this degree if there are enough.
    fn course(&self, degree: usize) -> Course {
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
        Course { origin: t0, coefficients }
    }
}

/// An input that has a course within a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moving {
    /// Its place among the inputs of its node that are numbers.
    pub place: usize,
    degree: usize,
    at_end: bool,
    history: History,
}

impl Moving {
    /// An input that takes its value at this end of a step.
    #[must_use]
    pub fn new(place: usize, extrapolate: Extrapolate, at: At) -> Self {
        let history = History::default();
        Moving { place, degree: extrapolate.order(), at_end: at == At::End, history }
    }

    /// Whether it knows the value at the end of the step.
    #[must_use]
    pub fn knows_end(&self) -> bool {
        self.at_end
    }

    /// Adds its new value in a step between two times [s]; `before` is the one that it had at the start.
    pub fn note(&mut self, (from, to): (f64, f64), before: f64, value: f64) {
        if self.at_end && self.history.count == 0 {
            self.history.note(from, before);
        }
        self.history.note(if self.at_end { to } else { from }, value);
    }

    /// Goes on with the values of another input with such a course.
    pub fn recall(&mut self, other: &Self) {
        if (self.degree, self.at_end) == (other.degree, other.at_end) {
            self.history = other.history;
        }
    }

    /// Its course within the step.
    #[must_use]
    pub fn course(&self) -> Course {
        self.history.course(self.degree)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_continued_exactly() {
        let parabola = |t: f64| 3.0 - 2.0 * t + 0.5 * t * t;
        let mut input = Moving::new(0, Extrapolate::Quadratic, At::Start);
        // The steps need not be equal.
        for t in [0.0, 0.5, 0.75, 1.0] {
            input.note((t, t + 0.25), f64::NAN, parabola(t));
        }
        let course = input.course();
        for t in [1.0, 1.1, 1.25] {
            assert!((course.at(t) - parabola(t)).abs() < 1e-14);
            assert!((course.slopes(t)[0] - (t - 2.0)).abs() < 1e-13);
        }
        assert!((course.slopes(1.0)[1] - 1.0).abs() < 1e-13);
        let antiderivative = |t: f64| 3.0 * t - t * t + t * t * t / 6.0;
        let mean = (antiderivative(1.25) - antiderivative(1.0)) / 0.25;
        assert!((course.mean((1.0, 1.25)) - mean).abs() < 1e-14);
        assert_eq!(course.degree(), 2);
    }

    #[test]
    fn an_input_that_knows_the_end_goes_there_evenly() {
        let mut input = Moving::new(0, Extrapolate::Linear, At::End);
        input.note((2.0, 3.0), 10.0, 12.0);
        assert_eq!([2.0, 2.5, 3.0].map(|t| input.course().at(t)), [10.0, 11.0, 12.0]);
        assert_eq!(input.course().mean((2.0, 3.0)), 11.0);
        // The step is done again, with another value.
        input.note((2.0, 3.0), 10.0, 14.0);
        assert_eq!(input.course().at(2.5), 12.0);
        assert!(input.knows_end());
    }

    #[test]
    fn a_first_value_holds() {
        let mut input = Moving::new(0, Extrapolate::Quadratic, At::Start);
        input.note((0.0, 1.0), f64::NAN, 5.0);
        assert_eq!((input.course().at(1.0), input.course().degree()), (5.0, 0));
        input.note((1.0, 2.0), f64::NAN, 6.0);
        assert_eq!((input.course().at(2.0), input.course().degree()), (7.0, 1));
    }
}
