//! Draws how stiffness and friction change over a log.

use std::fmt::Write;

use html_page::{Axis, Plot, escape};

use crate::stretches::QuantityDrift;

const SIZE: [f64; 2] = [530.0, 240.0];

/// A sentence and a plot for each quantity; empty where nothing was told.
pub fn section(told: &[QuantityDrift]) -> String {
    let mut html = String::new();
    let mut figures = String::new();
    for it in told {
        let _ = writeln!(html, "<p>{}</p>", escape(&it.sentence));
        if !it.drift.stretches.is_empty() {
            figures.push_str(&plot(it).figure(&it.name));
        }
    }
    if !figures.is_empty() {
        let _ = writeln!(
            html,
            "<p class=\"faint\">Dots are fits of single stretches, line and band what is left of them by a random walk, 95 %.</p>\n\
             <div class=\"grid two\">\n{figures}</div>"
        );
    }
    html
}

fn plot(told: &QuantityDrift) -> Plot {
    let (factor, unit) = told.unit;
    let unit = if unit.is_empty() { "–" } else { unit };
    let stretches = &told.drift.stretches;
    let scaled = |value: f64| factor * value;
    let line: Vec<_> = stretches.iter().map(|it| (it.time, scaled(it.value))).collect();
    let band: Vec<_> = stretches.iter().map(|it| (it.time, it.interval.map(scaled))).collect();
    let dots: Vec<_> = stretches.iter().map(|it| (it.time, scaled(it.alone))).collect();
    let values = dots.iter().map(|dot| dot.1).chain(band.iter().flat_map(|it| it.1));
    let y = Axis::about(&format!("{} [{unit}]", told.quantity), values);
    let mut plot = Plot::new(SIZE, Axis::about("time [s]", line.iter().map(|point| point.0)), y);
    plot.band(&band, "c0", "95 %");
    plot.line(&line, "c0", "random walk");
    plot.dots(&dots, 2.5, "c1", "single stretches");
    plot
}
