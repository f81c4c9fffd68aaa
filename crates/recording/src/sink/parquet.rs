//! Writes a run as Parquet: the time, then a column for each variable in its own type. Fields have their unit as metadata.

use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow_array::builder::StringBuilder;
use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray, UInt64Array,
};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use diagnostics::Error;
use expression::{ColumnIndex, IntegerIndex, NumberIndex, TextIndex};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;

use super::{RunHeader, Sink, partial};
use crate::columns::{Column, Direction, ValueKind};
use crate::row::{Recorded, Row};
use crate::view::{Quantity, View};

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
    columns: Vec<Values>,
}

/// Where the values of a column come from, and those that are not written yet.
enum Values {
    Reals(NumberIndex<Recorded>, Vec<f64>),
    Integers(NumberIndex<Recorded>, Vec<i64>),
    Signed(IntegerIndex<Recorded>, Vec<i64>),
    Unsigned(IntegerIndex<Recorded>, Vec<u64>),
    Booleans(NumberIndex<Recorded>, Vec<bool>),
    Texts(TextIndex<Recorded>, StringBuilder),
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
        let (mut fields, mut columns) = (vec![time()], Vec::new());
        // Of two columns of one name the output counts, which comes first.
        let all = &header.columns;
        for (index, column) in
            all.numbers().filter(|(at, it)| all.find(&it.name()) == Some(ColumnIndex::Number(*at)))
        {
            let values = match (column.kind, all.integer(index)) {
                (ValueKind::UInt64, Some(integer)) => Values::Unsigned(integer, Vec::new()),
                (_, Some(integer)) => Values::Signed(integer, Vec::new()),
                (ValueKind::Integer, None) => Values::Integers(index, Vec::new()),
                (ValueKind::Boolean, None) => Values::Booleans(index, Vec::new()),
                _ => Values::Reals(index, Vec::new()),
            };
            fields.push(field(column, &values));
            columns.push(values);
        }
        for (index, column) in
            all.texts().filter(|(at, it)| all.find(&it.name()) == Some(ColumnIndex::Text(*at)))
        {
            let values = Values::Texts(index, StringBuilder::new());
            fields.push(field(column, &values));
            columns.push(values);
        }
        let schema = Arc::new(Schema::new_with_metadata(fields, about(header)));
        let partial = partial(path);
        let file = File::create(&partial).map_err(|error| Error::output(&partial, error))?;
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
        let writer = Some(writer.map_err(|error| Error::output(&partial, error))?);
        let (path, time) = (path.to_owned(), Vec::with_capacity(BATCH));
        Ok(ParquetSink { path, partial, writer, schema, time, columns })
    }

    /// Hands the rows that wait to the writer.
    fn write(&mut self) -> Result<(), Error> {
        let Some(writer) = self.writer.as_mut().filter(|_| !self.time.is_empty()) else {
            return Ok(());
        };
        let times: ArrayRef = Arc::new(Float64Array::from(std::mem::take(&mut self.time)));
        let arrays = std::iter::once(times).chain(self.columns.iter_mut().map(Values::take));
        RecordBatch::try_new(self.schema.clone(), arrays.collect())
            .map_err(|error| error.to_string())
            .and_then(|batch| writer.write(&batch).map_err(|error| error.to_string()))
            .map_err(|error| Error::output(&self.partial, error))
    }
}

impl Values {
    fn add(&mut self, row: &Row<Recorded>) {
        match self {
            Values::Reals(at, values) => values.push(row[*at]),
            // What a run holds of these is exact in both types.
            Values::Integers(at, values) => values.push(row[*at] as i64),
            Values::Signed(at, values) => values.push(row[*at] as i64),
            Values::Unsigned(at, values) => values.push(row[*at] as u64),
            Values::Booleans(at, values) => values.push(row[*at] != 0.0),
            Values::Texts(at, values) => values.append_value(&row[*at]),
        }
    }

    /// The values since the last call.
    fn take(&mut self) -> ArrayRef {
        use std::mem::take;
        match self {
            Values::Reals(_, values) => Arc::new(Float64Array::from(take(values))),
            Values::Integers(_, values) | Values::Signed(_, values) => {
                Arc::new(Int64Array::from(take(values)))
            }
            Values::Unsigned(_, values) => Arc::new(UInt64Array::from(take(values))),
            Values::Booleans(_, values) => Arc::new(BooleanArray::from(take(values))),
            Values::Texts(_, values) => {
                let texts: StringArray = values.finish();
                Arc::new(texts)
            }
        }
    }

    fn data_type(&self) -> DataType {
        match self {
            Values::Reals(..) => DataType::Float64,
            Values::Integers(..) | Values::Signed(..) => DataType::Int64,
            Values::Unsigned(..) => DataType::UInt64,
            Values::Booleans(..) => DataType::Boolean,
            Values::Texts(..) => DataType::Utf8,
        }
    }
}

/// The field of the time.
fn time() -> Field {
    let unit = HashMap::from([("unit".to_owned(), "s".to_owned())]);
    Field::new("time", DataType::Float64, false).with_metadata(unit)
}

/// The field of a column, with what is known about it.
fn field(column: &Column, values: &Values) -> Field {
    let side = match column.direction {
        Direction::Input => "input",
        Direction::Output => "output",
    };
    let known = [
        ("unit", column.unit.clone()),
        ("description", column.description.clone()),
        ("direction", Some(side.to_owned())),
    ];
    let known = known.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
    Field::new(column.name(), values.data_type(), false).with_metadata(known.collect())
}

/// The metadata of the file: what was run, and how its plots are laid out.
fn about(header: &RunHeader) -> HashMap<String, String> {
    let known = [
        ("scenario", header.scenario.clone()),
        ("title", header.title.clone()),
        ("step", header.step.to_string()),
        ("seed", header.seed.to_string()),
        ("plots", plots(&header.view, header).to_string()),
    ];
    known.into_iter().map(|(key, value)| (format!("trackside.{key}"), value)).collect()
}

/// The time plots, with the curves that are columns of the file.
fn plots(view: &View, header: &RunHeader) -> serde_json::Value {
    let plots = view.plots.iter().map(|plot| {
        let curves = plot.series.iter().filter_map(|series| match &series.quantity {
            Quantity::Column(column) => Some(serde_json::json!({
                "label": series.label,
                "signal": header.columns[*column].name(),
                "factor": series.factor,
                "offset": series.offset,
                "role": series.role,
            })),
            Quantity::Formula(_) => None,
        });
        serde_json::json!({ "title": plot.title, "curves": curves.collect::<Vec<_>>() })
    });
    plots.collect()
}

impl Sink for ParquetSink {
    fn row(&mut self, _tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        self.time.push(time);
        self.columns.iter_mut().for_each(|values| values.add(row));
        if self.time.len() < BATCH { Ok(()) } else { self.write() }
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        self.write()?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.close().map_err(|error| Error::output(&self.partial, error))?;
        // An incomplete table looks like a complete one, so it does not get the name.
        if !completed {
            return Ok(());
        }
        std::fs::rename(&self.partial, &self.path).map_err(|error| Error::output(&self.path, error))
    }
}
