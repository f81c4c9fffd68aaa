//! The plan of a check, by columns: what has to hold, of what, and when.

use std::path::PathBuf;

use expression::Expression;
use recording::{AllVariables, IntegerIndex};

/// Marks rows of results of analyses and validations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResultSpace;

/// What has to hold, and of what.
#[derive(Debug, Clone, PartialEq)]
pub enum CheckCondition {
    /// Of signals, at each sample.
    Run(Expression<AllVariables>),
    /// Of results of analyses and validations; a row has a number and a text for each of these names.
    Results(Expression<ResultSpace>, Vec<ResultName>),
}

impl CheckCondition {
    /// The unit that both sides are compared in, if it is one comparison of values with a unit.
    #[must_use]
    pub fn compared_unit(&self) -> Option<&str> {
        match self {
            CheckCondition::Run(expression) => expression.compared_unit(),
            CheckCondition::Results(expression, _) => expression.compared_unit(),
        }
    }
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
    /// The file that it is written in.
    pub file: PathBuf,
    /// Its line there, from 1 on.
    pub line: usize,
    /// The condition.
    pub condition: CheckCondition,
    /// The integers of 64 bits that it is about, with their names: it cannot judge one that no number holds.
    pub integers: Vec<(IntegerIndex<AllVariables>, String)>,
    /// First and last moment [s].
    pub during: [f64; 2],
    /// Whether the scenario gives the window; a run that ends early must not have cut it short.
    pub windowed: bool,
    /// By how much a comparison may be off.
    pub tolerance: f64,
}
