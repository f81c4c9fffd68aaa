//! Builds systems of nodes made of closures, and steps them.

use super::*;
use crate::effect::{EffectChain, EffectContext, SensorEffect, SensorGain};
use crate::quantity::InputUnit;
use crate::testing::mock_node;

const CLOCK: CommunicationClock = CommunicationClock { start: 0.0, step: 0.5, steps: 4 };

/// A clock, and a node that adds one to what it gets.
fn chain(algorithm: Algorithm) -> SystemBuilder {
    let mut builder = SystemBuilder::new(CLOCK, algorithm);
    let adder = mock_node(|_, inputs| Ok(inputs[0] + 1.0));
    builder.add_node("adder", adder, &["u"], &["y"]).expect("a new name");
    builder.add_node("clock", mock_node(|time, _| Ok(time)), &[], &["t"]).expect("a new name");
    builder
}

#[test]
fn an_execution_steps_the_nodes_in_the_order_of_the_flow() {
    for (algorithm, expected) in [(Algorithm::GaussSeidel, 2.0), (Algorithm::Jacobi, 1.5)] {
        let mut builder = chain(algorithm);
        builder.connect("clock.t", "adder.u").expect("both are there");
        let mut execution = builder.build().expect("a system");
        execution.simulate_until(1.0).expect("two steps");
        assert_eq!((execution.tick, execution.time()), (2, 1.0));
        assert_eq!(execution.variable_value("adder.y"), Some(expected), "{algorithm:?}");
        assert_eq!(execution.variable_value("adder.z"), None);
        let error = execution.simulate_until(3.0).expect_err("that is too late").to_string();
        assert_eq!(error, "the system ends at 2 s, before 3 s");
        execution.simulate_until(2.0).expect("the rest");
        execution.terminate().expect("the end");
    }
}

#[test]
fn sensor_effects_act_on_the_way() {
    let context = EffectContext { communication_step: CLOCK.step, stream: 1, input: InputUnit::default() };
    let effects: &[&dyn SensorEffect] = &[&SensorGain(2.0)];
    let effects = EffectChain::new(effects, context).expect("a gain");
    let options = ConnectionOptions { at: Some(StepBoundary::Start), effects, ..Default::default() };
    let mut builder = chain(Algorithm::GaussSeidel);
    builder.connect_with("clock.t", "adder.u", options).expect("both are there");
    let mut execution = builder.build().expect("a system");
    execution.simulate_until(1.5).expect("three steps");
    assert_eq!(execution.variable_value("adder.y"), Some(3.0));
}

#[test]
fn mistakes_name_what_is_wrong() {
    let mut builder = chain(Algorithm::GaussSeidel);
    let mut says = |output: &str, input: &str| {
        let connected = builder.connect(output, input).map(|_| ());
        connected.expect_err("a mistake").to_string()
    };
    assert_eq!(says("clock.u", "adder.u"), "unknown output `clock.u`");
    assert_eq!(says("clock.t", "adder.y"), "unknown input `adder.y`");
    builder.connect("adder.y", "adder.u").expect("both are there");
    let twice = builder.connect("clock.t", "adder.u").map(|_| ()).expect_err("a mistake");
    assert_eq!(twice.to_string(), "`adder.u` is connected twice");
    let again = builder.add_node("clock", mock_node(|_, _| Ok(0.0)), &[], &["t"]).map(|_| ());
    let again = again.expect_err("a mistake").to_string();
    assert_eq!(again, "there are two nodes called `clock`");
}

#[test]
fn a_loop_without_a_step_in_between_is_refused_by_those_that_do_not_solve_it() {
    let looped = |algorithm| {
        let mut builder = chain(algorithm);
        builder.connect("adder.y", "adder.u").expect("both are there");
        builder.declare_feedthrough("adder.y", "adder.u").expect("both are there");
        builder.build_system().map(|(system, _)| system)
    };
    let error = looped(Algorithm::GaussSeidel).expect_err("a loop").to_string();
    assert_eq!(error, "these connections form a loop: adder.y -> adder.u");
    let system = looped(Algorithm::Iterate).expect("it is solved");
    assert!(system.coupling.loops[0].is_algebraic);
    assert!(looped(Algorithm::Jacobi).is_ok(), "each value is that of the start of the step");
}
