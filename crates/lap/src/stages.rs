//! States an optimal control problem of stages: a sum of costs, with equations between neighbours, as collocation makes it.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{SMatrix, SVector};

/// Unknowns of a stage; the first of them are its states.
pub const VARIABLES: usize = 12;
/// States of a stage.
pub const STATES: usize = 7;
/// Equations within a stage.
pub const EQUATIONS: usize = 3;
/// Inequalities within a stage, besides the bounds of its unknowns.
pub const INEQUALITIES: usize = 3;

/// Functions of a stage: cost, slopes, equations, inequalities.
pub const FUNCTIONS: usize = 1 + STATES + EQUATIONS + INEQUALITIES;

/// The unknowns of a stage.
pub type StageVector = SVector<f64, VARIABLES>;

/// Values of the functions of a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageValues {
    /// Cost.
    pub cost: f64,
    /// Derivatives of the states by the way.
    pub slopes: SVector<f64, STATES>,
    /// What has to be 0.
    pub equations: SVector<f64, EQUATIONS>,
    /// What has to be at most 0.
    pub inequalities: SVector<f64, INEQUALITIES>,
}

/// The functions of a stage to second order.
#[derive(Clone, Debug)]
pub struct StageModel {
    /// Values.
    pub values: StageValues,
    /// Gradient of the cost.
    pub gradient: StageVector,
    /// Gradients of the slopes, one in each row.
    pub slopes: SMatrix<f64, STATES, VARIABLES>,
    /// Gradients of the equations, one in each row.
    pub equations: SMatrix<f64, EQUATIONS, VARIABLES>,
    /// Gradients of the inequalities, one in each row.
    pub inequalities: SMatrix<f64, INEQUALITIES, VARIABLES>,
    /// Second derivatives of the weighted sum of all functions.
    pub hessian: SMatrix<f64, VARIABLES, VARIABLES>,
}

/// Bounds of the unknowns of a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageBounds {
    /// Each below its upper one.
    pub lower: StageVector,
    /// Each above its lower one.
    pub upper: StageVector,
}

/// Stages at equal distances, closed or with ends. Collocation by trapezoids asks that the defects between neighbours
/// are 0: x_{k+1} − x_k − h (f_k + f_{k+1}) / 2.
pub trait StagedProblem: Sync {
    /// Number of stages, three at least.
    fn stages(&self) -> usize;
    /// Whether the last stage has the first one for its neighbour.
    fn is_closed(&self) -> bool;
    /// Distance h of two stages.
    fn step(&self) -> f64;
    /// Bounds at a stage.
    fn bounds(&self, stage: usize) -> StageBounds;
    /// The functions of a stage.
    fn values(&self, x: &StageVector, stage: usize) -> StageValues;
    /// The same to second order, with the weights that the functions have together.
    fn model(&self, x: &StageVector, stage: usize, weights: &[f64; FUNCTIONS]) -> StageModel;

    /// The stage behind another one.
    fn next(&self, stage: usize) -> usize {
        (stage + 1) % self.stages()
    }

    /// The stage before another one.
    fn previous(&self, stage: usize) -> usize {
        (stage + self.stages() - 1) % self.stages()
    }

    /// Whether a stage has defects, against the one behind it.
    fn has_defect(&self, stage: usize) -> bool {
        self.is_closed() || stage + 1 < self.stages()
    }
}
