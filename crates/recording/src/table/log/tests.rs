//! Columns of logs as tables: several clocks, names, units, gaps, and what is refused.

#[path = "../../../../log-file/tests/support/ld.rs"]
mod ld;

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_array::{TimestampMicrosecondArray, UInt64Array};
use ld::{Ld, ld, ld_channels};

use crate::table::{
    ColumnType, CsvDialect, GapRule, ReadRequest, TableError, TimeSeriesTable, UnitRow, check_columns_exist,
    read_titles,
};

/// A file of these bytes whose name tells nothing.
fn file(bytes: &[u8]) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(file.path(), bytes).expect("it can be written");
    file
}

/// Without a column of the time.
fn timeless(columns: &[&str]) -> ReadRequest {
    ReadRequest { time: None, ..ReadRequest::from_names("", columns) }
}

fn read(bytes: &[u8], request: &ReadRequest) -> Result<TimeSeriesTable, TableError> {
    TimeSeriesTable::read(file(bytes).path(), request)
}

fn parquet(columns: Vec<(&str, ArrayRef)>) -> Vec<u8> {
    let batch = RecordBatch::try_from_iter(columns).expect("a batch");
    let mut file = Vec::new();
    let writer = parquet::arrow::ArrowWriter::try_new(&mut file, batch.schema(), None);
    let mut writer = writer.expect("a writer");
    writer.write(&batch).expect("it is written");
    writer.close().expect("it is written");
    file
}

#[test]
fn channels_of_several_rates_have_clocks_of_their_own() {
    let request = timeless(&["G Force Lat", "Ground Speed", "Steer"]);
    let mut table = read(&ld(&ld_channels()), &request).expect("a log");
    assert_eq!([0, 1, 2].map(|it| table.column_clock(it)), [1, 0, 0]);
    assert_eq!(table.clock_times(), [vec![0.0, 0.1, 0.2], vec![0.0, 0.05, 0.1, 0.15]]);
    assert_eq!([0, 1, 2].map(|it| table.column_unit(it)), [Some("g0"), Some("km/h"), Some("deg")]);
    assert_eq!(table.value_at(0, 0.125), 0.625);
    assert_eq!(table.value_at(1, 0.05), 100.25);
}

#[test]
fn names_are_found_with_and_without_unit_and_doubts_are_told() {
    let channel = |name, unit| Ld {
        name,
        unit,
        kind: [3, 2, 10],
        scale: [0, 1, 1, 0],
        rows: 2,
        bytes: vec![1, 0, 2, 0],
    };
    let twice = ld(&[channel("Speed", "mph"), channel("Speed", "km/h"), channel("T [ms]", "")]);
    let error = read(&twice, &timeless(&["Speed"])).expect_err("two have this name").to_string();
    assert!(error.contains("`Speed` can be any of Speed #1, Speed #2"), "{error}");
    let second = read(&twice, &timeless(&["Speed #2"])).expect("one is the second");
    assert_eq!(second.column_unit(0), Some("km/h"));
    for name in ["T", "T [ms]"] {
        let table = read(&twice, &timeless(&[name])).expect("one has it");
        assert_eq!(table.column_unit(0), Some("ms"));
    }
    let error = read(&twice, &timeless(&["t"])).expect_err("there is none").to_string();
    assert!(error.contains("no column `t`") && error.contains("did you mean `T`?"), "{error}");
    let found = check_columns_exist(file(&twice).path(), &["T", "Speed", "x"], &CsvDialect::default());
    let found: Vec<bool> = found.expect("a log").iter().map(Result::is_ok).collect();
    assert_eq!(found, [true, false, false]);
    let titles = read_titles(file(&ld(&ld_channels())).path()).expect("a log");
    assert!(titles.has_time);
    assert_eq!(titles.columns[0].unit.as_deref(), Some("km/h"));
}

#[test]
fn points_of_time_keep_their_digits() {
    let day = 1_700_000_000_000_000;
    let stamps: ArrayRef = Arc::new(TimestampMicrosecondArray::from(vec![day + 1, day + 2, day + 250_000]));
    let v: ArrayRef = Arc::new(Float64Array::from(vec![Some(1.0), None, Some(3.0)]));
    let bytes = parquet(vec![("at", stamps), ("v [km/h]", v)]);
    let refused = read(&bytes, &timeless(&["v"])).expect_err("a gap").to_string();
    assert!(refused.contains("`v` has no value in 1 row of") && refused.contains("row 2"), "{refused}");
    for time in [None, Some("at".to_owned())] {
        let mut request = ReadRequest { time, ..timeless(&["v"]) };
        request.columns[0].gaps = GapRule::Hold;
        let mut table = read(&bytes, &request).expect("a table");
        assert_eq!((table.column_values(0), table.column_unit(0)), (&[1.0, 1.0, 3.0][..], Some("km/h")));
        assert!((table.clock_times()[0][1] - 1e-6).abs() < 1e-15, "{:?}", table.clock_times());
        table.set_origin(Some(1_700_000_000.0));
        assert_eq!(table.clock_times()[0], [1e-6, 2e-6, 0.25]);
    }
}

#[test]
fn a_column_of_numbers_is_the_time_where_it_is_named() {
    let columns = || -> Vec<(&str, ArrayRef)> {
        vec![
            ("ms", Arc::new(Float64Array::from(vec![500.0, 1000.0, 1500.0]))),
            ("n", Arc::new(UInt64Array::from(vec![u64::MAX, 1, 2]))),
            ("word", Arc::new(StringArray::from(vec![Some("a"), None, Some("c")]))),
        ]
    };
    let bytes = parquet(columns());
    let mut request = ReadRequest::from_names("ms", &["n", "word"]);
    request.time_unit = Some(units::Unit::parse("ms").expect("a unit"));
    request.columns[0].column_type = ColumnType::Integer;
    request.columns[1].column_type = ColumnType::Text;
    let mut table = read(&bytes, &request).expect("a table");
    assert_eq!(table.clock_times(), [[0.0, 0.5, 1.0]]);
    assert_eq!(table.integer_at(0, 0.0), Some(u64::MAX.into()));
    assert_eq!(table.text_at(1, 0.0), Some("a"));
    assert_eq!(table.text_at(1, 0.6), Some(""));
    let error = |request: &ReadRequest| read(&bytes, request).expect_err("it is wrong").to_string();
    let none = error(&timeless(&["n"]));
    assert!(none.contains("is read as Parquet, which needs `time`"), "{none}");
    assert!(none.ends_with("it has ms, n, word"), "{none}");
    let text = error(&ReadRequest::from_names("ms", &["word", "x"]));
    assert!(text.contains("expected numbers, found the text \"a\" in row 1"), "{text}");
    assert!(text.contains("no column `x`"), "{text}");
    let still = vec![("t", Arc::new(Int64Array::from(vec![0, 1, 1])) as ArrayRef), columns().remove(1)];
    let still = read(&parquet(still), &ReadRequest::from_names("t", &["n"])).expect_err("it stands still");
    assert!(still.to_string().contains("expected a time after 1 s in row 3, found 1 s"), "{still}");
    let key = CsvDialect { unit_row: Some(UnitRow::Below(true)), ..CsvDialect::default() };
    let key = error(&ReadRequest { dialect: key, ..ReadRequest::from_names("ms", &["n"]) });
    assert!(key.contains("is Parquet: `unit_row` is about CSV files"), "{key}");
}

#[test]
fn damage_is_told_as_a_warning_or_an_error() {
    let vbo =
        "[header]\ntime\nvelocity kmh\n[column names]\ntime velocity\n[data]\n000001 36\n00\n000002 37\n";
    let table = read(vbo.as_bytes(), &timeless(&["velocity"])).expect("a log");
    assert_eq!(table.clock_times(), [[0.0, 1.0]]);
    let warning = &table.warnings()[0];
    assert!(warning.contains("1 line left out") && warning.ends_with("line 8"), "{warning}");
    let empty =
        read(vbo.split_inclusive('\n').take(6).collect::<String>().as_bytes(), &timeless(&["velocity"]))
            .expect_err("no rows")
            .to_string();
    assert!(empty.contains("expected at least one row, found none"), "{empty}");
    let hdf5 = read(b"\x89HDF\r\n\x1a\n and more", &timeless(&["v"])).expect_err("refused").to_string();
    assert!(hdf5.contains("the HDF5 file cannot be read"), "{hdf5}");
}
