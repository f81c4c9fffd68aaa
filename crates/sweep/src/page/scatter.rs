//! Draws margins over the values that drive them most.

use html_page::{Axis, Markup, Plot};

use super::thinned;
use crate::summary::{Check, Summary};
use crate::table::{Column, Table};

/// Points of a plot, of each kind.
const MOST_POINTS: usize = 1500;
/// Values for each check, and plots on the page.
const MOST_VALUES: usize = 2;
const MOST_PLOTS: usize = 12;
/// Of a plot [px].
const SIZE: [f64; 2] = [520.0, 300.0];

/// A plot for each check and each of the two values that drive its margin most.
pub fn plots(table: &Table, summary: &Summary) -> Vec<Markup> {
    let pairs = summary.checks.iter().flat_map(|check| {
        let margin = format!("margin.{}", check.name);
        let output = summary.outputs.iter().find(|output| output.name == margin);
        let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
        let values = effects.iter().filter_map(|effect| table.column(&effect.parameter));
        let margin = table.column(&margin);
        values.take(MOST_VALUES).filter_map(move |value| Some((check, value, margin?)))
    });
    let plot = |(check, value, margin): (&Check, &Column, &Column)| {
        let verdict = table.column(&format!("check.{}", check.name)).and_then(Column::booleans);
        let title = format!("{} over {}", check.name, value.name);
        plot(value, margin, verdict.unwrap_or_default()).figure(&title)
    };
    pairs.take(MOST_PLOTS).map(plot).collect()
}

fn plot(value: &Column, margin: &Column, verdicts: &[Option<bool>]) -> Plot {
    let (x, y) = (value.to_numbers(), margin.to_numbers());
    let of = |passed: bool| {
        let rows = verdicts.iter().enumerate().filter(|(_, it)| **it == Some(passed));
        let rows: Vec<usize> = rows.map(|(row, _)| row).collect();
        let points = thinned(&rows, MOST_POINTS).into_iter().map(|row| (x[row], y[row]));
        points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect::<Vec<_>>()
    };
    let [passed, failed] = [of(true), of(false)];
    let shown = || passed.iter().chain(&failed);
    let across = Axis::about(&value.label(), shown().map(|point| point.0));
    // 0 is where the check begins to fail.
    let up = Axis::about(&margin.label(), shown().map(|point| point.1).chain([0.0]));
    let mut plot = Plot::new(SIZE, across, up);
    plot.level(0.0, "truth", "");
    plot.dots(&passed, 2.5, "passed", "passed");
    plot.dots(&failed, 2.5, "failed", "failed");
    plot
}
