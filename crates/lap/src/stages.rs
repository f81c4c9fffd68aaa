//! States an optimal control problem of stages: a sum of costs, with equations between neighbours, as collocation makes it.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{SMatrix, SVector};

/// Equations within a stage.
pub const EQUATIONS: usize = 5;
/// Inequalities within a stage, besides the bounds of its unknowns.
pub const INEQUALITIES: usize = 3;

/// The unknowns of a stage, of which the first are its states.
pub type StageVector<const V: usize> = SVector<f64, V>;

/// Values of the functions of a stage with S states.
#[derive(Clone, Copy, Debug)]
pub struct StageValues<const S: usize> {
    /// Cost.
    pub cost: f64,
    /// Derivatives of the states by the way.
    pub slopes: SVector<f64, S>,
    /// What has to be 0.
    pub equations: SVector<f64, EQUATIONS>,
    /// What has to be at most 0.
    pub inequalities: SVector<f64, INEQUALITIES>,
}

/// The functions of a stage of V unknowns, S of them states, to second order.
#[derive(Clone, Debug)]
pub struct StageModel<const V: usize, const S: usize> {
    /// Values.
    pub values: StageValues<S>,
    /// Gradient of the cost.
    pub gradient: StageVector<V>,
    /// Gradients of the slopes, one in each row.
    pub slopes: SMatrix<f64, S, V>,
    /// Gradients of the equations, one in each row.
    pub equations: SMatrix<f64, EQUATIONS, V>,
    /// Gradients of the inequalities, one in each row.
    pub inequalities: SMatrix<f64, INEQUALITIES, V>,
    /// Second derivatives of the cost and the weighted sum of the other functions.
    pub hessian: SMatrix<f64, V, V>,
}

/// What the functions of a stage weigh in the Lagrangian beside the cost.
#[derive(Clone, Copy, Debug)]
pub struct StageWeights<const S: usize> {
    /// Weights of the slopes.
    pub slopes: SVector<f64, S>,
    /// Weights of the equations.
    pub equations: SVector<f64, EQUATIONS>,
    /// Weights of the inequalities.
    pub inequalities: SVector<f64, INEQUALITIES>,
}

/// Bounds of the unknowns of a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageBounds<const V: usize> {
    /// Each below its upper one.
    pub lower: StageVector<V>,
    /// Each above its lower one.
    pub upper: StageVector<V>,
}

/// Stages at equal distances, closed or with ends. Collocation by trapezoids asks that the defects between neighbours
/// are 0: x_{k+1} − x_k − h (f_k + f_{k+1}) / 2.
pub trait StagedProblem<const V: usize, const S: usize>: Sync {
    /// Number of stages, three at least.
    fn stages(&self) -> usize;
    /// Whether the last stage has the first one for its neighbour.
    fn is_closed(&self) -> bool;
    /// Distance h of two stages.
    fn step(&self) -> f64;
    /// Bounds at a stage.
    fn bounds(&self, stage: usize) -> StageBounds<V>;
    /// The functions of a stage.
    fn values(&self, x: &StageVector<V>, stage: usize) -> StageValues<S>;
    /// The same to second order, with these weights.
    fn model(&self, x: &StageVector<V>, stage: usize, weights: &StageWeights<S>) -> StageModel<V, S>;

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
