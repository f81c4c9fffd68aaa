//! Decides whether data identify a quantity: all thresholds for that, each with its reason, and the verdict.

use serde::Serialize;

/// Ratio of posterior to prior standard deviation below which data identify a quantity: its variance has contracted by 91 %, so the
/// prior is less than a tenth of what is known.
pub const MAX_WIDTH_IDENTIFIED: f64 = 0.3;
/// Ratio from which on a quantity is not identifiable: half of the variance is left there, so the prior says as much as the data.
pub const MAX_WIDTH_WEAK: f64 = 0.7;
/// Posterior standard deviations by which half or double the width of the prior may move the mean of what is identified: with the
/// posterior's own spread a shift of a quarter adds 3 % to the distance from the truth.
pub const MAX_PRIOR_SHIFT: f64 = 0.25;
/// A move by less than this share of the prior's width is of no consequence, however many posterior standard deviations it is.
pub const NEGLIGIBLE_PRIOR_SHIFT: f64 = 0.01;

/// Whether the data could tell a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Identifiability {
    /// The data decide; the prior does not matter.
    Identified,
    /// The data say something, the prior the rest.
    Weak,
    /// The value is what the prior said.
    NotIdentifiable,
}

impl Identifiability {
    /// The verdict that follows from the ratio of posterior to prior width [-] alone; NaN is not identifiable.
    #[must_use]
    pub fn from_width(ratio: f64) -> Self {
        if ratio < MAX_WIDTH_IDENTIFIED {
            Self::Identified
        } else if ratio < MAX_WIDTH_WEAK {
            Self::Weak
        } else {
            Self::NotIdentifiable
        }
    }

    /// The verdict as results and style sheets have it.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::Weak => "weak",
            Self::NotIdentifiable => "not_identifiable",
        }
    }

    /// The verdict for people.
    #[must_use]
    pub fn to_display_text(self) -> &'static str {
        match self {
            Self::NotIdentifiable => "not identifiable",
            _ => self.key(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrower_posterior_has_a_better_verdict() {
        let ratios = [0.1, 0.3, 0.69, 0.7, 1.2, f64::NAN].map(Identifiability::from_width);
        use Identifiability::{Identified, NotIdentifiable, Weak};
        let expected = [Identified, Weak, Weak, NotIdentifiable, NotIdentifiable, NotIdentifiable];
        assert_eq!(ratios, expected);
    }
}
