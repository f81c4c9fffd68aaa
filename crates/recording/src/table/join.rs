//! Concatenates tables of several logs in time.

use super::{ExactValues, TableClock, TableColumn, TimeSeriesTable};

/// Between the end of a log and the beginning of the next one [s]: no rule for gaps joins them, and no filter runs on.
const PAUSE: f64 = 10.0;

impl TimeSeriesTable {
    /// Joins tables with the same columns, which are read as numbers. Each begins 10 s behind the end of the one before, whatever its own times are; the
    /// clock of the file is that of the first one. Nothing of no tables.
    ///
    /// # Panics
    /// When they have different numbers of columns.
    #[must_use]
    pub fn concatenate(tables: Vec<TimeSeriesTable>) -> Option<TimeSeriesTable> {
        let mut tables = tables.into_iter();
        let mut joined = tables.next()?;
        joined.set_origin(None);
        tables.for_each(|table| joined.append_table(table));
        Some(joined)
    }

    fn append_table(&mut self, table: TimeSeriesTable) {
        assert_eq!(self.columns.len(), table.columns.len(), "the same columns");
        let shown = |clock: &TableClock, stamp: &f64| stamp + clock.delay;
        let end = |it: &TableClock| it.stamps.last().map(|last| shown(it, last));
        let begin = |it: &TableClock| it.stamps.first().map(|first| shown(it, first));
        let end = self.clocks.iter().filter_map(end).reduce(f64::max).unwrap_or(0.0);
        let begin = table.clocks.iter().filter_map(begin).reduce(f64::min).unwrap_or(0.0);
        let shift = end + PAUSE - begin;
        let old: Vec<TableClock> = std::mem::take(&mut self.clocks);
        // Columns share a clock that they shared in both.
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for (column, more) in self.columns.iter_mut().zip(table.columns) {
            let pair = (column.clock, more.clock);
            column.clock = pairs.iter().position(|it| *it == pair).unwrap_or_else(|| {
                let (first, then) = (&old[pair.0], &table.clocks[pair.1]);
                let stamps = first.stamps.iter().copied();
                let stamps = stamps.chain(then.stamps.iter().map(|stamp| stamp + shift)).collect();
                self.clocks.push(TableClock { stamps, delay: first.delay, cursor: 0 });
                pairs.push(pair);
                pairs.len() - 1
            });
            column.values.extend(more.values);
        }
        self.logs.push(end + PAUSE / 2.0);
        self.warnings.extend(table.warnings);
    }

    /// Leaves out all columns but these, by their indices in rising order.
    pub fn retain_columns(&mut self, columns: &[usize]) {
        let mut place = 0..;
        self.columns.retain(|_| columns.contains(&place.next().unwrap_or_default()));
    }

    /// Converts the numbers of a column: value times factor plus offset.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    pub fn scale_column(&mut self, column: usize, factor: f64, offset: f64) {
        if let TableColumn { exact: ExactValues::Nothing, values, .. } = &mut self.columns[column] {
            values.iter_mut().for_each(|value| *value = *value * factor + offset);
        }
    }

    /// Adds a column with the number of the log that each row of the first column is from, counted from 1.
    pub fn add_log_number_column(&mut self, name: &str) {
        let Some(first) = self.columns.first() else { return };
        let (clock, of) = (first.clock, &self.clocks[first.clock]);
        let number = |stamp: &f64| 1 + self.logs.iter().filter(|begin| stamp + of.delay > **begin).count();
        let values = of.stamps.iter().map(|stamp| number(stamp) as f64).collect();
        let (name, exact, unit) = (name.to_owned(), ExactValues::Nothing, None);
        self.columns.push(TableColumn { name, clock, values, exact, unit });
    }
}
