//! Makes systems and nodes for tests, and keeps the rows of a run.

use diagnostics::Error;
use fmu_import::{CallError, Message, MessageLevel};
use recording::view::View;
use recording::{
    Column, Columns, Direction, Event, Full, NumberIndex, NumberRange, Row, RunHeader, Selection,
    Sink, ValueKind,
};
use scenario::document::At;
use scenario::effect::Chain;
use scenario::plan::{
    Accepts, Body, Clock, CouplingPlan, ExactPlan, InputChain, NodePlan, ResolvedConnection,
    Source, System, TextPlan,
};

use crate::coupling;
use crate::master::{Progress, run};
use crate::node::Node;

/// A node with one output: what a closure makes of the end of the step and the inputs.
pub(crate) struct Mock<F> {
    compute: F,
    time: f64,
    inputs: Vec<f64>,
    output: Result<f64, CallError>,
}

impl<F: FnMut(f64, &[f64]) -> Result<f64, CallError> + Send> Node for Mock<F> {
    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs = inputs.to_vec();
        Ok(())
    }
    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        outputs[0] = self.output.clone()?;
        Ok(())
    }
    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
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

/// A system of nodes with one output each. `connections` are producer, consumer and end of the step.
pub(crate) fn system(nodes: usize, connections: &[(usize, usize, At)], steps: u64) -> System {
    let mut next = nodes;
    let plans = (0..nodes).map(|index| {
        let connections: Vec<_> = connections.iter().filter(|(_, to, _)| *to == index).collect();
        let first = next;
        next += connections.len();
        NodePlan {
            name: format!("n{index}"),
            body: Body::Signals(Vec::new()),
            pace: None,
            outputs: NumberRange::new(index..index + 1),
            needed: vec![NumberIndex::new(index)],
            inputs: NumberRange::new(first..next),
            connections: connections.iter().map(|(from, _, at)| link(*from, *at)).collect(),
            texts: TextPlan::default(),
            exact: ExactPlan::default(),
            faults: Vec::new(),
        }
    });
    let plans: Vec<_> = plans.collect();
    let header = RunHeader {
        scenario: String::new(),
        title: String::new(),
        source: diagnostics::Source::default(),
        given: Vec::new(),
        step: STEP,
        stop: STEP * steps as f64,
        seed: 1,
        columns: Columns::default(),
        status_tracks: Vec::new(),
        view: View::default(),
        folder: std::path::PathBuf::new(),
    };
    System {
        texts: Vec::new(),
        coupling: CouplingPlan::default(),
        clock: Clock { start: 0.0, step: STEP, steps },
        announced_stop: None,
        tolerance: None,
        nodes: plans,
        order: (0..nodes).collect(),
        columns: columns(next, ValueKind::Real),
        analyses: Vec::new(),
        checks: Vec::new(),
        collected: Vec::new(),
        baselines: Vec::new(),
        recorded: Selection::default(),
        header,
        warnings: Vec::new(),
    }
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

pub(crate) fn link(source: usize, at: At) -> ResolvedConnection {
    let input_chain = InputChain {
        factor: 1.0,
        offset: 0.0,
        effects: Chain::default(),
        faults: Vec::new(),
        map: Vec::new(),
        accepts: Accepts::Real,
    };
    ResolvedConnection {
        source: Source { index: NumberIndex::new(source), at },
        input_chain,
        course: None,
    }
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
