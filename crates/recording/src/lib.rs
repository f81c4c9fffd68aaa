//! The rows and events of a run go in through the trait [`Sink`]; MCAP, CSV, Parquet and MDF files come out. Readers take such files, and those
//! of other programs, and return rows or columns over time. An index fits only one kind of row ([`Full`] or [`Recorded`]) and one kind
//! of value ([`Number`] or [`Text`]).
#![forbid(unsafe_code)]

mod columns;
mod golden;
mod reader;
mod records;
pub mod recover;
mod row;
mod selection;
mod sink;
pub mod survey;
pub mod table;
pub mod view;

pub use columns::{Column, Columns, Direction, ValueKind};
pub use expression::{
    ColumnIndex, Integer, IntegerIndex, IntegerRange, Number, NumberIndex, NumberRange, Text,
    TextIndex, TextRange, TypedIndex, TypedRange, Values,
};
pub use golden::{Golden, GoldenColumn, GoldenValues};
pub use reader::Recording;
pub use row::{Full, Recorded, Row, fits_number};
pub use selection::Selection;
pub use sink::csv::CsvSink;
pub use sink::ld::LdSink;
pub use sink::mcap::McapSink;
pub use sink::mdf::MdfSink;
pub use sink::parquet::ParquetSink;
pub use sink::threaded_sink::ThreadedSink;
pub use sink::{
    BoxedSink, DerivedColumns, Event, Level, Notice, RunHeader, Sink, SinkKind, Status,
    StatusChange, StatusTrack,
};
