//! The keys of `[coupling]`, the coupling algorithm and its settings.

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Exchange of values between the nodes.
///
/// ```toml
/// [coupling]
/// algorithm = "iterate"
/// tolerance = 1e-4
/// ```
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Coupling {
    /// Coupling algorithm.
    #[serde(default)]
    #[schemars(example = &"jacobi")]
    pub algorithm: Algorithm,
    /// What becomes of a loop of connections that all want the value of the end of the step, with `gauss_seidel`.
    #[serde(default)]
    #[schemars(example = &"delay")]
    pub loops: Loops,
    /// Solution of loops, for `iterate`; in the initialisation for all algorithms.
    #[serde(default)]
    pub iteration: Iteration,
    /// Error of the coupling that a step may add, relative to the largest size of each connected value so far [-]; that is its nominal
    /// value at least, or a millionth of its unit. With it, a communication step is divided, again and again into halves, where that is needed. Recordings and checks see the
    /// communication points only.
    #[schemars(with = "Option<f64>", example = 1e-4)]
    pub tolerance: Option<Spanned<f64>>,
    /// Estimate of that error.
    #[schemars(with = "Option<ErrorEstimate>", example = &"energy")]
    pub error: Option<Spanned<ErrorEstimate>>,
    /// Connections that carry power, for `error = "energy"`.
    #[serde(default)]
    pub bond: Vec<Bond>,
    /// What becomes of a step that an FMU discards. Without a word it is halved where states are saved anyway, with `tolerance`, and
    /// ends the run else.
    #[schemars(with = "Option<OnDiscard>", example = &"halve")]
    pub on_discard: Option<Spanned<OnDiscard>>,
}

/// Coupling algorithm.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Algorithm {
    /// The nodes step one after the other; each sees the new values of the nodes before it.
    #[default]
    GaussSeidel,
    /// All nodes step with the values from the start of the step, so their order does not matter.
    Jacobi,
    /// The nodes of a loop repeat the step until what they get fits what they give. Continuous inputs go evenly from their value at
    /// the start of the step to that at its end, or have the mean of both where the FMU takes no slopes. That is of second order.
    Iterate,
}

/// What becomes of a loop of connections.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Loops {
    /// The scenario is refused: it says itself which connection has `at = "start"`.
    #[default]
    Refuse,
    /// As few connections as possible take the value of the start of the step; of several choices, the one that lets nodes step in the order
    /// of the file. A warning names them. A system of SSP runs so.
    Delay,
}

/// Solution of loops.
///
/// ```toml
/// [coupling]
/// algorithm = "iterate"
/// iteration = { method = "anderson", tolerance = 1e-10 }
/// ```
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Iteration {
    /// The method.
    #[serde(default)]
    #[schemars(example = &"anderson")]
    pub method: Method,
    /// Difference between what inputs have and what they would get, relative to the size of each, that ends the iteration [-]; 1e-8
    /// without it.
    #[schemars(with = "Option<f64>", example = 1e-8)]
    pub tolerance: Option<Spanned<f64>>,
    /// Passes through a loop, after which a step fails; 50 without it.
    #[schemars(with = "Option<u32>", example = 50)]
    pub passes: Option<Spanned<u32>>,
}

/// Method that solves a loop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Newton's method. The derivatives come from the FMUs where all of a loop give them, else from differences; between two steps and
    /// two passes they are corrected by what was seen (Broyden).
    #[default]
    Newton,
    /// Each pass takes the values of the one before. Converges where the loop gain is below 1.
    FixedPoint,
    /// Fixed point with a factor from the last two passes (Aitken).
    Aitken,
    /// Fixed point with the best combination of the last five passes (Anderson).
    Anderson,
}

/// Estimate of the error of the coupling.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorEstimate {
    /// Each step is done once as a whole and once in two halves, which count (Richardson). All FMUs have to save and restore their
    /// states.
    #[default]
    Richardson,
    /// From the energy that the connections in `bond` lose or add. No step is repeated, so FMUs need no states.
    Energy,
}

/// Two connections that carry power between two nodes: an effort one way, the flow the other way.
///
/// ```toml
/// [[coupling.bond]]
/// effort = "wheel.F"
/// flow = "chassis.v"
/// ```
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bond {
    /// Input that takes the effort, such as a force or a voltage.
    #[schemars(example = &"wheel.F")]
    pub effort: Spanned<String>,
    /// Input that takes the flow, such as a velocity or a current.
    #[schemars(example = &"chassis.v")]
    pub flow: Spanned<String>,
}

/// What becomes of a step that an FMU discards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnDiscard {
    /// It ends the run.
    End,
    /// All nodes go back to the start of the step and do it in halves. All FMUs have to save and restore their states.
    Halve,
}

/// Course of an input within a step: on from its last values, which are those at the start of this step and the ones before it, with
/// `at = "end"` that at its end, too. An FMU that takes no slopes gets the mean over each step of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Extrapolate {
    /// A straight line through the last two values.
    Linear,
    /// A parabola through the last three values.
    Quadratic,
}

impl Extrapolate {
    /// The order of the polynomial.
    #[must_use]
    pub fn order(self) -> usize {
        match self {
            Extrapolate::Linear => 1,
            Extrapolate::Quadratic => 2,
        }
    }
}
