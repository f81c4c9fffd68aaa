//! Integrates over B on one line of the box, and draws from it: as a normal distribution of ln B where it is one, from a table
//! where not.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::PI;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StudentT};

/// Points of a table.
const NODES: usize = 24;
/// Nats below the highest point that a table goes down to.
const DEPTH: f64 = 12.0;
/// Step of ln B that a line without a guess is looked over with.
const SCAN: f64 = 0.3;
/// Narrower tables may turn out to be normal distributions.
const NARROW: f64 = 0.45;

/// The density on a line, as a function of ln B.
#[derive(Clone, Debug)]
pub struct LineDensity {
    /// Logarithm of its integral.
    pub log: f64,
    /// What is remembered of it.
    pub shape: LineShape,
}

/// What a line looks like.
#[derive(Clone, Debug)]
pub enum LineShape {
    /// B is held.
    Point,
    /// A normal distribution: centre and standard deviation.
    Normal(f64, f64),
    /// Logarithms of the density at even steps from the first to the second number, as lines in between.
    Table([f64; 2], Box<[f64; NODES]>),
}

/// Finds the shape of a density between `ends`, near one that was found before.
pub fn explore_line_density(
    density: &impl Fn(f64) -> f64,
    ends: [f64; 2],
    near: Option<&LineShape>,
) -> LineDensity {
    if ends[0] >= ends[1] {
        return LineDensity { log: density(ends[0]), shape: LineShape::Point };
    }
    let (range, start) = match near {
        Some(LineShape::Normal(centre, std)) => {
            let range = [centre - 6.0 * std, centre + 6.0 * std];
            (range, Some((*centre, *std)))
        }
        Some(LineShape::Table(range, values)) if range[1] - range[0] < NARROW => (
            *range,
            Some((node_position(*range, index_of_maximum(&values[..])), (range[1] - range[0]) / 8.0)),
        ),
        Some(LineShape::Table(range, _)) => (*range, None),
        _ => {
            let count = ((ends[1] - ends[0]) / SCAN).ceil() as usize;
            let step = (ends[1] - ends[0]) / count as f64;
            let index = |k: usize| ends[0] + (k as f64 + 0.5) * step;
            let values: Vec<f64> = (0..count).map(|k| density(index(k))).collect();
            (ends, Some((index(index_of_maximum(&values)), 0.3 * step)))
        }
    };
    start
        .and_then(|(centre, step)| fit_normal_shape(density, ends, centre, step))
        .unwrap_or_else(|| tabulate_density(density, ends, range))
}

fn index_of_maximum(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&i, &j| values[i].total_cmp(&values[j])).unwrap_or(0)
}

/// Newton's steps with parabolas through three points. `None` if that is no good description of the density.
fn fit_normal_shape(
    density: &impl Fn(f64) -> f64,
    ends: [f64; 2],
    mut centre: f64,
    mut step: f64,
) -> Option<LineDensity> {
    for _ in 0..6 {
        let [below, middle, above] = [-1.0, 0.0, 1.0].map(|k| density(centre + k * step));
        let bend = (2.0 * middle - below - above) / (step * step);
        if bend.is_nan() || bend <= 0.0 {
            return None;
        }
        let std = bend.sqrt().recip();
        let shift = (above - below) / (2.0 * step * bend);
        if shift.abs() < 0.5 * step && (0.4..2.5).contains(&(step / std)) {
            let mode = centre + shift;
            let top = middle + 0.5 * shift * shift * bend;
            let inside = mode - 2.5 * std > ends[0] && mode + 2.5 * std < ends[1];
            let fits = |k: f64| (density(mode + k * std) - top + 0.5 * k * k).abs() < 0.6;
            return (std < 0.04 && inside && fits(-2.2) && fits(2.2)).then(|| LineDensity {
                log: top + 0.5 * (2.0 * PI * std * std).ln(),
                shape: LineShape::Normal(mode, std),
            });
        }
        centre += shift.clamp(-4.0 * step, 4.0 * step);
        if centre <= ends[0] || centre >= ends[1] {
            return None;
        }
        step = std.clamp(0.1 * step, 10.0 * step);
    }
    None
}

/// Place of a node.
fn node_position(range: [f64; 2], node: usize) -> f64 {
    range[0] + (range[1] - range[0]) * node as f64 / (NODES - 1) as f64
}

/// Tabulates the density, from a range to the one where it is not negligible.
fn tabulate_density(density: &impl Fn(f64) -> f64, ends: [f64; 2], range: [f64; 2]) -> LineDensity {
    let mut range = [range[0].max(ends[0]), range[1].min(ends[1])];
    let mut values = [0.0; NODES];
    for _ in 0..7 {
        values = std::array::from_fn(|node| density(node_position(range, node)));
        let top = values[index_of_maximum(&values)];
        let counts = |value: &f64| *value > top - DEPTH;
        let first = values.iter().position(counts).unwrap_or(0);
        let last = values.iter().rposition(counts).unwrap_or(NODES - 1);
        let width = range[1] - range[0];
        let low =
            if first == 0 { (range[0] - 0.5 * width).max(ends[0]) } else { node_position(range, first - 1) };
        let high = if last == NODES - 1 {
            (range[1] + 0.5 * width).min(ends[1])
        } else {
            node_position(range, last + 1)
        };
        let grows = low < range[0] || high > range[1];
        if !grows && high - low > 0.6 * width {
            break;
        }
        range = [low, high];
    }
    let (log, _) = segment_masses(&values, (range[1] - range[0]) / (NODES - 1) as f64);
    LineDensity { log, shape: LineShape::Table(range, Box::new(values)) }
}

/// Logarithm of the integral, and the mass of each segment relative to it.
fn segment_masses(values: &[f64; NODES], step: f64) -> (f64, [f64; NODES - 1]) {
    let top = values[index_of_maximum(values)];
    // From the higher end: a cliff of the box may be more nats high than a number has.
    let masses: [f64; NODES - 1] = std::array::from_fn(|k| {
        let (high, fall) = (values[k].max(values[k + 1]) - top, (values[k + 1] - values[k]).abs());
        step * high.exp() * if fall < 1e-9 { 1.0 } else { -(-fall).exp_m1() / fall }
    });
    let whole: f64 = masses.iter().sum();
    (top + whole.ln(), masses.map(|mass| mass / whole))
}

impl LineDensity {
    /// A draw of ln B, with the logarithm of the density that it was drawn from.
    pub fn draw_log_B(&self, ends: [f64; 2], random: &mut impl Rng) -> (f64, f64) {
        match &self.shape {
            LineShape::Point => (ends[0], 0.0),
            LineShape::Normal(centre, std) => {
                // Heavier tails than those of what is drawn.
                let t: f64 = StudentT::new(4.0).map_or(0.0, |student| student.sample(random));
                (centre + t * std, (0.375 / std).ln() - 2.5 * (0.25 * t * t).ln_1p())
            }
            LineShape::Table(range, values) => {
                // A cliff may be anywhere between two nodes.
                let guarded: [f64; NODES] = std::array::from_fn(|k| {
                    let neighbours = values[k.saturating_sub(1)].max(values[(k + 1).min(NODES - 1)]);
                    values[k].max(neighbours - 2.5)
                });
                let step = (range[1] - range[0]) / (NODES - 1) as f64;
                let (log, masses) = segment_masses(&guarded, step);
                let mut rest = random.random::<f64>();
                let last = (0..NODES - 1).find(|&k| {
                    rest -= masses[k];
                    rest < 0.0
                });
                let k = last.unwrap_or(NODES - 2);
                let rise = guarded[k + 1] - guarded[k];
                let share = random.random::<f64>();
                let share = if rise.abs() < 1e-9 { share } else { (share * rise.exp_m1()).ln_1p() / rise };
                (node_position(*range, k) + share * step, guarded[k] + share * rise - log)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn a_cliff_of_any_height_leaves_the_mass_beside_it() {
        let ends = [0.0, 1.0];
        for cliff in [10.0, 705.0, 720.0, 1e5] {
            let density = |x: f64| if x < 0.5 { -cliff } else { -3.0 * x };
            // The cliff is somewhere in a step of the table: 1/23 of the range, which the density beside it says is 8 %.
            let line = explore_line_density(&density, ends, None);
            let exact = ((-1.5_f64).exp() - (-3.0_f64).exp()) / 3.0;
            assert_relative_eq!(line.log.exp(), exact, max_relative = 0.1);
        }
    }
}
