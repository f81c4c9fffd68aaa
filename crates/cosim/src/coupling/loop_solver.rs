//! Repeats the step of a loop until what its nodes get fits what they give.

use std::ops::Range;

use diagnostics::rounded;
use serde::{Deserialize, Serialize};

use super::solver::Solver;
use super::summary::LoopSummary;
use crate::exchange::{Exchange, GuessedInput, Interruption, Snapshot, unsolved};
use crate::system::{Block, Iteration, Method};

/// Nodes that get values from each other within a step.
pub(super) struct LoopSolver {
    block: Block,
    iteration: Iteration,
    snapshot: Option<Snapshot>,
    /// Whether the nodes give derivatives; not known before they are asked.
    gives_derivatives: Option<bool>,
    memory: LoopMemory,
    guess: Vec<f64>,
    found: Vec<f64>,
    row: Vec<f64>,
    pub summary: LoopSummary,
}

/// What a loop remembers from one step to the next.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct LoopMemory {
    solver: Solver,
    /// The change of each guessed input in the last step, per second.
    slopes: Vec<f64>,
}

impl LoopSolver {
    pub fn new(
        block: Block,
        iteration: Iteration,
        is_continuous: Vec<bool>,
        names: Vec<String>,
    ) -> Self {
        let slopes = vec![0.0; block.tears.len()];
        LoopSolver {
            memory: LoopMemory { solver: Solver::new(iteration, is_continuous), slopes },
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

    pub fn memory(&self) -> &LoopMemory {
        &self.memory
    }

    /// Goes on with what a loop of the same values remembered; whether this is that.
    pub fn recall(&mut self, memory: LoopMemory) -> bool {
        let fits = memory.slopes.len() == self.memory.slopes.len()
            && self.memory.solver.is_alike(&memory.solver);
        if fits {
            self.memory = memory;
            self.memory.solver.begin();
        }
        fits
    }

    /// The nodes of it that cannot go back to the start of a step.
    pub fn cannot_go_back(&self, exchange: &mut Exchange) -> Vec<usize> {
        exchange.cannot_go_back(&self.block.nodes)
    }

    /// Its nodes.
    pub fn nodes(&self) -> &[usize] {
        &self.block.nodes
    }

    /// Does the step.
    ///
    /// # Errors
    /// When a node fails, and when nothing fits after the passes that are allowed.
    pub fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        exchange.save(&self.block.nodes, &mut self.snapshot)?;
        let span = exchange.span();
        let before = self.block.tears.iter().map(|tear| exchange.input_value_before(*tear));
        self.guess.clear();
        self.guess.extend(
            before.zip(&self.memory.slopes).map(|(it, slope)| it + slope * (span.end - span.start)),
        );
        self.memory.solver.begin();
        let mut worst = 0;
        for pass in 1..=self.iteration.passes {
            self.pass(exchange, pass == 1)?;
            match self.memory.solver.misfit(&self.guess, &self.found) {
                None if self.memory.solver.is_near(&self.guess, &self.found) => {
                    self.accept(exchange, pass, &span);
                    return Ok(());
                }
                misfit => worst = misfit.unwrap_or(worst),
            }
            if pass == self.iteration.passes {
                break;
            }
            if self.memory.solver.wants_derivatives() {
                self.update_derivatives(exchange)?;
            }
            self.memory.solver.advance(&mut self.guess, &self.found);
        }
        let name = exchange.input_name(self.block.tears[worst]);
        let (has, gets) = (rounded(self.guess[worst]), rounded(self.found[worst]));
        let message = format!(
            "the loop of `{}` is not solved at t = {} s after {} passes: `{name}` has {has} and would get {gets}",
            self.summary.inputs.join("`, `"),
            rounded(span.start),
            self.iteration.passes,
        );
        Err(unsolved(message, self.advice()))
    }

    fn advice(&self) -> &'static str {
        match self.iteration.method {
            Method::Newton => {
                "choose a shorter step, or in [coupling] a `tolerance` that divides it, more `passes` or a larger `tolerance` in `iteration`"
            }
            _ => {
                "leave `method` in [coupling] iteration out, which is Newton's, or choose a shorter step"
            }
        }
    }

    /// Steps all nodes with the guess, and notes what they give for it.
    fn pass(&mut self, exchange: &mut Exchange, is_first: bool) -> Result<(), Interruption> {
        if let Some(snapshot) = self.snapshot.as_ref().filter(|_| !is_first) {
            exchange.restore(snapshot)?;
        }
        let LoopSolver { block, guess, found, .. } = self;
        for &node in &block.nodes {
            let own = block.tears.iter().zip(guess.iter()).filter(|(tear, _)| tear.node == node);
            let own: Vec<_> = own
                .map(|(tear, value)| GuessedInput { place: tear.place, value: *value })
                .collect();
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
    fn update_derivatives(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        let tears = self.block.tears.clone();
        let mut columns = Vec::with_capacity(tears.len());
        if self.gives_derivatives != Some(false) {
            for tear in &tears {
                let nodes = &self.block.nodes;
                columns.extend(exchange.derivatives(nodes, &tears, *tear, &mut self.row)?);
            }
            self.gives_derivatives = Some(columns.len() == tears.len());
        }
        if columns.len() < tears.len() {
            columns.clear();
            let (guess, found) = (self.guess.clone(), self.found.clone());
            for place in 0..tears.len() {
                self.guess[place] += self.memory.solver.nudge(place, guess[place]);
                let by = self.guess[place] - guess[place];
                self.pass(exchange, false)?;
                self.summary.passes += 1;
                let change = self.found.iter().zip(&found).map(|(a, b)| (a - b) / by);
                columns.push(change.collect::<Vec<_>>());
                self.guess.clone_from(&guess);
            }
            self.found = found;
        }
        self.memory.solver.derivatives(&columns);
        Ok(())
    }

    fn accept(&mut self, exchange: &Exchange, passes: u32, span: &Range<f64>) {
        let ends = self.block.tears.iter().zip(&self.guess);
        for ((tear, end), slope) in ends.zip(&mut self.memory.slopes) {
            *slope = (end - exchange.input_value_before(*tear)) / (span.end - span.start);
        }
        self.memory.solver.accept(&self.guess);
        self.summary.steps += 1;
        self.summary.passes += u64::from(passes);
        if passes > self.summary.most.0 {
            self.summary.most = (passes, span.start);
        }
    }
}
