//! Checks the numbers of a shape and says which one breaks a rule.

use std::ops::Range;

use super::{Checked, error};

/// The rules for the numbers of one shape; an error names the number that breaks one.
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
