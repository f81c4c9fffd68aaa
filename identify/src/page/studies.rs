//! Draws the studies: estimates over the excitation, and sensitivities over slip.

use html_page::{CssClass, Markup, Plot, PlotAxis};
use numerics::text::format_significant;
use tire_inference::parameters::{Parameter, Theta, magic_formula_from_theta};
use tire_inference::quantity::Quantity;
use tire_inference::synthetic::synthetic_samples;
use tire_inference::verdict::Identifiability;

use crate::studies::{excitation, sensitivity};

const SIZE: [f64; 2] = [530.0, 290.0];
const NAMES: [&str; 4] = ["B", "C", "D", "E"];

/// B, C, D, E and K over the largest slip of the data, with ±2 standard deviations: Fig. 3 of Goblirsch et al. 2025.
pub fn excitation(study: &excitation::ExcitationStudy) -> Vec<(&'static str, Plot)> {
    use Parameter::{B, C, D, E};
    let quantities = [B, C, D, E].map(Quantity::Parameter).into_iter().chain([Quantity::K]);
    quantities.map(|quantity| (quantity.name(), over_levels(study, quantity))).collect()
}

/// Curves that were fitted up to some levels, over the data and the true one, by each method: Fig. 2 of Goblirsch et al. 2025.
pub fn curves_of_levels(study: &excitation::ExcitationStudy) -> Vec<(&'static str, Plot)> {
    let by_svi = |level: &excitation::ExcitationLevel| {
        let value = |parameter| level.svi.mean.get(&Quantity::Parameter(parameter)).copied().unwrap_or(0.0);
        Parameter::ALL.map(value)
    };
    let farthest = study.levels.iter().map(|it| it.level).fold(0.0, f64::max);
    let curve = |theta: &Theta| -> Vec<(f64, f64)> {
        let tire = magic_formula_from_theta(theta);
        let slips = (0..=200).map(|i| farthest * f64::from(i) / 200.0);
        slips.map(|slip| (100.0 * slip, tire.friction_coefficient(slip))).collect()
    };
    let levels = drawn_levels(study);
    let methods = [
        ("Nelder-Mead", levels.iter().map(|(level, _)| curve(&level.nelder_mead)).collect::<Vec<_>>()),
        ("Variational inference", levels.iter().map(|(level, _)| curve(&by_svi(level))).collect()),
    ];
    let data = drawn_samples(study, farthest);
    let heights = data.iter().chain(methods.iter().flat_map(|(_, curves)| curves.iter().flatten()));
    let y = PlotAxis::around_values("friction coefficient [–]", heights.map(|it| it.1).chain([0.0]));
    let plot = |(method, curves): (&'static str, Vec<Vec<(f64, f64)>>)| {
        let x = PlotAxis::linear("slip [%]", 0.0, 100.0 * farthest);
        let mut plot = Plot::new(SIZE, x, y.clone());
        plot.add_dots(&data, 1.5, "data", "data");
        for ((level, class), points) in levels.iter().zip(&curves) {
            let name = format!("fitted up to {} %", format_significant(100.0 * level.level, 2));
            plot.add_line(points, class, &name);
        }
        plot.add_dashed_line(&curve(&study.excitation.truth), "truth", "truth");
        (method, plot)
    };
    methods.into_iter().map(plot).collect()
}

/// The levels that are drawn: those next to the ones of the paper's figure.
fn drawn_levels(study: &excitation::ExcitationStudy) -> Vec<(&excitation::ExcitationLevel, CssClass)> {
    const LEVELS: [(f64, CssClass); 4] = [(0.02, "c1"), (0.08, "c2"), (0.3, "c3"), (0.75, "c0")];
    let mut drawn: Vec<(&excitation::ExcitationLevel, CssClass)> = Vec::new();
    for (wanted, class) in LEVELS {
        let distance = |it: &excitation::ExcitationLevel| (it.level / wanted).ln().abs();
        let nearest = study.levels.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let new = nearest.filter(|it| drawn.iter().all(|(known, _)| known.level != it.level));
        drawn.extend(new.map(|it| (it, class)));
    }
    drawn
}

/// Some of the samples up to a level, slip in percent.
fn drawn_samples(study: &excitation::ExcitationStudy, level: f64) -> Vec<(f64, f64)> {
    const MOST: usize = 600;
    let samples = synthetic_samples(&study.excitation, level);
    let stride = samples.len().div_ceil(MOST).max(1);
    let data = samples.slip.iter().zip(&samples.force).step_by(stride);
    data.map(|(slip, force)| (100.0 * slip, *force)).collect()
}

fn over_levels(study: &excitation::ExcitationStudy, quantity: Quantity) -> Plot {
    let truth = quantity.value(&study.excitation.truth);
    let percent = |level: f64| 100.0 * level;
    let (mut band, mut svi, mut means) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sure, mut unsure, mut simplex) = (Vec::new(), Vec::new(), Vec::new());
    for level in &study.levels {
        let x = percent(level.level);
        let fitted = quantity.value(&level.least_squares);
        simplex.push((x, quantity.value(&level.nelder_mead)));
        if let Some((mean, std)) = level.svi.mean.get(&quantity).zip(level.svi.std.get(&quantity)) {
            svi.push((x, *mean));
            band.push((x, [mean - 2.0 * std, mean + 2.0 * std]));
        }
        let Some(judgement) = level.judgements.iter().find(|judgement| judgement.quantity == quantity) else {
            continue;
        };
        means.push((x, judgement.mean));
        let points = if judgement.verdict == Identifiability::Identified { &mut sure } else { &mut unsure };
        points.push((x, fitted));
    }
    let name = quantity.name();
    let values = [&svi, &means, &sure, &unsure, &simplex].into_iter().flatten().map(|point| point.1);
    let y = PlotAxis::around_values(
        &format!("{name} [–]"),
        values.chain(band.iter().flat_map(|point| point.1)).chain([truth]),
    );
    let levels = study.levels.iter().map(|level| percent(level.level));
    let (low, high) = levels.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    let mut plot =
        Plot::new(SIZE, PlotAxis::logarithmic("largest slip of the data [%]", 0.9 * low, 1.1 * high), y);
    plot.add_band(&band, "c0", "variational inference ± 2 std");
    plot.add_line(&svi, "c0", "variational inference");
    plot.add_dashed_line(&means, "c2", "mean of the exact posterior");
    plot.add_line(&simplex, "c1", "Nelder-Mead");
    plot.add_horizontal_line(truth, "truth", "truth");
    plot.add_dots(&simplex, 2.5, "c1", "");
    plot.add_dots(&unsure, 4.0, "c0 hollow", "least squares, not identified");
    plot.add_dots(&sure, 4.0, "c0", "least squares, identified");
    plot
}

/// Total Sobol indices over slip, and the force: Fig. 4 of Goblirsch et al. 2025.
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
    let tire = magic_formula_from_theta(&study.centre);
    let slips = || study.indices.iter().map(|indices| indices.slip);
    let peak = slips().map(|slip| tire.friction_coefficient(slip)).fold(0.0, f64::max);
    let forces: Vec<_> = slips().map(|slip| (100.0 * slip, tire.friction_coefficient(slip) / peak)).collect();
    plot.add_dashed_line(&forces, "truth", "the tire's force over its peak");
    plot.figure_with_legend("Share of the variance of the friction coefficient")
}
