//! Statistics of a sweep: confidence intervals of shares, rank correlations, Sobol indices.

mod indices;
mod ranks;
mod share;

pub use indices::{SobolIndices, sobol_indices};
pub use ranks::{ranks, spearman_correlation};
pub use share::PassRate;

use serde::Serialize;

/// A number with the interval that holds the true one 95 % of the time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The best guess.
    pub value: f64,
    /// Lower and upper end.
    pub interval: [f64; 2],
}
