//! What recordings leave whose program was killed between two rows.

use crate::made;

use std::path::Path;

use mcap::MessageStream;
use recording::recover::recover_recording;
use recording::{Column, McapSink, Row, Sink as _, ValueKind, VariableDirection};

/// The rows that are left of a run of so many, killed after the last one.
fn left(folder: &Path, step: f64, ticks: u64, damage: impl FnOnce(&Path)) -> u64 {
    let column = |k: usize| Column {
        node: ["car", "road"][k % 2].to_owned(),
        variable: format!("c{k}"),
        direction: VariableDirection::Output,
        kind: ValueKind::Real,
        unit: None,
        description: None,
    };
    let header = made::header(folder, (0..10).map(column).collect(), step, ticks);
    let mut sink = McapSink::new(&header).expect("it can be written");
    for tick in 0..ticks {
        let numbers = (0..10).map(|column| made::value_of(tick, column)).collect();
        let row = Row::from_values(numbers, Vec::new());
        sink.push_row(tick, tick as f64 * step, &row).expect("it can be written");
    }
    // As a kill: nothing of it comes to its end.
    std::mem::forget(sink);
    let path = folder.join("run.mcap");
    damage(&path);
    let into = folder.join("new.mcap");
    recover_recording(&path, &into, false).expect("it has rows");
    let bytes = std::fs::read(into).expect("it is there");
    let messages = MessageStream::new(&bytes).expect("it is sound");
    let mut rows = [0; 2];
    for message in messages.map(|message| message.expect("it is sound")) {
        let side = usize::from(message.channel.topic == "/road/outputs");
        assert_eq!(u64::from(message.sequence), rows[side], "a row is missing, or there twice");
        let value = message.data.last_chunk().map(|bytes| f64::from_le_bytes(*bytes));
        assert_eq!(value, Some(made::value_of(rows[side], 8 + side)));
        rows[side] += 1;
    }
    assert_eq!(rows[0], rows[1]);
    rows[0]
}

#[test]
fn a_killed_run_leaves_all_but_the_last_second() {
    // Many chunks, some chunks, one that is open; and steps that are longer than a second.
    for (step, ticks) in [(0.001, 5_000), (0.01, 3_000), (0.1, 777), (0.1, 12), (2.0, 300)] {
        let folder = tempfile::tempdir().expect("a folder");
        let left = left(folder.path(), step, ticks, |_| {});
        assert!(left <= ticks && left as f64 >= ticks as f64 - 1.0 / step, "{left} of {ticks}");
    }
}

#[test]
fn of_a_damaged_tail_what_comes_before_the_damage_is_taken() {
    let damaged = |part: f64| {
        let folder = tempfile::tempdir().expect("a folder");
        left(folder.path(), 0.1, 60, |path| {
            let tail = path.with_added_extension("tail");
            let mut bytes = std::fs::read(&tail).expect("rows are in it");
            let place = (part * bytes.len() as f64) as usize;
            bytes[place] ^= 0x10;
            std::fs::write(&tail, bytes).expect("it can be written");
        })
    };
    let [early, late] = [0.1, 0.9].map(damaged);
    assert!(early < 10 && late > 40 && late < 60, "{early} and {late}");
}
