//! Makes systems and nodes for tests, and keeps the rows of a run.

use diagnostics::Error;
use fmu_import::{CallError, Message, MessageLevel};
use recording::{Column, Columns, Direction, Event, Full, Row, Sink, ValueKind};

use crate::builder::{ConnectionOptions, SystemBuilder};
use crate::clock::{At, Clock};
use crate::coupling;
use crate::master::{Progress, run};
use crate::node::{Node, SourceNode};
use crate::signal::Signal;
use crate::system::{Algorithm, System};

/// A node with one output: what a closure makes of the end of the step and the inputs.
pub(crate) struct Mock<F> {
    compute: F,
    time: f64,
    inputs: Vec<f64>,
    output: Result<f64, CallError>,
}

impl<F: FnMut(f64, &[f64]) -> Result<f64, CallError> + Send> Node for Mock<F> {
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs = inputs.to_vec();
        Ok(())
    }
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        outputs[0] = self.output.clone()?;
        Ok(())
    }
    fn do_step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.time = clock.at(tick + 1);
        self.output = (self.compute)(self.time, &self.inputs);
        self.output.clone().map(|_| ())
    }
    fn messages(&mut self) -> Vec<Message> {
        match self.output {
            Ok(_) => Vec::new(),
            Err(_) => vec![Message::new(MessageLevel::Error, "", "ouch")],
        }
    }
}

pub(crate) fn mock(
    compute: impl FnMut(f64, &[f64]) -> Result<f64, CallError> + Send + 'static,
) -> Box<dyn Node> {
    Box::new(Mock { compute, time: 0.0, inputs: Vec::new(), output: Ok(0.0) })
}

/// Keeps what it gets.
#[derive(Default)]
pub(crate) struct Record {
    pub rows: Vec<Vec<f64>>,
    pub texts: Vec<Vec<String>>,
    pub events: Vec<String>,
    /// The communication step [s].
    pub step: f64,
}

impl Sink<Full> for Record {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Full>) -> Result<(), Error> {
        assert_eq!(tick as usize, self.rows.len());
        assert_eq!(time, tick as f64 * self.step);
        self.rows.push(row.numbers().to_vec());
        self.texts.push(row.texts().to_vec());
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.events.push(format!("{} {}: {}", event.time, event.source, event.message));
        Ok(())
    }
}

pub(crate) const STEP: f64 = 0.5;

/// A system of nodes `n0`, `n1` ... with one output `y` each, in this order, whose inputs are `u0`, `u1` ... `connections` are producer,
/// consumer and end of the step.
pub(crate) fn system(nodes: usize, connections: &[(usize, usize, At)], steps: u64) -> System {
    let clock = Clock { start: 0.0, step: STEP, steps };
    let mut builder = SystemBuilder::new(clock, Algorithm::default());
    for node in 0..nodes {
        let count = connections.iter().filter(|(_, to, _)| *to == node).count();
        let inputs: Vec<_> = (0..count).map(|input| format!("u{input}")).collect();
        let inputs: Vec<_> = inputs.iter().map(String::as_str).collect();
        builder.add_node(&format!("n{node}"), idle(), &inputs, &["y"]).expect("a new name");
    }
    let mut next = vec![0; nodes];
    for (from, to, at) in connections {
        let (output, input) = (format!("n{from}.y"), format!("n{to}.u{}", next[*to]));
        let options = ConnectionOptions { at: Some(*at), ..ConnectionOptions::default() };
        builder.connect_with(&output, &input, options).expect("both are there");
        next[*to] += 1;
    }
    let (system, _) = builder.system().expect("no loop");
    System { order: (0..nodes).collect(), ..system }
}

/// A node that does nothing, in the place of one that comes later.
pub(crate) fn idle() -> Box<dyn Node> {
    Box::new(SourceNode::new(Vec::<Signal>::new()))
}

pub(crate) fn columns(count: usize, kind: ValueKind) -> Columns<Full> {
    let mut columns = Columns::default();
    for number in 0..count {
        columns.push(Column {
            node: String::new(),
            variable: format!("v{number}"),
            direction: Direction::Output,
            kind,
            unit: None,
            description: None,
        });
    }
    columns
}

/// Plays a system with steps of [`STEP`].
pub(crate) fn play(
    system: &mut System,
    nodes: Vec<Box<dyn Node>>,
) -> (Record, Progress, Result<(), Error>) {
    play_at(system, nodes, STEP)
}

/// The same with other steps [s].
pub(crate) fn play_at(
    system: &mut System,
    mut nodes: Vec<Box<dyn Node>>,
    step: f64,
) -> (Record, Progress, Result<(), Error>) {
    let (mut record, mut progress) = (Record { step, ..Record::default() }, Progress::default());
    let mut coupling = coupling::of(system);
    let result =
        run(system, &mut nodes, coupling.as_mut(), &mut record, &mut progress, &mut |_| Ok(()));
    (record, progress, result)
}
