//! Rates the agreement of two signals by standards: two slices of numbers go in; a rating of ISO/TS 18571, or the places inside a
//! band as ISO 19364 draws it, come out.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

pub mod band;
pub mod objective;
#[cfg(test)]
mod tests;
mod warping;

pub use band::{BandCoverage, LinearTolerance, ToleranceBand};
pub use objective::{RatingGrade, SignalRating, rate_signal};

/// Numbers that cannot be judged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RatingError {
    /// Series that belong together have different lengths.
    #[error("expected as many samples of {what} as of the reference, which has {reference}, found {found}")]
    Lengths {
        /// What differs.
        what: &'static str,
        /// Samples of the reference.
        reference: usize,
        /// Samples found.
        found: usize,
    },
    /// There are too few samples.
    #[error("expected at least {least} samples, found {found}")]
    Short {
        /// The fewest.
        least: usize,
        /// Samples found.
        found: usize,
    },
    /// A number is infinite or none.
    #[error("expected finite numbers, found another one in {what} at sample {index}")]
    NotFinite {
        /// The series.
        what: &'static str,
        /// Its index, from 0 on.
        index: usize,
    },
    /// A tolerance is negative.
    #[error("expected tolerances that are not negative, found one in {what} at sample {index}")]
    Negative {
        /// The series.
        what: &'static str,
        /// Its index, from 0 on.
        index: usize,
    },
}

/// Refuses numbers that are infinite or none.
fn check_finite(what: &'static str, values: &[f64]) -> Result<(), RatingError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(RatingError::NotFinite { what, index }),
        None => Ok(()),
    }
}

/// Refuses another number of samples than that of the reference.
fn check_length(what: &'static str, values: &[f64], reference: usize) -> Result<(), RatingError> {
    match values.len() {
        found if found == reference => Ok(()),
        found => Err(RatingError::Lengths { what, reference, found }),
    }
}
