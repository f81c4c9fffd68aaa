//! Sets how many experiments the explanation of a difference between two runs may take.

/// The most runs that experiments take: with the work around them, 20 times one run.
pub const MOST_RUNS: usize = 17;
