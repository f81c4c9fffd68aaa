//! Repeats the step of a loop until what its nodes get fits what they give.

use std::ops::Range;

use diagnostics::rounded_time;
use serde::{Deserialize, Serialize};

use super::solver::LoopEquationSolver;
use super::summary::LoopSummary;
use crate::exchange::{
    Exchange, ExchangeSnapshot, GuessedInput, StepInterruption, unsolved_loop_interruption,
};
use crate::system::{LoopIteration, LoopSolverMethod, NodeBlock};

/// Nodes that get values from each other within a step.
pub(super) struct LoopSolver {
    block: NodeBlock,
    iteration: LoopIteration,
    snapshot: Option<ExchangeSnapshot>,
    /// Whether the nodes give derivatives; not known before they are asked.
    gives_derivatives: Option<bool>,
    memory: LoopSolverState,
    guess: Vec<f64>,
    found: Vec<f64>,
    row: Vec<f64>,
    pub summary: LoopSummary,
}

/// What a loop remembers from one step to the next.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct LoopSolverState {
    solver: LoopEquationSolver,
    /// The change of each guessed input in the last step, per second.
    slopes: Vec<f64>,
}

impl LoopSolver {
    pub fn new(
        block: NodeBlock,
        iteration: LoopIteration,
        is_continuous: Vec<bool>,
        names: Vec<String>,
    ) -> Self {
        let slopes = vec![0.0; block.tears.len()];
        LoopSolver {
            memory: LoopSolverState { solver: LoopEquationSolver::new(iteration, is_continuous), slopes },
            block,
            iteration,
            snapshot: None,
            gives_derivatives: None,
            guess: Vec::new(),
            found: Vec::new(),
            row: Vec::new(),
            summary: LoopSummary { inputs: names, ..LoopSummary::default() },
        }
    }

    pub fn state(&self) -> &LoopSolverState {
        &self.memory
    }

    /// Goes on with what a loop of the same values remembered; whether this is that.
    pub fn restore_state(&mut self, memory: LoopSolverState) -> bool {
        let fits = memory.slopes.len() == self.memory.slopes.len()
            && self.memory.solver.is_compatible_with(&memory.solver);
        if fits {
            self.memory = memory;
            self.memory.solver.begin_step();
        }
        fits
    }

    /// The nodes of it that cannot go back to the start of a step.
    pub fn nodes_without_rollback(&self, exchange: &mut Exchange) -> Vec<usize> {
        exchange.nodes_without_rollback(&self.block.nodes)
    }

    /// Its nodes.
    pub fn loop_nodes(&self) -> &[usize] {
        &self.block.nodes
    }

    /// Does the step.
    ///
    /// # Errors
    /// When a node fails, and when nothing fits after the passes that are allowed.
    pub fn solve_step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        exchange.save_snapshot(&self.block.nodes, &mut self.snapshot)?;
        let span = exchange.step_interval();
        let before = self.block.tears.iter().map(|tear| exchange.input_value_at_step_start(*tear));
        self.guess.clear();
        self.guess
            .extend(before.zip(&self.memory.slopes).map(|(it, slope)| it + slope * (span.end - span.start)));
        self.memory.solver.begin_step();
        let mut worst = 0;
        for pass in 1..=self.iteration.passes {
            self.do_pass(exchange, pass == 1)?;
            match self.memory.solver.worst_misfit_index(&self.guess, &self.found) {
                None if self.memory.solver.is_near(&self.guess, &self.found) => {
                    self.record_converged_step(exchange, pass, &span);
                    return Ok(());
                }
                misfit => worst = misfit.unwrap_or(worst),
            }
            if pass == self.iteration.passes {
                break;
            }
            if self.memory.solver.needs_jacobian() {
                self.update_jacobian(exchange)?;
            }
            self.memory.solver.improve_guess(&mut self.guess, &self.found);
        }
        let name = exchange.input_name(self.block.tears[worst]);
        let (has, gets) = (rounded_time(self.guess[worst]), rounded_time(self.found[worst]));
        let message = format!(
            "the loop of `{}` is not solved at t = {} s after {} passes: `{name}` has {has} and would get {gets}",
            self.summary.inputs.join("`, `"),
            rounded_time(span.start),
            self.iteration.passes,
        );
        Err(unsolved_loop_interruption(message, self.convergence_advice()))
    }

    fn convergence_advice(&self) -> &'static str {
        match self.iteration.method {
            LoopSolverMethod::Newton => {
                "choose a shorter step, or in [coupling] a `tolerance` that divides it, more `passes` or a larger `tolerance` in `iteration`"
            }
            _ => "leave `method` in [coupling] iteration out, which is Newton's, or choose a shorter step",
        }
    }

    /// Steps all nodes with the guess, and notes what they give for it.
    fn do_pass(&mut self, exchange: &mut Exchange, is_first: bool) -> Result<(), StepInterruption> {
        if let Some(snapshot) = self.snapshot.as_ref().filter(|_| !is_first) {
            exchange.restore_snapshot(snapshot)?;
        }
        let LoopSolver { block, guess, found, .. } = self;
        for &node in &block.nodes {
            let own = block.tears.iter().zip(guess.iter()).filter(|(tear, _)| tear.node == node);
            let own: Vec<_> =
                own.map(|(tear, value)| GuessedInput { place: tear.place, value: *value }).collect();
            exchange.gather_guessed_inputs(node, &own)?;
            exchange.step_node(node)?;
        }
        found.clear();
        for tear in &block.tears {
            found.push(exchange.source_value(*tear)?);
        }
        Ok(())
    }

    /// Gives the solver the derivatives at the guess: from the nodes, or by one more pass for each guessed input.
    fn update_jacobian(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        let tears = self.block.tears.clone();
        let mut columns = Vec::with_capacity(tears.len());
        if self.gives_derivatives != Some(false) {
            for tear in &tears {
                let nodes = &self.block.nodes;
                columns.extend(exchange.loop_derivatives(nodes, &tears, *tear, &mut self.row)?);
            }
            self.gives_derivatives = Some(columns.len() == tears.len());
        }
        if columns.len() < tears.len() {
            columns.clear();
            let (guess, found) = (self.guess.clone(), self.found.clone());
            for place in 0..tears.len() {
                self.guess[place] += self.memory.solver.perturbation(place, guess[place]);
                let by = self.guess[place] - guess[place];
                self.do_pass(exchange, false)?;
                self.summary.passes += 1;
                let change = self.found.iter().zip(&found).map(|(a, b)| (a - b) / by);
                columns.push(change.collect::<Vec<_>>());
                self.guess.clone_from(&guess);
            }
            self.found = found;
        }
        self.memory.solver.set_jacobian(&columns);
        Ok(())
    }

    fn record_converged_step(&mut self, exchange: &Exchange, passes: u32, span: &Range<f64>) {
        let ends = self.block.tears.iter().zip(&self.guess);
        for ((tear, end), slope) in ends.zip(&mut self.memory.slopes) {
            *slope = (end - exchange.input_value_at_step_start(*tear)) / (span.end - span.start);
        }
        self.memory.solver.update_scales(&self.guess);
        self.summary.steps += 1;
        self.summary.passes += u64::from(passes);
        if passes > self.summary.most.0 {
            self.summary.most = (passes, span.start);
        }
    }
}
