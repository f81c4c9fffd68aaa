//! The rows and events of a run go in, by the trait [`Sink`]; MCAP and CSV files come out. Such files, and those of others, go in
//! again; rows, or columns over time, come out.
#![forbid(unsafe_code)]

mod reader;
pub mod recover;
mod row;
mod sink;
pub mod table;
pub mod view;

pub use reader::Recording;
pub use row::{
    Column, ColumnIndex, Columns, Direction, Full, Number, NumberIndex, NumberRange, Recorded, Row,
    Selection, Text, TextIndex, TextRange, TypedIndex, TypedRange, ValueKind,
};
pub use sink::csv::CsvSink;
pub use sink::mcap::McapSink;
pub use sink::threaded_sink::ThreadedSink;
pub use sink::{Derived, Event, Level, RunHeader, Sink, Status, StatusChange, StatusTrack};
