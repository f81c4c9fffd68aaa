//! Says how an optimisation ended.

use serde::Serialize;

/// How an optimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum OptimisationStatus {
    /// The conditions of optimality hold to the tolerance.
    Converged,
    /// Steps became too small to change the numbers before the conditions held.
    Stalled,
    /// The limit of iterations was reached.
    IterationLimit,
}

/// How a method got to its result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConvergenceReport {
    /// How it ended.
    pub status: OptimisationStatus,
    /// Iterations of the best start.
    pub iterations: usize,
    /// Evaluations of the model over all samples, in all starts.
    pub evaluations: usize,
    /// Largest violation of the conditions of Karush, Kuhn and Tucker, scaled [-]; absent for methods without gradients.
    pub kkt_residual: Option<f64>,
    /// Starts that were made.
    pub starts: usize,
    /// Different optima that the starts found: more than one is a warning.
    pub optima: usize,
    /// Sum of squared, weighted residuals, halved, at the result.
    pub cost: f64,
    /// The cost at the best start and after each of its steps, of Nelder and Mead after each restart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trace: Vec<f64>,
}
