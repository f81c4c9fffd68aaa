//! Says how well two signals agree, as standards do: two slices of numbers go in; a rating of ISO/TS 18571, or the places inside a
//! band as ISO 19364 draws it, come out.
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

pub mod band;
pub mod objective;
#[cfg(test)]
mod tests;
mod warping;

pub use band::{Band, Inside, Tolerance};
pub use objective::{Grade, Rating, rating};

/// Numbers that cannot be judged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unrated {
    /// Series that belong together have different lengths.
    #[error(
        "expected as many samples of {what} as of the reference, which has {reference}, found {found}"
    )]
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
fn finite(what: &'static str, values: &[f64]) -> Result<(), Unrated> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Unrated::NotFinite { what, index }),
        None => Ok(()),
    }
}

/// Refuses another number of samples than that of the reference.
fn as_long(what: &'static str, values: &[f64], reference: usize) -> Result<(), Unrated> {
    match values.len() {
        found if found == reference => Ok(()),
        found => Err(Unrated::Lengths { what, reference, found }),
    }
}
