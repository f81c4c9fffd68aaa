//! Lets nodes in processes of their own step while others do: each begins when its inputs are there, and ends when another node, or the end
//! of the communication step, needs its outputs. All take the values that they take one after the other.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::{Exchange, NodeStepTiming, StepInterruption, set_inputs};
use crate::clock::StepBoundary;
use crate::node::Node;
use crate::system::{NodeBody, NodePlan};

/// The hand-over to a process is little beside steps that take longer than this.
const WORTH_A_PROCESS: Duration = Duration::from_micros(100);

/// What was gained by nodes that stepped at the same time.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ConcurrencySummary {
    /// The nodes.
    pub nodes: Vec<String>,
    /// The time of all their steps, one after the other [s].
    pub step_seconds: f64,
    /// The time from the begin of the first one to the end of the last one, in all communication steps [s].
    pub wall_seconds: f64,
}

/// What is done next in a communication step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ScheduledAction {
    /// A node gets its inputs and begins its step.
    Begin(usize),
    /// The step of a node is awaited, and its outputs are read.
    Finish(usize),
    /// A node of this process steps.
    Step(usize),
}

impl ScheduledAction {
    fn node(self) -> usize {
        let (ScheduledAction::Begin(node) | ScheduledAction::Finish(node) | ScheduledAction::Step(node)) =
            self;
        node
    }
}

/// The nodes that step beside others, and what they gained.
#[derive(Debug, Clone, Default)]
pub(super) struct ConcurrentSteps {
    /// What each communication step is made of; empty where no node steps beside another one.
    schedule: Vec<ScheduledAction>,
    step_time: Duration,
    wall_time: Duration,
}

impl ConcurrentSteps {
    /// Those of these nodes, which have this order.
    pub fn new(plans: &[NodePlan], order: &[usize], nodes: &mut [Box<dyn Node>]) -> Self {
        let is_concurrent = |(plan, node): (&NodePlan, &mut Box<dyn Node>)| {
            let is_extrapolated =
                plan.connections.iter().any(|connection| connection.extrapolation.is_some());
            !is_extrapolated && node.as_concurrent_step().is_some()
        };
        let concurrent: Vec<_> = plans.iter().zip(nodes).map(is_concurrent).collect();
        if !concurrent.contains(&true) {
            return ConcurrentSteps::default();
        }
        let schedule = schedule_steps(order, &concurrent, &sources_at_step_end(plans));
        let is_of_fmu = |action: &&ScheduledAction| matches!(plans[action.node()].body, NodeBody::Fmu { .. });
        let of_fmus: Vec<_> = schedule.iter().filter(is_of_fmu).collect();
        // Else each FMU waits for the one before it.
        let overlaps = of_fmus.windows(2).any(|pair| {
            matches!(pair[0], ScheduledAction::Begin(_)) && !matches!(pair[1], ScheduledAction::Finish(_))
        });
        ConcurrentSteps {
            schedule: if overlaps { schedule } else { Vec::new() },
            ..ConcurrentSteps::default()
        }
    }

    /// Whether no node steps beside others.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.schedule.is_empty()
    }

    fn summary(&self, plans: &[NodePlan]) -> Option<ConcurrencySummary> {
        let begun = self.schedule.iter().filter(|action| matches!(action, ScheduledAction::Begin(_)));
        let nodes = begun.map(|action| plans[action.node()].name.clone()).collect();
        let [step_seconds, wall_seconds] = [self.step_time, self.wall_time].map(|time| time.as_secs_f64());
        (!self.is_empty()).then_some(ConcurrencySummary { nodes, step_seconds, wall_seconds })
    }
}

/// The actions of a communication step: those nodes begin as early as they can that are `concurrent`, the others step meanwhile, and
/// nobody is awaited as long as there is something to do. `sources` are the nodes whose values of the end of the step each one takes: of one
/// before it in the order the new ones, of one behind it those of the step before, which that one may not write over until they are taken.
fn schedule_steps(order: &[usize], concurrent: &[bool], sources: &[Vec<usize>]) -> Vec<ScheduledAction> {
    let places = places_in_order(order);
    let is_before = |one: usize, other: usize| places[one] < places[other];
    let mut is_done = vec![false; concurrent.len()];
    let (mut waiting, mut begun, mut schedule) = (order.to_vec(), Vec::new(), Vec::new());
    loop {
        let is_ready = |node: &&usize| {
            let has_sources =
                sources[**node].iter().all(|source| is_done[*source] || !is_before(*source, **node));
            let is_taken =
                |receiver: &&usize| is_before(**receiver, **node) && sources[**receiver].contains(node);
            has_sources && !waiting.iter().any(|receiver| is_taken(&receiver))
        };
        let ready = waiting.iter().filter(is_ready).min_by_key(|node| !concurrent[**node]).copied();
        if let Some(node) = ready {
            waiting.retain(|other| *other != node);
            if concurrent[node] {
                begun.push(node);
                schedule.push(ScheduledAction::Begin(node));
            } else {
                is_done[node] = true;
                schedule.push(ScheduledAction::Step(node));
            }
        } else if !begun.is_empty() {
            // One that the first waiting node waits for.
            let is_needed =
                |node: &usize| waiting.first().is_some_and(|first| sources[*first].contains(node));
            let node = begun.remove(begun.iter().position(is_needed).unwrap_or(0));
            is_done[node] = true;
            schedule.push(ScheduledAction::Finish(node));
        } else {
            // The first waiting node waits for begun ones only, since the nodes before it are done or begun.
            debug_assert!(waiting.is_empty(), "{order:?} {sources:?}");
            return schedule;
        }
    }
}

/// The place of each node in the order.
fn places_in_order(order: &[usize]) -> Vec<usize> {
    let mut places = vec![0; order.len()];
    order.iter().enumerate().for_each(|(place, node)| places[*node] = place);
    places
}

/// The nodes whose values of the end of a step each node takes in that step.
fn sources_at_step_end(plans: &[NodePlan]) -> Vec<Vec<usize>> {
    let sources = plans.iter().map(|plan| {
        let sources = plan.connected_sources(plans).filter(|(_, at)| *at == StepBoundary::End);
        sources.map(|(node, _)| node).collect()
    });
    sources.collect()
}

/// Whether a node takes new values of another one, also through others.
fn waits_for(sources: &[Vec<usize>], node: usize, other: usize) -> bool {
    let (mut seen, mut open) = (vec![false; sources.len()], vec![node]);
    while let Some(node) = open.pop() {
        if node == other {
            return true;
        }
        if !std::mem::replace(&mut seen[node], true) {
            open.extend(&sources[node]);
        }
    }
    false
}

/// The first failure in the order of the nodes, by its place: the one that ends the step when they step one after the other.
#[derive(Default)]
struct FirstFailure(Option<(usize, StepInterruption)>);

impl FirstFailure {
    /// Takes the result of a node.
    fn note(&mut self, order: &[usize], node: usize, result: Result<(), StepInterruption>) {
        if let Err(interruption) = result
            && !self.is_before(order, node)
        {
            let place = order.iter().position(|other| *other == node).unwrap_or(order.len());
            self.0 = Some((place, interruption));
        }
    }

    /// Whether there is one, of a node before this one.
    fn is_before(&self, order: &[usize], node: usize) -> bool {
        self.0.as_ref().is_some_and(|(place, _)| order.iter().take(*place).all(|other| *other != node))
    }
}

impl Exchange<'_> {
    /// What was gained by nodes that stepped at the same time, where some can.
    #[must_use]
    pub fn concurrency_summary(&self) -> Option<ConcurrencySummary> {
        self.state.concurrent.summary(self.plans)
    }

    /// The two FMUs of this process that took the most time of those that could step at the same time, where that is worth a process.
    pub(crate) fn independent_slow_nodes(&mut self) -> Option<[String; 2]> {
        let times: Vec<_> = self.node_timings().iter().map(NodeStepTiming::mean_step_time).collect();
        let is_slow = |node: &usize| {
            matches!(self.plans[*node].body, NodeBody::Fmu { isolation: None, .. })
                && times[*node] > WORTH_A_PROCESS
        };
        let mut slow: Vec<_> = (0..self.plans.len()).filter(is_slow).collect();
        slow.sort_by_key(|node| std::cmp::Reverse(times[*node]));
        if slow.len() < 2 {
            return None;
        }
        let places = places_in_order(self.order);
        let mut sources = sources_at_step_end(self.plans);
        // Those behind it in the order give it values of the step before.
        for (node, sources) in sources.iter_mut().enumerate() {
            sources.retain(|source| places[*source] < places[node]);
        }
        let pairs = slow
            .iter()
            .enumerate()
            .flat_map(|(place, one)| slow[place + 1..].iter().map(move |other| (*one, *other)));
        let independent = |(one, other): &(usize, usize)| {
            !waits_for(&sources, *one, *other) && !waits_for(&sources, *other, *one)
        };
        let (one, other) = pairs.into_iter().find(independent)?;
        Some([one, other].map(|node| self.plans[node].name.clone()))
    }

    /// Lets all nodes step; `gathers` says that each takes its inputs then. When one fails, those after it in the order are no longer
    /// begun, and those before it are: the failure that is told is that of nodes that step one after the other.
    ///
    /// # Errors
    /// As of [`step_node`](Self::step_node). No step goes on then.
    pub(super) fn step_nodes_concurrently(&mut self, gathers: bool) -> Result<(), StepInterruption> {
        let mut first = FirstFailure::default();
        let (mut begun, mut since) = (Vec::new(), None);
        for place in 0..self.state.concurrent.schedule.len() {
            let action = self.state.concurrent.schedule[place];
            let node = action.node();
            let result = match action {
                ScheduledAction::Finish(_) if begun.contains(&node) => {
                    begun.retain(|other| *other != node);
                    self.finish_node_step(node)
                }
                ScheduledAction::Begin(_) | ScheduledAction::Step(_)
                    if !first.is_before(self.order, node) =>
                {
                    let gathered = if gathers { self.gather_inputs(node) } else { Ok(()) };
                    gathered.and_then(|()| match action {
                        ScheduledAction::Begin(_) => {
                            since.get_or_insert_with(Instant::now);
                            self.begin_node_step(node).inspect(|()| begun.push(node))
                        }
                        _ => self.step_node(node),
                    })
                }
                _ => Ok(()),
            };
            if begun.is_empty() {
                let wall: Option<Instant> = since.take();
                self.state.concurrent.wall_time += wall.map(|since| since.elapsed()).unwrap_or_default();
            }
            first.note(self.order, node, result);
        }
        first.0.map_or(Ok(()), |(_, interruption)| Err(interruption))
    }

    /// Hands a node its inputs and begins its step.
    fn begin_node_step(&mut self, node: usize) -> Result<(), StepInterruption> {
        let (clock, tick) = self.part;
        self.state.efforts.count_step(node);
        self.call_node(node, |plan, node, row| {
            set_inputs(plan, node, row)?;
            node.as_concurrent_step().into_iter().for_each(|step| step.begin_step(&clock, tick));
            Ok(())
        })?;
        self.state.efforts.stop_timing_node();
        Ok(())
    }

    /// Waits for the end of the step of a node, and reads its outputs.
    fn finish_node_step(&mut self, node: usize) -> Result<(), StepInterruption> {
        let (clock, tick) = self.part;
        self.state.efforts.stop_timing_node();
        let finished = match self.nodes[node].as_concurrent_step() {
            Some(step) => step.finish_step(&clock, tick),
            None => Ok(Duration::ZERO),
        };
        match finished {
            Ok(duration) => {
                self.state.concurrent.step_time += duration;
                self.state.efforts.add_node_time(node, duration);
            }
            Err(error) => self.handle_step_error(node, error)?,
        }
        self.read_outputs(node)
    }
}

#[cfg(test)]
mod tests {
    use super::ScheduledAction::{Begin, Finish, Step};
    use super::*;

    #[test]
    fn a_node_begins_as_early_as_it_can_and_is_awaited_as_late() {
        // 0 feeds 1 and 2, both feed 3; 4 is on its own.
        let sources = [vec![], vec![0], vec![0], vec![1, 2], vec![]];
        let order = [0, 1, 2, 3, 4];
        let schedule = |concurrent: [bool; 5]| schedule_steps(&order, &concurrent, &sources);
        assert_eq!(schedule([false; 5]), order.map(Step));
        let both = [false, true, true, false, false];
        assert_eq!(schedule(both), [Step(0), Begin(1), Begin(2), Step(4), Finish(1), Finish(2), Step(3)]);
        // The one in this process steps meanwhile.
        let second = [false, false, true, false, true];
        assert_eq!(schedule(second), [Begin(4), Step(0), Begin(2), Step(1), Finish(2), Step(3), Finish(4)]);
    }

    /// A node takes the values of its sources from the row, and writes its own there: the same row comes out as one after the other.
    #[test]
    fn any_schedule_gives_the_values_of_nodes_that_step_one_after_the_other() {
        use rand::{RngExt as _, SeedableRng as _};
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        for _ in 0..2_000 {
            let count = random.random_range(1..8);
            let mut order: Vec<usize> = (0..count).collect();
            (0..count).for_each(|place| order.swap(place, random.random_range(0..count)));
            let concurrent: Vec<_> = (0..count).map(|_| random.random_bool(0.5)).collect();
            let mut sources = vec![Vec::new(); count];
            for (node, from) in (0..count).flat_map(|node| (0..count).map(move |from| (node, from))) {
                if random.random_bool(0.3) {
                    sources[node].push(from);
                }
            }
            let step = |node: usize, row: &[u64]| {
                let inputs = sources[node].iter().map(|from| row[*from]);
                inputs
                    .fold(row[node] + node as u64 + 1, |sum, value| sum.wrapping_mul(31).wrapping_add(value))
            };
            let (mut plain, mut scheduled) = (vec![0; count], vec![0; count]);
            let mut waiting = vec![None; count];
            for _ in 0..3 {
                order.iter().for_each(|node| plain[*node] = step(*node, &plain));
                for action in schedule_steps(&order, &concurrent, &sources) {
                    match action {
                        Begin(node) => waiting[node] = Some(step(node, &scheduled)),
                        Finish(node) => scheduled[node] = waiting[node].take().expect("it has begun"),
                        Step(node) => scheduled[node] = step(node, &scheduled),
                    }
                }
                assert_eq!(scheduled, plain, "{order:?} {concurrent:?} {sources:?}");
                assert!(waiting.iter().all(Option::is_none));
            }
        }
    }
}
