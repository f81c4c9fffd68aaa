//! The keys of `[coupling]`, the coupling algorithm and its settings.

use cosim::system::{Algorithm, ErrorEstimate, LoopSolverMethod};
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
    pub loops: LoopPolicy,
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

/// What becomes of a loop of connections.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoopPolicy {
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
    pub method: LoopSolverMethod,
    /// Difference between what inputs have and what they would get, relative to the size of each, that ends the iteration [-]; 1e-8
    /// without it.
    #[schemars(with = "Option<f64>", example = 1e-8)]
    pub tolerance: Option<Spanned<f64>>,
    /// Passes through a loop, after which a step fails; 50 without it.
    #[schemars(with = "Option<u32>", example = 50)]
    pub passes: Option<Spanned<u32>>,
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
