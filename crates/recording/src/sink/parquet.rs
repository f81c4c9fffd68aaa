//! Writes a run as Parquet: the time, then a column for each variable in its own type. Fields have their unit as metadata.

use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::builder::StringBuilder;
use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray, UInt64Array};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use diagnostics::Error;
use expression::{ColumnIndex, IntegerIndex, NumberIndex, TextIndex};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;

use super::{RunHeader, Sink, partial_path};
use crate::columns::{Column, ValueKind, VariableDirection};
use crate::row::{RecordedVariables, Row};
use crate::table::format_title;
use crate::view::{ReplayView, RowQuantity};

/// Rows that are encoded together: few enough for a processor's cache with 100 columns.
const BATCH: usize = 1024;
/// Values of a group of rows, which a writer holds in memory until it is complete: 64 MB of numbers.
const GROUP: usize = 8 << 20;

/// A Parquet file. It gets its name when it is complete.
pub struct ParquetSink {
    path: PathBuf,
    partial: PathBuf,
    /// None behind the end.
    writer: Option<ArrowWriter<File>>,
    schema: SchemaRef,
    time: Vec<f64>,
    columns: Vec<ColumnBuffer>,
}

/// Where the values of a column come from, and those that are not written yet.
enum ColumnBuffer {
    Reals(NumberIndex<RecordedVariables>, Vec<f64>),
    Integers(NumberIndex<RecordedVariables>, Vec<i64>),
    Signed(IntegerIndex<RecordedVariables>, Vec<i64>),
    Unsigned(IntegerIndex<RecordedVariables>, Vec<u64>),
    Booleans(NumberIndex<RecordedVariables>, Vec<bool>),
    Texts(TextIndex<RecordedVariables>, StringBuilder),
}

impl ParquetSink {
    /// The files that it may leave.
    pub const FILES: &[&str] = &["run.parquet", "run.parquet.partial"];

    /// Begins the file `run.parquet` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        Self::create(header, &header.folder.join("run.parquet"))
    }

    /// Begins a file of any name. Until it is complete it has the ending `.partial` as well.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(header: &RunHeader, path: &Path) -> Result<Self, Error> {
        let (mut fields, mut columns) = (vec![time_field()], Vec::new());
        // Of two columns of one name the output counts, which comes first.
        let all = &header.columns;
        for (index, column) in all
            .number_columns()
            .filter(|(at, it)| all.find(&it.qualified_name()) == Some(ColumnIndex::Number(*at)))
        {
            let values = match (column.kind, all.integer_index_of(index)) {
                (ValueKind::UInt64, Some(integer)) => ColumnBuffer::Unsigned(integer, Vec::new()),
                (_, Some(integer)) => ColumnBuffer::Signed(integer, Vec::new()),
                (ValueKind::Integer, None) => ColumnBuffer::Integers(index, Vec::new()),
                (ValueKind::Boolean, None) => ColumnBuffer::Booleans(index, Vec::new()),
                _ => ColumnBuffer::Reals(index, Vec::new()),
            };
            fields.push(arrow_field(column, &values));
            columns.push(values);
        }
        for (index, column) in all
            .text_columns()
            .filter(|(at, it)| all.find(&it.qualified_name()) == Some(ColumnIndex::Text(*at)))
        {
            let values = ColumnBuffer::Texts(index, StringBuilder::new());
            fields.push(arrow_field(column, &values));
            columns.push(values);
        }
        let schema = Arc::new(Schema::new_with_metadata(fields, parquet_metadata(header)));
        let partial = partial_path(path);
        let file = File::create(&partial).map_err(|error| Error::output_failure(&partial, error))?;
        let rows = (GROUP / (columns.len() + 1)).max(BATCH);
        let mut properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_max_row_group_row_count(Some(rows));
        // Numbers of a simulation hardly repeat, but their first bytes do.
        for field in schema.fields().iter().filter(|it| it.data_type() == &DataType::Float64) {
            let column = ColumnPath::new(vec![field.name().clone()]);
            properties = properties.set_column_encoding(column, Encoding::BYTE_STREAM_SPLIT);
        }
        let properties = properties.build();
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties));
        let writer = Some(writer.map_err(|error| Error::output_failure(&partial, error))?);
        let (path, time) = (path.to_owned(), Vec::with_capacity(BATCH));
        Ok(ParquetSink { path, partial, writer, schema, time, columns })
    }

    /// Hands the rows that wait to the writer.
    fn flush_rows(&mut self) -> Result<(), Error> {
        let Some(writer) = self.writer.as_mut().filter(|_| !self.time.is_empty()) else {
            return Ok(());
        };
        let times: ArrayRef = Arc::new(Float64Array::from(std::mem::take(&mut self.time)));
        let arrays = std::iter::once(times).chain(self.columns.iter_mut().map(ColumnBuffer::take_array));
        RecordBatch::try_new(self.schema.clone(), arrays.collect())
            .map_err(|error| error.to_string())
            .and_then(|batch| writer.write(&batch).map_err(|error| error.to_string()))
            .map_err(|error| Error::output_failure(&self.partial, error))
    }
}

impl ColumnBuffer {
    fn push_row_value(&mut self, row: &Row<RecordedVariables>) {
        match self {
            ColumnBuffer::Reals(at, values) => values.push(row[*at]),
            // What a run holds of these is exact in both types.
            ColumnBuffer::Integers(at, values) => values.push(row[*at] as i64),
            ColumnBuffer::Signed(at, values) => values.push(row[*at] as i64),
            ColumnBuffer::Unsigned(at, values) => values.push(row[*at] as u64),
            ColumnBuffer::Booleans(at, values) => values.push(row[*at] != 0.0),
            ColumnBuffer::Texts(at, values) => values.append_value(&row[*at]),
        }
    }

    /// The values since the last call.
    fn take_array(&mut self) -> ArrayRef {
        use std::mem::take;
        match self {
            ColumnBuffer::Reals(_, values) => Arc::new(Float64Array::from(take(values))),
            ColumnBuffer::Integers(_, values) | ColumnBuffer::Signed(_, values) => {
                Arc::new(Int64Array::from(take(values)))
            }
            ColumnBuffer::Unsigned(_, values) => Arc::new(UInt64Array::from(take(values))),
            ColumnBuffer::Booleans(_, values) => Arc::new(BooleanArray::from(take(values))),
            ColumnBuffer::Texts(_, values) => {
                let texts: StringArray = values.finish();
                Arc::new(texts)
            }
        }
    }

    fn data_type(&self) -> DataType {
        match self {
            ColumnBuffer::Reals(..) => DataType::Float64,
            ColumnBuffer::Integers(..) | ColumnBuffer::Signed(..) => DataType::Int64,
            ColumnBuffer::Unsigned(..) => DataType::UInt64,
            ColumnBuffer::Booleans(..) => DataType::Boolean,
            ColumnBuffer::Texts(..) => DataType::Utf8,
        }
    }
}

/// The field of the time.
fn time_field() -> Field {
    let unit = HashMap::from([("unit".to_owned(), "s".to_owned())]);
    Field::new("time", DataType::Float64, false).with_metadata(unit)
}

/// The field of a column, with what is known about it.
fn arrow_field(column: &Column, values: &ColumnBuffer) -> Field {
    let side = match column.direction {
        VariableDirection::Input => "input",
        VariableDirection::Output => "output",
    };
    // A name alone may look as if it had a unit.
    let no_unit =
        || (format_title(&column.qualified_name(), None) != column.qualified_name()).then(String::new);
    let known = [
        ("unit", column.unit.clone().or_else(no_unit)),
        ("description", column.description.clone()),
        ("direction", Some(side.to_owned())),
    ];
    let known = known.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
    Field::new(column.qualified_name(), values.data_type(), false).with_metadata(known.collect())
}

/// The metadata of the file: what was run, and how its plots are laid out.
fn parquet_metadata(header: &RunHeader) -> HashMap<String, String> {
    let known = [
        ("scenario", header.scenario.clone()),
        ("title", header.title.clone()),
        ("step", header.step.to_string()),
        ("seed", header.seed.to_string()),
        ("plots", time_plots_json(&header.view, header).to_string()),
    ];
    known.into_iter().map(|(key, value)| (format!("trackside.{key}"), value)).collect()
}

/// The time plots, with the curves that are columns of the file.
fn time_plots_json(view: &ReplayView, header: &RunHeader) -> serde_json::Value {
    let plots = view.plots.iter().map(|plot| {
        let curves = plot.series.iter().filter_map(|series| match &series.quantity {
            RowQuantity::Column(column) => Some(serde_json::json!({
                "label": series.label,
                "signal": header.columns[*column].qualified_name(),
                "factor": series.factor,
                "offset": series.offset,
                "role": series.role,
            })),
            RowQuantity::Formula(_) => None,
        });
        serde_json::json!({ "title": plot.title, "curves": curves.collect::<Vec<_>>() })
    });
    plots.collect()
}

impl Sink for ParquetSink {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        self.time.push(time);
        self.columns.iter_mut().for_each(|values| values.push_row_value(row));
        if self.time.len() < BATCH { Ok(()) } else { self.flush_rows() }
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        self.flush_rows()?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.close().map_err(|error| Error::output_failure(&self.partial, error))?;
        super::rename_completed_file(&self.partial, &self.path, completed)
    }
}

#[cfg(test)]
mod tests {
    use arrow_array::cast::AsArray as _;
    use arrow_array::types::{Float64Type, Int64Type, UInt64Type};
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    use super::*;
    use crate::columns::Columns;

    /// Rows enough for a second batch.
    const ROWS: u64 = BATCH as u64 + 3;

    fn column(variable: &str, kind: ValueKind, direction: VariableDirection) -> Column {
        let unit = (kind == ValueKind::Real).then(|| "m/s".to_owned());
        let (node, description) = ("car".to_owned(), Some(format!("the {variable}")));
        Column { node, variable: variable.to_owned(), direction, kind, unit, description }
    }

    /// A run with a column of each type, and an input of the name of an output.
    fn header(folder: &Path) -> RunHeader {
        let output = |name, kind| column(name, kind, VariableDirection::Output);
        let columns: Columns<_> = [
            output("v", ValueKind::Real),
            output("gear", ValueKind::Integer),
            output("on", ValueKind::Boolean),
            output("low", ValueKind::Int64),
            output("high", ValueKind::UInt64),
            column("v", ValueKind::Real, VariableDirection::Input),
            output("word", ValueKind::String),
        ]
        .into_iter()
        .collect();
        RunHeader {
            scenario: "made".to_owned(),
            title: "A made run".to_owned(),
            source: diagnostics::SourceFiles::from_generated(diagnostics::TextFile::default()),
            given: Vec::new(),
            step: 0.5,
            stop: 1.0,
            seed: 7,
            columns,
            status_tracks: Vec::new(),
            view: ReplayView::default(),
            folder: folder.to_owned(),
        }
    }

    fn value(tick: u64) -> f64 {
        (tick as f64).sin()
    }

    fn write(folder: &Path, completed: bool) {
        let header = header(folder);
        let mut sink = ParquetSink::new(&header).expect("a file");
        let integers: Vec<_> = header.columns.integer_columns().collect();
        let [(first, first_number), (second, second_number)] = integers[..] else { panic!("two integers") };
        for tick in 0..ROWS {
            let mut row = header.columns.zero_row();
            let numbers = [value(tick), tick as f64, (tick % 2) as f64, 0.0, 0.0, -1.0];
            row.set_values(&numbers, Some(vec![format!("row {tick}")]), &[0, 0]);
            row.set_integer(first, first_number, i128::from(i64::MIN) + i128::from(tick));
            row.set_integer(second, second_number, i128::from(u64::MAX) - i128::from(tick));
            sink.push_row(tick, tick as f64 * 0.5, &row).expect("it takes a row");
        }
        sink.finish("", completed).expect("it ends");
    }

    #[test]
    fn each_type_comes_back_exactly_with_its_unit() {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), true);
        let file = File::open(folder.path().join("run.parquet")).expect("the file");
        let reader = ParquetRecordBatchReaderBuilder::try_new(file).expect("Parquet");
        let schema = reader.schema().clone();
        let names: Vec<_> = schema.fields().iter().map(|it| it.name().as_str()).collect();
        let expected = ["time", "car.v", "car.gear", "car.on", "car.low", "car.high", "car.word"];
        assert_eq!(names, expected);
        let metadata = |field: usize, key: &str| schema.field(field).metadata().get(key).cloned();
        assert_eq!((metadata(0, "unit"), metadata(1, "unit")), (Some("s".into()), Some("m/s".into())));
        assert_eq!(metadata(2, "unit"), None);
        assert_eq!(metadata(2, "description"), Some("the gear".into()));
        assert_eq!(metadata(1, "direction"), Some("output".into()));
        assert_eq!(schema.metadata()["trackside.seed"], "7");
        let mut tick = 0;
        for batch in reader.build().expect("a reader") {
            let batch = batch.expect("rows");
            for at in 0..batch.num_rows() {
                let real = |column: usize| batch.column(column).as_primitive::<Float64Type>().value(at);
                let whole = |column: usize| batch.column(column).as_primitive::<Int64Type>().value(at);
                assert_eq!(
                    (real(0).to_bits(), real(1).to_bits()),
                    ((tick as f64 * 0.5).to_bits(), value(tick).to_bits())
                );
                assert_eq!((whole(2), whole(4)), (tick as i64, i64::MIN + tick as i64));
                assert_eq!(batch.column(3).as_boolean().value(at), tick % 2 == 1);
                assert_eq!(batch.column(5).as_primitive::<UInt64Type>().value(at), u64::MAX - tick);
                assert_eq!(batch.column(6).as_string::<i32>().value(at), format!("row {tick}"));
                tick += 1;
            }
        }
        assert_eq!(tick, ROWS);
    }

    #[test]
    fn a_run_that_an_error_ended_leaves_no_table_of_the_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), false);
        assert!(!folder.path().join("run.parquet").exists());
        assert!(folder.path().join("run.parquet.partial").exists());
    }
}
