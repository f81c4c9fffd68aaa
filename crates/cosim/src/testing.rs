//! Makes systems and nodes for tests, and keeps the rows of a run.

use diagnostics::Error;
use fmu_import::{CallError, FmuMessage, MessageLevel};
use recording::{AllVariables, Column, Columns, Row, RunEvent, Sink, ValueKind, VariableDirection};

use crate::builder::{ConnectionOptions, SystemBuilder};
use crate::clock::{CommunicationClock, StepBoundary};
use crate::coupling;
use crate::master::{RunProgress, run};
use crate::node::{Node, SourceNode};
use crate::signal::Signal;
use crate::system::{Algorithm, System};

/// A node with one output: what a closure makes of the end of the step and the inputs.
pub(crate) struct MockNode<F> {
    compute: F,
    time: f64,
    inputs: Vec<f64>,
    output: Result<f64, CallError>,
}

impl<F: FnMut(f64, &[f64]) -> Result<f64, CallError> + Send> Node for MockNode<F> {
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs = inputs.to_vec();
        Ok(())
    }
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        outputs[0] = self.output.clone()?;
        Ok(())
    }
    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.time = clock.time_at(tick + 1);
        self.output = (self.compute)(self.time, &self.inputs);
        self.output.clone().map(|_| ())
    }
    fn take_messages(&mut self) -> Vec<FmuMessage> {
        match self.output {
            Ok(_) => Vec::new(),
            Err(_) => vec![FmuMessage::new(MessageLevel::Error, "", "ouch")],
        }
    }
}

pub(crate) fn mock_node(
    compute: impl FnMut(f64, &[f64]) -> Result<f64, CallError> + Send + 'static,
) -> Box<dyn Node> {
    Box::new(MockNode { compute, time: 0.0, inputs: Vec::new(), output: Ok(0.0) })
}

/// Keeps what it gets.
#[derive(Default)]
pub(crate) struct RecordingSink {
    pub rows: Vec<Vec<f64>>,
    pub texts: Vec<Vec<String>>,
    pub events: Vec<String>,
    /// The communication step [s].
    pub step: f64,
}

impl Sink<AllVariables> for RecordingSink {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        assert_eq!(tick as usize, self.rows.len());
        assert_eq!(time, tick as f64 * self.step);
        self.rows.push(row.numbers().to_vec());
        self.texts.push(row.texts().to_vec());
        Ok(())
    }
    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        self.events.push(format!("{} {}: {}", event.time, event.source, event.message));
        Ok(())
    }
}

pub(crate) const STEP: f64 = 0.5;

/// A system of nodes `n0`, `n1` ... with one output `y` each, in this order, whose inputs are `u0`, `u1` ... `connections` are producer,
/// consumer and end of the step.
pub(crate) fn mock_system(nodes: usize, connections: &[(usize, usize, StepBoundary)], steps: u64) -> System {
    let clock = CommunicationClock { start: 0.0, step: STEP, steps };
    let mut builder = SystemBuilder::new(clock, Algorithm::default());
    for node in 0..nodes {
        let count = connections.iter().filter(|(_, to, _)| *to == node).count();
        let inputs: Vec<_> = (0..count).map(|input| format!("u{input}")).collect();
        let inputs: Vec<_> = inputs.iter().map(String::as_str).collect();
        builder.add_node(&format!("n{node}"), idle_node(), &inputs, &["y"]).expect("a new name");
    }
    let mut next = vec![0; nodes];
    for (from, to, at) in connections {
        let (output, input) = (format!("n{from}.y"), format!("n{to}.u{}", next[*to]));
        let options = ConnectionOptions { at: Some(*at), ..ConnectionOptions::default() };
        builder.connect_with(&output, &input, options).expect("both are there");
        next[*to] += 1;
    }
    let (system, _) = builder.build_system().expect("no loop");
    System { order: (0..nodes).collect(), ..system }
}

/// A node that does nothing, in the place of one that comes later.
pub(crate) fn idle_node() -> Box<dyn Node> {
    Box::new(SourceNode::new(Vec::<Signal>::new()))
}

pub(crate) fn mock_columns(count: usize, kind: ValueKind) -> Columns<AllVariables> {
    let mut columns = Columns::default();
    for number in 0..count {
        columns.push(Column {
            node: String::new(),
            variable: format!("v{number}"),
            direction: VariableDirection::Output,
            kind,
            unit: None,
            description: None,
        });
    }
    columns
}

/// Plays a system with steps of [`STEP`].
pub(crate) fn run_mock_system(
    system: &mut System,
    nodes: Vec<Box<dyn Node>>,
) -> (RecordingSink, RunProgress, Result<(), Error>) {
    run_mock_system_with_step(system, nodes, STEP)
}

/// The same with other steps [s].
pub(crate) fn run_mock_system_with_step(
    system: &mut System,
    mut nodes: Vec<Box<dyn Node>>,
    step: f64,
) -> (RecordingSink, RunProgress, Result<(), Error>) {
    let (mut record, mut progress) =
        (RecordingSink { step, ..RecordingSink::default() }, RunProgress::default());
    let mut coupling = coupling::create_coupling(system);
    let result = run(system, &mut nodes, coupling.as_mut(), &mut record, &mut progress, &mut |_| Ok(()));
    (record, progress, result)
}
