//! The rows and events of a run go in through the trait [`Sink`]; MCAP, CSV, Parquet and MDF files come out. Readers take such files, and those
//! of other programs, and return rows or columns over time. An index fits only one kind of row ([`AllVariables`] or [`RecordedVariables`]) and one kind
//! of value ([`NumberKind`] or [`TextKind`]).
#![forbid(unsafe_code)]

mod columns;
mod golden;
pub mod overview;
mod reader;
mod records;
pub mod recover;
mod road_samples;
mod row;
mod selection;
mod sink;
pub mod survey;
pub mod table;
mod thinned_samples;
pub mod view;

pub use columns::{Column, Columns, ValueKind, VariableDirection};
pub use expression::{
    ColumnIndex, IntegerIndex, IntegerKind, IntegerRange, NumberIndex, NumberKind, NumberRange, ReadableRow,
    TextIndex, TextKind, TextRange, TypedIndex, TypedRange,
};
pub use golden::{GoldenColumn, GoldenRecording, GoldenValues};
pub use reader::Recording;
pub use road_samples::RoadSamples;
pub use row::{AllVariables, RecordedVariables, Row, is_exact_in_f64};
pub use selection::RecordedSelection;
pub use sink::csv::CsvSink;
pub use sink::ld::LdSink;
pub use sink::mcap::McapSink;
pub use sink::mdf::MdfSink;
pub use sink::parquet::ParquetSink;
pub use sink::threaded_sink::ThreadedSink;
pub use sink::{
    AnalysisColumns, BoxedSink, CheckOrFaultStatus, EventLevel, RunEvent, RunHeader, Sink, SinkFactory,
    SinkNotice, StatusChange, StatusSource, TestTrackLayout,
};
pub use thinned_samples::ThinnedSamples;
