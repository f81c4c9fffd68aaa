//! Draws the studies: estimates over the excitation, and sensitivities over slip.

use html_page::{CssClass, Markup, Plot, PlotAxis};
use tire_inference::parameters::Parameter;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;

use crate::studies::{excitation, sensitivity};

const SIZE: [f64; 2] = [530.0, 290.0];
const NAMES: [&str; 4] = ["B", "C", "D", "E"];

/// B, C, D, E and K over the largest slip of the data, with ±2 standard deviations.
pub fn excitation(study: &excitation::ExcitationStudy) -> Vec<(&'static str, Plot)> {
    use Parameter::{B, C, D, E};
    let quantities = [B, C, D, E].map(Quantity::Parameter).into_iter().chain([Quantity::K]);
    quantities.map(|quantity| (quantity.name(), over_levels(study, quantity))).collect()
}

fn over_levels(study: &excitation::ExcitationStudy, quantity: Quantity) -> Plot {
    let truth = quantity.value(&study.excitation.truth);
    let percent = |level: f64| 100.0 * level;
    let mut band = Vec::new();
    let mut means = Vec::new();
    let (mut sure, mut unsure, mut simplex) = (Vec::new(), Vec::new(), Vec::new());
    for level in &study.levels {
        let x = percent(level.level);
        let fitted = quantity.value(&level.least_squares);
        simplex.push((x, quantity.value(&level.nelder_mead)));
        let Some(judgement) = level.judgements.iter().find(|judgement| judgement.quantity == quantity) else {
            continue;
        };
        band.push((x, [judgement.mean - 2.0 * judgement.std, judgement.mean + 2.0 * judgement.std]));
        means.push((x, judgement.mean));
        let points = if judgement.verdict == Identifiability::Identified { &mut sure } else { &mut unsure };
        points.push((x, fitted));
    }
    let name = quantity.name();
    let values = [&means, &sure, &unsure, &simplex].into_iter().flatten().map(|point| point.1);
    let y = PlotAxis::around_values(
        &format!("{name} [–]"),
        values.chain(band.iter().flat_map(|point| point.1)).chain([truth]),
    );
    let levels = study.levels.iter().map(|level| percent(level.level));
    let (low, high) = levels.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let mut plot =
        Plot::new(SIZE, PlotAxis::logarithmic("largest slip of the data [%]", 0.9 * low, 1.1 * high), y);
    plot.add_band(&band, "c0", "posterior ± 2 std");
    plot.add_line(&means, "c0", "posterior mean");
    plot.add_horizontal_line(truth, "truth", "truth");
    plot.add_dots(&simplex, 2.5, "c1", "Nelder-Mead");
    plot.add_dots(&unsure, 4.0, "c0 hollow", "least squares, not identified");
    plot.add_dots(&sure, 4.0, "c0", "least squares, identified");
    plot
}

/// Total Sobol indices over slip.
pub fn sensitivity(study: &sensitivity::SensitivityStudy) -> Markup {
    const COLOURS: [CssClass; 4] = ["c0", "c1", "c2", "c3"];
    let last = study.indices.last().map_or(1.0, |indices| indices.slip);
    let x = PlotAxis::linear("slip [%]", 0.0, 100.0 * last);
    let mut plot = Plot::new([1080.0, 380.0], x, PlotAxis::linear("total Sobol index S_T [–]", 0.0, 1.0));
    for (index, (name, class)) in NAMES.into_iter().zip(COLOURS).enumerate() {
        let points: Vec<_> =
            study.indices.iter().map(|indices| (100.0 * indices.slip, indices.total[index])).collect();
        plot.add_line(&points, class, name);
    }
    plot.figure_with_legend("Share of the variance of the friction coefficient")
}
