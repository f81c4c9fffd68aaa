//! Says what is wrong with a table of points, with limits, or with a track that nothing can drive.

/// What is wrong, where, and what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A line of the text of a table.
    #[error("line {line}: {message}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// Expectation and fact.
        message: String,
    },
    /// The table as a whole.
    #[error("{0}")]
    Table(String),
    /// A place on the line.
    #[error("at s = {s:.1} m: {message}")]
    Place {
        /// Station [m].
        s: f64,
        /// Expectation and fact.
        message: String,
    },
    /// A limit of the car.
    #[error("{0}")]
    Limits(String),
}
