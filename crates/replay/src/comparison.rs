//! Merges two recorded runs for a comparison: common columns with unit conversion, one layout, notes on what differs.

mod card;

use std::path::Path;

use diagnostics::Error;
use recording::view::ReplayView;
use recording::{
    AnalysisColumns, Column, Columns, NumberIndex, NumberKind, RecordedVariables, Recording, Row, RunEvent,
    RunHeader, Sink, StatusChange, TextIndex, TextKind, TypedIndex,
};
use scenario::Scenario;
use scenario::resolve::{layout_by_unit, plots_by_unit, replay_layout};
use units::Unit;

/// Two recorded runs.
pub struct RunComparison {
    /// The runs, A and B.
    pub runs: [RecordedRun; 2],
    /// Oddities of the runs, such as a recording that was cut off.
    pub notes: Vec<String>,
    /// What whoever compares them knows of their inputs.
    pub differences: RunDifferences,
}

/// What differs between two runs, as far as their recordings do not tell.
#[derive(Debug, Clone, Default)]
pub struct RunDifferences {
    /// Inputs, with the values of both; without them the scenarios in the recordings are compared.
    pub inputs: Option<Vec<(String, [String; 2])>>,
    /// The first time at which a value differs [s]: the viewer opens there.
    pub first_time: Option<f64>,
}

/// One of the two runs.
pub struct RecordedRun {
    /// The part of its path that differs from the other run's.
    pub name: String,
    /// Its description, with the columns of both runs and the part of the layout that this one can fill.
    pub header: RunHeader,
    /// Its recording.
    pub recording: Recording,
    mapping: ColumnMapping,
}

/// For each value of a common row its origin in a row of the run; nothing for what the run lacks.
struct ColumnMapping {
    numbers: Vec<Option<SourceColumn<NumberKind>>>,
    texts: Vec<Option<SourceColumn<TextKind>>>,
}

/// A column of a run, and its conversion to the unit of the common column.
struct SourceColumn<K> {
    index: TypedIndex<K, RecordedVariables>,
    factor: f64,
    offset: f64,
}

impl RunComparison {
    /// Opens both runs. The layout is that of the scenario of A; without plots there is one for each unit of each node.
    ///
    /// # Errors
    /// When one of them cannot be read, or they have no signal in common.
    pub fn open(a: &Path, b: &Path, differences: RunDifferences) -> Result<Self, Error> {
        let recordings = [Recording::open(a)?, Recording::open(b)?];
        let names = distinct_path_endings([a, b]);
        let mut notes = Vec::new();
        for recording in recordings.iter().filter(|it| it.cut) {
            let path = recording.path().display();
            notes.push(format!("{path} was cut off: it is shown up to its last whole chunk"));
        }
        let [of_a, of_b] = [&recordings[0].header, &recordings[1].header];
        let all = |header: &RunHeader| -> [Vec<Column>; 2] {
            let numbers = header.columns.number_columns().map(|(_, column)| column.clone()).collect();
            [numbers, header.columns.text_columns().map(|(_, column)| column.clone()).collect()]
        };
        let ([numbers_a, texts_a], [numbers_b, texts_b]) = (all(of_a), all(of_b));
        let (merged, numbers) = merge_columns::<NumberKind>(&numbers_a, &numbers_b, &mut notes);
        let (texts, words) = merge_columns::<TextKind>(&texts_a, &texts_b, &mut notes);
        let columns: Columns<_> = merged.into_iter().chain(texts).collect();
        if numbers.common + words.common == 0 {
            return Err(no_common_signal(&recordings));
        }
        for (only, name) in [(&numbers.only[0], &names[0]), (&numbers.only[1], &names[1])] {
            let only: Vec<_> = only.iter().map(|&index| columns[index].qualified_name()).collect();
            if !only.is_empty() {
                notes.push(format!("only {name} has {}", only.join(", ")));
            }
        }
        let header = RunHeader { columns, ..of_a.clone() };
        let view = common_view(&recordings, &header, &numbers.only[1], &names[1], &mut notes);
        let mappings = numbers.mappings.into_iter().zip(words.mappings);
        let mappings = mappings.map(|(numbers, texts)| ColumnMapping { numbers, texts });
        let lacks = [numbers.only[1].clone(), numbers.only[0].clone()];
        let runs = recordings.into_iter().zip(names).zip(mappings.zip(lacks));
        let runs = runs.map(|((recording, name), (mapping, lacks))| {
            let (columns, view) = (header.columns.clone(), view.without_columns(&lacks));
            let header = RunHeader { columns, view, ..recording.header.clone() };
            RecordedRun { name, header, recording, mapping }
        });
        let mut runs = runs.collect::<Vec<_>>().into_iter();
        match (runs.next(), runs.next()) {
            (Some(a), Some(b)) => Ok(RunComparison { runs: [a, b], notes, differences }),
            _ => Err(Error::invalid_input("expected two runs")),
        }
    }
}

impl RecordedRun {
    /// Plays common rows and events to a sink, with NaN for the columns that this run lacks.
    ///
    /// # Errors
    /// When the recording is damaged, or the sink fails.
    pub fn replay_into_sink(&self, sink: &mut dyn Sink) -> Result<(), Error> {
        let row = self.header.columns.zero_row();
        self.recording.replay_into(&mut CommonRowSink { mapping: &self.mapping, row, sink })
    }
}

/// Turns rows of a run into common rows.
struct CommonRowSink<'a> {
    mapping: &'a ColumnMapping,
    row: Row<RecordedVariables>,
    sink: &'a mut dyn Sink,
}

impl Sink for CommonRowSink<'_> {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        for (position, from) in self.mapping.numbers.iter().enumerate() {
            self.row[NumberIndex::new(position)] = match from {
                Some(SourceColumn { index, factor, offset }) => row[*index] * factor + offset,
                None => f64::NAN,
            };
        }
        for (position, from) in self.mapping.texts.iter().enumerate() {
            if let Some(SourceColumn { index, .. }) = from {
                self.row[TextIndex::new(position)].clone_from(&row[*index]);
            }
        }
        self.sink.push_row(tick, time, &self.row)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        self.sink.push_event(event)
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.sink.push_status_change(change)
    }

    fn push_derived_columns(&mut self, derived: &AnalysisColumns) -> Result<(), Error> {
        self.sink.push_derived_columns(derived)
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.sink.finish(summary, completed)
    }
}

/// The common columns of two runs.
struct CommonColumns<K> {
    /// For each run the origins of all common columns.
    mappings: [Vec<Option<SourceColumn<K>>>; 2],
    /// The number of columns that both have.
    common: usize,
    /// The columns that only one has.
    only: [Vec<TypedIndex<K, RecordedVariables>>; 2],
}

/// The columns of A, in its units, then those that only B has.
fn merge_columns<K>(a: &[Column], b: &[Column], notes: &mut Vec<String>) -> (Vec<Column>, CommonColumns<K>) {
    let mut columns = a.to_vec();
    let origin =
        |position, (factor, offset)| Some(SourceColumn { index: TypedIndex::new(position), factor, offset });
    let same = |position| origin(position, (1.0, 0.0));
    let mut mappings: [Vec<_>; 2] = [(0..a.len()).map(same).collect(), (0..a.len()).map(|_| None).collect()];
    for (position, column) in b.iter().enumerate() {
        let same_name = |it: &Column| {
            (&it.node, &it.variable, it.direction) == (&column.node, &column.variable, column.direction)
        };
        let known = a.iter().position(same_name);
        match known.and_then(|known| Some((known, unit_conversion(column, &a[known])?))) {
            Some((known, conversion)) => mappings[1][known] = origin(position, conversion),
            None => {
                if let Some(known) = known {
                    let [in_a, in_b] = [&a[known], column].map(|it| it.unit.as_deref().unwrap_or("1"));
                    let name = column.qualified_name();
                    notes.push(format!(
                        "`{name}` is in {in_a} and in {in_b}, which do not fit; it is shown as two signals"
                    ));
                }
                columns.push(column.clone());
                mappings[0].push(None);
                mappings[1].push(same(position));
            }
        }
    }
    let pairs = || mappings[0].iter().zip(&mappings[1]).enumerate();
    let only = |run: usize| {
        let other = |(position, (a, b)): (usize, (&Option<_>, &Option<_>))| {
            [b, a][run].is_none().then_some(TypedIndex::new(position))
        };
        pairs().filter_map(other).collect()
    };
    let only = [only(0), only(1)];
    let common = pairs().filter(|(_, (a, b))| a.is_some() && b.is_some()).count();
    (columns, CommonColumns { mappings, common, only })
}

/// Factor and offset from one column to another one, if they can be compared. A missing unit is taken to be that of the other
/// column.
fn unit_conversion(from: &Column, to: &Column) -> Option<(f64, f64)> {
    let (Some(from), Some(to)) = (&from.unit, &to.unit) else { return Some((1.0, 0.0)) };
    if from == to {
        return Some((1.0, 0.0));
    }
    Unit::conversion(&Unit::parse(from).ok()?, &Unit::parse(to).ok()?)
}

/// The scenario of a run.
fn recorded_scenario(recording: &Recording) -> Result<Scenario, Error> {
    Scenario::from_recording(&recording.header.scenario, recording.header.source.clone())
}

/// The layout of both runs; columns that only B has get plots of their own.
fn common_view(
    recordings: &[Recording; 2],
    header: &RunHeader,
    only_b: &[NumberIndex<RecordedVariables>],
    name: &str,
    notes: &mut Vec<String>,
) -> ReplayView {
    let laid = recorded_scenario(&recordings[0])
        .and_then(|it| Ok((replay_layout(&it, header)?, it.document.view.plot.is_empty())));
    let (mut view, complete) = match laid {
        Ok(laid) => laid,
        Err(error) => {
            let path = recordings[0].path().display();
            notes.push(format!("the [view] of {path} is not used: {error}"));
            return layout_by_unit(&header.columns);
        }
    };
    if !complete {
        let mut more =
            plots_by_unit(header.columns.number_columns().filter(|(index, _)| only_b.contains(index)));
        more.iter_mut().for_each(|plot| plot.group = Some(format!("Only {name}")));
        view.plots.extend(more);
        view.add_signals(view.shown_columns());
    }
    view
}

fn no_common_signal(recordings: &[Recording; 2]) -> Error {
    let nodes = |recording: &Recording| {
        let mut nodes: Vec<_> =
            recording.header.columns.number_columns().map(|(_, it)| it.node.clone()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        format!("{} has {}", recording.path().display(), nodes.join(", "))
    };
    let message = "the two runs have no signal in common";
    Error::invalid_input(message).with_help(format!(
        "expected two runs of one scenario, or of scenarios whose nodes and variables have the same names: {}; {}",
        nodes(&recordings[0]),
        nodes(&recordings[1])
    ))
}

/// The shortest ends of both paths that differ.
fn distinct_path_endings(paths: [&Path; 2]) -> [String; 2] {
    let parts = paths.map(|path| {
        let path = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = if path.is_file() { path.parent().unwrap_or(&path).to_owned() } else { path.clone() };
        // Two recordings in one folder differ by their files.
        let parts = |path: &Path| -> Vec<String> {
            path.components().map(|it| it.as_os_str().to_string_lossy().into_owned()).collect()
        };
        (parts(&folder), parts(&path))
    });
    let [(a, file_a), (b, file_b)] = parts;
    let (a, b) = if a == b { (file_a, file_b) } else { (a, b) };
    let count = a.len().max(b.len());
    let end = |parts: &[String], count: usize| parts[parts.len().saturating_sub(count)..].join("/");
    let differing = (1..=count).find(|&count| end(&a, count) != end(&b, count));
    match differing {
        Some(count) => [end(&a, count), end(&b, count)],
        None => ["A".to_owned(), "B".to_owned()],
    }
}

#[cfg(test)]
mod tests;
