//! Finds values of sensors that no motion explains: far from what the filter expects, while those beside them are not.

use preparation::{Drive, median};

use crate::adequacy::CHANNELS;
use crate::likelihood::DriveUnknowns;
use crate::problem::PredictionErrorProblem;
use crate::tires::Tires;

/// Robust standard deviations from which on an innovation is an outlier, if it is so many times those beside it: an error of the model
/// lasts for several rows.
const FAR: f64 = 6.0;
const ISOLATED: f64 = 2.0;
/// Share of a channel's values above which they are no outliers but what the sensor gives.
const MOST: f64 = 0.05;
/// How often the recordings are looked at.
const PASSES: usize = 3;
/// Rows at both ends of a recording that are not looked at: delays may leave them out.
const ENDS: usize = 30;

/// Values that were left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outliers {
    /// How many of v_x, v_y, r and a_y.
    pub counts: [usize; 4],
    /// What they would cost [nat].
    pub cost: f64,
}

impl Outliers {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.counts.iter().sum()
    }

    /// In words, by channel.
    pub fn by_channel(&self) -> String {
        let of = |(name, count): (&&str, &usize)| format!("{count} of {name}");
        let some = CHANNELS.iter().zip(&self.counts).filter(|(_, count)| **count > 0);
        some.map(of).collect::<Vec<_>>().join(", ")
    }
}

/// The recordings with no number in place of each outlier, from tires near the optimum. `None` where there are none. Each pass looks again
/// without those of the pass before, which hide others near them.
pub fn without_outliers(problem: &PredictionErrorProblem, start: &Tires) -> Option<(Vec<Drive>, Outliers)> {
    let mut recordings = problem.recordings.to_vec();
    let mut outliers = Outliers::default();
    for pass in 0..PASSES {
        let problem = PredictionErrorProblem { recordings: &recordings, ..problem.clone() };
        let innovations = whitened_innovations(&problem, start, pass > 0);
        let before = outliers.count();
        for channel in 0..CHANNELS.len() {
            let e: Vec<&[f64]> = innovations.iter().map(|drive| drive[channel].as_slice()).collect();
            remove_outliers(channel, &e, &mut recordings, &mut outliers);
        }
        if outliers.count() == before {
            break;
        }
    }
    (outliers.count() > 0).then_some((recordings, outliers))
}

/// Innovations over their standard deviations, by recording and channel; 0 in rows without any. Noises are estimated where wanted: without
/// most of the outliers they are those of the sensors.
fn whitened_innovations(
    problem: &PredictionErrorProblem,
    start: &Tires,
    with_noises: bool,
) -> Vec<[Vec<f64>; 4]> {
    let start = DriveUnknowns::new(start, &problem.noise.initial_noise());
    let fit = match with_noises {
        true => problem.fit_roughly(Vec::new(), start),
        false => problem.fit_tires_at_fixed_noise(start),
    };
    let blank = |drive: &Drive| [(); 4].map(|()| vec![0.0; drive.len()]);
    let mut innovations: Vec<[Vec<f64>; 4]> = problem.recordings.iter().map(blank).collect();
    fit.likelihood.visit_innovations(&problem.fitted_unknowns(&fit), |drive, row, innovation, _| {
        for (i, residual) in innovation.residual.iter().enumerate() {
            innovations[drive][i][row] = residual / innovation.variance[i].sqrt();
        }
    });
    innovations
}

/// Takes the outliers of a channel out, unless they are too many to be any.
fn remove_outliers(channel: usize, e: &[&[f64]], recordings: &mut [Drive], outliers: &mut Outliers) {
    let mut sizes: Vec<f64> = e.iter().flat_map(|drive| drive.iter().map(|e| e.abs())).collect();
    // Of a normal distribution half are within 0.6745 standard deviations.
    let std = median(&mut sizes).unwrap_or(0.0) / 0.6745;
    let is_outlier = |e: &[f64], k: usize| {
        // What comes after an outlier on its other side is the filter on its way back.
        let after = if e[k + 1] * e[k] > 0.0 { e[k + 1].abs() } else { 0.0 };
        let beside = e[k - 1].abs().max(after);
        e[k].abs() > FAR * std && e[k].abs() > ISOLATED * beside
    };
    let of_drive = |e: &&[f64]| -> Vec<usize> {
        (ENDS..e.len().saturating_sub(ENDS)).filter(|k| is_outlier(e, *k)).collect()
    };
    let rows: Vec<Vec<usize>> = e.iter().map(of_drive).collect();
    let count: usize = rows.iter().map(Vec::len).sum();
    if count as f64 > MOST * sizes.len() as f64 {
        return;
    }
    outliers.counts[channel] += count;
    for ((drive, rows), e) in recordings.iter_mut().zip(&rows).zip(e) {
        let column = match channel {
            0 => &mut drive.v_x,
            1 => &mut drive.v_y,
            2 => &mut drive.r,
            _ => &mut drive.a_y,
        };
        for &row in rows {
            column[row] = f64::NAN;
            outliers.cost += 0.5 * (e[row] / std).powi(2);
        }
    }
}
