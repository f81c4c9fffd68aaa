//! Makes points for a fit of samples: means over whole revolutions of the wheel, with rates and temperatures.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::TAU;

use numerics::statistics::quantile;
use tire::Coefficients;

use crate::sample::{BenchSample, SWEPT, value_range};

/// Time constant of the carcass temperature behind that of the tread [s]: the sweeps of a bench take about 10 s, the carcass minutes.
const CARCASS: f64 = 100.0;

/// The usual reference of the temperature terms [K]: the tread of a racing tire that works.
const USUAL_REFERENCE: f64 = 333.0;

/// Mean over one revolution of the wheel: run-out of tire and belt is no property of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RevolutionMean {
    /// Means of the samples; their time is that of the first.
    pub sample: BenchSample,
    /// Rate of the slip ratio [1/s] and of the slip angle [rad/s].
    pub rate: [f64; 2],
    /// Temperature of the carcass, that of the tread with a lag [K].
    pub carcass: f64,
    /// Mean load of the block [N].
    pub level: f64,
    /// Mean slip angle of a block that sweeps the slip ratio [rad].
    pub angle: Option<f64>,
    /// Time since the first sample of the run [s].
    pub elapsed: f64,
}

/// Means of samples in their order; `tire` gives the radius of the wheel.
pub fn average_over_revolutions(samples: &[BenchSample], tire: &Coefficients) -> Vec<RevolutionMean> {
    let mut points: Vec<RevolutionMean> = Vec::new();
    let (mut carcass, mut last) = (f64::NAN, f64::NAN);
    let mut start = (usize::MAX, 0.0);
    for block in samples.chunk_by(|a, b| (a.run, a.block) == (b.run, b.block)) {
        let (Some(first), Some(end)) = (block.first(), block.last()) else { continue };
        let step = (end.time - first.time) / (block.len() as f64 - 1.0).max(1.0);
        let turn = TAU * tire.UNLOADED_RADIUS / first.v_x.abs().max(1.0);
        let window = ((turn / step.max(1e-6)).round() as usize).clamp(1, block.len());
        if first.time < last || !carcass.is_finite() {
            carcass = first.temperature;
        }
        if start.0 != first.run {
            start = (first.run, first.time);
        }
        let level = block.iter().map(|it| it.F_z).sum::<f64>() / block.len() as f64;
        let driven = value_range(block.iter().map(|it| it.kappa)) > SWEPT;
        let angle = driven.then(|| block.iter().map(|it| it.alpha).sum::<f64>() / block.len() as f64);
        let begin = points.len();
        for samples in block.chunks_exact(window) {
            let sample = mean_sample(samples);
            if last.is_finite() && sample.time > last {
                carcass += (sample.temperature - carcass) * (1.0 - ((last - sample.time) / CARCASS).exp());
            }
            last = sample.time;
            points.push(RevolutionMean {
                sample,
                rate: [0.0; 2],
                carcass,
                level,
                angle,
                elapsed: sample.time - start.1,
            });
        }
        set_slip_rates(&mut points[begin..]);
    }
    points
}

/// The temperature [K] at which the terms of temperature are 0, so that the formula alone is a tire that was measured: the usual one
/// where the data reach it, else their median.
pub(crate) fn reference_temperature(points: &[RevolutionMean]) -> f64 {
    let measured = points.iter().map(|it| it.sample.temperature).filter(|it| it.is_finite());
    let mut measured: Vec<f64> = measured.collect();
    measured.sort_by(f64::total_cmp);
    let (Some(coldest), Some(warmest)) = (measured.first(), measured.last()) else {
        return USUAL_REFERENCE;
    };
    match (*coldest..=*warmest).contains(&USUAL_REFERENCE) {
        true => USUAL_REFERENCE,
        false => quantile(&measured, 0.5),
    }
}

fn mean_sample(samples: &[BenchSample]) -> BenchSample {
    let first = samples[0];
    let of = |value: fn(&BenchSample) -> f64| samples.iter().map(value).sum::<f64>() / samples.len() as f64;
    BenchSample {
        kappa: of(|it| it.kappa),
        alpha: of(|it| it.alpha),
        gamma: of(|it| it.gamma),
        F_z: of(|it| it.F_z),
        pressure: of(|it| it.pressure),
        v_x: of(|it| it.v_x),
        temperature: of(|it| it.temperature),
        F_x: of(|it| it.F_x),
        F_y: of(|it| it.F_y),
        M_z: of(|it| it.M_z),
        ..first
    }
}

fn set_slip_rates(points: &mut [RevolutionMean]) {
    for i in 0..points.len() {
        let (a, b) = (points[i.saturating_sub(1)].sample, points[(i + 1).min(points.len() - 1)].sample);
        let time = b.time - a.time;
        if time > 0.0 {
            points[i].rate = [(b.kappa - a.kappa) / time, (b.alpha - a.alpha) / time];
        }
    }
}
