//! Draws results over what varies: one small plot for each result and each varied value.

use html_page::{CssClass, Markup, Plot, PlotAxis};
use units::display::number_text;

use super::evenly_thinned;
use crate::summary::SweepSummary;
use crate::table::{SweepColumn, SweepColumnRole, SweepTable};
use crate::variant_table::{VariantEnding, display_name, variant_endings};

/// Points of a plot, of each kind.
const MOST_POINTS: usize = 1500;
/// Plots of all results, and of one where there are several.
const MOST_PLOTS: usize = 24;
const MOST_OF_RESULT: usize = 4;
/// Up to so many variants, each point has its value beside it.
const MOST_LABELS: usize = 8;
/// Different names on an axis.
const MOST_NAMES: usize = 40;
/// Of a plot [px].
const SIZE: [f64; 2] = [350.0, 230.0];
/// Of a plot over the names of set-ups, which are longer than numbers [px].
const SIZE_OVER_NAMES: [f64; 2] = [520.0, 230.0];

/// Results over what varies.
pub struct ResultPlots {
    pub plots: Vec<Markup>,
    pub legend: Markup,
    /// Whether some are over names, and wider.
    pub are_wide: bool,
    /// Plots that have no room.
    pub left_out: usize,
}

impl ResultPlots {
    /// The collected values over what varies, and the margins; what drives a result most comes first.
    pub fn new(table: &SweepTable, summary: &SweepSummary) -> Self {
        let endings = variant_endings(table);
        let results = [SweepColumnRole::Collected, SweepColumnRole::Margin];
        let results: Vec<_> = results.iter().flat_map(|role| table.columns_with_role(*role)).collect();
        let results: Vec<_> = results.into_iter().filter(|it| has_numbers(it)).collect();
        let pairs = results.iter().flat_map(|result| {
            let varied = varied_by_effect(table, summary, &result.name);
            let most = if results.len() == 1 { MOST_PLOTS } else { MOST_OF_RESULT };
            varied.into_iter().enumerate().map(move |(place, value)| (place < most, *result, value))
        });
        let (chosen, others): (Vec<_>, Vec<_>) = pairs.partition(|(chosen, ..)| *chosen);
        let left_out = others.len() + chosen.len().saturating_sub(MOST_PLOTS);
        let mut legend = html_page::Safe(String::new());
        let are_wide = chosen.iter().any(|(_, _, value)| value.role == SweepColumnRole::Name);
        let plots = chosen.into_iter().take(MOST_PLOTS).map(|(_, result, value)| {
            let plot = value_plot(value, result, &endings);
            legend = plot.legend_markup();
            match value.role {
                SweepColumnRole::Name => plot.figure_without_legend(&display_name(result)),
                _ => plot.figure_without_legend(&format!("{} over {}", display_name(result), value.name)),
            }
        });
        let plots = plots.collect();
        Self { plots, legend, are_wide, left_out }
    }
}

fn has_numbers(column: &SweepColumn) -> bool {
    column.to_numbers().iter().any(|it| it.is_finite())
}

/// What varies, by its effect on a result; in the order of the table where no effect is known. A seed varies like noise, and is left out.
fn varied_by_effect<'t>(table: &'t SweepTable, summary: &SweepSummary, result: &str) -> Vec<&'t SweepColumn> {
    let output = summary.outputs.iter().find(|output| output.name == result);
    let effects = output.map(|output| &output.effects[..]).unwrap_or_default();
    let place = |column: &&SweepColumn| {
        effects.iter().position(|effect| effect.parameter == column.name).unwrap_or(usize::MAX)
    };
    let mut varied: Vec<_> = table
        .columns_with_role(SweepColumnRole::Parameter)
        .filter(|it| it.distinct_texts().len() <= MOST_NAMES && varies_throughout(it))
        .collect();
    varied.sort_by_key(place);
    // Set-ups by hand differ in several values at once: their names say more than any of these.
    let names = table.columns_with_role(SweepColumnRole::Name);
    let names: Vec<_> = names.filter(|it| (2..=MOST_NAMES).contains(&it.distinct_texts().len())).collect();
    if !names.is_empty() && varied.len() > 1 {
        return names;
    }
    names.into_iter().chain(varied).collect()
}

/// Whether a column has at least two different values and none that is missing.
fn varies_throughout(column: &SweepColumn) -> bool {
    let numbers = column.to_numbers();
    numbers.iter().all(|it| it.is_finite()) && numbers.windows(2).any(|pair| pair[0] != pair[1])
}

/// An axis about numbers; of equal ones a twentieth of their size wide on both sides.
fn axis_around(label: &str, numbers: impl Iterator<Item = f64> + Clone) -> PlotAxis {
    let first = numbers.clone().next().unwrap_or(0.0);
    let equal = numbers.clone().all(|it| it == first);
    let reach = if first == 0.0 { 1.0 } else { 0.05 * first.abs() };
    match equal {
        true => PlotAxis::linear(label, first - reach, first + reach),
        false => PlotAxis::around_values(label, numbers),
    }
}

fn value_plot(value: &SweepColumn, result: &SweepColumn, endings: &[VariantEnding]) -> Plot {
    let (x, y) = (value.to_numbers(), result.to_numbers());
    let with_both: Vec<usize> =
        (0..endings.len()).filter(|row| x[*row].is_finite() && y[*row].is_finite()).collect();
    let of = |kinds: &[VariantEnding]| {
        let rows: Vec<usize> =
            with_both.iter().copied().filter(|row| kinds.contains(&endings[*row])).collect();
        evenly_thinned(&rows, MOST_POINTS).into_iter().map(|row| (x[row], y[row])).collect::<Vec<_>>()
    };
    let groups: [(&[VariantEnding], CssClass, &str); 3] = [
        (&[VariantEnding::Passed], "passed", "passed"),
        (&[VariantEnding::NoChecks], "passed", "no checks"),
        (&[VariantEnding::Failed, VariantEnding::Error], "failed", "failed a check"),
    ];
    let groups = groups.map(|(kinds, class, name)| (of(kinds), class, name));
    let shown = || groups.iter().flat_map(|(points, ..)| points);
    let is_name = value.role == SweepColumnRole::Name;
    let label = match is_name {
        true => String::new(),
        false => units::display::name_with_unit(&value.name, value.unit.as_deref()),
    };
    let across = match value.distinct_texts() {
        names if !names.is_empty() => PlotAxis::of_names(&label, &names),
        _ if value.as_booleans().is_some() => PlotAxis::of_names(&label, &["no", "yes"]),
        _ => axis_around(&label, shown().map(|point| point.0)),
    };
    let is_margin = result.role == SweepColumnRole::Margin;
    // 0 is where the check begins to fail.
    let zero = is_margin.then_some(0.0);
    let name = if is_margin { "margin".to_owned() } else { display_name(result) };
    let label = units::display::name_with_unit(&shortened(&name), result.unit.as_deref());
    let few = with_both.len() <= MOST_LABELS;
    let up = axis_around(&label, shown().map(|point| point.1).chain(zero));
    let mut plot = Plot::new(if is_name { SIZE_OVER_NAMES } else { SIZE }, across, up);
    if let Some(zero) = zero {
        plot.add_horizontal_line(zero, "truth", "");
    }
    for (points, class, name) in &groups {
        if !points.is_empty() {
            plot.add_dots(points, if few { 4.0 } else { 2.5 }, class, name);
        }
    }
    if few {
        with_both.iter().for_each(|row| plot.add_label((x[*row], y[*row]), &number_text(y[*row])));
    }
    plot
}

/// What of a name has room beside the upward axis.
fn shortened(name: &str) -> String {
    super::shortened_name(name, 22)
}
