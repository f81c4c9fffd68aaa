//! Places variants as lines across parallel axes, one for each varied value and the margins that matter most, for `parallel.html`.

use std::fmt::Write as _;

use units::display::number_text;

use super::{VariantEnding, evenly_thinned, shortened_name, variant_endings};
use crate::summary::SweepSummary;
use crate::table::{SweepColumn, SweepColumnRole, SweepTable};

/// Lines of all kinds together.
const MOST_LINES: usize = 1000;
/// Axes: varied values, and margins.
const MOST_VALUES: usize = 8;
const MOST_MARGINS: usize = 3;
/// Sizes [px]: of the figure, of the space beside and above the axes, and where they end below.
pub const SIZE: [f64; 2] = [1080.0, 400.0];
const BESIDE: f64 = 90.0;
pub const ABOVE: f64 = 62.0;
pub const BOTTOM: f64 = SIZE[1] - 24.0;
/// Width of a letter [px].
const LETTER: f64 = 7.0;

/// The figure: its axes, and the variants of each ending.
pub struct ParallelCoordinatesPlot {
    pub axes: Vec<ParallelAxis>,
    pub kinds: [EndingGroup; 3],
}

/// An axis with the places of the variants on it: 0 below, 1 above.
pub struct ParallelAxis {
    pub x: f64,
    pub name: String,
    pub ends: [String; 2],
    pub low: f64,
    pub high: f64,
    values: Vec<f64>,
}

/// Variants that ended alike.
pub struct EndingGroup {
    pub ending: VariantEnding,
    pub count: usize,
    /// Those that are drawn.
    pub rows: Vec<usize>,
}

impl ParallelCoordinatesPlot {
    /// Nothing when there are fewer than two axes.
    pub fn new(table: &SweepTable, summary: &SweepSummary) -> Option<Self> {
        let columns = chosen_columns(table, summary);
        let gaps = columns.len().checked_sub(1).filter(|gaps| *gaps > 0)?;
        let x = |index| BESIDE + index as f64 * (SIZE[0] - 2.0 * BESIDE) / gaps as f64;
        let axes = (0..).zip(&columns).map(|(index, column)| ParallelAxis::new(column, x(index)));
        let endings = variant_endings(table);
        let rows = |wanted: VariantEnding| -> Vec<usize> {
            (0..endings.len()).filter(|row| endings[*row] == wanted).collect()
        };
        // Either all variants have checks, or none.
        let without_checks = endings.contains(&VariantEnding::NoChecks);
        let sound = if without_checks { VariantEnding::NoChecks } else { VariantEnding::Passed };
        let all = [sound, VariantEnding::Error, VariantEnding::Failed].map(|ending| (ending, rows(ending)));
        let mut room = drawn_line_counts(all.each_ref().map(|(_, rows)| rows.len())).into_iter();
        let kinds = all.map(|(ending, rows)| EndingGroup {
            ending,
            count: rows.len(),
            rows: evenly_thinned(&rows, room.next().unwrap_or(0)),
        });
        Some(Self { axes: axes.collect(), kinds })
    }

    /// All lines of a kind. A value that is missing breaks a line.
    pub fn svg_path(&self, kind: &EndingGroup) -> String {
        let mut path = String::new();
        for &row in &kind.rows {
            let mut pen = 'M';
            for axis in &self.axes {
                match axis.y_of_row(row) {
                    Some(y) => {
                        // Writing into a string cannot fail.
                        let _ = write!(path, "{pen}{:.0} {y:.1}", axis.x);
                        pen = 'L';
                    }
                    None => pen = 'M',
                }
            }
        }
        path
    }
}

/// The varied values, the most driving first, and the margins of the checks that fail most.
fn chosen_columns<'a>(table: &'a SweepTable, summary: &SweepSummary) -> Vec<&'a SweepColumn> {
    let strength = |column: &&SweepColumn| {
        let effects = summary.outputs.iter().flat_map(|output| &output.effects);
        let own = effects.filter(|effect| effect.parameter == column.name);
        own.map(|effect| effect.effect_strength()).fold(0.0, f64::max)
    };
    let mut values: Vec<_> = table.columns_with_role(SweepColumnRole::Parameter).collect();
    values.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    values.truncate(MOST_VALUES);
    let mut checks: Vec<_> = summary.checks.iter().collect();
    checks.sort_by_key(|check| std::cmp::Reverse(check.share.of - check.share.passed));
    let margins = checks.iter().filter_map(|check| table.column(&format!("margin.{}", check.name)));
    values.into_iter().chain(margins.take(MOST_MARGINS)).collect()
}

/// How many lines each kind gets: those that passed leave room for the others, of which few are seen whole.
fn drawn_line_counts([passed, errors, failed]: [usize; 3]) -> [usize; 3] {
    let failed_room = failed.min(MOST_LINES - errors.min(MOST_LINES / 4) - passed.min(MOST_LINES / 4));
    let errors_room = errors.min(MOST_LINES - failed_room - passed.min(MOST_LINES / 4));
    [passed.min(MOST_LINES - failed_room - errors_room), errors_room, failed_room]
}

impl ParallelAxis {
    fn new(column: &SweepColumn, x: f64) -> Self {
        let values = column.to_numbers();
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let texts = column.distinct_texts();
        let end = |value: f64| match texts.get(value as usize) {
            Some(text) => shortened_name(text, 12),
            None if column.as_booleans().is_some() => (value > 0.0).to_string(),
            None if value.is_finite() => number_text(value),
            None => "–".to_owned(),
        };
        let ends = [end(low), end(high)];
        Self { x, name: column.name_with_unit(), ends, low, high, values }
    }

    /// The height of a variant on the page [px].
    fn y_of_row(&self, row: usize) -> Option<f64> {
        let value = self.values.get(row).copied().filter(|value| value.is_finite())?;
        // All alike stand in the middle.
        let share = if self.low < self.high { (value - self.low) / (self.high - self.low) } else { 0.5 };
        Some(BOTTOM - share * (BOTTOM - ABOVE))
    }

    /// What of its name has room.
    pub fn short_name(&self) -> String {
        shortened_name(&self.name, (2.0 * BESIDE / LETTER) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_all_kinds_are_at_most_a_thousand_and_none_is_wasted() {
        for counts in [[0, 0, 0], [1, 0, 0], [10, 20, 30], [1_000_000, 5, 3], [900, 0, 900], [1_000_000; 3]] {
            let room = drawn_line_counts(counts);
            let all: usize = room.iter().sum();
            assert!(room.iter().zip(counts).all(|(room, count)| *room <= count), "{counts:?} {room:?}");
            assert_eq!(all, counts.iter().sum::<usize>().min(MOST_LINES), "{counts:?} {room:?}");
        }
        assert_eq!(drawn_line_counts([1_000_000, 5, 3]), [992, 5, 3]);
    }
}
