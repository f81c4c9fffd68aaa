//! Solves the linear systems of Newton's method for stages: block by block along the chain, with the signs of its eigenvalues.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{SMatrix, SVector};

use crate::ldlt::SymmetricFactors;
use crate::stages::{EQUATIONS, StageModel, StageVector, StagedProblem};

/// Keeps the blocks regular where equations depend on one another.
const EQUATION_DAMPING: f64 = 1e-10;

/// A right side, or a solution.
pub type BlockVector<const B: usize> = SVector<f64, B>;
type Block<const B: usize> = SMatrix<f64, B, B>;
type DefectJacobian<const V: usize, const S: usize> = SMatrix<f64, S, V>;
/// Rows of the defects between the last stage and the first, as far as they reach into a stage.
type ClosingRows<const S: usize, const B: usize> = SMatrix<f64, S, B>;

/// The factors of the symmetric system [W Jᵀ; J −ε]. Its blocks form a chain, which is eliminated from its first stage on; the last one
/// borders all others, as a closed chain couples it with the first.
///
/// A block has the V unknowns of a stage, the multipliers of its equations, and those of its S defects against the stage behind: B rows.
pub struct NewtonFactors<const V: usize, const S: usize, const B: usize> {
    stages: Vec<SymmetricFactors<B>>,
    /// What couples each stage but the last two with the last one: rows of its defects.
    closing: Vec<ClosingRows<S, B>>,
    /// What couples the stage before the last one with it: rows of the last.
    to_last: Block<B>,
    last: SymmetricFactors<B>,
    /// Derivatives of the defects by the unknowns of the stage behind.
    defect_jacobians: Vec<DefectJacobian<V, S>>,
    negative_eigenvalues: usize,
}

impl<const V: usize, const S: usize, const B: usize> NewtonFactors<V, S, B> {
    /// Row where the multipliers of the defects begin.
    pub const DEFECTS: usize = {
        assert!(B == V + EQUATIONS + S);
        V + EQUATIONS
    };

    /// Factors the system with these Hessians, to whose diagonals `damping` is added; `None` where a block is singular.
    pub fn new(
        problem: &impl StagedProblem<V, S>,
        models: &[StageModel<V, S>],
        hessians: &[SMatrix<f64, V, V>],
        damping: f64,
    ) -> Option<Self> {
        let count = models.len();
        let half = 0.5 * problem.step();
        let block = |k: usize| {
            let factor = if problem.has_defect(k) { Some(-half) } else { None };
            stage_block::<V, S, B>(&models[k], &hessians[k], factor, damping)
        };
        let defect_jacobians: Vec<DefectJacobian<V, S>> =
            models.iter().map(|it| unit_states() - it.slopes * half).collect();
        let mut stages = Vec::with_capacity(count - 1);
        let mut closing = Vec::with_capacity(count - 1);
        let (mut last, mut current) = (block(count - 1), block(0));
        let mut rows = ClosingRows::<S, B>::zeros();
        if problem.is_closed() {
            rows.fixed_view_mut::<S, V>(0, 0).copy_from(&defect_jacobians[0]);
        }
        let mut unit_defects = ClosingRows::<S, B>::zeros();
        unit_defects.fixed_view_mut::<S, S>(0, Self::DEFECTS).copy_from(&SMatrix::identity());
        let mut negative_eigenvalues = 0;
        for k in 0..count - 2 {
            let factors = SymmetricFactors::new(&current)?;
            negative_eigenvalues += factors.negative_eigenvalues();
            let (across, behind) = (factors.half_solution(&rows), factors.half_solution(&unit_defects));
            let mut among_defects = last.fixed_view_mut::<S, S>(Self::DEFECTS, Self::DEFECTS);
            among_defects -= across.inverse_form(&across);
            closing.push(rows);
            let next = &defect_jacobians[k + 1];
            current = block(k + 1);
            let mut view = current.fixed_view_mut::<V, V>(0, 0);
            view -= next.transpose() * behind.inverse_form(&behind) * next;
            let coupling = across.inverse_form(&behind) * next;
            rows = ClosingRows::<S, B>::zeros();
            rows.fixed_view_mut::<S, V>(0, 0).copy_from(&-coupling);
            stages.push(factors);
        }
        let mut to_last = Block::<B>::zeros();
        to_last.fixed_view_mut::<S, B>(Self::DEFECTS, 0).copy_from(&rows);
        let mut view = to_last.fixed_view_mut::<V, S>(0, Self::DEFECTS);
        view += defect_jacobians[count - 1].transpose();
        let factors = SymmetricFactors::new(&current)?;
        negative_eigenvalues += factors.negative_eigenvalues();
        let half = factors.half_solution(&to_last);
        last -= half.inverse_form(&half);
        stages.push(factors);
        let last = SymmetricFactors::new(&last)?;
        negative_eigenvalues += last.negative_eigenvalues();
        Some(NewtonFactors { stages, closing, to_last, last, defect_jacobians, negative_eigenvalues })
    }

    /// Whether the Hessian is positive definite where the equations hold: as many negative eigenvalues as equations.
    pub fn has_right_inertia(&self) -> bool {
        self.negative_eigenvalues == (EQUATIONS + S) * (self.stages.len() + 1)
    }

    /// Solves the system for one right side.
    pub fn solve(&self, right: &[BlockVector<B>]) -> Vec<BlockVector<B>> {
        let end = right.len() - 1;
        let mut b = right.to_vec();
        for k in 0..end - 1 {
            let solved = self.stages[k].solve(&b[k]);
            let mut rows = b[end].fixed_rows_mut::<S>(Self::DEFECTS);
            rows -= self.closing[k] * solved;
            let defects = solved.fixed_rows::<S>(Self::DEFECTS).into_owned();
            let mut rows = b[k + 1].fixed_rows_mut::<V>(0);
            rows -= self.defect_jacobians[k + 1].transpose() * defects;
        }
        let solved = self.stages[end - 1].solve(&b[end - 1]);
        b[end] -= self.to_last * solved;
        let mut x = vec![BlockVector::<B>::zeros(); right.len()];
        x[end] = self.last.solve(&b[end]);
        x[end - 1] = self.stages[end - 1].solve(&(b[end - 1] - self.to_last.transpose() * x[end]));
        let closing_multipliers = x[end].fixed_rows::<S>(Self::DEFECTS).into_owned();
        for k in (0..end - 1).rev() {
            let mut rest = b[k] - self.closing[k].transpose() * closing_multipliers;
            let behind: StageVector<V> = x[k + 1].fixed_rows::<V>(0).into_owned();
            let mut rows = rest.fixed_rows_mut::<S>(Self::DEFECTS);
            rows -= self.defect_jacobians[k + 1] * behind;
            x[k] = self.stages[k].solve(&rest);
        }
        x
    }
}

/// The block of a stage. A stage without one behind it has multipliers of 0 for its defects.
fn stage_block<const V: usize, const S: usize, const B: usize>(
    model: &StageModel<V, S>,
    hessian: &SMatrix<f64, V, V>,
    minus_half_step: Option<f64>,
    damping: f64,
) -> Block<B> {
    let defects = V + EQUATIONS;
    let mut block = Block::<B>::zeros();
    block.fixed_view_mut::<V, V>(0, 0).copy_from(hessian);
    for i in 0..V {
        block[(i, i)] += damping;
    }
    block.fixed_view_mut::<EQUATIONS, V>(V, 0).copy_from(&model.equations);
    block.fixed_view_mut::<V, EQUATIONS>(0, V).copy_from(&model.equations.transpose());
    if let Some(factor) = minus_half_step {
        let gradient = model.slopes * factor - unit_states();
        block.fixed_view_mut::<S, V>(defects, 0).copy_from(&gradient);
        block.fixed_view_mut::<V, S>(0, defects).copy_from(&gradient.transpose());
    }
    for i in V..B {
        block[(i, i)] = if i < defects || minus_half_step.is_some() { -EQUATION_DAMPING } else { -1.0 };
    }
    block
}

/// The states of a stage as a function of its unknowns.
fn unit_states<const V: usize, const S: usize>() -> DefectJacobian<V, S> {
    DefectJacobian::<V, S>::identity()
}
