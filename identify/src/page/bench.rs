//! Writes the page of a tire from a test bench: verdicts, and curves of single sweeps with what was measured.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::fmt::Write;

use askama::Template;
use html_page::{Plot, PlotAxis};
use tire_bench::{ChannelFitSummary, FittedChannel, RevolutionMean, TireFit};

use crate::page::filters;

/// The most sweeps that are shown of one force.
const SWEEPS: usize = 12;

/// The size of a figure [px].
const SIZE: [f64; 2] = [420.0, 280.0];

/// Slips of less do not tell a curve.
const SWEPT: f64 = 0.05;

#[derive(Template)]
#[template(path = "bench.html")]
struct BenchPage<'a> {
    title: &'static str,
    fit: &'a TireFit,
    summary: &'a [String],
    forces: Vec<ForceSection<'a>>,
}

/// What the fit misses of one force, and some of its sweeps.
struct ForceSection<'a> {
    name: &'static str,
    unit: &'static str,
    residuals: &'a ChannelFitSummary,
    sweeps: usize,
    shown: usize,
    plots: Vec<(String, Plot)>,
}

/// The page; `points` are all means over a revolution, in their order.
pub fn render_bench_page(fit: &TireFit, points: &[RevolutionMean], summary: &[String]) -> String {
    let channels = [FittedChannel::Longitudinal, FittedChannel::Lateral, FittedChannel::Aligning];
    let forces = channels.into_iter().filter_map(|channel| force_section(fit, channel, points)).collect();
    html_page::render_page(&BenchPage { title: "Tire from a test bench", fit, summary, forces })
}

/// Name and unit of a force.
fn channel_name_and_unit(channel: FittedChannel) -> [&'static str; 2] {
    match channel {
        FittedChannel::Longitudinal => ["F_x", "N"],
        FittedChannel::Lateral => ["F_y", "N"],
        FittedChannel::Aligning => ["M_z", "N m"],
    }
}

fn force_section<'a>(
    fit: &'a TireFit,
    channel: FittedChannel,
    points: &[RevolutionMean],
) -> Option<ForceSection<'a>> {
    let along = channel == FittedChannel::Longitudinal;
    let slip = |it: &RevolutionMean| if along { it.sample.kappa } else { it.sample.alpha };
    let own = |a: &RevolutionMean, b: &RevolutionMean| {
        (a.sample.run, a.sample.block) == (b.sample.run, b.sample.block)
    };
    let range = |sweep: &[RevolutionMean]| {
        let ends =
            sweep.iter().map(slip).fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x), high.max(x)]);
        ends[1] - ends[0]
    };
    let sweeps: Vec<_> = points.chunk_by(own).filter(|sweep| range(sweep) > SWEPT).collect();
    let residuals = fit.residuals.iter().find(|it| it.channel == channel)?;
    let [name, unit] = channel_name_and_unit(channel);
    let shown = sweeps.len().min(SWEEPS);
    let plot = |k: usize| {
        // Spread over the whole test, from its first sweep to its last.
        let place = if shown > 1 { k * (sweeps.len() - 1) / (shown - 1) } else { 0 };
        let bands = fit.prediction_bands(channel, sweeps[place])?;
        Some(sweep_figure(channel, sweeps[place], &bands, &slip))
    };
    let plots = (0..shown).filter_map(plot).collect();
    Some(ForceSection { name, unit, residuals, sweeps: sweeps.len(), shown, plots })
}

fn sweep_figure(
    channel: FittedChannel,
    sweep: &[RevolutionMean],
    bands: &[[f64; 2]],
    slip: &dyn Fn(&RevolutionMean) -> f64,
) -> (String, Plot) {
    let [name, unit] = channel_name_and_unit(channel);
    let along = channel == FittedChannel::Longitudinal;
    // Angles are displayed in degrees.
    let shown = |it: &RevolutionMean| if along { slip(it) } else { slip(it).to_degrees() };
    let measured: Vec<_> = sweep.iter().map(|it| (shown(it), channel.measured_value(it))).collect();
    let fitted: Vec<_> = sweep.iter().zip(bands).map(|(it, band)| (shown(it), band[0])).collect();
    let band: Vec<_> = sweep
        .iter()
        .zip(bands)
        .map(|(it, [value, half])| (shown(it), [value - half, value + half]))
        .collect();
    let heights = measured.iter().map(|it| it.1).chain(band.iter().flat_map(|it| it.1));
    let x = PlotAxis::around_values(
        if along { "slip ratio" } else { "slip angle [deg]" },
        measured.iter().map(|it| it.0),
    );
    let mut plot = Plot::new(SIZE, x, PlotAxis::around_values(&format!("{name} [{unit}]"), heights));
    for (k, branch) in split_sweep_branches(&band).into_iter().enumerate() {
        plot.add_band(&branch, "c1", if k == 0 { "95 % of means" } else { "" });
    }
    plot.add_line(&fitted, "c1", "fit");
    // Over the line, which hides them where the fit is close.
    plot.add_dots(&measured, 1.6, "data", "measured");
    // Not -0.0.
    let mean = |of: fn(&RevolutionMean) -> f64| {
        (sweep.iter().map(of).sum::<f64>() / sweep.len() as f64 * 1e4).round() / 1e4 + 0.0
    };
    let mut title = format!(
        "{:.0} N, camber {:.1} deg, {:.1} kPa",
        mean(|it| it.sample.F_z),
        mean(|it| it.sample.gamma).to_degrees(),
        mean(|it| it.sample.pressure) / 1e3
    );
    if along {
        let _ = write!(title, ", slip angle {:.1} deg", mean(|it| it.sample.alpha).to_degrees());
    }
    (title, plot)
}

/// A place on a curve, and the lower and the upper end of its band there.
type SweepBandPoint = (f64, [f64; 2]);

/// The ways of a sweep between its least and its largest slip, each from left to right: on the way back the tire is warmer.
fn split_sweep_branches(band: &[SweepBandPoint]) -> Vec<Vec<SweepBandPoint>> {
    let extreme = |sign: f64| {
        let order = |a: &usize, b: &usize| (sign * band[*a].0).total_cmp(&(sign * band[*b].0));
        (0..band.len()).max_by(order).unwrap_or(0)
    };
    let mut ends = [0, extreme(1.0), extreme(-1.0), band.len().saturating_sub(1)];
    ends.sort_unstable();
    let branch = |ends: &[usize]| {
        let mut branch = band[ends[0]..=ends[1]].to_vec();
        branch.sort_by(|a, b| a.0.total_cmp(&b.0));
        branch
    };
    ends.windows(2).filter(|it| it[1] > it[0]).map(branch).collect()
}
