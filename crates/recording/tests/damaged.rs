//! Recordings that are damaged or very wide.

use crate::made;
use crate::recoveries;

use recording::recover::recover_recording;
use recording::{Column, GoldenRecording, GoldenValues, Recording, ValueKind, VariableDirection};

/// A third of the recording is overwritten; the rest is saved.
#[test]
fn most_of_a_damaged_recording_is_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = made::finished(folder.path(), 900).expect("it can be made");
    let count = |bytes: &[u8]| recoveries::contents(bytes).expect("it is sound").count;
    let whole = count(&bytes);
    let third = bytes.len() / 3;
    bytes[third..2 * third].fill(0);
    let (broken, into) = (folder.path().join("broken.mcap"), folder.path().join("new.mcap"));
    std::fs::write(&broken, &bytes).expect("it can be written");
    let found = recover_recording(&broken, &into, false).expect("most is sound");
    assert!(found.messages > whole / 2 && found.messages < whole, "{} of {whole}", found.messages);
}

/// Reading a hole of a terabyte takes an hour.
#[cfg(target_os = "linux")]
#[test]
fn holes_of_a_sparse_file_are_skipped() {
    use std::os::unix::fs::FileExt as _;
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = made::finished(folder.path(), 900).expect("it can be made");
    let count = |bytes: &[u8]| recoveries::contents(bytes).expect("it is sound").count;
    // Within a chunk.
    let (half, behind) = (bytes.len() / 3, 1 << 40);
    let (broken, into) = (folder.path().join("broken.mcap"), folder.path().join("new.mcap"));
    let file = std::fs::File::create(&broken).expect("it can be written");
    file.write_all_at(&bytes[..half], 0).expect("it can be written");
    // Without the end of the file, which has a checksum over all of the data.
    file.write_all_at(&bytes[half..bytes.len() - 100], behind).expect("it can be written");
    let found = recover_recording(&broken, &into, false).expect("most is sound");
    let whole = count(&bytes);
    assert!(found.messages > whole / 2 && found.messages < whole, "{} of {whole}", found.messages);
    assert!(std::fs::metadata(&into).expect("it is there").len() <= 2 * bytes.len() as u64);
}

/// Protobuf keeps the numbers from 19,000 to 19,999 for itself.
#[test]
fn more_variables_than_protobuf_has_numbers_in_a_row_are_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let column = |k: usize| Column {
        node: "car".to_owned(),
        variable: format!("c[{k}]"),
        direction: VariableDirection::Output,
        kind: ValueKind::Real,
        unit: None,
        description: None,
    };
    let columns = (0..20_500).map(column).collect();
    let bytes = made::made(folder.path(), columns, 2).expect("it can be written");
    let read = GoldenRecording::read(&folder.path().join("run.mcap"), &[]).expect("it is sound");
    assert_eq!((read.times.len(), read.columns().len()), (3, 20_500));
    for (k, column) in read.columns().iter().enumerate() {
        let GoldenValues::Numbers(values) = &column.values else { panic!("no numbers") };
        let expected: Vec<_> = (0..3).map(|tick| made::value_of(tick, k)).collect();
        assert_eq!((&column.name, values), (&format!("car.c[{k}]"), &expected));
    }
    let summary = mcap::Summary::read(&bytes).expect("it is sound").expect("a summary");
    let schemas = summary.schemas.values().find(|it| it.name == "trackside.car_outputs");
    let pool = prost_reflect::DescriptorPool::decode(&*schemas.expect("a schema").data);
    assert!(pool.is_ok(), "other readers refuse it: {pool:?}");
}

#[test]
fn a_reader_refuses_damage_that_only_a_checksum_shows() {
    let folder = tempfile::tempdir().expect("a folder");
    let column = Column {
        node: "car".to_owned(),
        variable: "x".to_owned(),
        direction: VariableDirection::Output,
        kind: ValueKind::Real,
        unit: None,
        description: None,
    };
    let bytes = made::made(folder.path(), [column].into_iter().collect(), 50).expect("written");
    let path = folder.path().join("run.mcap");
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = bytes.clone();
        change(&mut bytes);
        std::fs::write(&path, bytes).expect("it can be written");
        Recording::open(&path).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let at = |needle: &[u8]| bytes.windows(needle.len()).position(|it| it == needle).expect("it is there");
    let (step, title) = (at(b"0.01"), at(b"title = \"made\""));
    assert_eq!(refused(&|_| {}), "");
    let changed = refused(&|bytes| bytes[step + 3] = b'2');
    assert!(changed.contains("the metadata `run` do not fit their checksum"), "{changed}");
    let changed = refused(&|bytes| bytes[title] = b'T');
    assert!(changed.contains("the checksum of the attachment"), "{changed}");
    // The same in a recording that was cut, where no checksum over all data helps.
    let half = bytes.len() / 2;
    let changed = refused(&|bytes| {
        bytes.truncate(half);
        bytes[step + 3] = b'2';
    });
    assert!(changed.contains("do not fit their checksum"), "{changed}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_as_one() {
    let folder = tempfile::tempdir().expect("a folder");
    std::os::unix::fs::symlink("/dev/full", folder.path().join("run.mcap")).expect("a link");
    let error = made::made(folder.path(), std::iter::empty().collect(), 1).expect_err("it is full");
    let message = error.to_string();
    assert!(message.contains("run.mcap") && message.contains("No space left"), "{message}");
}
