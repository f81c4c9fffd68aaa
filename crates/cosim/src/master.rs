//! Steps the nodes from communication point to communication point and hands every row to the sinks.

use std::time::{Duration, Instant};

use diagnostics::{Error, rounded};
use fmu_import::{CallError, MessageLevel};
use recording::{Columns, Event, Full, Level, NumberIndex, Row, Sink};
use scenario::plan::{Clock, InputChain, NodePlan, ResolvedConnection, System};
use scenario::words::At;

use crate::node::Node;

/// How often a node was stepped, and how long that took.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Effort {
    /// Number of steps.
    pub calls: u64,
    /// Time in them, with the values going in and coming out.
    pub time: Duration,
}

/// How far a run came, and what it cost.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Steps that were done.
    pub steps: u64,
    /// Who ended the run before its last communication point, as planned, and when.
    pub ended: Option<String>,
    /// The effort of each node, in the order of the file.
    pub efforts: Vec<Effort>,
}

/// Runs the system to its last communication point (Gauss-Seidel coupling).
///
/// In the order of the system, each node gets its inputs, steps, and shows its outputs, which the nodes
/// after it see at once. `progress` tells how far the run came, also when it fails; `tick` is called at
/// every communication point.
///
/// # Errors
/// With node, call and time when a node fails or shows a value that is no number, and when a sink fails.
pub fn run(
    system: &mut System,
    nodes: &mut [Box<dyn Node>],
    sink: &mut dyn Sink<Full>,
    progress: &mut Progress,
    tick: &mut dyn FnMut(u64),
) -> Result<(), Error> {
    let System { nodes: plans, order, columns, clock, .. } = system;
    let mut row = columns.row();
    progress.efforts = vec![Effort::default(); nodes.len()];
    let initialised = initialise((plans, columns), order, nodes, clock, &mut row);
    report_messages(plans, nodes, sink, 0.0)?;
    initialised?;
    sink.row(0, 0.0, &row)?;
    let mut start = row.clone();
    for k in 0..clock.steps {
        start.copy_from(&row);
        for &place in order.iter() {
            let (plan, node) = (&mut plans[place], &mut nodes[place]);
            let begin = Instant::now();
            feed(plan, columns, (&start, &mut row), clock, k)?;
            let stepped = step(plan, node.as_mut(), &mut row, clock, k);
            let effort = &mut progress.efforts[place];
            effort.calls += 1;
            effort.time += begin.elapsed();
            match stepped {
                Ok(()) => check_numbers(plan, columns, &row, clock.at(k + 1))?,
                Err(CallError { terminated: Some(reached), what, .. }) => {
                    let message = format!("ended the simulation at {reached} s: {what}");
                    let source = plan.name.clone();
                    progress.ended = Some(format!("`{source}` {message}"));
                    sink.event(&Event {
                        time: clock.at(k),
                        level: Level::Warning,
                        source,
                        message,
                    })?;
                    return end(plans, nodes, clock.at(k));
                }
                Err(error) => {
                    // What cannot be read belongs to the end of the step, all else to its start.
                    let time = clock.at(k + u64::from(error.at_end_of_step()));
                    report_messages(plans, nodes, sink, time)?;
                    return Err(failure(&plans[place], error, time));
                }
            }
        }
        let time = clock.at(k + 1);
        report_messages(plans, nodes, sink, time)?;
        sink.row(k + 1, time, &row)?;
        progress.steps = k + 1;
        tick(k + 1);
    }
    end(plans, nodes, clock.stop())
}

fn failure(plan: &NodePlan, error: CallError, time: f64) -> Error {
    Error::component(&plan.name, error.call, Some(time), error.what)
}

/// Lets the values of the first communication point settle: all nodes show their start values, then each
/// sees those before it in the order, and on a second pass the ones that a broken loop hands back.
fn initialise(
    (plans, columns): (&[NodePlan], &Columns<Full>),
    order: &[usize],
    nodes: &mut [Box<dyn Node>],
    clock: &Clock,
    row: &mut Row<Full>,
) -> Result<(), Error> {
    for (plan, node) in plans.iter().zip(nodes.iter_mut()) {
        let entered = node.enter(0.0, clock.stop()).and_then(|()| get(plan, node.as_mut(), row));
        entered.map_err(|error| failure(plan, error, 0.0))?;
    }
    for pass in 0..2 {
        for &place in order {
            let (plan, node) = (&plans[place], &mut nodes[place]);
            for (ResolvedConnection { source, treatment }, input) in
                plan.links.iter().zip(plan.inputs.indices())
            {
                row[input] = treatment.convert(row[source.index]);
                accept(treatment, columns, (source.index, input), row, 0.0)?;
            }
            for (source, input) in plan.texts.links.iter().zip(plan.texts.inputs.indices()) {
                row[input] = row[source.index].clone();
            }
            let mut exchange = || {
                set(plan, node.as_mut(), row)?;
                if pass == 1 {
                    node.ready()?;
                }
                get(plan, node.as_mut(), row)
            };
            exchange().map_err(|error| failure(plan, error, 0.0))?;
        }
    }
    plans.iter().try_for_each(|plan| check_numbers(plan, columns, row, 0.0))
}

fn set(plan: &NodePlan, node: &mut dyn Node, row: &Row<Full>) -> Result<(), CallError> {
    node.set(&row[plan.inputs])?;
    node.set_texts(&row[plan.texts.inputs])
}

fn get(plan: &NodePlan, node: &mut dyn Node, row: &mut Row<Full>) -> Result<(), CallError> {
    node.get(&mut row[plan.outputs])?;
    node.get_texts(&mut row[plan.texts.outputs])
}

/// A value that is no number spoils everything that it reaches, so the run ends where it appears.
fn check_numbers(
    plan: &NodePlan,
    columns: &Columns<Full>,
    row: &Row<Full>,
    time: f64,
) -> Result<(), Error> {
    match plan.outputs.indices().find(|&output| row[output].is_nan()) {
        None => Ok(()),
        Some(output) => {
            Err(failure(plan, CallError::not_a_number(&columns[output].variable), time))
        }
    }
}

/// Puts what the inputs of a node get in the step from communication point `k` on into the row; `start`
/// is the row at that point.
fn feed(
    plan: &mut NodePlan,
    columns: &Columns<Full>,
    (start, row): (&Row<Full>, &mut Row<Full>),
    clock: &Clock,
    k: u64,
) -> Result<(), Error> {
    for (ResolvedConnection { source, treatment }, input) in
        plan.links.iter_mut().zip(plan.inputs.indices())
    {
        let from = if source.at == At::Start { start } else { &*row };
        row[input] = treatment.value(from[source.index], clock.at(k));
        let shown = clock.at(k + u64::from(source.at == At::End));
        accept(treatment, columns, (source.index, input), row, shown)?;
    }
    for (source, input) in plan.texts.links.iter().zip(plan.texts.inputs.indices()) {
        match source.at {
            At::Start => row[input].clone_from(&start[source.index]),
            At::End => row[input] = row[source.index].clone(),
        }
    }
    Ok(())
}

/// Ends the run when a number is no value of the input's type: rounded it would look like a result. `time`
/// is when the source showed it [s].
fn accept(
    treatment: &InputChain,
    columns: &Columns<Full>,
    (source, input): (NumberIndex<Full>, NumberIndex<Full>),
    row: &Row<Full>,
    time: f64,
) -> Result<(), Error> {
    let value = row[input];
    if treatment.accepts.holds(value) {
        return Ok(());
    }
    let (to, from) = (columns[input].name(), columns[source].name());
    let (time, expected) = (rounded(time), treatment.accepts.expected());
    let error = Error::input(format!(
        "`{to}` would get {value} from `{from}` at t = {time} s, but it is {expected}"
    ));
    Err(error.help("let the source have such values only; `quantise = 1.0` on the connection rounds to whole numbers"))
}

/// One communication step of one node, whose inputs are in the row.
fn step(
    plan: &NodePlan,
    node: &mut dyn Node,
    row: &mut Row<Full>,
    clock: &Clock,
    k: u64,
) -> Result<(), CallError> {
    set(plan, node, row)?;
    node.step(clock, k)?;
    get(plan, node, row)
}

fn report_messages(
    plans: &[NodePlan],
    nodes: &mut [Box<dyn Node>],
    sink: &mut dyn Sink<Full>,
    time: f64,
) -> Result<(), Error> {
    for (plan, node) in plans.iter().zip(nodes) {
        for message in node.messages() {
            let level = match message.level() {
                MessageLevel::Info => Level::Info,
                MessageLevel::Warning => Level::Warning,
                MessageLevel::Error => Level::Error,
            };
            let source = plan.name.clone();
            sink.event(&Event { time, level, source, message: message.text })?;
        }
    }
    Ok(())
}

fn end(plans: &[NodePlan], nodes: &mut [Box<dyn Node>], time: f64) -> Result<(), Error> {
    for (plan, node) in plans.iter().zip(nodes) {
        node.end().map_err(|error| failure(plan, error, time))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
