//! Solves the linear systems of Newton's method for stages: block by block along the chain, with the signs of its eigenvalues.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{SMatrix, SVector};

use crate::ldlt::SymmetricFactors;
use crate::stages::{EQUATIONS, STATES, StageModel, StageVector, StagedProblem, VARIABLES};

/// Unknowns and multipliers of a stage: its unknowns, those of its equations, those of its defects against the stage behind.
pub const BLOCK: usize = VARIABLES + EQUATIONS + STATES;
/// Row where the multipliers of the defects begin.
pub const DEFECTS: usize = VARIABLES + EQUATIONS;

/// Keeps the blocks regular where equations depend on one another.
const EQUATION_DAMPING: f64 = 1e-10;

/// A right side, or a solution.
pub type BlockVector = SVector<f64, BLOCK>;
type Block = SMatrix<f64, BLOCK, BLOCK>;
type DefectJacobian = SMatrix<f64, STATES, VARIABLES>;
/// Rows of the defects between the last stage and the first, as far as they reach into a stage.
type ClosingRows = SMatrix<f64, STATES, BLOCK>;

/// The factors of the symmetric system [W Jᵀ; J −ε]. Its blocks form a chain, which is eliminated from its first stage on; the last one
/// borders all others, as a closed chain couples it with the first.
pub struct NewtonFactors {
    stages: Vec<SymmetricFactors<BLOCK>>,
    /// What couples each stage but the last two with the last one: rows of its defects.
    closing: Vec<ClosingRows>,
    /// What couples the stage before the last one with it: rows of the last.
    to_last: Block,
    last: SymmetricFactors<BLOCK>,
    /// Derivatives of the defects by the unknowns of the stage behind.
    defect_jacobians: Vec<DefectJacobian>,
    negative_eigenvalues: usize,
}

impl NewtonFactors {
    /// Factors the system with these Hessians, to whose diagonals `damping` is added; `None` where a block is singular.
    pub fn new(
        problem: &impl StagedProblem,
        models: &[StageModel],
        hessians: &[SMatrix<f64, VARIABLES, VARIABLES>],
        damping: f64,
    ) -> Option<Self> {
        let count = models.len();
        let half = 0.5 * problem.step();
        let block = |k: usize| {
            let factor = if problem.has_defect(k) { Some(-half) } else { None };
            stage_block(&models[k], &hessians[k], factor, damping)
        };
        let defect_jacobians: Vec<DefectJacobian> =
            models.iter().map(|it| unit_states() - it.slopes * half).collect();
        let mut stages = Vec::with_capacity(count - 1);
        let mut closing = Vec::with_capacity(count - 1);
        let (mut last, mut current) = (block(count - 1), block(0));
        let mut rows = ClosingRows::zeros();
        if problem.is_closed() {
            rows.fixed_view_mut::<STATES, VARIABLES>(0, 0).copy_from(&defect_jacobians[0]);
        }
        let mut unit_defects = ClosingRows::zeros();
        unit_defects.fixed_view_mut::<STATES, STATES>(0, DEFECTS).copy_from(&SMatrix::identity());
        let mut negative_eigenvalues = 0;
        for k in 0..count - 2 {
            let factors = SymmetricFactors::new(&current)?;
            negative_eigenvalues += factors.negative_eigenvalues();
            let (across, behind) = (factors.half_solution(&rows), factors.half_solution(&unit_defects));
            let mut among_defects = last.fixed_view_mut::<STATES, STATES>(DEFECTS, DEFECTS);
            among_defects -= across.inverse_form(&across);
            closing.push(rows);
            let next = &defect_jacobians[k + 1];
            current = block(k + 1);
            let mut view = current.fixed_view_mut::<VARIABLES, VARIABLES>(0, 0);
            view -= next.transpose() * behind.inverse_form(&behind) * next;
            let coupling = across.inverse_form(&behind) * next;
            rows = ClosingRows::zeros();
            rows.fixed_view_mut::<STATES, VARIABLES>(0, 0).copy_from(&-coupling);
            stages.push(factors);
        }
        let mut to_last = Block::zeros();
        to_last.fixed_view_mut::<STATES, BLOCK>(DEFECTS, 0).copy_from(&rows);
        let mut view = to_last.fixed_view_mut::<VARIABLES, STATES>(0, DEFECTS);
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
        self.negative_eigenvalues == (EQUATIONS + STATES) * (self.stages.len() + 1)
    }

    /// Solves the system for one right side.
    pub fn solve(&self, right: &[BlockVector]) -> Vec<BlockVector> {
        let end = right.len() - 1;
        let mut b = right.to_vec();
        for k in 0..end - 1 {
            let solved = self.stages[k].solve(&b[k]);
            let mut rows = b[end].fixed_rows_mut::<STATES>(DEFECTS);
            rows -= self.closing[k] * solved;
            let defects = solved.fixed_rows::<STATES>(DEFECTS).into_owned();
            let mut rows = b[k + 1].fixed_rows_mut::<VARIABLES>(0);
            rows -= self.defect_jacobians[k + 1].transpose() * defects;
        }
        let solved = self.stages[end - 1].solve(&b[end - 1]);
        b[end] -= self.to_last * solved;
        let mut x = vec![BlockVector::zeros(); right.len()];
        x[end] = self.last.solve(&b[end]);
        x[end - 1] = self.stages[end - 1].solve(&(b[end - 1] - self.to_last.transpose() * x[end]));
        let closing_multipliers = x[end].fixed_rows::<STATES>(DEFECTS).into_owned();
        for k in (0..end - 1).rev() {
            let mut rest = b[k] - self.closing[k].transpose() * closing_multipliers;
            let behind: StageVector = x[k + 1].fixed_rows::<VARIABLES>(0).into_owned();
            let mut rows = rest.fixed_rows_mut::<STATES>(DEFECTS);
            rows -= self.defect_jacobians[k + 1] * behind;
            x[k] = self.stages[k].solve(&rest);
        }
        x
    }
}

/// The block of a stage. A stage without one behind it has multipliers of 0 for its defects.
fn stage_block(
    model: &StageModel,
    hessian: &SMatrix<f64, VARIABLES, VARIABLES>,
    minus_half_step: Option<f64>,
    damping: f64,
) -> Block {
    let mut block = Block::zeros();
    block.fixed_view_mut::<VARIABLES, VARIABLES>(0, 0).copy_from(hessian);
    for i in 0..VARIABLES {
        block[(i, i)] += damping;
    }
    block.fixed_view_mut::<EQUATIONS, VARIABLES>(VARIABLES, 0).copy_from(&model.equations);
    block.fixed_view_mut::<VARIABLES, EQUATIONS>(0, VARIABLES).copy_from(&model.equations.transpose());
    if let Some(factor) = minus_half_step {
        let gradient = model.slopes * factor - unit_states();
        block.fixed_view_mut::<STATES, VARIABLES>(DEFECTS, 0).copy_from(&gradient);
        block.fixed_view_mut::<VARIABLES, STATES>(0, DEFECTS).copy_from(&gradient.transpose());
    }
    for i in VARIABLES..BLOCK {
        block[(i, i)] = if i < DEFECTS || minus_half_step.is_some() { -EQUATION_DAMPING } else { -1.0 };
    }
    block
}

/// The states of a stage as a function of its unknowns.
fn unit_states() -> DefectJacobian {
    DefectJacobian::identity()
}
