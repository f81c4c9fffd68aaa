//! Computes moments of a posterior by brute force, in a way of its own: a fixed grid in C and a root of the distance of E from its
//! upper bound, a fine line of ln B through each of its points, and a line of D through each point of that.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use rayon::prelude::*;
use tire_inference::compressed::CompressedSamples;
use tire_inference::parameters::Theta;
use tire_inference::prior::Prior;

/// B, C, D, E, K.
pub const COUNT: usize = 5;

/// Mean and standard deviation of each, and the mass with E above a value.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    pub mean: [f64; COUNT],
    pub std: [f64; COUNT],
    pub mass_above: f64,
}

/// B, C, D, E, K of a tire.
pub fn quantities([B, C, D, E, ..]: &Theta) -> [f64; COUNT] {
    [*B, *C, *D, *E, B * C * D]
}

/// B, C, D and E free, no shifts. `nodes` per side of the plane, in the whole box and then again where anything is.
pub fn judge(data: &CompressedSamples, prior: &Prior, nodes: usize, above: f64) -> Moments {
    let mut rectangle = [[prior.bounds.lower[1], prior.bounds.upper[1]], [0.0, 1.0]];
    let mut sums = Vec::new();
    for pass in 0..3 {
        let step = rectangle.map(|[low, high]| (high - low) / nodes as f64);
        let at = |axis: usize, k: usize| rectangle[axis][0] + (k as f64 + 0.5) * step[axis];
        sums = (0..nodes * nodes)
            .into_par_iter()
            .map(|k| line(data, prior, [at(0, k / nodes), at(1, k % nodes)], above, pass < 2))
            .collect();
        let best = sums.iter().map(|sum: &Sum| sum.log).fold(f64::NEG_INFINITY, f64::max);
        let mut next = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for k in (0..nodes * nodes).filter(|&k| sums[k].log > best - 22.0) {
            for (axis, index) in [k / nodes, k % nodes].into_iter().enumerate() {
                next[axis][0] = next[axis][0].min(at(axis, index) - 2.0 * step[axis]);
                next[axis][1] = next[axis][1].max(at(axis, index) + 2.0 * step[axis]);
            }
        }
        if pass < 2 {
            for axis in 0..2 {
                rectangle[axis] =
                    [next[axis][0].max(rectangle[axis][0]), next[axis][1].min(rectangle[axis][1])];
            }
        }
    }
    moments(&sums)
}

/// Mass and first two moments, relative to exp(log).
pub struct Sum {
    /// Logarithm of the mass.
    pub log: f64,
    mass: f64,
    above: f64,
    first: [f64; COUNT],
    second: [f64; COUNT],
}

/// The line of all B through C and s. Where only the highest point is wanted, `log` is that.
pub fn line(data: &CompressedSamples, prior: &Prior, [C, s]: [f64; 2], above: f64, rough: bool) -> Sum {
    let [lowest, highest_E] = [prior.bounds.lower[3], prior.bounds.upper[3]];
    // Most of a wide box is far from the upper bound, near which E has to be resolved.
    let root = if highest_E - lowest > 2.0 { 4.0 } else { 2.0 };
    let E = highest_E - (highest_E - lowest) * s.powf(root);
    let ends = [prior.bounds.lower[0].ln(), prior.bounds.upper[0].ln()];
    let within = [prior.bounds.lower[2], prior.bounds.upper[2]];
    let half = 0.5 * (data.effective_count() as f64 - 1.0);
    let zero = data.force_squares();
    // The sum of squares is a parabola in D.
    let parabola = |log_B: f64| {
        let [one, two] = [1.0, 2.0].map(|D| data.residual_squares(&[log_B.exp(), C, D, E, 0.0, 0.0]));
        let bend = 0.5 * (two - 2.0 * one + zero);
        (one - zero - bend, bend)
    };
    let highest = |log_B: f64| {
        let (slope, bend) = parabola(log_B);
        let D = (-0.5 * slope / bend).clamp(within[0], within[1]);
        -half * (zero + D * (slope + D * bend)).ln()
    };
    // Where the line counts, ever closer.
    let points = if rough { 20 } else { 60 };
    let mut range = ends;
    let mut highest_of_all = f64::NEG_INFINITY;
    for _ in 0..4 {
        let step = (range[1] - range[0]) / f64::from(points);
        let values: Vec<f64> = (0..=points).map(|k| highest(range[0] + f64::from(k) * step)).collect();
        let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let first = values.iter().position(|v| *v > top - 20.0).unwrap_or(0);
        let last = values.iter().rposition(|v| *v > top - 20.0).unwrap_or(points as usize);
        let low = range[0] + (first as f64 - 1.0) * step;
        let high = range[0] + (last as f64 + 1.0) * step;
        range = [low.max(range[0]), high.min(range[1])];
        highest_of_all = top;
        if 3 * (last - first) > values.len() {
            break;
        }
    }
    let mut sum = Sum { log: f64::NEG_INFINITY, mass: 0.0, above: 0.0, first: [0.0; 5], second: [0.0; 5] };
    if rough {
        return Sum { log: highest_of_all, ..sum };
    }
    let step = (range[1] - range[0]) / 60.0;
    for k in 0..60 {
        let log_B = range[0] + (k as f64 + 0.5) * step;
        let B = log_B.exp();
        let (slope, bend) = parabola(log_B);
        let centre = -0.5 * slope / bend;
        let least = zero - bend * centre * centre;
        let wide = 9.0 * (least / (2.0 * half * bend)).sqrt();
        let nearest = centre.clamp(within[0], within[1]);
        let low = (nearest - wide).max(within[0]);
        let high = (nearest + wide).min(within[1]);
        let count = 24;
        for l in 0..count {
            let D = low + (high - low) * (l as f64 + 0.5) / count as f64;
            let squares = zero + D * (slope + D * bend);
            let log = -half * squares.ln() + log_B + (root - 1.0) * s.ln() + ((high - low) * step).ln();
            if log > sum.log {
                let shrink = (sum.log - log).exp();
                sum.mass *= shrink;
                sum.first.iter_mut().chain(&mut sum.second).for_each(|x| *x *= shrink);
                sum.log = log;
            }
            let weight = (log - sum.log).exp();
            sum.mass += weight;
            for (i, value) in quantities(&[B, C, D, E, 0.0, 0.0]).into_iter().enumerate() {
                sum.first[i] += weight * value;
                sum.second[i] += weight * value * value;
            }
        }
    }
    if E > above {
        sum.above = sum.mass;
    }
    sum.log += sum.mass.ln();
    for value in sum.first.iter_mut().chain(&mut sum.second).chain([&mut sum.above]) {
        *value /= sum.mass;
    }
    sum.mass = 1.0;
    sum
}

/// Of lines that stand for areas of the same size.
pub fn moments(sums: &[Sum]) -> Moments {
    let best = sums.iter().map(|sum| sum.log).fold(f64::NEG_INFINITY, f64::max);
    let (mut whole, mut above) = (0.0, 0.0);
    let (mut first, mut second) = ([0.0; COUNT], [0.0; COUNT]);
    for sum in sums {
        let weight = (sum.log - best).exp();
        whole += weight;
        above += weight * sum.above;
        for i in 0..COUNT {
            first[i] += weight * sum.first[i];
            second[i] += weight * sum.second[i];
        }
    }
    let mean = first.map(|sum| sum / whole);
    let std = std::array::from_fn(|i| (second[i] / whole - mean[i] * mean[i]).sqrt());
    Moments { mean, std, mass_above: above / whole }
}
