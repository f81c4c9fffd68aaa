//! Repeats steps of our plant FMU from a saved state, as coupling algorithms and analyses of linearity do.

use std::sync::Arc;

use cosim::clock::CommunicationClock;
use cosim::node::{ExperimentSetup, FmuNode, Node, Stateful};
use cosim::system::{StartValue, VariableGroup, VariableGroups};
use fmu_import::{Causality, Fmu, StorageType, Value};

use super::fmus::ours;

tests! {
    a_restored_plant_repeats_its_steps_bit_for_bit,
}

const CLOCK: CommunicationClock = CommunicationClock { start: 0.0, step: 0.01, steps: 10 };

/// The outputs after each of five steps from `first` on, as bits.
fn five_steps(node: &mut dyn Node, first: u64, outputs: usize) -> Vec<u64> {
    let mut seen = Vec::new();
    for tick in first..first + 5 {
        let mut row = vec![0.0; outputs];
        node.set_inputs(&[0.01 * tick as f64]).expect("an input");
        node.do_step(&CLOCK, tick).expect("a step");
        node.get_outputs(&mut row).expect("outputs");
        seen.extend(row.into_iter().map(f64::to_bits));
    }
    seen
}

fn a_restored_plant_repeats_its_steps_bit_for_bit() {
    let fmu = Arc::new(Fmu::open(&ours().join("plant.fmu")).expect("our FMU"));
    let reference = |name: &str| {
        let variable = fmu.description.variables.iter().find(|it| it.name == name);
        variable.unwrap_or_else(|| panic!("no variable {name}")).reference
    };
    let real = |names: &[&str]| {
        let (references, elements) = (names.iter().map(|name| reference(name)), names.len());
        let references = references.collect();
        let (storage, places) = (StorageType::Float64, (0..elements).collect());
        let numbers = vec![VariableGroup {
            storage,
            references,
            elements,
            discrete: false,
            tunable: false,
            clocks: Vec::new(),
            places,
            needed: true,
        }];
        VariableGroups { numbers, texts: Vec::new() }
    };
    const OUTPUTS: [&str; 6] = ["v_x", "v_y", "r", "X", "Y", "psi"];
    let outputs = real(&OUTPUTS);
    let inputs = real(&["delta"]);
    let mut node = FmuNode::new(&fmu, "plant", false, inputs, outputs).expect("an instance");
    let start = |name: &str, causality, value| StartValue {
        name: name.to_owned(),
        reference: reference(name),
        storage: StorageType::Float64,
        element: (0, 1),
        causality,
        value: Value::Real(value),
        place: None,
    };
    let starts = vec![start("start.v_x", Causality::Parameter, 20.0), start("F_x", Causality::Input, 0.0)];
    let stop = Some(CLOCK.announced_stop());
    let experiment = ExperimentSetup { start: CLOCK.start, stop, tolerance: None, absolute_tolerance: None };
    node.set_experiment_and_starts(experiment, starts).expect("start values");
    assert!(node.enter_initialization().expect("it starts").is_empty());
    node.exit_initialization().expect("it starts");
    assert!(node.can_save());
    five_steps(&mut node, 0, OUTPUTS.len());
    let state = node.save_state().expect("a state");
    let first = five_steps(&mut node, 5, OUTPUTS.len());
    node.restore_state(&state).expect("its own state");
    assert_eq!(five_steps(&mut node, 5, OUTPUTS.len()), first);
    drop(state);
    node.terminate().expect("it ends");
}
