//! Fills gaps by the rule of their column, drops their rows, or cuts the ends.

use std::path::Path;

use diagnostics::suggest::join_shortened;

use super::read_request::{ColumnRequest, GapRule};
use super::{ExactValues, ReadColumns, ReadSeries, TableError};

/// Fills the gaps, which are NaN. Before the first value of a column, and after the last one when it interpolates, there is
/// nothing to fill them with: these rows are left out of all columns that share its time stamps, and a warning says so.
pub(super) fn fill_gaps(
    path: &Path,
    recorded: &mut ReadColumns,
    wanted: &[ColumnRequest],
) -> Result<(), TableError> {
    let ReadColumns { clocks, columns, .. } = recorded;
    for (column, wanted) in columns.iter_mut().zip(wanted) {
        let Ok(series) = column else { continue };
        if let Err(error) = fill_series_gaps(path, clocks, series, wanted) {
            *column = Err(error);
        }
    }
    (0..recorded.clocks.len()).try_for_each(|clock| trim_gap_ends(path, recorded, clock, wanted))
}

fn fill_series_gaps(
    path: &Path,
    clocks: &mut Vec<Vec<f64>>,
    series: &mut ReadSeries,
    wanted: &ColumnRequest,
) -> Result<(), TableError> {
    let Some(place) = series.gap.take() else { return Ok(()) };
    let count = series.values.iter().filter(|value| value.is_nan()).count();
    let (path, column) = (path.to_owned(), wanted.column.clone());
    if count == series.values.len() {
        return Err(TableError::NoValue { path, column });
    }
    match wanted.gaps {
        GapRule::Refuse => return Err(TableError::GapRule { path, column, count, place }),
        GapRule::Hold => hold_last_value(&mut series.values),
        // Between two texts or integers there is no third one.
        GapRule::Interpolate if !matches!(series.exact, ExactValues::Nothing) => {
            hold_last_value(&mut series.values)
        }
        GapRule::Interpolate => interpolate_gaps(&mut series.values, &clocks[series.clock]),
        GapRule::Drop => drop_rows(clocks, series),
    }
    Ok(())
}

/// Leaves rows out of one column, which gets a clock of its own; columns that have values in the same rows share it.
fn drop_rows(clocks: &mut Vec<Vec<f64>>, series: &mut ReadSeries) {
    let rows = clocks[series.clock].iter().zip(&series.values);
    let (stamps, values): (Vec<f64>, Vec<f64>) =
        rows.filter(|(_, value)| !value.is_nan()).map(|(stamp, value)| (*stamp, *value)).unzip();
    series.values = values;
    series.clock = clocks.iter().position(|clock| *clock == stamps).unwrap_or_else(|| {
        clocks.push(stamps);
        clocks.len() - 1
    });
}

fn hold_last_value(values: &mut [f64]) {
    for row in 1..values.len() {
        if values[row].is_nan() {
            values[row] = values[row - 1];
        }
    }
}

fn interpolate_gaps(values: &mut [f64], stamps: &[f64]) {
    let known: Vec<_> = (0..values.len()).filter(|row| !values[*row].is_nan()).collect();
    for pair in known.windows(2) {
        let (left, right) = (pair[0], pair[1]);
        for row in left + 1..right {
            let share = (stamps[row] - stamps[left]) / (stamps[right] - stamps[left]);
            values[row] = values[left] * (1.0 - share) + values[right] * share;
        }
    }
}

/// Leaves out the rows at both ends where a column of the clock has no value.
fn trim_gap_ends(
    path: &Path,
    recorded: &mut ReadColumns,
    clock: usize,
    wanted: &[ColumnRequest],
) -> Result<(), TableError> {
    let rows = recorded.clocks[clock].len();
    let on_clock = |series: &&ReadSeries| series.clock == clock;
    let known = |value: &f64| !value.is_nan();
    let begin = |series: &ReadSeries| series.values.iter().position(known).unwrap_or(rows);
    let end = |series: &ReadSeries| series.values.iter().rposition(known).map_or(0, |row| row + 1);
    let columns = || recorded.columns.iter().flatten().filter(on_clock);
    let first = columns().map(begin).max().unwrap_or(0);
    let last = columns().map(end).min().unwrap_or(rows);
    if first == 0 && last == rows {
        return Ok(());
    }
    let late = |series: &ReadSeries| begin(series) > 0 || end(series) < rows;
    let named = recorded.columns.iter().zip(wanted);
    let named = named.filter_map(|(series, wanted)| Some((series.as_ref().ok()?, wanted)));
    let blamed = named.filter(|(series, _)| series.clock == clock && late(series));
    let blamed: Vec<_> = blamed.map(|(_, wanted)| format!("`{}`", wanted.column)).collect();
    let blamed = join_shortened(&blamed);
    if first >= last {
        return Err(TableError::Apart { path: path.to_owned(), columns: blamed });
    }
    let stamps = &mut recorded.clocks[clock];
    let (from, to) = (stamps[first] + recorded.zero, stamps[last - 1] + recorded.zero);
    recorded.warnings.push(format!(
        "{} is read from {from} s to {to} s: outside of it {blamed} has no value, {first} rows at the beginning and {} at \
         the end are left out",
        path.display(),
        rows - last
    ));
    *stamps = stamps[first..last].to_vec();
    for series in recorded.columns.iter_mut().flatten().filter(|series| series.clock == clock) {
        series.values = series.values[first..last].to_vec();
    }
    Ok(())
}
