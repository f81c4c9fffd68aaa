//! Measures a fit on what it has not seen: a load, a pressure or a slip angle is left out of the fit.

use std::collections::BTreeSet;

use crate::condition::{RevolutionMean, average_over_revolutions};
use crate::fit::{TireFit, TireFitOptions, fit_tire_to_means};
use crate::model::FittedChannel;
use crate::sample::{BenchError, BenchSample};

/// What is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FitHoldout {
    /// Nothing: errors are those of the data that were fitted.
    Nothing,
    /// Blocks with a mean load within 150 N of this [N].
    Load(f64),
    /// Blocks with a mean pressure within 6 kPa of this [Pa].
    Pressure(f64),
    /// Blocks that sweep the slip ratio at a mean slip angle within 0.01 rad of this [rad].
    SlipAngle(f64),
}

/// How one channel of one run was predicted.
#[derive(Clone, Debug, PartialEq)]
pub struct HoldoutErrors {
    /// The run.
    pub run: usize,
    /// The channel.
    pub channel: FittedChannel,
    /// Points that were predicted.
    pub points: usize,
    /// The 99.9 % quantile of the size of the run's samples [N, N m]: what percents are of.
    pub peak: f64,
    /// Root mean square error of means over a revolution, as a share of the peak [-].
    pub means: f64,
    /// Root mean square error of single samples, as a share of the peak [-].
    pub samples: f64,
    /// Share of the means that lie within their 95 % bands [-].
    pub coverage: f64,
}

/// Fits without what is left out, and predicts it.
///
/// # Errors
/// As [`crate::fit_tire`].
pub fn fit_with_holdout(
    samples: &[BenchSample],
    options: &TireFitOptions,
    left: FitHoldout,
) -> Result<(TireFit, Vec<HoldoutErrors>), BenchError> {
    let blocks: BTreeSet<_> = samples
        .chunk_by(|a, b| (a.run, a.block) == (b.run, b.block))
        .filter(|block| is_held_out(block, left))
        .map(|block| (block[0].run, block[0].block))
        .collect();
    // The temperature of the carcass and the age of the tire need the whole run.
    let (points, kept): (Vec<RevolutionMean>, Vec<RevolutionMean>) =
        average_over_revolutions(samples, &options.tire)
            .into_iter()
            .partition(|it| blocks.contains(&(it.sample.run, it.sample.block)));
    let (kept, points) = if left == FitHoldout::Nothing { (kept.clone(), kept) } else { (kept, points) };
    let found = fit_tire_to_means(&kept, options)?;
    let mut results = Vec::new();
    let runs: BTreeSet<_> = points.iter().map(|it| it.sample.run).collect();
    for run in runs {
        for channel in [FittedChannel::Longitudinal, FittedChannel::Lateral, FittedChannel::Aligning] {
            let of_run = |it: &&RevolutionMean| it.sample.run == run;
            let own: Vec<_> = points.iter().filter(of_run).copied().collect();
            results.extend(holdout_errors(&found, channel, &own, samples));
        }
    }
    Ok((found, results))
}

fn is_held_out(block: &[BenchSample], left: FitHoldout) -> bool {
    let mean = |value: fn(&BenchSample) -> f64| block.iter().map(value).sum::<f64>() / block.len() as f64;
    match left {
        FitHoldout::Nothing => false,
        FitHoldout::Load(load) => (mean(|it| it.F_z) - load).abs() < 150.0,
        FitHoldout::Pressure(pressure) => (mean(|it| it.pressure) - pressure).abs() < 6000.0,
        FitHoldout::SlipAngle(angle) => {
            let swept = block.iter().any(|it| it.kappa.abs() > 0.05);
            swept && (mean(|it| it.alpha) - angle).abs() < 0.01
        }
    }
}

/// `None` for a channel that the run does not sweep.
fn holdout_errors(
    found: &TireFit,
    channel: FittedChannel,
    points: &[RevolutionMean],
    samples: &[BenchSample],
) -> Option<HoldoutErrors> {
    let run = points.first()?.sample.run;
    if channel == FittedChannel::Longitudinal && !points.iter().any(|it| it.sample.kappa.abs() > 0.05) {
        return None;
    }
    let bands = found.prediction_bands(channel, points)?;
    let single = |it: &BenchSample| RevolutionMean { sample: *it, ..RevolutionMean::default() };
    let mut sizes: Vec<f64> = samples
        .iter()
        .filter(|it| it.run == run)
        .map(|it| channel.measured_value(&single(it)).abs())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let peak = numerics::statistics::quantile(&sizes, 0.999);
    let errors = points.iter().zip(&bands).map(|(it, band)| (channel.measured_value(it) - band[0], band[1]));
    let (mut squares, mut inside) = (0.0, 0usize);
    for (error, half) in errors {
        squares += error * error;
        inside += usize::from(error.abs() <= half);
    }
    let count = points.len() as f64;
    let mut all = [0.0; 2];
    for it in samples.iter().filter(|it| it.run == run) {
        let next = points.partition_point(|point| point.sample.time <= it.time);
        let near = next.checked_sub(1).map(|place| points[place]);
        let Some(near) = near.filter(|near| near.sample.block == it.block) else { continue };
        let point = RevolutionMean { sample: *it, ..near };
        let error = found.predict_channel(channel, &point)? - channel.measured_value(&point);
        all = [all[0] + error * error, all[1] + 1.0];
    }
    Some(HoldoutErrors {
        run,
        channel,
        points: points.len(),
        peak,
        means: (squares / count).sqrt() / peak,
        samples: (all[0] / all[1]).sqrt() / peak,
        coverage: inside as f64 / count,
    })
}
