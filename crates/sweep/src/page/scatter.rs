//! Draws margins over the values that drive them most.

use html_page::{Markup, Plot, PlotAxis};

use super::evenly_thinned;
use crate::summary::{CheckSummary, SweepSummary};
use crate::table::{SweepColumn, SweepTable};

/// Points of a plot, of each kind.
const MOST_POINTS: usize = 1500;
/// Values for each check, and plots on the page.
const MOST_VALUES: usize = 2;
const MOST_PLOTS: usize = 12;
/// Of a plot [px].
const SIZE: [f64; 2] = [520.0, 300.0];

/// A plot for each check and each of the two values that drive its margin most.
pub fn margin_scatter_plots(table: &SweepTable, summary: &SweepSummary) -> Vec<Markup> {
    let pairs = summary.checks.iter().flat_map(|check| {
        let margin = format!("margin.{}", check.name);
        let output = summary.outputs.iter().find(|output| output.name == margin);
        let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
        let values = effects.iter().filter_map(|effect| table.column(&effect.parameter));
        let margin = table.column(&margin);
        values.take(MOST_VALUES).filter_map(move |value| Some((check, value, margin?)))
    });
    let plot = |(check, value, margin): (&CheckSummary, &SweepColumn, &SweepColumn)| {
        let verdict = table.column(&format!("check.{}", check.name)).and_then(SweepColumn::as_booleans);
        let title = format!("{} over {}", check.name, value.name);
        margin_scatter_plot(value, margin, verdict.unwrap_or_default()).figure_with_legend(&title)
    };
    pairs.take(MOST_PLOTS).map(plot).collect()
}

fn margin_scatter_plot(value: &SweepColumn, margin: &SweepColumn, verdicts: &[Option<bool>]) -> Plot {
    let (x, y) = (value.to_numbers(), margin.to_numbers());
    let of = |passed: bool| {
        let rows = verdicts.iter().enumerate().filter(|(_, it)| **it == Some(passed));
        let rows: Vec<usize> = rows.map(|(row, _)| row).collect();
        let points = evenly_thinned(&rows, MOST_POINTS).into_iter().map(|row| (x[row], y[row]));
        points.filter(|(x, y)| x.is_finite() && y.is_finite()).collect::<Vec<_>>()
    };
    let [passed, failed] = [of(true), of(false)];
    let shown = || passed.iter().chain(&failed);
    let across = PlotAxis::around_values(&value.name_with_unit(), shown().map(|point| point.0));
    // 0 is where the check begins to fail.
    let up = PlotAxis::around_values(&margin.name_with_unit(), shown().map(|point| point.1).chain([0.0]));
    let mut plot = Plot::new(SIZE, across, up);
    plot.add_horizontal_line(0.0, "truth", "");
    plot.add_dots(&passed, 2.5, "passed", "passed");
    plot.add_dots(&failed, 2.5, "failed", "failed");
    plot
}
