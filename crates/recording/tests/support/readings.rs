//! What tries damaged recordings by reading them.

use std::path::Path;

use damage::FuzzTarget;
use recording::table::{self, ReadRequest, TimeSeriesTable};
use recording::{GoldenRecording, GoldenValues, Recording};

use super::made;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "readings",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../recording/tests/corpus/recordings"),
    sound: made::all,
    words: &[
        "fmi:c0",
        "/car/outputs",
        "protobuf",
        "json",
        "cdr",
        "ros2msg",
        "float64[]",
        "lz4",
        "zstd",
        "run",
        "log",
    ],
    own: Some(made::own),
    attempt,
};

/// Reads the recording as a run, as columns, and as a table. What has the checksums of the sound one has its numbers, too.
fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("run.mcap");
    std::fs::write(&path, bytes).expect("it can be written");
    let mut taken = Recording::open(&path).is_ok();
    if let Ok(whole) = GoldenRecording::read(&path, &[]) {
        for column in whole.columns() {
            let length = match &column.values {
                GoldenValues::Numbers(values) => values.len(),
                GoldenValues::Texts(values) => values.len(),
            };
            assert_eq!(length, whole.times.len(), "{}", column.name);
        }
    }
    let _ = table::read_titles(&path);
    let _ = table::survey_file(&path, recording::survey::SurveyExtent::Whole);
    for column in ["car.c0", "/x.x", "/ros.x", "/ros.list.1", "car.missing"] {
        let wanted = ReadRequest { time: None, ..ReadRequest::from_names("", &[column]) };
        let Ok(mut table) = TimeSeriesTable::read(&path, &wanted) else { continue };
        taken = true;
        // Times of the file's own clock: its first row may be lost.
        table.set_origin(Some(0.0));
        if column == "car.c0" {
            for (time, value) in table.clock_times()[0].iter().zip(table.column_values(0)) {
                let right = made::value_of((time / made::STEP).round() as u64, 0);
                assert!(*value == right, "{value} in place of {right} at {time} s");
            }
        }
        table.value_at(0, 0.5);
    }
    taken
}
