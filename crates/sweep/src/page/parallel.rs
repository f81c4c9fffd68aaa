//! Draws variants as lines across parallel axes, one for each varied value and the margins that matter most.

use std::fmt::Write as _;

use html_page::escape;
use numerics::text::significant;

use super::bars::shortened;
use super::{Ended, ended, grouped, thinned, with_unit};
use crate::summary::Summary;
use crate::table::{Column, Role, Table};

/// Lines of all kinds together.
const MOST_LINES: usize = 1000;
/// Axes: varied values, and margins.
const MOST_VALUES: usize = 8;
const MOST_MARGINS: usize = 3;
/// Sizes [px]: of the figure, of the space beside, above and below the axes.
const SIZE: [f64; 2] = [1080.0, 400.0];
const BESIDE: f64 = 90.0;
const ABOVE: f64 = 62.0;
const BELOW: f64 = 24.0;
/// Width of a letter [px].
const LETTER: f64 = 7.0;

/// An axis with the places of the variants on it: 0 below, 1 above.
struct Upright {
    name: String,
    ends: [String; 2],
    low: f64,
    high: f64,
    values: Vec<f64>,
}

/// The figure, unless there are fewer than two axes.
pub fn write(html: &mut String, table: &Table, summary: &Summary) {
    let axes: Vec<Upright> = chosen(table, summary).into_iter().map(Upright::of).collect();
    if axes.len() < 2 {
        return;
    }
    let ended = ended(table);
    let rows = |wanted: Ended| {
        let rows = ended.iter().enumerate().filter(|(_, ended)| **ended == wanted);
        rows.map(|(row, _)| row).collect::<Vec<_>>()
    };
    let kinds = [Ended::Passed, Ended::Error, Ended::Failed].map(|ended| (ended, rows(ended)));
    let room = shared(kinds.each_ref().map(|(_, rows)| rows.len()));
    html.push_str("<h2>All variants side by side</h2>\n<p class=\"legend\">");
    for ((ended, rows), room) in kinds.iter().zip(room).filter(|((_, rows), _)| !rows.is_empty()) {
        let word = match ended {
            Ended::Passed => "passed",
            Ended::Failed => "failed a check",
            Ended::Error => "did not end",
        };
        let part = if room < rows.len() {
            format!(", {room} of {}", grouped(rows.len() as u64))
        } else {
            String::new()
        };
        let class = ended.class();
        let _ =
            write!(html, "<span class=\"key\"><i class=\"line {class}\"></i>{word}{part}</span>");
    }
    let [width, height] = SIZE;
    let _ = writeln!(html, "</p>\n<figure><svg viewBox=\"0 0 {width} {height}\" role=\"img\">");
    for ((ended, rows), room) in kinds.iter().zip(room) {
        lines(html, &axes, &thinned(rows, room), *ended);
    }
    (0..axes.len()).for_each(|index| axes[index].write(html, x(index, axes.len()), index));
    html.push_str("</svg></figure>\n");
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

fn x(index: usize, axes: usize) -> f64 {
    BESIDE + index as f64 * (SIZE[0] - 2.0 * BESIDE) / (axes as f64 - 1.0)
}

/// All lines of a kind as one path. A value that is missing breaks a line.
fn lines(html: &mut String, axes: &[Upright], rows: &[usize], ended: Ended) {
    let mut path = String::new();
    for &row in rows {
        let mut pen = 'M';
        for (index, axis) in axes.iter().enumerate() {
            match axis.y(row) {
                Some(y) => {
                    let _ = write!(path, "{pen}{:.0} {y:.1}", x(index, axes.len()));
                    pen = 'L';
                }
                None => pen = 'M',
            }
        }
    }
    let density = if rows.len() > 200 { "many" } else { "some" };
    if !path.is_empty() {
        let class = ended.class();
        let _ = writeln!(html, "<path class=\"hair {density} {class}\" d=\"{path}\"/>");
    }
}

impl Upright {
    fn of(column: &Column) -> Self {
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
        Self { name: with_unit(&column.name, column.unit.as_deref()), ends, low, high, values }
    }

    /// The height of a variant on the page [px].
    fn y(&self, row: usize) -> Option<f64> {
        let value = self.values.get(row).copied().filter(|value| value.is_finite())?;
        // All alike stand in the middle.
        let share =
            if self.low < self.high { (value - self.low) / (self.high - self.low) } else { 0.5 };
        Some(SIZE[1] - BELOW - share * (SIZE[1] - ABOVE - BELOW))
    }

    /// The axis with its name, which is higher for every other axis so that neighbours have room, and its ends.
    fn write(&self, html: &mut String, x: f64, index: usize) {
        let (bottom, name) = (SIZE[1] - BELOW, if index.is_multiple_of(2) { 14.0 } else { 32.0 });
        let letters = (2.0 * BESIDE / LETTER) as usize;
        let _ = write!(
            html,
            "<path class=\"frame\" d=\"M{x:.1} {ABOVE}V{bottom}\"/>\
             <text class=\"name\" x=\"{x:.1}\" y=\"{name}\">{}<title>{}</title></text>",
            escape(&shortened(&self.name, letters)),
            escape(&self.name)
        );
        let [low, high] = self.ends.each_ref().map(|end| escape(end));
        let _ = match self.low < self.high {
            true => writeln!(
                html,
                "<text x=\"{x:.1}\" y=\"{}\">{high}</text><text x=\"{x:.1}\" y=\"{}\">{low}</text>",
                ABOVE - 8.0,
                bottom + 16.0
            ),
            false => writeln!(html, "<text x=\"{x:.1}\" y=\"{}\">{low}</text>", bottom + 16.0),
        };
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
