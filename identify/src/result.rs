//! Says what an identification found: values, how certain they are, and whether the data could tell.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::posterior::report::Report;
use crate::svi;

/// A number for each quantity, by name: the parameters that were fitted, and `K` (stiffness B C D), `peak` (highest
/// friction coefficient) and `peak_slip`.
pub type ByName<T = f64> = BTreeMap<String, T>;

/// Whether the data could tell a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The data decide; the prior does not matter.
    Identified,
    /// The data say something, the prior the rest.
    Weak,
    /// The value is what the prior said.
    NotIdentifiable,
}

/// How an optimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The conditions of optimality hold to the tolerance.
    Converged,
    /// Steps became too small to change the numbers before the conditions held.
    Stalled,
    /// The limit of iterations was reached.
    IterationLimit,
}

/// How a method got to its result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Convergence {
    /// How it ended.
    pub status: Status,
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

/// What standard deviations, intervals and covariance are those of, and of posteriors also the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The likelihood near its maximum.
    Likelihood,
    /// A normal distribution, by variational inference, its draws weighted by the posterior.
    Svi,
    /// The exact posterior, from a grid.
    Grid,
    /// The posterior, from a tempered population.
    Tempered,
    /// The exact posterior, from draws with weights.
    Importance,
}

/// What one method found for one axle in one direction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Best values.
    pub mean: ByName,
    /// Standard deviations.
    pub std: ByName,
    /// 95 % intervals, lower and upper end.
    pub interval: ByName<[f64; 2]>,
    /// Rows and columns of `covariance`.
    pub parameters: Vec<String>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Parameters that stand on a bound.
    pub at_bound: Vec<String>,
    /// Parameters that were held at their prior, since the data cannot tell them.
    pub fixed: Vec<String>,
    /// What the data could tell.
    pub identified: ByName<Verdict>,
    /// Why.
    pub reason: ByName<String>,
    /// Smallest and largest slip of the data: outside, the curve is an extrapolation.
    pub slip_range: [f64; 2],
    /// How many samples were used.
    pub samples: usize,
    /// Standard deviation of the noise of the friction coefficient [-].
    pub noise_std: f64,
    /// How the method got there.
    pub convergence: Convergence,
    /// Wall time [s].
    pub seconds: f64,
    /// What the uncertainty is that of.
    pub source: Source,
    /// How the posterior was found that verdicts rest on, and standard deviations and intervals unless `source` says
    /// otherwise; absent where they come from the likelihood alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posterior: Option<Report>,
    /// What variational inference said, also where it is not to be trusted and the numbers above are the posterior's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub svi: Option<svi::report::Report>,
}
