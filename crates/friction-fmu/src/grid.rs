//! Knows friction and stiffness of an axle as probabilities on a grid.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use serde::{Deserialize, Serialize};

use crate::curve::{SPACING, TabulatedCurve};

/// Points below and above the nominal D: 0.165 to 1.93 of it.
const BELOW: usize = 30;
const ABOVE: usize = 11;
/// Points on either side of the nominal K: 0.52 to 1.93 of it.
const SIDE: usize = 11;
/// Points of D and of K.
const PEAKS: usize = BELOW + 1 + ABOVE;
const SLOPES: usize = 2 * SIDE + 1;
/// Values of ln K − ln D on the grid.
const SHAPES: usize = PEAKS + SLOPES - 1;

/// Largest square of an error in its variances, and smallest probability: products stay normal numbers, whatever comes in.
const MOST: f64 = 1e6;
const LEAST: f64 = 1e-60;

/// How an axle changes while nobody looks.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SurfaceDrift {
    /// Growth of the variances of ln D and ln K by random walk [1/s].
    pub walk: [f64; 2],
    /// Expected changes of the surface in a second [1/s].
    pub changes: f64,
    /// Standard deviation of ln D after a change of the surface.
    pub spread: f64,
}

/// Probabilities of D and K of an axle, by rows of one D.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrictionGrid {
    probabilities: Vec<f64>,
}

/// Means and variances of D and K [-, 1/rad], relative to the nominal ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FrictionMoments {
    /// Means of D and K over the nominal ones.
    pub mean: [f64; 2],
    /// Their standard deviations.
    pub std: [f64; 2],
}

/// Weights of a normal distribution at points of the grid; `first` is the place of the first one.
fn normal_weights<const N: usize>(first: f64, std: f64) -> [f64; N] {
    let std = std.max(0.3 * SPACING);
    let weight = |k: usize| (-0.5 * ((first + k as f64) * SPACING / std).powi(2)).exp();
    let weights: [f64; N] = std::array::from_fn(weight);
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// D and K over the nominal ones at the points.
fn grid_points<const N: usize>(first: f64) -> [f64; N] {
    std::array::from_fn(|k| ((first + k as f64) * SPACING).exp())
}

impl Default for FrictionGrid {
    fn default() -> Self {
        FrictionGrid::new([0.0; 2])
    }
}

impl FrictionGrid {
    /// Normal distributions of ln D and ln K around the nominal ones.
    pub fn new([std_D, std_K]: [f64; 2]) -> Self {
        let peaks = normal_weights::<PEAKS>(-(BELOW as f64), std_D);
        let slopes = normal_weights::<SLOPES>(-(SIDE as f64), std_K);
        let row = |p: f64| slopes.map(|q| p * q);
        FrictionGrid { probabilities: peaks.into_iter().flat_map(row).collect() }
    }

    fn probability_rows(&self) -> impl DoubleEndedIterator<Item = &[f64]> {
        self.probabilities.chunks_exact(SLOPES)
    }

    /// Bayes' theorem for a force over load (without S_v) at a slip angle [rad]. `variance` is that of the force, `weight` the
    /// share of an independent sample that this one is.
    ///
    /// The noise is Student's t with seven degrees of freedom: a sample that fits nowhere moves little.
    pub fn update_with_force(
        &mut self,
        curve: &TabulatedCurve,
        alpha: f64,
        force: f64,
        variance: f64,
        weight: f64,
    ) {
        let nominal = curve.nominal;
        let slip = alpha + nominal.S_h;
        let (K, D) = (nominal.cornering_stiffness_per_load(), nominal.D);
        let mut shapes = [0.0; SHAPES];
        let lowest = -((SIDE + ABOVE) as f64) * SPACING;
        curve.interpolate_shape(K * slip / D * lowest.exp(), &mut shapes);
        let peaks = grid_points::<PEAKS>(-(BELOW as f64));
        let factor = weight / (8.0 * variance);
        let mut sums = [0.0; SLOPES];
        for (i, row) in self.probabilities.chunks_exact_mut(SLOPES).enumerate() {
            let peak = (D * peaks[i]).copysign(slip);
            let shapes = &shapes[PEAKS - 1 - i..][..SLOPES];
            for ((p, shape), sum) in row.iter_mut().zip(shapes).zip(&mut sums) {
                let error = force - peak * shape;
                let inverse = 1.0 / (1.0 + (factor * error * error).min(MOST));
                let square = inverse * inverse;
                *p = (*p * square * square).max(LEAST);
                *sum += *p;
            }
        }
        let scale = 1.0 / sums.iter().sum::<f64>();
        self.probabilities.iter_mut().for_each(|p| *p *= scale);
    }

    /// Lets `time` [s] pass: D and K walk, and the surface may change, which leaves K alone.
    pub fn apply_drift(&mut self, drift: &SurfaceDrift, time: f64) {
        // No part of a walk moves more than a quarter of a probability to a neighbour.
        let moved = drift.walk.map(|variance| variance * time / (2.0 * SPACING * SPACING));
        let parts = (4.0 * moved[0].max(moved[1])).ceil().clamp(1.0, 50.0);
        let shares = moved.map(|share| (share / parts).min(0.25));
        for _ in 0..parts as usize {
            self.diffuse_probabilities(shares);
        }
        let changed = -(-drift.changes * time).exp_m1();
        let slopes = self.stiffness_marginal([1.0; PEAKS]);
        let surfaces = normal_weights::<PEAKS>(-(BELOW as f64), drift.spread);
        for (row, surface) in self.probabilities.chunks_exact_mut(SLOPES).zip(surfaces) {
            for (p, slope) in row.iter_mut().zip(slopes) {
                *p += changed * (surface * slope - *p);
            }
        }
    }

    /// Moves shares of each probability to both neighbours in D and in K; none leaves the grid.
    fn diffuse_probabilities(&mut self, [share_D, share_K]: [f64; 2]) {
        let mut before = [0.0; SLOPES];
        before.copy_from_slice(&self.probabilities[..SLOPES]);
        for end in (SLOPES..=self.probabilities.len()).step_by(SLOPES) {
            let (row, rest) = self.probabilities[end - SLOPES..].split_at_mut(SLOPES);
            let mut above = [0.0; SLOPES];
            above.copy_from_slice(rest.get(..SLOPES).unwrap_or(row));
            for ((p, before), above) in row.iter_mut().zip(&mut before).zip(above) {
                let here = *p;
                *p = here + share_D * (*before + above - 2.0 * here);
                *before = here;
            }
        }
        for row in self.probabilities.chunks_exact_mut(SLOPES) {
            let mut before = row[0];
            for j in 0..SLOPES {
                let here = row[j];
                let above = *row.get(j + 1).unwrap_or(&here);
                row[j] = here + share_K * (before + above - 2.0 * here);
                before = here;
            }
        }
    }

    /// Probabilities of D alone.
    fn peak_marginal(&self) -> [f64; PEAKS] {
        let mut peaks = [0.0; PEAKS];
        peaks.iter_mut().zip(self.probability_rows()).for_each(|(sum, row)| *sum = row.iter().sum());
        peaks
    }

    /// Probabilities of K alone, with a weight of each D.
    fn stiffness_marginal(&self, weights: [f64; PEAKS]) -> [f64; SLOPES] {
        let mut slopes = [0.0; SLOPES];
        for (row, weight) in self.probability_rows().zip(weights) {
            slopes.iter_mut().zip(row).for_each(|(sum, p)| *sum += weight * p);
        }
        slopes
    }

    /// Means and standard deviations, with a weight of each D. The grid itself is as unsure as a point is wide.
    fn weighted_moments(&self, weights: [f64; PEAKS]) -> FrictionMoments {
        let mut peaks = self.peak_marginal();
        peaks.iter_mut().zip(weights).for_each(|(p, weight)| *p *= weight);
        let (mean_D, std_D) = geometric_mean_and_log_std(&peaks, BELOW);
        let (mean_K, std_K) = geometric_mean_and_log_std(&self.stiffness_marginal(weights), SIDE);
        FrictionMoments { mean: [mean_D, mean_K], std: [std_D, std_K] }
    }
}

/// The exponential of the mean of a logarithm, and its standard deviation, from a distribution over points; `first` is the number of
/// those below 0. The distribution of a friction is skew: its logarithm is what has a mean.
fn geometric_mean_and_log_std(weights: &[f64], first: usize) -> (f64, f64) {
    let (mut sum, mut mean, mut square) = (0.0, 0.0, 0.0);
    for (k, p) in weights.iter().enumerate() {
        let x = (k as f64 - first as f64) * SPACING;
        sum += p;
        mean += p * x;
        square += p * x * x;
    }
    let mean = mean / sum;
    let variance = (square / sum - mean * mean).max(0.0) + SPACING * SPACING / 12.0;
    (mean.exp(), mean.exp() * variance.sqrt())
}

/// Both axles on one surface: what one of them knows of friction is news for the other one.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct AxleGrids {
    /// Each axle with its own news only.
    pub grids: [FrictionGrid; 2],
    /// An axle without news.
    blind: FrictionGrid,
}

/// Share of pairs of axles that have nothing in common: a puncture, a worn axle.
const ALONE: f64 = 0.05;

impl AxleGrids {
    /// Axles that know as much as `std` of ln D and ln K.
    pub fn new(std: [f64; 2]) -> Self {
        let grid = FrictionGrid::new(std);
        AxleGrids { grids: [grid.clone(), grid.clone()], blind: grid }
    }

    /// Lets `time` [s] pass.
    pub fn apply_drift(&mut self, drift: &SurfaceDrift, time: f64) {
        self.grids.iter_mut().chain([&mut self.blind]).for_each(|grid| grid.apply_drift(drift, time));
    }

    /// Both axles, each with the news of the other one. `difference` is the standard deviation of ln D_f − ln D_r, both over
    /// the nominal ones.
    ///
    /// p(D_f | both) ∝ p_f(D_f) Σ C(D_r | D_f) p_r(D_r) / π(D_r), with π without news.
    pub fn combined_moments(&self, difference: f64) -> [FrictionMoments; 2] {
        let blind = self.blind.peak_marginal();
        let near: [f64; PEAKS] = std::array::from_fn(|k| {
            (-0.5 * (k as f64 * SPACING / difference.max(0.3 * SPACING)).powi(2)).exp()
        });
        [0, 1].map(|axle| {
            let mut news = self.grids[1 - axle].peak_marginal();
            news.iter_mut().zip(blind).for_each(|(p, blind)| *p /= blind);
            let mean = news.iter().sum::<f64>() / PEAKS as f64;
            let weights = std::array::from_fn(|i| {
                let (mut common, mut norm) = (0.0, 0.0);
                for (j, p) in news.iter().enumerate() {
                    common += near[i.abs_diff(j)] * p;
                    norm += near[i.abs_diff(j)];
                }
                (1.0 - ALONE) * common / norm + ALONE * mean
            });
            self.grids[axle].weighted_moments(weights)
        })
    }
}
