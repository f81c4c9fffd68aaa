//! Iterated coupling: the nodes of a loop repeat a step until it fits, all others step once.

use diagnostics::Error;

use super::initial::InitialLoops;
use super::loop_solver::{LoopSolver, LoopSolverState};
use super::summary::CouplingSummary;
use super::{CouplingAlgorithm, invalid_state_error};
use crate::exchange::{Exchange, StepInterruption, check_failures, quoted_node_names};
use crate::system::{AcceptedValues, System, TearConnection};

/// Steps the blocks of the system one after the other.
pub(super) struct IteratedCoupling {
    initial: InitialLoops,
    blocks: Vec<BlockStep>,
}

enum BlockStep {
    Node(usize),
    Loop(Box<LoopSolver>),
}

impl IteratedCoupling {
    pub fn new(system: &System, initial: InitialLoops) -> Self {
        let part = |block: &crate::system::NodeBlock| {
            let link = |tear: &TearConnection| &system.nodes[tear.node].connections[tear.place];
            let is_continuous =
                |tear: &TearConnection| matches!(link(tear).input_chain.accepts, AcceptedValues::Real);
            let name = |tear: &TearConnection| {
                let input = system.nodes[tear.node].inputs.nth_index(tear.place);
                input.map(|input| system.columns[input].qualified_name()).unwrap_or_default()
            };
            match (block.nodes.as_slice(), block.tears.is_empty()) {
                (nodes, true) => nodes.iter().map(|node| BlockStep::Node(*node)).collect::<Vec<_>>(),
                _ => {
                    let is_continuous = block.tears.iter().map(is_continuous).collect();
                    let names = block.tears.iter().map(name).collect();
                    let iteration = system.coupling.iteration;
                    vec![BlockStep::Loop(Box::new(LoopSolver::new(
                        block.clone(),
                        iteration,
                        is_continuous,
                        names,
                    )))]
                }
            }
        };
        IteratedCoupling { initial, blocks: system.coupling.blocks.iter().flat_map(part).collect() }
    }

    fn loop_solvers(&self) -> impl Iterator<Item = &LoopSolver> {
        self.blocks.iter().filter_map(|part| match part {
            BlockStep::Loop(it) => Some(it.as_ref()),
            BlockStep::Node(_) => None,
        })
    }
}

impl CouplingAlgorithm for IteratedCoupling {
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        for it in self.loop_solvers() {
            let stuck = it.nodes_without_rollback(exchange);
            if !stuck.is_empty() {
                let message = format!(
                    "the coupling `iterate` repeats the steps of the loop of `{}`, but {} cannot go back to the start of a step (canGetAndSetFMUstate)",
                    it.summary.inputs.join("`, `"),
                    quoted_node_names(exchange, &stuck)
                );
                return Err(Error::invalid_input(message).with_help(
                    "break the loop with `at = \"start\"` on one of its connections, or choose the coupling `gauss_seidel` with a shorter step",
                ));
            }
            check_failures(exchange, it.loop_nodes())?;
        }
        self.initial.solve_initial_loops(exchange)
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        for part in &mut self.blocks {
            match part {
                BlockStep::Loop(it) => it.solve_step(exchange)?,
                BlockStep::Node(node) => {
                    exchange.gather_inputs(*node)?;
                    exchange.step_node(*node)?;
                }
            }
        }
        Ok(())
    }

    fn coupling_summary(&self) -> CouplingSummary {
        CouplingSummary { loops: self.loop_solvers().map(|it| it.summary.clone()).collect(), division: None }
    }

    fn state_to_bytes(&self) -> Vec<u8> {
        let kept: Vec<_> = self.loop_solvers().map(LoopSolver::state).collect();
        // Vectors of numbers always have bytes.
        postcard::to_stdvec(&kept).unwrap_or_default()
    }

    fn restore_from_bytes(&mut self, memory: &[u8]) -> Result<(), Error> {
        let kept: Vec<LoopSolverState> = postcard::from_bytes(memory).map_err(invalid_state_error)?;
        let loops = self.blocks.iter_mut().filter_map(|part| match part {
            BlockStep::Loop(it) => Some(it),
            BlockStep::Node(_) => None,
        });
        let (mut loops, mut kept) = (loops, kept.into_iter());
        let recalled = loops.all(|it| kept.next().is_some_and(|kept| it.restore_state(kept)));
        match recalled && kept.next().is_none() {
            true => Ok(()),
            false => Err(Error::invalid_input("the memory of the coupling is that of other loops")),
        }
    }
}
