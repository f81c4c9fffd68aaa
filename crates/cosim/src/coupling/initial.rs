//! Solves the loops of the initialisation, in which values go round without a step in between.

use diagnostics::{Error, rounded};
use scenario::plan::{Block, System};
use scenario::words::Iteration;

use super::solver::Solver;
use crate::exchange::Exchange;

/// The loops of the initialisation.
#[derive(Debug, Default)]
pub(super) struct Initial {
    blocks: Vec<Block>,
    iteration: Iteration,
    /// Whether a loop without a solution is an error; else it is told.
    strict: bool,
}

impl Initial {
    pub fn new(system: &System) -> Self {
        let plan = &system.coupling;
        let strict = plan.algorithm.rules().solves_loops;
        Initial { blocks: plan.initial.clone(), iteration: plan.iteration, strict }
    }

    /// Lets the values of the first communication point settle.
    ///
    /// # Errors
    /// With the node, when one fails, or shows a value that is no number.
    pub fn run(&self, exchange: &mut Exchange) -> Result<(), Error> {
        exchange.initialise(&mut |exchange| {
            self.blocks.iter().try_for_each(|block| self.solve(exchange, block))
        })
    }

    fn solve(&self, exchange: &mut Exchange, block: &Block) -> Result<(), Error> {
        let tears = &block.tears;
        let mut guess: Vec<_> = tears.iter().map(|tear| exchange.taken(*tear)).collect();
        let smooth: Vec<_> = tears.iter().map(|tear| exchange.is_continuous(*tear)).collect();
        let mut solver = Solver::new(self.iteration, smooth);
        let (mut found, mut worst) = (Vec::new(), 0);
        for _ in 0..self.iteration.passes {
            sweep(exchange, block, &guess, &mut found)?;
            match solver.misfit(&guess, &found) {
                None => return Ok(()),
                Some(place) => worst = place,
            }
            if solver.wants_derivatives() {
                let mut jacobian = Vec::with_capacity(guess.len());
                for place in 0..guess.len() {
                    let (mut other, mut changed) = (guess.clone(), Vec::new());
                    other[place] += solver.nudge(place, guess[place]);
                    sweep(exchange, block, &other, &mut changed)?;
                    let by = other[place] - guess[place];
                    jacobian.push(changed.iter().zip(&found).map(|(a, b)| (a - b) / by).collect());
                }
                solver.derivatives(&jacobian);
            }
            solver.advance(&mut guess, &found);
        }
        let tear = tears[worst];
        let message = format!(
            "the values of the first communication point do not fit after {} passes: `{}` has {} and would get {}",
            self.iteration.passes,
            exchange.input_name(tear),
            rounded(guess[worst]),
            rounded(found[worst])
        );
        match self.strict {
            true => Err(Error::input(message).help(
                "give the inputs of the loop start values that are closer, or more `passes` or another `method` in [coupling] iteration",
            )),
            false => {
                exchange.notice(message);
                Ok(())
            }
        }
    }
}

/// Hands the guessed values through the loop once.
fn sweep(
    exchange: &mut Exchange,
    block: &Block,
    guess: &[f64],
    found: &mut Vec<f64>,
) -> Result<(), Error> {
    for &node in &block.nodes {
        let own = block.tears.iter().zip(guess).filter(|(tear, _)| tear.node == node);
        let own: Vec<_> = own.map(|(tear, value)| (tear.place, *value)).collect();
        exchange.visit_initially(node, &own)?;
    }
    found.clear();
    found.extend(block.tears.iter().map(|tear| exchange.given_initially(*tear)));
    Ok(())
}
