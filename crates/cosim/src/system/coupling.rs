//! The coupling of a run: its algorithm, its loops, and the division of its steps.

use crate::clock::{CommunicationClock, StepBoundary};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The properties of a coupling algorithm that are known before a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CouplingProperties {
    /// The name in messages.
    pub name: &'static str,
    /// The end of the step at which an input takes the output of an FMU unless the connection sets `at`.
    pub default_at: StepBoundary,
    /// Whether a connection may set `at = "end"`.
    pub allows_end: bool,
    /// Whether it solves loops of values that need each other.
    pub solves_loops: bool,
    /// Its order: halving the step divides the error of a step by two to the power of this and one more [-].
    pub order: i32,
}

/// Coupling algorithm.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
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

impl Algorithm {
    /// The word for it in a scenario.
    #[must_use]
    pub fn keyword(self) -> &'static str {
        match self {
            Algorithm::GaussSeidel => "gauss_seidel",
            Algorithm::Jacobi => "jacobi",
            Algorithm::Iterate => "iterate",
        }
    }

    /// The rules of the algorithm.
    #[must_use]
    pub fn properties(self) -> CouplingProperties {
        let name = match self {
            Algorithm::GaussSeidel => "Gauss-Seidel",
            Algorithm::Jacobi => "Jacobi",
            Algorithm::Iterate => "iterated",
        };
        let ends = self != Algorithm::Jacobi;
        let iterates = self == Algorithm::Iterate;
        CouplingProperties {
            name,
            default_at: if ends { StepBoundary::End } else { StepBoundary::Start },
            allows_end: ends,
            solves_loops: iterates,
            order: if iterates { 2 } else { 1 },
        }
    }
}

/// Method that solves a loop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LoopSolverMethod {
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
#[non_exhaustive]
pub enum ErrorEstimate {
    /// Each step is done once as a whole and once in two halves, which count (Richardson). All FMUs have to save and restore their
    /// states.
    #[default]
    Richardson,
    /// From the energy that the connections in `bond` lose or add. No step is repeated, so FMUs need no states.
    Energy,
}

/// The coupling of a run.
#[derive(Debug, Clone, Default)]
pub struct CouplingPlan {
    /// The algorithm.
    pub algorithm: Algorithm,
    /// Solution of loops.
    pub iteration: LoopIteration,
    /// The nodes in the order in which they step, those of a loop together, for an algorithm that solves loops.
    pub blocks: Vec<NodeBlock>,
    /// The loops of the initialisation.
    pub initial: Vec<NodeBlock>,
    /// All loops of connections, broken or not.
    pub loops: Vec<ConnectionLoop>,
    /// Division of communication steps; without it none is divided.
    pub division: Option<StepDivision>,
}

/// Solution of loops.
#[derive(Debug, Clone, Copy)]
pub struct LoopIteration {
    /// The method.
    pub method: LoopSolverMethod,
    /// Difference between what inputs have and what they would get, relative to the size of each, that ends the iteration [-].
    pub tolerance: f64,
    /// Passes through a loop, after which a step fails.
    pub passes: u32,
}

impl Default for LoopIteration {
    fn default() -> Self {
        LoopIteration { method: LoopSolverMethod::default(), tolerance: 1e-8, passes: 50 }
    }
}

/// Nodes that step together.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NodeBlock {
    /// Their indices, in the order in which they step.
    pub nodes: Vec<usize>,
    /// The connections from a node of the block to itself or to an earlier one. Without them, there is no loop.
    pub tears: Vec<TearConnection>,
}

/// A connection of a number. In a block, its value is guessed until it fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TearConnection {
    /// The node that takes the value.
    pub node: usize,
    /// The place of the connection among those of numbers of the node.
    pub place: usize,
}

/// Nodes that get values from each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConnectionLoop {
    /// Their indices.
    pub nodes: Vec<usize>,
    /// The connections among them.
    pub links: Vec<LoopConnection>,
    /// Whether the outputs follow the inputs all the way round, without a step in between.
    pub is_algebraic: bool,
}

/// A connection of a loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoopConnection {
    /// `producer.output -> consumer.input`.
    pub label: String,
    /// The node that gives the value, and the one that takes it.
    pub ends: (usize, usize),
    /// The end of the step at which the value is taken.
    pub at: StepBoundary,
    /// Whether an output of the receiver follows the input without a step in between.
    pub needed: bool,
}

/// Division of communication steps into halves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepDivision {
    /// The estimate of the error of the coupling, and how much of it a step may add, relative to the size of a value [-].
    pub control: Option<(ErrorEstimate, f64)>,
    /// Whether a step that an FMU discards is repeated in halves.
    pub halves_discarded: bool,
    /// The connections that carry power.
    pub bonds: Vec<BondPlan>,
}

/// Two connections that carry power. Each node multiplies what it gets with what it gives; the difference is power that the coupling
/// adds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BondPlan {
    /// The names of the effort and of the flow.
    pub name: String,
    /// The connection of the effort.
    pub effort: TearConnection,
    /// The connection of the flow.
    pub flow: TearConnection,
}

/// The step of a node beside the communication step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepRatio {
    /// So many steps of its own in each communication step.
    Finer(u64),
    /// One step of its own in so many communication steps.
    Coarser(u64),
}

impl StepRatio {
    /// The steps of the node in a run with these communication points.
    #[must_use]
    pub fn node_clock(self, clock: &CommunicationClock) -> CommunicationClock {
        match self {
            StepRatio::Finer(times) => clock.refined_by(times),
            StepRatio::Coarser(times) => clock.coarsened_by(times),
        }
    }
}

impl CouplingPlan {
    /// The coupling in a few words.
    #[must_use]
    pub fn describe_coupling(&self) -> String {
        let mut parts = vec![match self.algorithm {
            Algorithm::GaussSeidel | Algorithm::Jacobi => self.algorithm.keyword().to_owned(),
            Algorithm::Iterate => {
                let LoopIteration { method, tolerance, passes } = self.iteration;
                let method = format!("{method:?}").to_lowercase().replace("fixedpoint", "fixed_point");
                format!("iterate by {method}, up to {passes} passes, tolerance {tolerance:e}")
            }
        }];
        if let Some(StepDivision { control, halves_discarded, .. }) = &self.division {
            parts.extend(control.map(|(estimate, tolerance)| match estimate {
                ErrorEstimate::Richardson => {
                    format!("steps divided to the tolerance {tolerance:e} by repeating them")
                }
                ErrorEstimate::Energy => {
                    format!("steps divided to the tolerance {tolerance:e} by the energy of bonds")
                }
            }));
            parts.extend(halves_discarded.then(|| "discarded steps halved".to_owned()));
        }
        parts.join(", ")
    }
}
