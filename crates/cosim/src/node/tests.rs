//! Repeats steps of signals and tables from a saved state.

use std::io::Write as _;

use recording::table::{ReadRequest, TimeSeriesTable};

use super::{Node, NodeState, SourceNode, stateful_node};
use crate::clock::CommunicationClock;
use crate::signal::shape::{Chirp, Multisine, ShapeParameters};
use crate::signal::{Signal, SignalPart, SignalWindow};

const CLOCK: CommunicationClock = CommunicationClock { start: 0.0, step: 0.01, steps: 20 };

/// The outputs after each of five steps from `first` on, as bits.
fn five_steps(node: &mut dyn Node, first: u64, outputs: usize) -> Vec<u64> {
    let mut seen = Vec::new();
    for tick in first..first + 5 {
        let mut row = vec![0.0; outputs];
        node.do_step(&CLOCK, tick).expect("a step");
        node.get_outputs(&mut row).expect("outputs");
        seen.extend(row.into_iter().map(f64::to_bits));
    }
    seen
}

fn restores(mut node: impl Node, outputs: usize) {
    assert!(node.as_stateful().is_some_and(|state| state.can_save()));
    let before = five_steps(&mut node, 0, outputs);
    let state = stateful_node(&mut node).and_then(|it| it.save_state()).expect("a state");
    let first = five_steps(&mut node, 5, outputs);
    stateful_node(&mut node).and_then(|it| it.restore_state(&state)).expect("its own state");
    assert_eq!(five_steps(&mut node, 5, outputs), first);
    assert_ne!(before, first, "the outputs move");
    drop(state);
    let foreign = NodeState::new("another kind of state");
    assert!(stateful_node(&mut node).and_then(|it| it.restore_state(&foreign)).is_err());
}

#[test]
fn signals_repeat_their_steps_from_a_saved_state() {
    let multisine =
        Multisine { peak: 0.5, frequencies: vec![0.3, 4.1], weights: None, phases: None, seed: None };
    let chirp = Chirp { amplitude: 1.0, f_start: 0.1, f_end: 9.0, duration: 0.2, phase: 0.0 };
    let shapes: [&dyn ShapeParameters; 2] = [&multisine, &chirp];
    let signals = shapes.map(|shape| {
        let (until, end) = (f64::INFINITY, CLOCK.stop_time());
        let window = SignalWindow { from: 0.0, until, fade_in: 0.0, fade_out: 0.0, end };
        Signal::new(vec![SignalPart::new(shape, window, 1).expect("a shape")])
    });
    restores(SourceNode::new(signals.to_vec()), 2);
}

#[test]
fn a_table_repeats_its_steps_from_a_saved_state() {
    let mut file = tempfile::Builder::new().suffix(".csv").tempfile().expect("a file");
    file.write_all(b"t,v\n0,1\n0.045,3\n0.06,-7\n0.1,2.5\n").expect("a file");
    let table = TimeSeriesTable::read(file.path(), &ReadRequest::from_names("t", &["v"])).expect("a table");
    restores(SourceNode::new(table), 1);
}
