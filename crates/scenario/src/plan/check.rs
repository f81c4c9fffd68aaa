//! A check, by columns.

use expression::Expression;

/// The subject of a check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// Signals, at each sample; the expression's columns are those of the row.
    Run,
    /// Results of analyses and validations; the expression's columns are these names.
    Results(Vec<ResultName>),
}

/// The name of a result: `tires.least_squares.front.mean.D`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultName {
    /// The analysis or validation.
    pub of: String,
    /// Path in the result. The result of a validation is its report.
    pub path: String,
    /// Whether it is compared with a text.
    pub is_text: bool,
}

/// A check, by columns.
#[derive(Debug)]
pub struct CheckPlan {
    /// Its name.
    pub name: String,
    /// As it was written.
    pub that: String,
    /// The condition.
    pub expression: Expression,
    /// Its subject.
    pub subject: Subject,
    /// First and last moment [s].
    pub during: [f64; 2],
    /// Whether the scenario gives the window; a run that ends early must not have cut it short.
    pub windowed: bool,
    /// By how much a comparison may be off.
    pub tolerance: f64,
}
