//! Solves the loops of the initialisation, in which values go round without a step in between.

use diagnostics::{Error, rounded_time};

use super::solver::LoopEquationSolver;
use crate::exchange::{Exchange, GuessedInput, TearValue};
use crate::system::{LoopIteration, NodeBlock, System, TearConnection};

/// Passes after the first one that fits [-].
const POLISH: u32 = 4;

/// The loops of the initialisation.
#[derive(Debug, Default)]
pub(super) struct InitialLoops {
    blocks: Vec<NodeBlock>,
    iteration: LoopIteration,
    /// Whether a loop without a solution is an error; else it is told.
    strict: bool,
}

impl InitialLoops {
    pub fn new(system: &System) -> Self {
        let plan = &system.coupling;
        let strict = plan.algorithm.properties().solves_loops;
        InitialLoops { blocks: plan.initial.clone(), iteration: plan.iteration, strict }
    }

    /// Lets the values of the first communication point settle.
    ///
    /// # Errors
    /// With the node, when one fails, or shows a value that is no number.
    pub fn solve_initial_loops(&self, exchange: &mut Exchange) -> Result<(), Error> {
        exchange.initialise(&mut |exchange| {
            let mut solved = Vec::new();
            for block in &self.blocks {
                let values = self.solve_loop(exchange, block)?;
                let tears = block.tears.iter().zip(values);
                solved.extend(tears.map(|(tear, value)| TearValue { tear: *tear, value }));
            }
            Ok(solved)
        })
    }

    /// The values of the connections that lead back; none if there is no solution.
    fn solve_loop(&self, exchange: &mut Exchange, block: &NodeBlock) -> Result<Vec<f64>, Error> {
        let tears = &block.tears;
        let mut guess: Vec<_> = tears.iter().map(|tear| exchange.input_value(*tear)).collect();
        let is_continuous: Vec<_> = tears.iter().map(|tear| exchange.is_real_input(*tear)).collect();
        let mut solver = LoopEquationSolver::new(self.iteration, is_continuous);
        let (mut found, mut worst) = (Vec::new(), 0);
        // What fits, how well, and how many passes more to make it fit better: a later step has no second chance.
        let mut best: Option<(Vec<f64>, f64)> = None;
        let mut more = POLISH;
        for pass in 1..=self.iteration.passes {
            evaluate_loop_once(exchange, block, &guess, &mut found)?;
            match solver.worst_misfit_index(&guess, &found) {
                None if solver.is_near(&guess, &found) => {
                    let distance = max_relative_difference(&guess, &found);
                    if best.as_ref().is_some_and(|(_, least)| *least <= distance) {
                        break;
                    }
                    best = Some((guess.clone(), distance));
                    more -= 1;
                    if distance == 0.0 || more == 0 {
                        break;
                    }
                }
                misfit => worst = misfit.unwrap_or(worst),
            }
            if pass == self.iteration.passes {
                break;
            }
            if solver.needs_jacobian() {
                let columns = finite_difference_jacobian(exchange, block, &solver, &guess, &found)?;
                solver.set_jacobian(&columns);
            }
            solver.improve_guess(&mut guess, &found);
        }
        match best {
            Some((values, _)) => Ok(values),
            None => self.report_unsolved_loop(exchange, tears[worst], guess[worst], found[worst]),
        }
    }

    fn report_unsolved_loop(
        &self,
        exchange: &mut Exchange,
        tear: TearConnection,
        has: f64,
        gets: f64,
    ) -> Result<Vec<f64>, Error> {
        let message = format!(
            "the values of the first communication point do not fit after {} passes: `{}` has {} and would get {}",
            self.iteration.passes,
            exchange.input_name(tear),
            rounded_time(has),
            rounded_time(gets)
        );
        match self.strict {
            true => Err(Error::invalid_input(message).with_help(
                "give the inputs of the loop start values that are closer, or more `passes` or another `method` in [coupling] iteration",
            )),
            false => {
                exchange.add_notice(message);
                Ok(Vec::new())
            }
        }
    }
}

/// The largest difference between what values are and what they would be, relative to their size [-].
fn max_relative_difference(guess: &[f64], found: &[f64]) -> f64 {
    let each = guess.iter().zip(found).map(|(a, b)| match a == b {
        true => 0.0,
        false => (a - b).abs() / a.abs().max(b.abs()),
    });
    each.fold(0.0, f64::max)
}

/// The derivatives of what a loop gives by each guessed value, by columns.
fn finite_difference_jacobian(
    exchange: &mut Exchange,
    block: &NodeBlock,
    solver: &LoopEquationSolver,
    guess: &[f64],
    found: &[f64],
) -> Result<Vec<Vec<f64>>, Error> {
    let mut columns = Vec::with_capacity(guess.len());
    for place in 0..guess.len() {
        let (mut other, mut changed) = (guess.to_vec(), Vec::new());
        other[place] += solver.perturbation(place, guess[place]);
        evaluate_loop_once(exchange, block, &other, &mut changed)?;
        let by = other[place] - guess[place];
        columns.push(changed.iter().zip(found).map(|(a, b)| (a - b) / by).collect());
    }
    Ok(columns)
}

/// Hands the guessed values through the loop once.
fn evaluate_loop_once(
    exchange: &mut Exchange,
    block: &NodeBlock,
    guess: &[f64],
    found: &mut Vec<f64>,
) -> Result<(), Error> {
    for &node in &block.nodes {
        let own = block.tears.iter().zip(guess).filter(|(tear, _)| tear.node == node);
        let own: Vec<_> =
            own.map(|(tear, value)| GuessedInput { place: tear.place, value: *value }).collect();
        exchange.exchange_initial_values(node, &own)?;
    }
    found.clear();
    found.extend(block.tears.iter().map(|tear| exchange.source_value_in_input_unit(*tear)));
    Ok(())
}
