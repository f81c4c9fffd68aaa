//! Rates the agreement of two signals over time by ISO/TS 18571:2014: corridor, phase, magnitude and slope.
//!
//! The formulas are those of Barbat, Fu, Zhan, Yang and Gehre, Objective rating metric for dynamic systems (ESV 2013, paper
//! 13-0448), from which the standard was made.

use std::fmt;

use crate::warping::warping_path;
use crate::{RatingError, check_finite, check_length};

/// Half width of the inner corridor, as a share of the largest absolute value of the reference.
const INNER: f64 = 0.05;
/// The same of the outer corridor.
const OUTER: f64 = 0.5;
/// The largest shift that is tried, as a share of the samples.
const LARGEST_SHIFT: f64 = 0.2;
/// The error of the magnitude, and of the slope, that scores 0.
const LARGEST_MAGNITUDE_ERROR: f64 = 0.5;
const LARGEST_SLOPE_ERROR: f64 = 2.0;
/// Half width of the window of the time warping, as a share of the samples.
const WARPED: f64 = 0.1;
/// Samples on each side of the mean of nine that smooths slopes.
const SMOOTHED: usize = 4;

/// Fewest samples: nine slopes remain after the largest shift.
pub const FEWEST: usize = 11;
/// Samples that are compared at most: time and memory grow with their square.
pub const MOST: usize = 10_000;

/// How well a candidate agrees with a reference; all scores are from 0 to 1, the best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalRating {
    /// Score of the distances at each time, Z.
    pub corridor: f64,
    /// Score of the shift in time, EP.
    pub phase: f64,
    /// Score of the sizes, without shift and differences in time, EM.
    pub magnitude: f64,
    /// Score of the slopes, without shift, ES.
    pub slope: f64,
    /// R = 0.4 Z + 0.2 EP + 0.2 EM + 0.2 ES.
    pub overall: f64,
    /// The grade of R.
    pub grade: RatingGrade,
    /// The shift with the best correlation [s], a multiple of the sampling step; positive when the candidate is late.
    pub delay: f64,
}

/// The grade of an overall rating.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RatingGrade {
    /// At most 0.58.
    Poor,
    /// More than 0.58.
    Fair,
    /// More than 0.80.
    Good,
    /// More than 0.94.
    Excellent,
}

impl RatingGrade {
    /// The grade of an overall rating.
    #[must_use]
    pub fn from_overall(overall: f64) -> Self {
        match overall {
            r if r > 0.94 => RatingGrade::Excellent,
            r if r > 0.80 => RatingGrade::Good,
            r if r > 0.58 => RatingGrade::Fair,
            _ => RatingGrade::Poor,
        }
    }
}

impl fmt::Display for RatingGrade {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            RatingGrade::Excellent => "excellent",
            RatingGrade::Good => "good",
            RatingGrade::Fair => "fair",
            RatingGrade::Poor => "poor",
        })
    }
}

/// Rates a candidate against a reference, sampled at the same times `dt` [s] apart, over the whole of both.
///
/// The scores do not depend on `dt`, but on what a sample is: slopes are means over nine of them, and shifts are whole ones. The
/// standard, which is about crashes, wants 10 kHz. More than [`MOST`] samples become means of neighbours first.
///
/// Where the standard divides by zero, equal things score 1 and others 0, and no shift fits a constant signal better than none.
///
/// # Errors
/// When lengths differ, there are fewer than [`FEWEST`] samples, or some are not finite.
pub fn rate_signal(reference: &[f64], candidate: &[f64], dt: f64) -> Result<SignalRating, RatingError> {
    check_length("the candidate", candidate, reference.len())?;
    if reference.len() < FEWEST {
        return Err(RatingError::Short { least: FEWEST, found: reference.len() });
    }
    check_finite("the reference", reference)?;
    check_finite("the candidate", candidate)?;
    let each = reference.len().div_ceil(MOST);
    let (reference, candidate) = (block_means(reference, each), block_means(candidate, each));

    let corridor = corridor_score(&reference, &candidate);
    let late = best_shift(&reference, &candidate);
    let phase = phase_score(late, reference.len());
    let (reference, candidate) = overlapping_samples(&reference, &candidate, late);
    let magnitude = magnitude_score(reference, candidate);
    let slope = slope_score(reference, candidate);
    let overall = 0.4 * corridor + 0.2 * phase + 0.2 * magnitude + 0.2 * slope;
    let delay = late as f64 * each as f64 * dt;
    Ok(SignalRating {
        corridor,
        phase,
        magnitude,
        slope,
        overall,
        grade: RatingGrade::from_overall(overall),
        delay,
    })
}

/// Means of so many neighbours each; the last one may have fewer.
fn block_means(values: &[f64], each: usize) -> Vec<f64> {
    values.chunks(each).map(|part| part.iter().sum::<f64>() / part.len() as f64).collect()
}

/// Z: 1 within the inner corridor, 0 outside of the outer one, a parabola between.
fn corridor_score(reference: &[f64], candidate: &[f64]) -> f64 {
    let peak = reference.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()));
    let (inner, outer) = (INNER * peak, OUTER * peak);
    let score = |(reference, candidate): (&f64, &f64)| match (reference - candidate).abs() {
        distance if distance <= inner => 1.0,
        distance if distance > outer => 0.0,
        distance => ((outer - distance) / (outer - inner)).powi(2),
    };
    reference.iter().zip(candidate).map(score).sum::<f64>() / reference.len() as f64
}

/// The samples that the candidate is late, negative when it is early: the smallest shift with the largest correlation, of two
/// equal ones the late one.
fn best_shift(reference: &[f64], candidate: &[f64]) -> isize {
    let most = (reference.len() as f64 * LARGEST_SHIFT).floor() as isize;
    let both_ways = (1..=most).flat_map(|shift| [shift, -shift]);
    let correlated = |late| {
        let (reference, candidate) = overlapping_samples(reference, candidate, late);
        correlation(reference, candidate)
    };
    let mut best = (0, correlated(0));
    for late in both_ways {
        let found = correlated(late);
        if found > best.1 {
            best = (late, found);
        }
    }
    best.0
}

/// What is left of both signals when the candidate is moved forward by so many samples.
fn overlapping_samples<'a>(
    reference: &'a [f64],
    candidate: &'a [f64],
    late: isize,
) -> (&'a [f64], &'a [f64]) {
    let (shift, kept) = (late.unsigned_abs(), reference.len() - late.unsigned_abs());
    match late >= 0 {
        true => (&reference[..kept], &candidate[shift..]),
        false => (&reference[shift..], &candidate[..kept]),
    }
}

/// Pearson's correlation; not a number for a constant signal.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    ab / (aa * bb).sqrt()
}

/// EP: 1 without a shift, 0 at the largest one, linear between.
fn phase_score(late: isize, samples: usize) -> f64 {
    let largest = LARGEST_SHIFT * samples as f64;
    linear_score(late.unsigned_abs() as f64, largest)
}

/// EM: from the distances that are left when time is warped, against the size of the reference.
fn magnitude_score(reference: &[f64], candidate: &[f64]) -> f64 {
    let width = (WARPED * reference.len() as f64).ceil() as usize;
    let path = warping_path(candidate, reference, width.saturating_sub(1));
    let distances = path.iter().map(|[candidate, reference]| (candidate - reference).abs()).sum();
    let sizes = path.iter().map(|[_, reference]| reference.abs()).sum();
    linear_score(relative_error(distances, sizes), LARGEST_MAGNITUDE_ERROR)
}

/// ES: from the distances of smoothed slopes, against the slopes of the reference.
fn slope_score(reference: &[f64], candidate: &[f64]) -> f64 {
    let (reference, candidate) = (smoothed_slopes(reference), smoothed_slopes(candidate));
    let distances = reference.iter().zip(&candidate).map(|(a, b)| (a - b).abs()).sum();
    let sizes = reference.iter().map(|slope| slope.abs()).sum();
    linear_score(relative_error(distances, sizes), LARGEST_SLOPE_ERROR)
}

/// Central differences per sample, and at the ends one-sided ones; then means over nine, and over 1, 3, 5 and 7 at the ends.
fn smoothed_slopes(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let difference = |k: usize| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
        (values[after] - values[before]) / (after - before) as f64
    };
    let raw: Vec<f64> = (0..=last).map(difference).collect();
    let smooth = |k: usize| {
        let side = SMOOTHED.min(k).min(last - k);
        raw[k - side..=k + side].iter().sum::<f64>() / (2 * side + 1) as f64
    };
    (0..=last).map(smooth).collect()
}

/// An error as a share of a size; none of nothing is none.
fn relative_error(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}

/// 1 without an error, 0 at the largest one, linear between.
fn linear_score(error: f64, largest: f64) -> f64 {
    ((largest - error) / largest).clamp(0.0, 1.0)
}
