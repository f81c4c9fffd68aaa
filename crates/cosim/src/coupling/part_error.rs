//! Holds the estimated error of a part of a communication step.

/// The error of a part at a connection or a bond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SubstepError {
    /// In the unit of the input; of a bond, an energy.
    pub absolute: f64,
    /// Relative to the largest value so far [-].
    pub relative: f64,
}
