//! Plots what was found of one tire: its curve with the data and the band, the densities of its parameters, and how the fits
//! came to their ends.

use html_page::{CssClass, Plot, PlotAxis};
use numerics::statistics::{quantile, std};
use plugin::AnalysisServices;
use preparation::samples::CurveSamples;
use tire_inference::estimate::TireEstimate;
use tire_inference::parameters::{Parameter, Theta, magic_formula_from_theta, theta_from_magic_formula};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::quantity::Quantity;

use crate::names::quantity_unit;
use crate::page::misfit::MisfitOverSlip;
use crate::page::{TireSection, replay};

/// Colours of the methods, in their order.
const COLOURS: [CssClass; 5] = ["c0", "c1", "c2", "c3", "c4"];
/// Data points that are drawn at most.
const DRAWN: usize = 700;
const WIDE: [f64; 2] = [1080.0, 420.0];
const SMALL: [f64; 2] = [350.0, 230.0];

/// What is shown of one tire.
pub struct TireFigures {
    /// Nothing without samples.
    pub curve: Option<Plot>,
    /// What the curve misses.
    pub misfit: Option<Plot>,
    /// By the name of the quantity.
    pub densities: Vec<(&'static str, Plot)>,
    /// How the fits came to their ends.
    pub trace: Option<Plot>,
}

pub const CURVE_TITLE: &str = "Tire curve (dashed: no data there)";
pub const MISFIT_TITLE: &str = "What the curve misses (0: nothing)";
pub const TRACE_TITLE: &str = "Trace of the fits";

impl TireFigures {
    /// Those of a tire.
    pub fn for_section(section: &TireSection) -> Self {
        use Parameter::{B, C, D, E};
        let quantities = [B, C, D, E].map(Quantity::Parameter).into_iter().chain(Quantity::DERIVED);
        Self {
            curve: curve_plot(section),
            misfit: section.methods.first().and_then(|first| {
                MisfitOverSlip::from_samples(section.samples, &theta_of_estimate(first.estimate, section))
                    .plot_beneath_curve(section)
            }),
            densities: quantities.map(|it| (it.name(), density_plot(section, it))).collect(),
            trace: convergence_plot(section),
        }
    }

    /// Hands all of them over for the replay.
    pub fn show_in_replay(&self, section: &TireSection, host: &mut dyn AnalysisServices) {
        let methods: Vec<&str> = section.methods.iter().map(|method| method.name).collect();
        let mut show = |plot, title: &str| replay::show_plot(plot, section.name, title, &methods, host);
        if let Some(plot) = &self.curve {
            show(plot, "tire curve, with the 95 % band of the posterior");
        }
        self.densities.iter().for_each(|(quantity, plot)| show(plot, quantity));
        if let Some(plot) = &self.trace {
            show(plot, TRACE_TITLE);
        }
    }
}

/// Curves of all methods over the data, with the band of the first.
fn curve_plot(section: &TireSection) -> Option<Plot> {
    let [low, high] = section.samples.slip_range()?;
    let space = 0.3 * (high - low).max(high.abs()).max(1e-6);
    let (start, end) = (if low < -0.25 * high { low - space } else { low.min(0.0) }, high + space);
    let grid = |from: f64, to: f64| (0..=160).map(move |i| from + (to - from) * f64::from(i) / 160.0);
    let data = thin_by_slip(section.samples);
    let found: Vec<_> = section
        .methods
        .iter()
        .map(|method| magic_formula_from_theta(&theta_of_estimate(method.estimate, section)))
        .collect();
    let heights = found.iter().flat_map(|tire| grid(start, end).map(|slip| tire.friction_coefficient(slip)));
    let y = PlotAxis::around_values(
        section.direction.force_label(),
        data.iter().map(|point| point.1).chain(heights),
    );
    let mut plot = Plot::new(WIDE, PlotAxis::linear(section.direction.slip_label(), start, end), y);
    if let Some(first) = section.methods.first() {
        let slips: Vec<f64> = grid(start, end).collect();
        let band: Vec<_> = slips.iter().copied().zip(first.posterior.curve_band(&slips)).collect();
        plot.add_band(&band, COLOURS[0], "95 % of the posterior");
    }
    plot.add_dots(&data, 1.8, "data", "data");
    for ((method, tire), class) in section.methods.iter().zip(&found).zip(COLOURS.into_iter().cycle()) {
        let points =
            |from, to| grid(from, to).map(|slip| (slip, tire.friction_coefficient(slip))).collect::<Vec<_>>();
        plot.add_line(&points(low, high), class, method.name);
        plot.add_dashed_line(&points(start, low), class, "");
        plot.add_dashed_line(&points(high, end), class, "");
    }
    Some(plot)
}

/// How far each fit was from its end: the cost above that of the end, of variational inference the evidence lower bound below it.
fn convergence_plot(section: &TireSection) -> Option<Plot> {
    let ways: Vec<_> = section
        .methods
        .iter()
        .zip(COLOURS.into_iter().cycle())
        .map(|(method, class)| {
            let estimate = method.estimate;
            let bound = estimate.svi.as_ref().map(|variational| variational.elbo_trace.as_slice());
            let values = bound.unwrap_or(&estimate.convergence.trace);
            let last = values.last().copied().unwrap_or(f64::NAN);
            let distances = values.iter().map(|value| (value - last).abs()).enumerate();
            let points = distances.map(|(step, distance)| (step as f64, distance));
            // Where the last value is met there is no logarithm.
            (method, class, points.filter(|point| point.1 > 0.0).collect::<Vec<_>>())
        })
        .collect();
    let points = || ways.iter().flat_map(|way| &way.2);
    let longest = points().map(|point| point.0).fold(1.0, f64::max);
    let least = points().map(|point| point.1).fold(f64::INFINITY, f64::min);
    let most = points().map(|point| point.1).fold(0.0, f64::max);
    let y = PlotAxis::logarithmic("cost above its end", 0.5 * least, 2.0 * most);
    let mut plot = Plot::new(WIDE, PlotAxis::linear("iteration", 0.0, longest), y);
    for (method, class, points) in ways.iter().filter(|way| !way.2.is_empty()) {
        plot.add_line(points, class, method.name);
        plot.add_dots(points, 2.5, class, "");
    }
    (!plot.layers.is_empty()).then_some(plot)
}

/// One of B, C, D, E, of stiffness, peak and the slip at the peak; dashed those of normal distributions.
fn density_plot(section: &TireSection, quantity: Quantity) -> Plot {
    let range = quantity.range_in_prior(section.prior);
    // Methods may share one posterior, and a method's posterior may be its normal distribution.
    let mut curves: Vec<(&PosteriorSamples, CssClass, bool)> = Vec::new();
    for (method, class) in section.methods.iter().zip(COLOURS.into_iter().cycle()) {
        let own = method.gaussian.map(|gaussian| (gaussian, class, true));
        for curve in own.into_iter().chain([(method.posterior, class, false)]) {
            if !curves.iter().any(|(known, ..)| std::ptr::eq(*known, curve.0)) {
                curves.push(curve);
            }
        }
    }
    let draws: Vec<Vec<f64>> = curves
        .iter()
        .map(|(posterior, ..)| {
            let mut values = posterior.quantity_values(quantity);
            values.sort_by(f64::total_cmp);
            values
        })
        .collect();
    // The middle 99.8 %: single draws far away would flatten the rest.
    let ends = draws.iter().flat_map(|values| [quantile(values, 0.001), quantile(values, 0.999)]);
    let values = section.methods.iter().filter_map(|method| method.estimate.mean.get(&quantity).copied());
    let x = PlotAxis::around_values(
        &format!("{quantity} [{}]", quantity_unit(quantity, section.direction)),
        ends.chain(values),
    );
    let grid: Vec<f64> = (0..=120).map(|i| x.low() + (x.high() - x.low()) * f64::from(i) / 120.0).collect();
    let smooth: Vec<Vec<f64>> = draws.iter().map(|values| kernel_density(values, range, &grid)).collect();
    let top = smooth.iter().flatten().copied().filter(|height| height.is_finite()).fold(0.0, f64::max);
    let mut plot = Plot::new(SMALL, x, PlotAxis::linear("density", 0.0, 1.08 * top));
    for ((posterior, class, gaussian), heights) in curves.iter().zip(&smooth) {
        if posterior.samples.is_empty() {
            continue;
        }
        let points: Vec<_> = grid.iter().copied().zip(heights.iter().copied()).collect();
        if *gaussian {
            plot.add_dashed_line(&points, class, "normal distribution");
        } else {
            let filled: Vec<_> = points.iter().map(|&(x, height)| (x, [0.0, height])).collect();
            plot.add_band(&filled, class, "");
            plot.add_line(&points, class, "posterior");
        }
    }
    for (method, class) in section.methods.iter().zip(COLOURS.into_iter().cycle()) {
        if let Some(&value) = method.estimate.mean.get(&quantity) {
            plot.add_vertical_line(value, class, method.name);
        }
    }
    plot
}

/// Densities of B, C, D and E of several tires, as the first method says: Fig. 6 of Goblirsch et al. 2025.
pub fn axle_densities(sections: &[&TireSection]) -> Vec<(&'static str, Plot)> {
    use Parameter::{B, C, D, E};
    let plot = |quantity: Quantity| (quantity.name(), axle_density_plot(sections, quantity));
    [B, C, D, E].map(Quantity::Parameter).map(plot).into()
}

fn axle_density_plot(sections: &[&TireSection], quantity: Quantity) -> Plot {
    let drawn: Vec<(&TireSection, Vec<f64>)> = sections
        .iter()
        .filter_map(|section| {
            let mut values = section.methods.first()?.posterior.quantity_values(quantity);
            values.sort_by(f64::total_cmp);
            // What is held at the prior has no density.
            (values.first() < values.last()).then_some((*section, values))
        })
        .collect();
    let ends = drawn.iter().flat_map(|(_, values)| [quantile(values, 0.001), quantile(values, 0.999)]);
    let unit = sections.first().map_or("–", |it| quantity_unit(quantity, it.direction));
    let x = PlotAxis::around_values(&format!("{quantity} [{unit}]"), ends);
    let grid: Vec<f64> = (0..=120).map(|i| x.low() + (x.high() - x.low()) * f64::from(i) / 120.0).collect();
    let heights = drawn
        .iter()
        .map(|(section, values)| kernel_density(values, quantity.range_in_prior(section.prior), &grid));
    let heights: Vec<Vec<f64>> = heights.collect();
    let top = heights.iter().flatten().copied().filter(|height| height.is_finite()).fold(0.0, f64::max);
    let mut plot = Plot::new(SMALL, x, PlotAxis::linear("density", 0.0, 1.08 * top));
    for (((section, _), heights), class) in drawn.iter().zip(&heights).zip(COLOURS.into_iter().cycle()) {
        let points: Vec<_> = grid.iter().copied().zip(heights.iter().copied()).collect();
        let filled: Vec<_> = points.iter().map(|&(x, height)| (x, [0.0, height])).collect();
        plot.add_band(&filled, class, "");
        plot.add_line(&points, class, section.name);
    }
    plot
}

/// Sum of normal kernels of Silverman's width; what would leak through a bound is reflected.
fn kernel_density(ascending: &[f64], [low, high]: [f64; 2], grid: &[f64]) -> Vec<f64> {
    let count = ascending.len() as f64;
    let robust = (quantile(ascending, 0.75) - quantile(ascending, 0.25)) / 1.349;
    let width =
        0.9 * std(ascending).min(if robust > 0.0 { robust } else { f64::INFINITY }) * count.powf(-0.2);
    let factor = 1.0 / (count * width * (2.0 * std::f64::consts::PI).sqrt());
    let kernel = |distance: f64| (-0.5 * (distance / width).powi(2)).exp();
    let near = |at: f64| -> f64 {
        let first = ascending.partition_point(|&value| value < at - 6.0 * width);
        ascending[first..]
            .iter()
            .take_while(|&&value| value <= at + 6.0 * width)
            .map(|value| kernel(value - at))
            .sum()
    };
    let inside = |at: f64| (low..=high).contains(&at);
    let height = |&at: &f64| {
        if inside(at) { factor * (near(at) + near(2.0 * low - at) + near(2.0 * high - at)) } else { 0.0 }
    };
    grid.iter().map(height).collect()
}

/// At most `DRAWN` points, evenly taken from those ordered by slip.
fn thin_by_slip(samples: &CurveSamples) -> Vec<(f64, f64)> {
    let point = |row: usize| (samples.slip[row], samples.force[row]);
    samples.rows_by_slip(DRAWN).into_iter().map(point).collect()
}

/// The parameters of an estimate; what it does not name is at the prior.
fn theta_of_estimate(estimate: &TireEstimate, section: &TireSection) -> Theta {
    let mut values = theta_from_magic_formula(&magic_formula_from_theta(&section.prior.centre));
    for parameter in Parameter::ALL {
        if let Some(&value) = estimate.mean.get(&Quantity::from(parameter)) {
            values[parameter as usize] = value;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    #[test]
    fn a_density_integrates_to_one_and_does_not_leak_through_bounds() {
        let draws: Vec<f64> = (0..4000).map(|i| f64::from(i) / 4000.0).collect();
        let grid: Vec<f64> = (0..=600).map(|i| -1.0 + f64::from(i) / 200.0).collect();
        let heights = kernel_density(&draws, [0.0, 1.0], &grid);
        assert_abs_diff_eq!(heights.iter().sum::<f64>() / 200.0, 1.0, epsilon = 0.01);
        assert_abs_diff_eq!(heights[200], 1.0, epsilon = 0.02);
        assert_eq!(heights[199], 0.0);
    }

    #[test]
    fn thinning_keeps_the_ends_and_no_more_than_it_draws() {
        let slip: Vec<f64> = (0..10_000).rev().map(f64::from).collect();
        let thinned = thin_by_slip(&CurveSamples::new(slip.clone(), slip));
        assert_eq!(thinned.len(), DRAWN);
        assert_eq!(thinned[0].0, 0.0);
        assert!(thinned[DRAWN - 1].0 > 9980.0);
        assert!(thin_by_slip(&CurveSamples::default()).is_empty());
    }
}
