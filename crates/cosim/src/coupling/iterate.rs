//! Iterated coupling: the nodes of a loop repeat a step until it fits, all others step once.

use diagnostics::Error;

use super::account::Account;
use super::initial::Initial;
use super::looped::{Kept, Loop};
use super::{Coupling, postcard_error};
use crate::exchange::{Exchange, Interruption, check_failures, lacking};
use crate::system::{Accepts, System, Tear};

/// Steps the blocks of the system one after the other.
pub(super) struct Iterate {
    initial: Initial,
    blocks: Vec<Part>,
}

enum Part {
    Node(usize),
    Loop(Box<Loop>),
}

impl Iterate {
    pub fn new(system: &System, initial: Initial) -> Self {
        let part = |block: &crate::system::Block| {
            let link = |tear: &Tear| &system.nodes[tear.node].connections[tear.place];
            let smooth = |tear: &Tear| matches!(link(tear).input_chain.accepts, Accepts::Real);
            let name = |tear: &Tear| {
                let input = system.nodes[tear.node].inputs.index(tear.place);
                input.map(|input| system.columns[input].name()).unwrap_or_default()
            };
            match (block.nodes.as_slice(), block.tears.is_empty()) {
                (nodes, true) => nodes.iter().map(|node| Part::Node(*node)).collect::<Vec<_>>(),
                _ => {
                    let smooth = block.tears.iter().map(smooth).collect();
                    let names = block.tears.iter().map(name).collect();
                    let iteration = system.coupling.iteration;
                    vec![Part::Loop(Box::new(Loop::new(block.clone(), iteration, smooth, names)))]
                }
            }
        };
        Iterate { initial, blocks: system.coupling.blocks.iter().flat_map(part).collect() }
    }

    fn loops(&self) -> impl Iterator<Item = &Loop> {
        self.blocks.iter().filter_map(|part| match part {
            Part::Loop(it) => Some(it.as_ref()),
            Part::Node(_) => None,
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
                    it.account.inputs.join("`, `"),
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
                Part::Loop(it) => it.step(exchange)?,
                Part::Node(node) => {
                    exchange.feed(*node)?;
                    exchange.go(*node)?;
                }
            }
        }
        Ok(())
    }

    fn account(&self) -> Account {
        Account { loops: self.loops().map(|it| it.account.clone()).collect(), division: None }
    }

    fn memory(&self) -> Vec<u8> {
        let kept: Vec<_> = self.loops().map(Loop::kept).collect();
        // Vectors of numbers always have bytes.
        postcard::to_stdvec(&kept).unwrap_or_default()
    }

    fn recall(&mut self, memory: &[u8]) -> Result<(), Error> {
        let kept: Vec<Kept> = postcard::from_bytes(memory).map_err(postcard_error)?;
        let loops = self.blocks.iter_mut().filter_map(|part| match part {
            Part::Loop(it) => Some(it),
            Part::Node(_) => None,
        });
        let (mut loops, mut kept) = (loops, kept.into_iter());
        let recalled = loops.all(|it| kept.next().is_some_and(|kept| it.recall(kept)));
        match recalled && kept.next().is_none() {
            true => Ok(()),
            false => Err(Error::input("the memory of the coupling is that of other loops")),
        }
    }
}
