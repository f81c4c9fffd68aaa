//! Checks each row of nodes made of closures: values, their times, and the ends of runs.

use recording::{NumberRange, TextIndex, TextRange, ValueKind};

use super::*;
use crate::clock::{CommunicationClock, StepBoundary};
use crate::fault::{BiasFault, FaultKind, FixedValueFault, FreezeFault, GainFault};
use crate::node::TypedValues;
use crate::quantity::InputUnit;
use crate::system::{AcceptedValues, Algorithm, InputFault, InputSource, NodeTextColumns};
use crate::testing::{RecordingSink, STEP, mock_columns, mock_node, mock_system, run_mock_system};

/// A clock and two nodes that add one to what they get.
fn chain() -> Vec<Box<dyn Node>> {
    let adder = || mock_node(|_, inputs| Ok(inputs[0] + 1.0));
    vec![mock_node(|time, _| Ok(time)), adder(), adder()]
}

#[test]
fn a_value_goes_through_the_whole_chain_within_a_step() {
    let mut system = mock_system(3, &[(0, 1, StepBoundary::End), (1, 2, StepBoundary::End)], 3);
    let (record, progress, result) = run_mock_system(&mut system, chain());
    result.expect("the chain runs");
    assert_eq!(record.rows[3][..3], [1.5, 2.5, 3.5]);
    assert_eq!(record.rows[3][3..], [1.5, 2.5], "inputs are what the step was done with");
    assert_eq!((progress.steps, progress.efforts[1].calls), (3, 3));
}

#[test]
fn a_value_from_the_start_of_the_step_is_one_step_late() {
    let mut system = mock_system(3, &[(0, 1, StepBoundary::Start), (1, 2, StepBoundary::Start)], 3);
    let (record, ..) = run_mock_system(&mut system, chain());
    assert_eq!(record.rows[3][..3], [1.5, 2.0, 2.5]);
}

#[test]
fn a_node_that_comes_first_sees_the_start_of_the_step() {
    let mut system = mock_system(3, &[(0, 1, StepBoundary::End), (1, 2, StepBoundary::End)], 3);
    system.order = vec![2, 1, 0];
    let (record, ..) = run_mock_system(&mut system, chain());
    assert_eq!(record.rows[3][..3], [1.5, 2.0, 2.5]);
}

#[test]
fn units_are_converted_and_faults_begin_and_end_on_time() {
    let kinds: [(&dyn FaultKind, _); 4] = [
        (&FreezeFault(true), [1.0, 2.0, 2.0, 2.0, 5.0]),
        (&FixedValueFault(9.0.into()), [1.0, 2.0, 9.0, 9.0, 5.0]),
        (&BiasFault(0.5.into()), [1.0, 2.0, 3.5, 4.5, 5.0]),
        (&GainFault(2.0), [1.0, 2.0, 6.0, 8.0, 5.0]),
    ];
    for (kind, expected) in kinds {
        let action = kind.build_action(InputUnit::default()).expect("a number").expect("an action");
        let mut system = mock_system(2, &[(0, 1, StepBoundary::End)], 5);
        let input_chain = &mut system.nodes[1].connections[0].input_chain;
        input_chain.factor = 2.0;
        input_chain.faults = vec![InputFault { from: 1.0, until: 2.0, action: action.clone() }];
        let nodes = vec![mock_node(|time, _| Ok(time)), mock_node(|_, inputs| Ok(inputs[0]))];
        let (record, ..) = run_mock_system(&mut system, nodes);
        let seen: Vec<_> = record.rows[1..].iter().map(|row| row[1]).collect();
        assert_eq!(seen, expected, "{action:?}");
    }
}

#[test]
fn a_value_that_is_no_number_ends_the_run_before_it_is_recorded() {
    let mut system = mock_system(1, &[], 4);
    let nodes = vec![mock_node(|time, _| Ok(if time > 1.0 { f64::NAN } else { time }))];
    let (record, progress, result) = run_mock_system(&mut system, nodes);
    let error = result.expect_err("NaN").to_string();
    assert!(error.contains("n0") && error.contains("`y`") && error.contains("1.5 s"), "{error}");
    assert_eq!((record.rows.len(), progress.steps), (3, 2));
}

#[test]
fn a_failing_node_is_named_with_call_and_time_after_its_own_message() {
    let mut system = mock_system(1, &[], 4);
    let fail = || CallError::new("step", "returned an error");
    let nodes = vec![mock_node(move |time, _| if time > 1.0 { Err(fail()) } else { Ok(0.0) })];
    let (record, _, result) = run_mock_system(&mut system, nodes);
    let error = result.expect_err("a failure").to_string();
    assert_eq!(error, "node `n0`: step at t = 1 s returned an error");
    assert_eq!(record.events, ["1 n0: ouch"]);
}

#[test]
fn a_node_may_end_the_run() {
    let mut system = mock_system(1, &[], 4);
    let done = || CallError { terminated: Some(1.0), ..CallError::new("step", "finished") };
    let nodes = vec![mock_node(move |time, _| if time > 1.0 { Err(done()) } else { Ok(0.0) })];
    let (record, progress, result) = run_mock_system(&mut system, nodes);
    result.expect("that is no error");
    assert_eq!(progress.steps, 2);
    assert!(record.events[0].contains("ended the simulation at 1 s"), "{:?}", record.events);
}

/// A node whose text is what it was given and a mark more, or the tick if it is given nothing.
#[derive(Default)]
struct Speaker(Option<String>, String);

impl Node for Speaker {
    fn get_outputs(&mut self, _outputs: &mut [f64]) -> Result<(), CallError> {
        Ok(())
    }
    fn do_step(&mut self, _clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.1 = self.0.as_ref().map_or(tick.to_string(), |given| format!("{given}!"));
        Ok(())
    }
    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }
}

impl TypedValues for Speaker {
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.0 = inputs.first().cloned();
        Ok(())
    }
    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        outputs[0].clone_from(&self.1);
        Ok(())
    }
    fn set_integers(&mut self, _inputs: &[i128]) -> Result<(), CallError> {
        Ok(())
    }
    fn get_integers(&mut self, _outputs: &mut [i128]) -> Result<(), CallError> {
        Ok(())
    }
}

#[test]
fn texts_travel_with_the_same_delay_as_numbers() {
    for (at, order, expected) in [
        (StepBoundary::End, [0, 1, 2], ["2", "2!", "2!!", "2", "2!"]),
        (StepBoundary::Start, [0, 1, 2], ["2", "1!", "0!!", "1", "0!"]),
        (StepBoundary::Start, [2, 1, 0], ["2", "1!", "0!!", "1", "0!"]),
        (StepBoundary::End, [2, 1, 0], ["2", "1!", "0!!", "1", "0!"]),
    ] {
        let mut system = mock_system(3, &[], 3);
        system.order = order.to_vec();
        system.columns = mock_columns(5, ValueKind::String);
        for (index, plan) in system.nodes.iter_mut().enumerate() {
            plan.outputs = NumberRange::default();
            plan.needed.clear();
            plan.inputs = NumberRange::default();
            plan.texts = match index.checked_sub(1) {
                None => NodeTextColumns { outputs: TextRange::new(0..1), ..NodeTextColumns::default() },
                Some(source) => NodeTextColumns {
                    outputs: TextRange::new(index..index + 1),
                    inputs: TextRange::new(2 + index..3 + index),
                    connections: vec![InputSource { index: TextIndex::new(source), at }],
                    unneeded: false,
                },
            };
        }
        let speaker = || Box::new(Speaker::default()) as Box<dyn Node>;
        let (record, _, result) = run_mock_system(&mut system, vec![speaker(), speaker(), speaker()]);
        result.expect("the chain runs");
        assert_eq!(record.texts[3], expected, "{at:?} {order:?}");
    }
}

#[test]
fn a_number_that_the_input_does_not_take_ends_the_run() {
    let mut system = mock_system(2, &[(0, 1, StepBoundary::End)], 4);
    system.nodes[1].connections[0].input_chain.accepts = AcceptedValues::Boolean;
    let nodes = vec![mock_node(|time, _| Ok(if time > 1.0 { 0.5 } else { time })), mock_node(|_, _| Ok(0.0))];
    let (record, _, result) = run_mock_system(&mut system, nodes);
    let error = result.expect_err("0.5 is no truth").to_string();
    assert!(error.contains("`n1.u0` would get 0.5 from `n0.y` at t = 0.5 s"), "{error}");
    assert_eq!(record.rows.len(), 1);
}

#[test]
fn jacobi_coupling_gives_every_node_the_start_of_the_step() {
    for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
        let mut system = mock_system(3, &[(0, 1, StepBoundary::Start), (1, 2, StepBoundary::Start)], 3);
        (system.coupling.algorithm, system.order) = (Algorithm::Jacobi, order.to_vec());
        let (record, ..) = run_mock_system(&mut system, chain());
        assert_eq!(record.rows[3], [1.5, 2.0, 2.5, 1.0, 1.5], "{order:?}");
    }
}

/// A third algorithm: the nodes step in the order of the file.
struct InOrderOfFile {
    steps: u64,
}

impl CouplingAlgorithm for InOrderOfFile {
    fn step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        self.steps += 1;
        for node in 0..exchange.nodes.len() {
            exchange.gather_inputs(node)?;
            exchange.do_step(node)?;
            exchange.read_outputs(node)?;
        }
        Ok(())
    }
}

#[test]
fn another_coupling_algorithm_needs_no_change_of_the_master() {
    let mut system = mock_system(3, &[(0, 1, StepBoundary::End), (1, 2, StepBoundary::End)], 3);
    system.order = vec![2, 1, 0];
    let (mut record, mut progress) =
        (RecordingSink { step: STEP, ..RecordingSink::default() }, RunProgress::default());
    let mut coupling = InOrderOfFile { steps: 0 };
    run(&mut system, &mut chain(), &mut coupling, &mut record, &mut progress, &mut |_| Ok(()))
        .expect("the chain runs");
    assert_eq!((coupling.steps, progress.steps), (3, 3));
    assert_eq!(record.rows[3][..3], [1.5, 2.5, 3.5]);
}
