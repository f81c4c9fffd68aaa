//! Iterated coupling: the nodes of a loop repeat a step until it fits, all others step once.

use diagnostics::Error;

use super::initial::InitialLoops;
use super::loop_solver::{LoopMemory, LoopSolver};
use super::summary::CouplingSummary;
use super::{Coupling, postcard_error};
use crate::exchange::{Exchange, Interruption, check_failures, lacking};
use crate::system::{AcceptedValues, System, Tear};

/// Steps the blocks of the system one after the other.
pub(super) struct Iterate {
    initial: InitialLoops,
    blocks: Vec<BlockStep>,
}

enum BlockStep {
    Node(usize),
    Loop(Box<LoopSolver>),
}

impl Iterate {
    pub fn new(system: &System, initial: InitialLoops) -> Self {
        let part = |block: &crate::system::Block| {
            let link = |tear: &Tear| &system.nodes[tear.node].connections[tear.place];
            let is_continuous =
                |tear: &Tear| matches!(link(tear).input_chain.accepts, AcceptedValues::Real);
            let name = |tear: &Tear| {
                let input = system.nodes[tear.node].inputs.index(tear.place);
                input.map(|input| system.columns[input].name()).unwrap_or_default()
            };
            match (block.nodes.as_slice(), block.tears.is_empty()) {
                (nodes, true) => {
                    nodes.iter().map(|node| BlockStep::Node(*node)).collect::<Vec<_>>()
                }
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
        Iterate { initial, blocks: system.coupling.blocks.iter().flat_map(part).collect() }
    }

    fn loops(&self) -> impl Iterator<Item = &LoopSolver> {
        self.blocks.iter().filter_map(|part| match part {
            BlockStep::Loop(it) => Some(it.as_ref()),
            BlockStep::Node(_) => None,
        })
    }
}

impl Coupling for Iterate {
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        for it in self.loops() {
            let stuck = it.cannot_go_back(exchange);
            if !stuck.is_empty() {
                let message = format!(
                    "the coupling `iterate` repeats the steps of the loop of `{}`, but {} cannot go back to the start of a step (canGetAndSetFMUstate)",
                    it.summary.inputs.join("`, `"),
                    lacking(exchange, &stuck)
                );
                return Err(Error::input(message).help(
                    "break the loop with `at = \"start\"` on one of its connections, or choose the coupling `gauss_seidel` with a shorter step",
                ));
            }
            check_failures(exchange, it.nodes())?;
        }
        self.initial.run(exchange)
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        for part in &mut self.blocks {
            match part {
                BlockStep::Loop(it) => it.step(exchange)?,
                BlockStep::Node(node) => {
                    exchange.gather_inputs(*node)?;
                    exchange.step_node(*node)?;
                }
            }
        }
        Ok(())
    }

    fn summary(&self) -> CouplingSummary {
        CouplingSummary {
            loops: self.loops().map(|it| it.summary.clone()).collect(),
            division: None,
        }
    }

    fn memory(&self) -> Vec<u8> {
        let kept: Vec<_> = self.loops().map(LoopSolver::memory).collect();
        // Vectors of numbers always have bytes.
        postcard::to_stdvec(&kept).unwrap_or_default()
    }

    fn recall(&mut self, memory: &[u8]) -> Result<(), Error> {
        let kept: Vec<LoopMemory> = postcard::from_bytes(memory).map_err(postcard_error)?;
        let loops = self.blocks.iter_mut().filter_map(|part| match part {
            BlockStep::Loop(it) => Some(it),
            BlockStep::Node(_) => None,
        });
        let (mut loops, mut kept) = (loops, kept.into_iter());
        let recalled = loops.all(|it| kept.next().is_some_and(|kept| it.recall(kept)));
        match recalled && kept.next().is_none() {
            true => Ok(()),
            false => Err(Error::input("the memory of the coupling is that of other loops")),
        }
    }
}
