//! Computes moments of a posterior with free shifts by brute force: a fixed grid in C and √(1 − E), at each of its points one in
//! ln B and S_h, and at each of those lines of S_v and D.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use rayon::prelude::*;
use tire_inference::compressed::CompressedSamples;
use tire_inference::kernel::shape_sums;
use tire_inference::prior::Prior;

/// B, C, D, E, K, S_h, S_v.
pub const COUNT: usize = 7;

/// B, C, D, E, K, S_h and S_v of a tire.
pub fn quantities([B, C, D, E, S_h, S_v]: &[f64; 6]) -> [f64; COUNT] {
    [*B, *C, *D, *E, B * C * D, *S_h, *S_v]
}

/// From and to of C, s, ln B and S_h.
type Box4 = [[f64; 2]; 4];

/// Nats below the highest point that are of no consequence.
const DEPTH: f64 = 18.0;

/// Mean and standard deviation of each with all six parameters free, or all but S_h. `nodes` per side of the plane, `inner`
/// per side of what is at its points.
pub fn judge(data: &CompressedSamples, prior: &Prior, nodes: usize, inner: usize) -> [[f64; 2]; COUNT] {
    let judge = Judge { data, prior };
    let (lower, upper) = (prior.bounds.lower, prior.bounds.upper);
    let shift = if prior.free[4] { [lower[4], upper[4]] } else { [prior.centre[4]; 2] };
    let mut whole: Box4 = [[lower[1], upper[1]], [0.0, 1.0], [lower[0].ln(), upper[0].ln()], shift];
    let mut best = f64::NEG_INFINITY;
    for _ in 0..4 {
        (whole, best) = judge.closer(whole, nodes, inner);
    }
    let sums: Vec<Sum> = (0..nodes * nodes)
        .into_par_iter()
        .map(|k| judge.sum(&at_node(whole, k, nodes), inner, best - DEPTH))
        .collect();
    let best = sums.iter().map(|sum| sum.log).fold(f64::NEG_INFINITY, f64::max);
    let mut total = Sum::default();
    sums.iter().for_each(|sum| total.add((sum.log - best).exp(), sum));
    total.moments()
}

/// The inner rectangle at a node of the plane: C and s as ranges without a length.
fn at_node(whole: Box4, k: usize, nodes: usize) -> Box4 {
    let middle = |axis: usize, k: usize| {
        let [low, high] = whole[axis];
        [low + (high - low) * (k as f64 + 0.5) / nodes as f64; 2]
    };
    [middle(0, k / nodes), middle(1, k % nodes), whole[2], whole[3]]
}

fn across(range: [f64; 2], k: usize, count: usize) -> f64 {
    range[0] + (range[1] - range[0]) * (k as f64 + 0.5) / count as f64
}

#[derive(Clone, Default)]
struct Sum {
    log: f64,
    mass: f64,
    first: [f64; COUNT],
    second: [f64; COUNT],
}

impl Sum {
    fn add(&mut self, weight: f64, other: &Self) {
        self.mass += weight * other.mass;
        for i in 0..COUNT {
            self.first[i] += weight * other.first[i];
            self.second[i] += weight * other.second[i];
        }
    }

    fn moments(&self) -> [[f64; 2]; COUNT] {
        std::array::from_fn(|i| {
            let mean = self.first[i] / self.mass;
            [mean, (self.second[i] / self.mass - mean * mean).sqrt()]
        })
    }
}

struct Judge<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
}

/// Sum of squares of a shape as a function of D and S_v.
struct Paraboloid {
    ones: f64,
    y: f64,
    yy: f64,
    hh: f64,
    yh: f64,
    h: f64,
}

impl Paraboloid {
    fn at(&self, D: f64, S_v: f64) -> f64 {
        self.yy
            + D * (D * self.hh - 2.0 * self.yh)
            + S_v * (S_v * self.ones - 2.0 * self.y)
            + 2.0 * D * S_v * self.h
    }
}

impl Judge<'_> {
    fn half(&self) -> f64 {
        0.5 * (self.data.effective_count() as f64 - 1.0)
    }

    fn paraboloid(&self, log_B: f64, C: f64, s: f64, S_h: f64) -> Paraboloid {
        let (mut slips, mut weights, mut forces) = (Vec::new(), Vec::new(), Vec::new());
        for [slip, weight, force] in self.data.slip_nodes() {
            slips.push(slip + S_h);
            weights.push(weight);
            forces.push(force);
        }
        let of = [log_B.exp(), C, 1.0 - 2.0 * s * s];
        let [hh, yh, h] = shape_sums(of, &slips, [&weights, &forces, &weights]);
        let (ones, y) = (weights.iter().sum(), forces.iter().sum());
        Paraboloid { ones, y, yy: self.data.force_squares(), hh, yh, h }
    }

    /// Where S_v may be, and where D may be for an S_v.
    fn S_v(&self, of: &Paraboloid) -> [f64; 2] {
        let information = of.ones - of.h * of.h / of.hh;
        let centre = (of.y - of.h * of.yh / of.hh) / information;
        let squares = of.yy - of.yh * of.yh / of.hh - centre * centre * information;
        self.between(5, centre, (squares / (2.0 * self.half() * information)).sqrt())
    }

    fn D(&self, of: &Paraboloid, S_v: f64) -> [f64; 2] {
        let centre = (of.yh - S_v * of.h) / of.hh;
        let squares = of.at(centre, S_v);
        self.between(2, centre, (squares / (2.0 * self.half() * of.hh)).sqrt())
    }

    fn between(&self, parameter: usize, centre: f64, std: f64) -> [f64; 2] {
        let ends = [self.prior.bounds.lower[parameter], self.prior.bounds.upper[parameter]];
        if !self.prior.free[parameter] {
            return [self.prior.centre[parameter]; 2];
        }
        let nearest = centre.clamp(ends[0], ends[1]);
        [(nearest - 7.0 * std).max(ends[0]), (nearest + 7.0 * std).min(ends[1])]
    }

    /// Highest point over D and S_v, nearly.
    fn highest(&self, of: &Paraboloid) -> f64 {
        let [low, high] = self.S_v(of);
        let best = (0..9).map(|k| {
            let S_v = low + (high - low) * f64::from(k) / 8.0;
            let [low, high] = self.D(of, S_v);
            of.at(0.5 * (low + high), S_v)
        });
        -self.half() * best.fold(f64::INFINITY, f64::min).ln()
    }

    /// The inner points with their heights.
    fn scan(&self, at: &Box4, inner: usize) -> Vec<([f64; 2], f64)> {
        let point = |k: usize| {
            let (log_B, S_h) = (across(at[2], k / inner, inner), across(at[3], k % inner, inner));
            ([log_B, S_h], self.highest(&self.paraboloid(log_B, at[0][0], at[1][0], S_h)))
        };
        (0..inner * inner).map(point).collect()
    }

    /// The smallest box around all that counts, with a margin, and the highest point.
    fn closer(&self, whole: Box4, nodes: usize, inner: usize) -> (Box4, f64) {
        let points: Vec<([f64; 4], f64)> = (0..nodes * nodes)
            .into_par_iter()
            .flat_map_iter(|k| {
                let at = at_node(whole, k, nodes);
                let index = move |[log_B, S_h]: [f64; 2]| [at[0][0], at[1][0], log_B, S_h];
                self.scan(&at, inner).into_iter().map(move |(p, height)| (index(p), height))
            })
            .collect();
        let best = points.iter().map(|point| point.1).fold(f64::NEG_INFINITY, f64::max);
        let around = |axis: usize| {
            let count = if axis < 2 { nodes } else { inner } as f64;
            let margin = 1.5 * (whole[axis][1] - whole[axis][0]) / count;
            let inside = points.iter().filter(|point| point.1 > best - DEPTH).map(|p| p.0[axis]);
            let low = inside.clone().fold(f64::INFINITY, f64::min) - margin;
            let high = inside.fold(f64::NEG_INFINITY, f64::max) + margin;
            [low.max(whole[axis][0]), high.min(whole[axis][1])]
        };
        ([0, 1, 2, 3].map(around), best)
    }

    fn sum(&self, at: &Box4, inner: usize, least: f64) -> Sum {
        // Only the part that counts here.
        let heights = self.scan(at, inner / 2);
        let top = heights.iter().map(|point| point.1).fold(f64::NEG_INFINITY, f64::max);
        let mut sum = Sum { log: top, ..Sum::default() };
        if top < least {
            return sum;
        }
        let part: [[f64; 2]; 2] = std::array::from_fn(|axis| {
            let range = at[2 + axis];
            let margin = 1.5 * (range[1] - range[0]) / (inner / 2) as f64;
            let counts = heights.iter().filter(|point| point.1 > top - DEPTH);
            let inside = counts.map(|point| point.0[axis]);
            let low = inside.clone().fold(f64::INFINITY, f64::min) - margin;
            let high = inside.fold(f64::NEG_INFINITY, f64::max) + margin;
            [low.max(range[0]), high.min(range[1])]
        });
        let (C, s) = (at[0][0], at[1][0]);
        for k in 0..inner * inner {
            let (log_B, S_h) = (across(part[0], k / inner, inner), across(part[1], k % inner, inner));
            let of = self.paraboloid(log_B, C, s, S_h);
            if self.highest(&of) < top - DEPTH {
                continue;
            }
            let shifts = self.S_v(&of);
            for i in 0..16 {
                let S_v = across(shifts, i, 16);
                let peaks = self.D(&of, S_v);
                let volume: f64 = part
                    .iter()
                    .chain([&shifts, &peaks])
                    .filter(|range| range[1] > range[0])
                    .map(|range| (range[1] - range[0]).ln())
                    .sum();
                for j in 0..16 {
                    let D = across(peaks, j, 16);
                    let log = -self.half() * of.at(D, S_v).ln() + log_B + s.ln() + volume;
                    let weight = (log - top).exp();
                    sum.mass += weight;
                    let theta = [log_B.exp(), C, D, 1.0 - 2.0 * s * s, S_h, S_v];
                    for (n, value) in quantities(&theta).into_iter().enumerate() {
                        sum.first[n] += weight * value;
                        sum.second[n] += weight * value * value;
                    }
                }
            }
        }
        sum
    }
}
