//! Keeps the rows of a table within given time ranges.

use super::{TableClock, TableColumn, TimeSeriesTable};

impl TimeSeriesTable {
    /// Keeps the rows within any of these stretches, both ends included [s, times as of [`TimeSeriesTable::clock_times`]].    ///
    /// # Errors
    /// When a column keeps no row: its name, and from when until when it goes [s].
    pub fn keep_time_ranges(&mut self, stretches: &[[f64; 2]]) -> Result<(), (String, [f64; 2])> {
        let origin = self.origin;
        let is_kept = |stamp: &f64| {
            let time = stamp - origin;
            stretches.iter().any(|[from, until]| (*from..=*until).contains(&time))
        };
        let kept: Vec<Vec<bool>> =
            self.clocks.iter().map(|it| it.stamps.iter().map(is_kept).collect()).collect();
        for TableColumn { name, clock, .. } in &self.columns {
            let stamps = &self.clocks[*clock].stamps;
            if !kept[*clock].contains(&true) {
                let ends = [stamps.first(), stamps.last()].map(|it| it.map_or(0.0, |it| it - origin));
                return Err((name.clone(), ends));
            }
        }
        for (TableClock { stamps, cursor, .. }, kept) in self.clocks.iter_mut().zip(&kept) {
            retain_rows(stamps, kept);
            *cursor = 0;
        }
        for column in &mut self.columns {
            retain_rows(&mut column.values, &kept[column.clock]);
        }
        Ok(())
    }
}

fn retain_rows(values: &mut Vec<f64>, kept: &[bool]) {
    let mut kept = kept.iter();
    values.retain(|_| kept.next().copied().unwrap_or(false));
}
