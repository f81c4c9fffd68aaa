//! Places variants as lines across parallel axes, one for each varied value and the margins that matter most, for `parallel.html`.

use std::fmt::Write as _;

use numerics::text::significant;

use super::{Ending, endings, shortened, thinned};
use crate::summary::Summary;
use crate::table::{Column, Role, Table};

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
pub struct Parallel {
    pub axes: Vec<Upright>,
    pub kinds: [Kind; 3],
}

/// An axis with the places of the variants on it: 0 below, 1 above.
pub struct Upright {
    pub x: f64,
    pub name: String,
    pub ends: [String; 2],
    pub low: f64,
    pub high: f64,
    values: Vec<f64>,
}

/// Variants that ended alike.
pub struct Kind {
    pub ending: Ending,
    pub count: usize,
    /// Those that are drawn.
    pub rows: Vec<usize>,
}

impl Parallel {
    /// Nothing when there are fewer than two axes.
    pub fn new(table: &Table, summary: &Summary) -> Option<Self> {
        let columns = chosen(table, summary);
        let gaps = columns.len().checked_sub(1).filter(|gaps| *gaps > 0)?;
        let x = |index| BESIDE + index as f64 * (SIZE[0] - 2.0 * BESIDE) / gaps as f64;
        let axes = (0..).zip(&columns).map(|(index, column)| Upright::new(column, x(index)));
        let endings = endings(table);
        let rows = |wanted: Ending| -> Vec<usize> {
            (0..endings.len()).filter(|row| endings[*row] == wanted).collect()
        };
        let all =
            [Ending::Passed, Ending::Error, Ending::Failed].map(|ending| (ending, rows(ending)));
        let mut room = shared(all.each_ref().map(|(_, rows)| rows.len())).into_iter();
        let kinds = all.map(|(ending, rows)| Kind {
            ending,
            count: rows.len(),
            rows: thinned(&rows, room.next().unwrap_or(0)),
        });
        Some(Self { axes: axes.collect(), kinds })
    }

    /// All lines of a kind. A value that is missing breaks a line.
    pub fn path(&self, kind: &Kind) -> String {
        let mut path = String::new();
        for &row in &kind.rows {
            let mut pen = 'M';
            for axis in &self.axes {
                match axis.y(row) {
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
fn chosen<'a>(table: &'a Table, summary: &Summary) -> Vec<&'a Column> {
    let strength = |column: &&Column| {
        let effects = summary.outputs.iter().flat_map(|output| &output.effects);
        let own = effects.filter(|effect| effect.parameter == column.name);
        own.map(|effect| effect.strength()).fold(0.0, f64::max)
    };
    let mut values: Vec<_> = table.of(Role::Parameter).collect();
    values.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    values.truncate(MOST_VALUES);
    let mut checks: Vec<_> = summary.checks.iter().collect();
    checks.sort_by_key(|check| std::cmp::Reverse(check.share.of - check.share.passed));
    let margins = checks.iter().filter_map(|check| table.column(&format!("margin.{}", check.name)));
    values.into_iter().chain(margins.take(MOST_MARGINS)).collect()
}

/// How many lines each kind gets: those that passed leave room for the others, of which few are seen whole.
fn shared([passed, errors, failed]: [usize; 3]) -> [usize; 3] {
    let failed_room =
        failed.min(MOST_LINES - errors.min(MOST_LINES / 4) - passed.min(MOST_LINES / 4));
    let errors_room = errors.min(MOST_LINES - failed_room - passed.min(MOST_LINES / 4));
    [passed.min(MOST_LINES - failed_room - errors_room), errors_room, failed_room]
}

impl Upright {
    fn new(column: &Column, x: f64) -> Self {
        let values = column.to_numbers();
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let texts = column.distinct_texts();
        let end = |value: f64| match texts.get(value as usize) {
            Some(text) => shortened(text, 12),
            None if column.booleans().is_some() => (value > 0.0).to_string(),
            None => significant(value, 4),
        };
        let ends = [end(low), end(high)];
        Self { x, name: column.label(), ends, low, high, values }
    }

    /// The height of a variant on the page [px].
    fn y(&self, row: usize) -> Option<f64> {
        let value = self.values.get(row).copied().filter(|value| value.is_finite())?;
        // All alike stand in the middle.
        let share =
            if self.low < self.high { (value - self.low) / (self.high - self.low) } else { 0.5 };
        Some(BOTTOM - share * (BOTTOM - ABOVE))
    }

    /// What of its name has room.
    pub fn short_name(&self) -> String {
        shortened(&self.name, (2.0 * BESIDE / LETTER) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_all_kinds_are_at_most_a_thousand_and_none_is_wasted() {
        for counts in
            [[0, 0, 0], [1, 0, 0], [10, 20, 30], [1_000_000, 5, 3], [900, 0, 900], [1_000_000; 3]]
        {
            let room = shared(counts);
            let all: usize = room.iter().sum();
            assert!(
                room.iter().zip(counts).all(|(room, count)| *room <= count),
                "{counts:?} {room:?}"
            );
            assert_eq!(all, counts.iter().sum::<usize>().min(MOST_LINES), "{counts:?} {room:?}");
        }
        assert_eq!(shared([1_000_000, 5, 3]), [992, 5, 3]);
    }
}
