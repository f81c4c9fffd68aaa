//! Draws how stiffness and friction change over a log.

use html_page::{Markup, Plot, PlotAxis};

use crate::stretches::QuantityDrift;

const SIZE: [f64; 2] = [530.0, 240.0];

/// A plot for each quantity of which stretches tell anything.
pub fn plots(drifts: &[QuantityDrift]) -> impl Iterator<Item = Markup> {
    drifts
        .iter()
        .filter(|it| !it.drift.stretches.is_empty())
        .map(|it| drift_plot(it).figure_with_legend(&it.name))
}

fn drift_plot(drifting: &QuantityDrift) -> Plot {
    let (factor, unit) = drifting.unit;
    let unit = if unit.is_empty() { "–" } else { unit };
    let stretches = &drifting.drift.stretches;
    let scaled = |value: f64| factor * value;
    let line: Vec<_> = stretches.iter().map(|it| (it.time, scaled(it.value))).collect();
    let band: Vec<_> = stretches.iter().map(|it| (it.time, it.interval.map(scaled))).collect();
    let dots: Vec<_> = stretches.iter().map(|it| (it.time, scaled(it.alone))).collect();
    let values = dots.iter().map(|dot| dot.1).chain(band.iter().flat_map(|it| it.1));
    let y = PlotAxis::around_values(&format!("{} [{unit}]", drifting.quantity), values);
    let mut plot = Plot::new(SIZE, PlotAxis::around_values("time [s]", line.iter().map(|point| point.0)), y);
    plot.add_band(&band, "c0", "95 %");
    plot.add_line(&line, "c0", "random walk");
    plot.add_dots(&dots, 2.5, "c1", "single stretches");
    plot
}
