//! Writes a run as a MoTeC `.ld` file for i2: a channel for each number, at the rate of the run's steps. Texts are left out.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use expression::{ColumnIndex, NumberIndex};
use log_file::{LdChannel, LdSession, LdWriter, ld_names};

use super::{RunHeader, Sink, SinkNotice, partial_path};
use crate::columns::ValueKind;
use crate::row::{RecordedVariables, Row};

/// A MoTeC file. It gets its name when it is complete.
pub struct LdSink {
    path: PathBuf,
    partial: PathBuf,
    /// None behind the end.
    writer: Option<LdWriter>,
    columns: Vec<NumberIndex<RecordedVariables>>,
    notices: Vec<SinkNotice>,
    step: f64,
    /// The time of the first row [s].
    first: Option<f64>,
    rows: u32,
}

impl LdSink {
    /// The files that it may leave.
    pub const FILES: &[&str] = &["run.ld", "run.ld.partial"];

    /// Begins the file `run.ld` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be created, or the run's step is not one over a whole rate.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        Self::create(header, &header.folder.join("run.ld"))
    }

    /// Begins a file of any name. Until it is complete it has the ending `.partial` as well.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn create(header: &RunHeader, path: &Path) -> Result<Self, Error> {
        let rate = sample_rate(header.step)?;
        let all = &header.columns;
        // Of two columns of one name the output counts, which comes first.
        let numbers = all
            .number_columns()
            .filter(|(at, it)| all.find(&it.qualified_name()) == Some(ColumnIndex::Number(*at)));
        let (columns, described): (Vec<_>, Vec<_>) = numbers.unzip();
        let names: Vec<_> = described.iter().map(|it| it.qualified_name()).collect();
        let short = ld_names(&names);
        let channel = |((column, index), name): ((&&crate::columns::Column, &NumberIndex<_>), &String)| {
            let is_integer = matches!(column.kind, ValueKind::Integer | ValueKind::Boolean)
                && all.integer_index_of(*index).is_none();
            let unit = column.unit.clone().unwrap_or_default();
            LdChannel { name: name.clone(), unit, is_integer }
        };
        let channels: Vec<_> = described.iter().zip(&columns).zip(&short).map(channel).collect();
        let partial = partial_path(path);
        let room = ((header.stop / header.step).round() + 2.0) as u32;
        let writer = LdWriter::create(&partial, &ld_session(header), &channels, rate, room)
            .map_err(|error| Error::output_failure(&partial, error))?;
        let mut sink = LdSink {
            path: path.to_owned(),
            partial,
            writer: Some(writer),
            columns,
            notices: Vec::new(),
            step: header.step,
            first: None,
            rows: 0,
        };
        sink.warn_about_short_names(&names, &short);
        let texts: Vec<_> = all.text_columns().map(|(_, it)| format!("`{}`", it.qualified_name())).collect();
        if !texts.is_empty() {
            sink.push_warning(&format!("texts are left out, it has numbers only: {}", texts.join(", ")));
        }
        Ok(sink)
    }

    fn push_warning(&mut self, what: &str) {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.notices.push(SinkNotice::Warning(format!("{name}: {what}")));
    }

    fn warn_about_short_names(&mut self, names: &[String], short: &[String]) {
        let changed: Vec<_> = names
            .iter()
            .zip(short)
            .filter(|(name, short)| name != short)
            .map(|(name, short)| format!("`{short}` is `{name}`"))
            .collect();
        if !changed.is_empty() {
            let (most, count) = (LdWriter::NAME, changed.len());
            let names = if count == 1 { "name is" } else { "names are" };
            let changed = changed.join(", ");
            self.push_warning(&format!("{count} {names} shortened to at most {most} letters: {changed}"));
        }
    }
}

/// The rate of a step [Hz].
fn sample_rate(step: f64) -> Result<u16, Error> {
    let rate = (1.0 / step).round();
    if !(1.0..=f64::from(u16::MAX)).contains(&rate) || (rate * step - 1.0).abs() > 1e-9 {
        let text = format!("a MoTeC file has a whole rate of 1 to 65535 Hz, found a step of {step} s");
        return Err(Error::invalid_input(text).with_help("take a step such as 0.001, 0.002, 0.005 or 0.01"));
    }
    Ok(rate as u16)
}

/// What was run.
fn ld_session(header: &RunHeader) -> LdSession {
    LdSession {
        event: header.scenario.clone(),
        session: format!("seed {}", header.seed),
        comment: header.title.clone(),
        ..LdSession::default()
    }
}

impl Sink for LdSink {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let expected = self.first.unwrap_or(time) + f64::from(self.rows) * self.step;
        if (time - expected).abs() > 0.01 * self.step {
            let text = format!("expected a row at {expected} s, found the next one at {time} s");
            return Err(Error::output_failure(&self.partial, text));
        }
        let values = self.columns.iter().map(|it| row[*it]);
        writer.write_row(values).map_err(|error| Error::output_failure(&self.partial, error))?;
        self.rows += 1;
        if self.first.is_none() {
            self.first = Some(time);
            if time != 0.0 {
                self.push_warning(&format!("its time 0 is {time} s of the run"));
            }
        }
        Ok(())
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.finish().map_err(|error| Error::output_failure(&self.partial, error))?;
        super::rename_completed_file(&self.partial, &self.path, completed)
    }

    fn take_notices(&mut self) -> Vec<SinkNotice> {
        std::mem::take(&mut self.notices)
    }
}

#[cfg(test)]
mod tests {
    use log_file::LogFile;

    use super::*;
    use crate::columns::{Column, Columns, VariableDirection};
    use crate::view::ReplayView;

    fn column(variable: &str, kind: ValueKind, direction: VariableDirection) -> Column {
        let unit = (kind == ValueKind::Real).then(|| "m/s2".to_owned());
        let (node, variable) = ("car".to_owned(), variable.to_owned());
        Column { node, variable, direction, kind, unit, description: None }
    }

    fn header(folder: &Path, step: f64) -> RunHeader {
        let columns: Columns<_> = [
            column("a_x", ValueKind::Real, VariableDirection::Output),
            column("gear", ValueKind::Integer, VariableDirection::Output),
            column("a_x", ValueKind::Real, VariableDirection::Input),
            column("suspension.front_left.damper_force", ValueKind::Real, VariableDirection::Output),
            column("word", ValueKind::String, VariableDirection::Output),
        ]
        .into_iter()
        .collect();
        RunHeader {
            scenario: "made".to_owned(),
            title: "A made run".to_owned(),
            source: diagnostics::SourceFiles::from_generated(diagnostics::TextFile::default()),
            given: Vec::new(),
            step,
            stop: 1.0,
            seed: 7,
            columns,
            status_tracks: Vec::new(),
            view: ReplayView::default(),
            folder: folder.to_owned(),
        }
    }

    fn write(folder: &Path, times: &[f64], completed: bool) -> (Result<(), Error>, String) {
        let header = header(folder, 0.01);
        let mut sink = LdSink::new(&header).expect("a file");
        let mut row = header.columns.zero_row();
        let written = times.iter().try_for_each(|time| {
            row.set_values(&[*time, 3.0, -1.0, 0.5], Some(vec!["a".to_owned()]), &[]);
            sink.push_row(0, *time, &row)
        });
        sink.finish("", completed).expect("it ends");
        let text = |it: SinkNotice| match it {
            SinkNotice::Warning(text) => text,
            other => panic!("{other:?}"),
        };
        (written, sink.take_notices().into_iter().map(text).collect::<Vec<_>>().join("; "))
    }

    #[test]
    fn numbers_come_back_and_what_is_lost_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let (written, told) = write(folder.path(), &[0.5, 0.51, 0.52], true);
        assert!(written.is_ok());
        for what in [
            "run.ld: 1 name is shortened to at most 31 letters: `",
            "` is `car.suspension.front_left.damper_force`",
            "run.ld: texts are left out, it has numbers only: `car.word`",
            "run.ld: its time 0 is 0.5 s of the run",
        ] {
            assert!(told.contains(what), "{what}: {told}");
        }
        let path = folder.path().join("run.ld");
        let mut log = LogFile::open(&path).expect("it is read").expect("a log");
        let names: Vec<_> = log.channels().iter().map(|it| it.name.as_str()).collect();
        assert_eq!(names, ["car.a_x", "car.gear", "pension.front_left.damper_force"]);
        let read = log.read_all_rows(&[0, 1]).expect("the numbers");
        assert_eq!((read[0].len(), read[0].number_at(1)), (3, Some(f64::from(0.51f32))));
        assert_eq!(read[1].number_at(2), Some(3.0));
    }

    #[test]
    fn a_run_that_ends_early_leaves_no_complete_file() {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), &[0.0, 0.01], false).0.expect("rows");
        assert!(!folder.path().join("run.ld").exists());
        assert!(LogFile::open(&folder.path().join("run.ld.partial")).is_ok_and(|it| it.is_some()));
    }

    #[test]
    fn a_rate_that_motec_has_not_is_refused_and_so_is_a_gap() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = LdSink::new(&header(folder.path(), 0.003)).err().expect("no whole rate");
        assert!(error.to_string().contains("found a step of 0.003 s"), "{error}");
        let gap = write(folder.path(), &[0.0, 0.02], true).0.expect_err("a gap").to_string();
        assert!(gap.contains("expected a row at 0.01 s"), "{gap}");
    }
}
