//! Steps the nodes from communication point to communication point and hands every row to the sinks.

use std::time::Duration;

use diagnostics::{Error, rounded_time};
use fmu_import::{CallError, FmuMessage, MessageLevel, SUMMARY};
use recording::{AllVariables, Column, EventLevel, NumberIndex, RunEvent, Sink, is_exact_in_f64};

use crate::coupling::{CouplingAlgorithm, CouplingSummary};
use crate::exchange::{
    ConcurrencySummary, Exchange, NodeStepTiming, NodeTermination, StepInterruption, call_failure_error,
};
use crate::node::{Node, SAME};
use crate::system::System;

/// How far a run came, and what it cost.
#[derive(Debug, Clone, Default)]
pub struct RunProgress {
    /// Steps that were done.
    pub steps: u64,
    /// Who ended the run before its last communication point, as planned, and when.
    pub ended: Option<String>,
    /// What nodes did not keep of their start values.
    pub notices: Vec<String>,
    /// The effort of each node, in the order of the file.
    pub efforts: Vec<NodeStepTiming>,
    /// What the coupling did.
    pub coupling: CouplingSummary,
    /// What nodes gained that stepped at the same time.
    pub concurrency: Option<ConcurrencySummary>,
    /// Two FMUs of this process that took long and could step at the same time.
    pub independent_nodes: Option<[String; 2]>,
    /// How long a node may take for a communication step; longer ones are counted.
    pub deadline: Option<Duration>,
}

/// Observes a run, and may begin it at a later communication point.
pub trait RunObserver {
    /// Brings the nodes to the first communication point of the run, and says which one that is.
    ///
    /// # Errors
    /// When a node fails.
    fn begin_run(
        &mut self,
        exchange: &mut Exchange,
        coupling: &mut dyn CouplingAlgorithm,
    ) -> Result<u64, Error> {
        coupling.initialise(exchange).map(|()| 0)
    }

    /// The run is at communication point `tick`, whose row the sinks have.
    ///
    /// # Errors
    /// What ends the run.
    fn on_communication_point(
        &mut self,
        _tick: u64,
        _exchange: &mut Exchange,
        _coupling: &mut dyn CouplingAlgorithm,
    ) -> Result<(), Error> {
        Ok(())
    }

    /// Whether the nodes are needed after the run, and so do not hear of its end.
    fn keeps_nodes(&self) -> bool {
        false
    }
}

/// Observes nothing.
impl RunObserver for () {}

/// Runs the system to its last communication point. `progress` tells how far the run came, also when it
/// fails; `tick` is called at every communication point; an error of it ends the run there.
///
/// # Errors
/// With node, call and time when a node fails or shows a value that is no number, and when a sink or `tick` fails.
pub fn run(
    system: &mut System,
    nodes: &mut [Box<dyn Node>],
    coupling: &mut dyn CouplingAlgorithm,
    sink: &mut dyn Sink<AllVariables>,
    progress: &mut RunProgress,
    tick: &mut dyn FnMut(u64) -> Result<(), Error>,
) -> Result<(), Error> {
    run_observed(system, nodes, coupling, sink, progress, tick, &mut ())
}

/// The same with an observer.
///
/// # Errors
/// As of [`run`], and those of the observer.
pub fn run_observed(
    system: &mut System,
    nodes: &mut [Box<dyn Node>],
    coupling: &mut dyn CouplingAlgorithm,
    sink: &mut dyn Sink<AllVariables>,
    progress: &mut RunProgress,
    tick: &mut dyn FnMut(u64) -> Result<(), Error>,
    observer: &mut dyn RunObserver,
) -> Result<(), Error> {
    let mut exchange = Exchange::new(system, nodes);
    progress.deadline.into_iter().for_each(|deadline| exchange.set_deadline(deadline));
    let result = simulate(&mut exchange, coupling, sink, progress, tick, observer);
    progress.efforts = exchange.node_timings().to_vec();
    progress.concurrency = exchange.concurrency_summary();
    progress.independent_nodes = exchange.independent_slow_nodes();
    progress.coupling = coupling.coupling_summary();
    progress.notices = exchange.notices().to_vec();
    result
}

fn simulate(
    exchange: &mut Exchange,
    coupling: &mut dyn CouplingAlgorithm,
    sink: &mut dyn Sink<AllVariables>,
    progress: &mut RunProgress,
    tick: &mut dyn FnMut(u64) -> Result<(), Error>,
    observer: &mut dyn RunObserver,
) -> Result<(), Error> {
    let clock = exchange.clock();
    let begun = observer.begin_run(exchange, coupling);
    let start = clock.time_at(begun.as_ref().copied().unwrap_or_default());
    report_messages(exchange, sink, start, true)?;
    let first = begun?;
    let mut reported = Vec::new();
    let has_integers = exchange.columns.integer_columns().len() > 0;
    report_rounded(exchange, sink, &mut reported, start)?;
    sink.push_row(first, start, exchange.row())?;
    observer.on_communication_point(first, exchange, coupling)?;
    for k in first..clock.steps {
        exchange.begin_step(k);
        if let Err(interruption) = coupling.step(exchange) {
            progress.ended = Some(handle_interruption(exchange, interruption, k, sink)?);
            return terminate_nodes(exchange, observer, sink, clock.time_at(k));
        }
        let time = clock.time_at(k + 1);
        if exchange.state.take_message_flag() {
            report_messages(exchange, sink, time, false)?;
        }
        if has_integers {
            report_rounded(exchange, sink, &mut reported, time)?;
        }
        sink.push_row(k + 1, time, exchange.row())?;
        progress.steps = k + 1 - first;
        observer.on_communication_point(k + 1, exchange, coupling)?;
        if let Err(error) = tick(k + 1) {
            // Whoever calls the run off asks for nothing more.
            let _ = terminate_nodes(exchange, &(), sink, time);
            return Err(error);
        }
        if let Some(NodeTermination { node, error }) = exchange.node_termination() {
            let (node, error) = (*node, error.clone());
            let interruption = StepInterruption::Call { node, error };
            progress.ended = Some(handle_interruption(exchange, interruption, k, sink)?);
            return terminate_nodes(exchange, observer, sink, time);
        }
    }
    terminate_nodes(exchange, observer, sink, clock.time_at(clock.steps.max(first)))
}

/// Says who ended the run in the step from communication point `k` on, if that was planned.
///
/// # Errors
/// When it was not.
fn handle_interruption(
    exchange: &mut Exchange,
    interruption: StepInterruption,
    k: u64,
    sink: &mut dyn Sink<AllVariables>,
) -> Result<String, Error> {
    let clock = exchange.clock();
    match interruption {
        StepInterruption::Value(error) | StepInterruption::Unsolved(error) => {
            report_messages(exchange, sink, clock.time_at(k + 1), false)?;
            Err(error)
        }
        StepInterruption::Call { node, error: CallError { terminated: Some(reached), what, .. } } => {
            let source = exchange.plans[node].name.clone();
            let message = format!("ended the simulation at {} s: {what}", rounded_time(reached));
            let ended = format!("`{source}` {message}");
            let between = |from: f64, to: f64| reached > from && reached < to;
            let edge = SAME * clock.step;
            let row = between(clock.time_at(k) + edge, clock.time_at(k + 1) - edge)
                .then(|| exchange.row_at_termination(node))
                .flatten();
            if let Some(row) = row {
                sink.push_row(k + 1, reached, row)?;
            }
            let time = reached.clamp(clock.time_at(k), clock.time_at(k + 1));
            sink.push_event(&RunEvent { time, level: EventLevel::Info, source, message, again: 0 })?;
            Ok(ended)
        }
        StepInterruption::Call { node, error } => {
            let time = clock.time_at(k + u64::from(error.is_at_step_end()));
            report_messages(exchange, sink, time, false)?;
            Err(call_failure_error(&exchange.plans[node], error, time))
        }
    }
}

/// Hands over what the nodes logged; `begins` says that this was during their initialisation.
fn report_messages(
    exchange: &mut Exchange,
    sink: &mut dyn Sink<AllVariables>,
    time: f64,
    begins: bool,
) -> Result<(), Error> {
    for (plan, node) in exchange.plans.iter().zip(exchange.nodes.iter_mut()) {
        for message in node.take_messages() {
            let level = match message.level() {
                MessageLevel::Info if begins && message.category == SUMMARY => EventLevel::Summary,
                MessageLevel::Info => EventLevel::Info,
                MessageLevel::Warning => EventLevel::Warning,
                MessageLevel::Error => EventLevel::Error,
            };
            let FmuMessage { text: message, again, .. } = message;
            sink.push_event(&RunEvent { time, level, source: plan.name.clone(), message, again })?;
        }
    }
    Ok(())
}

/// Says of each integer of 64 bits, once, that from this time on not all see it exactly. `reported` has those of which it was said.
fn report_rounded(
    exchange: &Exchange,
    sink: &mut dyn Sink<AllVariables>,
    reported: &mut Vec<NumberIndex<AllVariables>>,
    time: f64,
) -> Result<(), Error> {
    for (integer, number) in exchange.columns.integer_columns() {
        let value = exchange.row()[integer];
        if is_exact_in_f64(value) || reported.contains(&number) {
            continue;
        }
        reported.push(number);
        let Column { node, variable, .. } = &exchange.columns[number];
        let message = format!(
            "`{variable}` is {value}, which no number holds exactly: run.csv and run.mcap have it as it is, diagrams, comparisons, \
             baselines and analyses a rounded one"
        );
        sink.push_event(&RunEvent {
            time,
            level: EventLevel::Warning,
            source: node.clone(),
            message,
            again: 0,
        })?;
    }
    Ok(())
}

fn terminate_nodes(
    exchange: &mut Exchange,
    observer: &dyn RunObserver,
    sink: &mut dyn Sink<AllVariables>,
    time: f64,
) -> Result<(), Error> {
    let mut nodes = exchange.plans.iter().zip(exchange.nodes.iter_mut());
    let ended = match observer.keeps_nodes() {
        true => Ok(()),
        false => nodes
            .try_for_each(|(plan, node)| node.terminate().map_err(|it| call_failure_error(plan, it, time))),
    };
    report_messages(exchange, sink, time, false)?;
    ended
}

#[cfg(test)]
mod tests;
