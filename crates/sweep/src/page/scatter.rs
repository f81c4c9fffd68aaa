//! Draws margins over the values that drive them most.

use std::fmt::Write as _;

use html_page::{Axis, Plot};

use super::{thinned, with_unit};
use crate::summary::Summary;
use crate::table::{Column, Table};

/// Points of a plot, of each kind.
const MOST_POINTS: usize = 1500;
/// Values for each check, and plots on the page.
const MOST_VALUES: usize = 2;
const MOST_PLOTS: usize = 12;
/// Of a plot [px].
const SIZE: [f64; 2] = [520.0, 300.0];

/// A plot for each check and each of the two values that drive its margin most.
pub fn write(html: &mut String, table: &Table, summary: &Summary) {
    let pairs = summary.checks.iter().flat_map(|check| {
        let margin = format!("margin.{}", check.name);
        let output = summary.outputs.iter().find(|output| output.name == margin);
        let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
        let values = effects.iter().filter_map(|effect| table.column(&effect.parameter));
        let margin = table.column(&margin);
        values.take(MOST_VALUES).filter_map(move |value| Some((check, value, margin?)))
    });
    let mut plots = String::new();
    for (check, value, margin) in pairs.take(MOST_PLOTS) {
        let verdict = table.column(&format!("check.{}", check.name)).and_then(Column::booleans);
        let title = format!("{} over {}", check.name, value.name);
        plots.push_str(&plot(value, margin, verdict.unwrap_or_default()).figure(&title));
    }
    if !plots.is_empty() {
        let _ = writeln!(
            html,
            "<h2>Margins over what drives them</h2>\n<p>Below 0 the check fails.</p>\n<div class=\"grid two\">\n{plots}</div>"
        );
    }
}

fn plot(value: &Column, margin: &Column, verdicts: &[Option<bool>]) -> Plot {
    let (x, y) = (value.to_numbers(), margin.to_numbers());
    let label = |column: &Column| with_unit(&column.name, column.unit.as_deref());
    let of = |passed: bool| {
        let rows = verdicts.iter().enumerate().filter(|(_, it)| **it == Some(passed));
        let rows: Vec<usize> = rows.map(|(row, _)| row).collect();
        let points = thinned(&rows, MOST_POINTS).into_iter().map(|row| (x[row], y[row]));
        points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect::<Vec<_>>()
    };
    let [passed, failed] = [of(true), of(false)];
    let shown = || passed.iter().chain(&failed);
    let across = Axis::about(&label(value), shown().map(|point| point.0));
    // 0 is where the check begins to fail.
    let up = Axis::about(&label(margin), shown().map(|point| point.1).chain([0.0]));
    let mut plot = Plot::new(SIZE, across, up);
    plot.level(0.0, "truth", "");
    plot.dots(&passed, 2.5, "passed", "passed");
    plot.dots(&failed, 2.5, "failed", "failed");
    plot
}
