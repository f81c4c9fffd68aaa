//! Writes a run as ASAM MDF 4.10: the time as master, and a channel for each variable in its own type with its unit.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use expression::{ColumnIndex, IntegerIndex, NumberIndex, TextIndex};
use mdf_file::{MdfCell, MdfColumn, MdfColumnType, MdfDescription, MdfWriter};

use super::{RunHeader, Sink, partial_path};
use crate::columns::{self, ValueKind, VariableDirection};
use crate::row::{RecordedVariables, Row};

/// A file of MDF. It gets its name when it is complete.
pub struct MdfSink {
    path: PathBuf,
    partial: PathBuf,
    /// None behind the end.
    writer: Option<MdfWriter>,
    columns: Vec<ChannelSource>,
}

/// Where the values of a column come from.
enum ChannelSource {
    Real(NumberIndex<RecordedVariables>),
    Integer(NumberIndex<RecordedVariables>),
    Signed(IntegerIndex<RecordedVariables>),
    Unsigned(IntegerIndex<RecordedVariables>),
    Boolean(NumberIndex<RecordedVariables>),
    Text(TextIndex<RecordedVariables>),
}

impl MdfSink {
    /// The files that it may leave.
    pub const FILES: &[&str] = &["run.mf4", "run.mf4.partial"];

    /// Begins the file `run.mf4` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        Self::create(header, &header.folder.join("run.mf4"))
    }

    /// Begins a file of any name. Until it is complete it has the ending `.partial` as well.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(header: &RunHeader, path: &Path) -> Result<Self, Error> {
        let all = &header.columns;
        // Of two columns of one name the output counts, which comes first.
        let first = |column: &columns::Column, at| all.find(&column.qualified_name()) == Some(at);
        let numbers = all.number_columns().filter(|(at, it)| first(it, ColumnIndex::Number(*at)));
        let texts = all.text_columns().filter(|(at, it)| first(it, ColumnIndex::Text(*at)));
        let number = |index, kind| match (kind, all.integer_index_of(index)) {
            (ValueKind::UInt64, Some(integer)) => ChannelSource::Unsigned(integer),
            (_, Some(integer)) => ChannelSource::Signed(integer),
            (ValueKind::Integer, None) => ChannelSource::Integer(index),
            (ValueKind::Boolean, None) => ChannelSource::Boolean(index),
            _ => ChannelSource::Real(index),
        };
        let places = numbers
            .map(|(index, column)| (column, number(index, column.kind)))
            .chain(texts.map(|(index, column)| (column, ChannelSource::Text(index))));
        let (described, columns): (Vec<_>, Vec<_>) =
            places.map(|(column, place)| (mdf_column(column, &place), place)).unzip();
        let partial = partial_path(path);
        let writer = MdfWriter::create(&partial, &mdf_description(header), &described)
            .map_err(|error| Error::output_failure(&partial, error))?;
        Ok(MdfSink { path: path.to_owned(), partial, writer: Some(writer), columns })
    }
}

impl ChannelSource {
    fn mdf_column_type(&self) -> MdfColumnType {
        match self {
            ChannelSource::Real(_) => MdfColumnType::Real,
            ChannelSource::Integer(_) | ChannelSource::Signed(_) => MdfColumnType::Signed,
            ChannelSource::Unsigned(_) => MdfColumnType::Unsigned,
            ChannelSource::Boolean(_) => MdfColumnType::Boolean,
            ChannelSource::Text(_) => MdfColumnType::Text,
        }
    }

    fn mdf_cell<'r>(&self, row: &'r Row<RecordedVariables>) -> MdfCell<'r> {
        match self {
            ChannelSource::Real(at) => MdfCell::Real(row[*at]),
            // What a run holds of these is exact in both types.
            ChannelSource::Integer(at) => MdfCell::Signed(row[*at] as i64),
            ChannelSource::Signed(at) => MdfCell::Signed(row[*at] as i64),
            ChannelSource::Unsigned(at) => MdfCell::Unsigned(row[*at] as u64),
            ChannelSource::Boolean(at) => MdfCell::Boolean(row[*at] != 0.0),
            ChannelSource::Text(at) => MdfCell::Text(&row[*at]),
        }
    }
}

/// A column, as the file describes it.
fn mdf_column(column: &columns::Column, place: &ChannelSource) -> MdfColumn {
    let input = (column.direction == VariableDirection::Input).then(|| "input".to_owned());
    let comment = [input, column.description.clone()].into_iter().flatten().collect::<Vec<_>>();
    MdfColumn {
        name: column.qualified_name(),
        unit: column.unit.clone(),
        comment: (!comment.is_empty()).then(|| comment.join(": ")),
        kind: place.mdf_column_type(),
    }
}

/// What was run.
fn mdf_description(header: &RunHeader) -> MdfDescription {
    let known = [
        ("scenario", header.scenario.clone()),
        ("step", header.step.to_string()),
        ("seed", header.seed.to_string()),
    ];
    MdfDescription {
        comment: Some(header.title.clone()),
        properties: known.map(|(name, value)| (format!("trackside.{name}"), value)).into(),
        group: Some(header.scenario.clone()),
        tool: Some(("trackside".to_owned(), env!("CARGO_PKG_VERSION").to_owned())),
        start: None,
    }
}

impl Sink for MdfSink {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let cells: Vec<_> = self.columns.iter().map(|it| it.mdf_cell(row)).collect();
        writer.write_row(time, &cells).map_err(|error| Error::output_failure(&self.partial, error))
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.finish().map_err(|error| Error::output_failure(&self.partial, error))?;
        super::rename_completed_file(&self.partial, &self.path, completed)
    }
}

#[cfg(test)]
mod tests {
    use mdf_file::{ChannelValueKind, ChannelValues, MdfFile};

    use super::*;
    use crate::columns::Columns;
    use crate::view::ReplayView;

    fn column(variable: &str, kind: ValueKind, direction: VariableDirection) -> columns::Column {
        let unit = (kind == ValueKind::Real).then(|| "m/s".to_owned());
        let (node, description) = ("car".to_owned(), Some(format!("the {variable}")));
        columns::Column { node, variable: variable.to_owned(), direction, kind, unit, description }
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
            column("delta", ValueKind::Real, VariableDirection::Input),
            output("word", ValueKind::String),
        ]
        .into_iter()
        .collect();
        RunHeader {
            scenario: "made".to_owned(),
            title: "A <made> run".to_owned(),
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

    fn write(folder: &Path, completed: bool) {
        let header = header(folder);
        let mut sink = MdfSink::new(&header).expect("a file");
        let integers: Vec<_> = header.columns.integer_columns().collect();
        let [(first, first_number), (second, second_number)] = integers[..] else { panic!("two integers") };
        for tick in 0..3u32 {
            let mut row = header.columns.zero_row();
            let number = f64::from(tick);
            let numbers = [number.sin(), number, f64::from(tick % 2), 0.0, 0.0, -1.0, 0.1];
            row.set_values(&numbers, Some(vec![format!("row {tick}")]), &[0, 0]);
            row.set_integer(first, first_number, i128::from(i64::MIN) + i128::from(tick));
            row.set_integer(second, second_number, i128::from(u64::MAX) - i128::from(tick));
            sink.push_row(tick.into(), number * 0.5, &row).expect("it takes a row");
        }
        sink.finish("", completed).expect("it ends");
    }

    #[test]
    fn each_type_comes_back_exactly_with_its_unit() {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), true);
        let mut file = MdfFile::open(&folder.path().join("run.mf4")).expect("the file");
        assert_eq!(file.file_comment(), Some("A <made> run"));
        let channels = file.channels().to_vec();
        let names: Vec<_> = channels.iter().map(|it| it.name.as_str()).collect();
        let expected =
            ["time", "car.v", "car.gear", "car.on", "car.low", "car.high", "car.delta", "car.word"];
        assert_eq!(names, expected);
        let units = [0, 1, 2].map(|it: usize| channels[it].unit.as_deref());
        assert_eq!(units, [Some("s"), Some("m/s"), None]);
        assert_eq!(channels[2].comment.as_deref(), Some("the gear"));
        assert_eq!(channels[6].comment.as_deref(), Some("input: the delta"));
        assert_eq!((channels[7].kind, channels[7].group.as_str()), (ChannelValueKind::Text, "made"));
        let read = file.read_columns(&[1, 2, 3, 4, 5, 6, 7]).expect("values").remove(0);
        assert_eq!(read.times, [0.0, 0.5, 1.0]);
        let exact = |first: i128, step: i128| {
            ChannelValues::Integers((0..3).map(|it| Some(first + step * it)).collect())
        };
        let text = |it: u32| Some(format!("row {it}"));
        let expected = [
            ChannelValues::Numbers([0.0f64, 1.0, 2.0].map(f64::sin).into()),
            exact(0, 1),
            ChannelValues::Numbers(vec![0.0, 1.0, 0.0]),
            exact(i64::MIN.into(), 1),
            exact(u64::MAX.into(), -1),
            ChannelValues::Numbers(vec![0.1; 3]),
            ChannelValues::Texts((0..3).map(text).collect()),
        ];
        assert_eq!(read.values, expected);
    }

    #[test]
    fn a_run_that_ends_early_leaves_no_complete_file() {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), false);
        assert!(!folder.path().join("run.mf4").exists());
        let file = MdfFile::open(&folder.path().join("run.mf4.partial")).expect("what there is");
        assert_eq!(file.clocks()[0].rows, Some(3));
    }
}
