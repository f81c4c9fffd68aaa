//! Steps nodes made of closures and checks each row: values, their times, and the ends of runs.

use fmu_import::{Message, MessageLevel};
use recording::view::View;
use recording::{
    Column, Columns, Direction, NumberIndex, NumberRange, Row, RunHeader, Selection, TextIndex,
    TextRange, ValueKind,
};
use scenario::effect::Chain;
use scenario::fault::{Bias, FaultWords, Freeze, Gain, Value};
use scenario::plan::{
    Accepts, Body, Clock, ExactPlan, FaultPlan, InputChain, NodePlan, ResolvedConnection, Source,
    TextPlan,
};
use scenario::words::{Algorithm, At};

use crate::coupling;

use super::*;

/// A node with one output: what a closure makes of the end of the step and the inputs.
struct Mock<F> {
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

fn mock(
    compute: impl FnMut(f64, &[f64]) -> Result<f64, CallError> + Send + 'static,
) -> Box<dyn Node> {
    Box::new(Mock { compute, time: 0.0, inputs: Vec::new(), output: Ok(0.0) })
}

/// Keeps what it gets.
#[derive(Default)]
struct Record {
    rows: Vec<Vec<f64>>,
    texts: Vec<Vec<String>>,
    events: Vec<String>,
}

impl Sink<Full> for Record {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Full>) -> Result<(), Error> {
        assert_eq!(tick as usize, self.rows.len());
        assert_eq!(time, tick as f64 * STEP);
        self.rows.push(row.numbers().to_vec());
        self.texts.push(row.texts().to_vec());
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.events.push(format!("{} {}: {}", event.time, event.source, event.message));
        Ok(())
    }
}

const STEP: f64 = 0.5;

/// A system of nodes with one output each. `connections` are producer, consumer and end of the step.
fn system(nodes: usize, connections: &[(usize, usize, At)], steps: u64) -> System {
    let mut next = nodes;
    let plans = (0..nodes).map(|index| {
        let connections: Vec<_> = connections.iter().filter(|(_, to, _)| *to == index).collect();
        let first = next;
        next += connections.len();
        NodePlan {
            name: format!("n{index}"),
            body: Body::Signals(Vec::new()),
            outputs: NumberRange::new(index..index + 1),
            needed: vec![NumberIndex::new(index)],
            inputs: NumberRange::new(first..next),
            connections: connections.iter().map(|(from, _, at)| link(*from, *at)).collect(),
            texts: TextPlan::default(),
            exact: ExactPlan::default(),
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
        coupling: Algorithm::GaussSeidel,
        clock: Clock { start: 0.0, step: STEP, steps },
        announced_stop: None,
        tolerance: None,
        nodes: plans,
        order: (0..nodes).collect(),
        columns: columns(next, ValueKind::Real),
        analyses: Vec::new(),
        checks: Vec::new(),
        baselines: Vec::new(),
        recorded: Selection::default(),
        header,
        warnings: Vec::new(),
    }
}

fn columns(count: usize, kind: ValueKind) -> Columns<Full> {
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

fn link(source: usize, at: At) -> ResolvedConnection {
    let input_chain = InputChain {
        factor: 1.0,
        offset: 0.0,
        effects: Chain::default(),
        faults: Vec::new(),
        map: Vec::new(),
        accepts: Accepts::Real,
    };
    ResolvedConnection { source: Source { index: NumberIndex::new(source), at }, input_chain }
}

fn play(
    system: &mut System,
    mut nodes: Vec<Box<dyn Node>>,
) -> (Record, Progress, Result<(), Error>) {
    let (mut record, mut progress) = (Record::default(), Progress::default());
    let mut coupling = coupling::of(system.coupling);
    let result =
        run(system, &mut nodes, coupling.as_mut(), &mut record, &mut progress, &mut |_| Ok(()));
    (record, progress, result)
}

/// A clock and two nodes that add one to what they get.
fn chain() -> Vec<Box<dyn Node>> {
    let adder = || mock(|_, inputs| Ok(inputs[0] + 1.0));
    vec![mock(|time, _| Ok(time)), adder(), adder()]
}

#[test]
fn a_value_goes_through_the_whole_chain_within_a_step() {
    let mut system = system(3, &[(0, 1, At::End), (1, 2, At::End)], 3);
    let (record, progress, result) = play(&mut system, chain());
    result.expect("the chain runs");
    assert_eq!(record.rows[3][..3], [1.5, 2.5, 3.5]);
    assert_eq!(record.rows[3][3..], [1.5, 2.5], "inputs are what the step was done with");
    assert_eq!((progress.steps, progress.efforts[1].calls), (3, 3));
}

#[test]
fn a_value_from_the_start_of_the_step_is_one_step_late() {
    let mut system = system(3, &[(0, 1, At::Start), (1, 2, At::Start)], 3);
    let (record, ..) = play(&mut system, chain());
    assert_eq!(record.rows[3][..3], [1.5, 2.0, 2.5]);
}

#[test]
fn a_node_that_comes_first_sees_the_start_of_the_step() {
    let mut system = system(3, &[(0, 1, At::End), (1, 2, At::End)], 3);
    system.order = vec![2, 1, 0];
    let (record, ..) = play(&mut system, chain());
    assert_eq!(record.rows[3][..3], [1.5, 2.0, 2.5]);
}

#[test]
fn units_are_converted_and_faults_begin_and_end_on_time() {
    let kinds: [(&dyn FaultWords, _); 4] = [
        (&Freeze(true), [1.0, 2.0, 2.0, 2.0, 5.0]),
        (&Value(9.0), [1.0, 2.0, 9.0, 9.0, 5.0]),
        (&Bias(0.5), [1.0, 2.0, 3.5, 4.5, 5.0]),
        (&Gain(2.0), [1.0, 2.0, 6.0, 8.0, 5.0]),
    ];
    for (kind, expected) in kinds {
        let action = kind.action().expect("an action");
        let mut system = system(2, &[(0, 1, At::End)], 5);
        let input_chain = &mut system.nodes[1].connections[0].input_chain;
        input_chain.factor = 2.0;
        input_chain.faults = vec![FaultPlan { from: 1.0, until: 2.0, action: action.clone() }];
        let nodes = vec![mock(|time, _| Ok(time)), mock(|_, inputs| Ok(inputs[0]))];
        let (record, ..) = play(&mut system, nodes);
        let seen: Vec<_> = record.rows[1..].iter().map(|row| row[1]).collect();
        assert_eq!(seen, expected, "{action:?}");
    }
}

#[test]
fn a_value_that_is_no_number_ends_the_run_before_it_is_recorded() {
    let mut system = system(1, &[], 4);
    let nodes = vec![mock(|time, _| Ok(if time > 1.0 { f64::NAN } else { time }))];
    let (record, progress, result) = play(&mut system, nodes);
    let error = result.expect_err("NaN").to_string();
    assert!(error.contains("n0") && error.contains("v0") && error.contains("1.5 s"), "{error}");
    assert_eq!((record.rows.len(), progress.steps), (3, 2));
}

#[test]
fn a_failing_node_is_named_with_call_and_time_after_its_own_message() {
    let mut system = system(1, &[], 4);
    let fail = || CallError::new("step", "returned an error");
    let nodes = vec![mock(move |time, _| if time > 1.0 { Err(fail()) } else { Ok(0.0) })];
    let (record, _, result) = play(&mut system, nodes);
    let error = result.expect_err("a failure").to_string();
    assert_eq!(error, "node `n0`: step at t = 1 s returned an error");
    assert_eq!(record.events, ["1 n0: ouch"]);
}

#[test]
fn a_node_may_end_the_run() {
    let mut system = system(1, &[], 4);
    let done =
        || CallError { call: "step".into(), what: "finished".to_owned(), terminated: Some(1.0) };
    let nodes = vec![mock(move |time, _| if time > 1.0 { Err(done()) } else { Ok(0.0) })];
    let (record, progress, result) = play(&mut system, nodes);
    result.expect("that is no error");
    assert_eq!(progress.steps, 2);
    assert!(record.events[0].contains("ended the simulation at 1 s"), "{:?}", record.events);
}

/// A node whose text is what it was given and a mark more, or the tick if it is given nothing.
#[derive(Default)]
struct Speaker(Option<String>, String);

impl Node for Speaker {
    fn get(&mut self, _outputs: &mut [f64]) -> Result<(), CallError> {
        Ok(())
    }
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.0 = inputs.first().cloned();
        Ok(())
    }
    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        outputs[0].clone_from(&self.1);
        Ok(())
    }
    fn step(&mut self, _clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.1 = self.0.as_ref().map_or(tick.to_string(), |given| format!("{given}!"));
        Ok(())
    }
}

#[test]
fn texts_travel_with_the_same_delay_as_numbers() {
    for (at, order, expected) in [
        (At::End, [0, 1, 2], ["2", "2!", "2!!", "2", "2!"]),
        (At::Start, [0, 1, 2], ["2", "1!", "0!!", "1", "0!"]),
        (At::Start, [2, 1, 0], ["2", "1!", "0!!", "1", "0!"]),
        (At::End, [2, 1, 0], ["2", "1!", "0!!", "1", "0!"]),
    ] {
        let mut system = system(3, &[], 3);
        system.order = order.to_vec();
        system.columns = columns(5, ValueKind::String);
        for (index, plan) in system.nodes.iter_mut().enumerate() {
            plan.outputs = NumberRange::default();
            plan.needed.clear();
            plan.inputs = NumberRange::default();
            plan.texts = match index.checked_sub(1) {
                None => TextPlan { outputs: TextRange::new(0..1), ..TextPlan::default() },
                Some(source) => TextPlan {
                    outputs: TextRange::new(index..index + 1),
                    inputs: TextRange::new(2 + index..3 + index),
                    connections: vec![Source { index: TextIndex::new(source), at }],
                    unneeded: false,
                },
            };
        }
        let speaker = || Box::new(Speaker::default()) as Box<dyn Node>;
        let (record, _, result) = play(&mut system, vec![speaker(), speaker(), speaker()]);
        result.expect("the chain runs");
        assert_eq!(record.texts[3], expected, "{at:?} {order:?}");
    }
}

#[test]
fn a_number_that_the_input_does_not_take_ends_the_run() {
    let mut system = system(2, &[(0, 1, At::End)], 4);
    system.nodes[1].connections[0].input_chain.accepts = Accepts::Boolean;
    let nodes = vec![mock(|time, _| Ok(if time > 1.0 { 0.5 } else { time })), mock(|_, _| Ok(0.0))];
    let (record, _, result) = play(&mut system, nodes);
    let error = result.expect_err("0.5 is no truth").to_string();
    assert!(error.contains(".v2` would get 0.5 from `.v0` at t = 0.5 s"), "{error}");
    assert_eq!(record.rows.len(), 1);
}

#[test]
fn jacobi_coupling_gives_every_node_the_start_of_the_step() {
    for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
        let mut system = system(3, &[(0, 1, At::Start), (1, 2, At::Start)], 3);
        (system.coupling, system.order) = (Algorithm::Jacobi, order.to_vec());
        let (record, ..) = play(&mut system, chain());
        assert_eq!(record.rows[3], [1.5, 2.0, 2.5, 1.0, 1.5], "{order:?}");
    }
}

/// A third algorithm: the nodes step in the order of the file.
struct InOrderOfFile {
    steps: u64,
}

impl Coupling for InOrderOfFile {
    fn initialisation_passes(&self) -> usize {
        1
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), Interruption> {
        self.steps += 1;
        for node in 0..exchange.nodes.len() {
            exchange.feed(node)?;
            exchange.step(node)?;
            exchange.read(node)?;
        }
        Ok(())
    }
}

#[test]
fn another_coupling_algorithm_needs_no_change_of_the_master() {
    let mut system = system(3, &[(0, 1, At::End), (1, 2, At::End)], 3);
    system.order = vec![2, 1, 0];
    let (mut record, mut progress) = (Record::default(), Progress::default());
    let mut coupling = InOrderOfFile { steps: 0 };
    run(&mut system, &mut chain(), &mut coupling, &mut record, &mut progress, &mut |_| Ok(()))
        .expect("the chain runs");
    assert_eq!((coupling.steps, progress.steps), (3, 3));
    assert_eq!(record.rows[3][..3], [1.5, 2.5, 3.5]);
}
