//! The rows and events of a run go in through the trait [`Sink`]; MCAP and CSV files come out. Readers take such files, and those
//! of other programs, and return rows or columns over time. An index fits only one kind of row ([`Full`] or [`Recorded`]) and one kind
//! of value ([`Number`] or [`Text`]).
#![forbid(unsafe_code)]

mod golden;
mod reader;
mod records;
pub mod recover;
mod row;
mod sink;
pub mod table;
pub mod view;

pub use golden::{Golden, GoldenColumn, GoldenValues};
pub use reader::Recording;
pub use row::{
    Column, ColumnIndex, Columns, Direction, Full, Number, NumberIndex, NumberRange, Recorded, Row,
    Selection, Text, TextIndex, TextRange, TypedIndex, TypedRange, ValueKind, Values,
};
pub use sink::csv::CsvSink;
pub use sink::mcap::McapSink;
pub use sink::threaded_sink::ThreadedSink;
pub use sink::{
    BoxedSink, Derived, Event, Level, Notice, RunHeader, Sink, SinkKind, Status, StatusChange,
    StatusTrack,
};
