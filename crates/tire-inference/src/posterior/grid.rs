//! Draws from the posterior in the box: a grid in C and E that is refined where the posterior is, a line of ln B through each
//! cell, D, the shifts and the noise in closed form; weights correct what grid and lines leave.
//!
//! Several modes get their masses, also narrow ones, which random walks and populations miss.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

mod height;
mod line;
mod linear;
mod modes;
mod plane;

use numerics::resampling::systematic_resample;
use rand::RngExt;
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::compressed::CompressedSamples;
use crate::parameters::{COUNT, Parameter, Theta};
use crate::posterior::report::{PosteriorMode, PosteriorReport, SamplingMethod, SamplingStatus};
use crate::posterior::{PosteriorSamples, SampledPosterior, SamplingOptions};
use crate::prior::Prior;
use linear::LinearParameterIntegrator;
use plane::{CellIndex, GridCell, PosteriorGrid, is_noise_too_small};

const S_H: usize = Parameter::S_h as usize;

/// Fewer samples would make the approximations for Student's t distribution coarse.
const SAMPLES: usize = 12;
/// Draws that are spread over all cells evenly, in case a cell is worth more than its centre.
const EVEN: f64 = 1e-4;
/// Draws from one line of a cell: exploring it costs much more than a draw, and a cell is small beside the posterior.
const ON_LINE: usize = 4;
/// Effective number of draws over their number from which on they can be relied on.
pub const EFFECTIVE: f64 = 0.5;
/// Largest weight of a draw, their sum being 1, up to which they can.
pub const LARGEST: f64 = 0.01;
/// How often cells are split once more for it.
const FINER: usize = 2;
/// Modes of less mass are not reported.
const TOLD: f64 = 1e-3;

/// Draws of equal weight. `optima` are points that the grid must not miss, such as the minima of least squares; `None` where
/// the method does not apply, see [`SamplingStatus::NotApplicable`].
pub fn draw_from_grid(
    data: &CompressedSamples,
    prior: &Prior,
    optima: &[Theta],
    options: &SamplingOptions,
) -> Option<SampledPosterior> {
    if data.effective_count() < SAMPLES || prior.free == [false; COUNT] || options.draws == 0 {
        return None;
    }
    let near = optima.first().filter(|_| prior.free[S_H]).unwrap_or(&prior.centre);
    let linear = LinearParameterIntegrator::new(data, prior, near[S_H]);
    let least = optima.iter().map(|theta| data.residual_squares(theta)).fold(f64::INFINITY, f64::min);
    let least = if least.is_finite() { least } else { 1e-3 * data.force_squares() };
    let noise = linear.relative_noise(least);
    if is_noise_too_small(noise, data.effective_count() as f64) {
        return None;
    }
    let mut plane = PosteriorGrid::new(&linear, prior, optima, noise);
    let mut weighted = WeightedDraws::new(&plane, &linear, prior, options);
    for _ in 0..FINER {
        // In smaller cells there is less that a centre does not say.
        if weighted.is_even() || !plane.resolved || !plane.split_once_more() {
            break;
        }
        weighted = WeightedDraws::new(&plane, &linear, prior, options);
    }
    let WeightedDraws { drawn, weights, effective_share, largest_weight } = &weighted;
    let report = PosteriorReport {
        method: SamplingMethod::Grid,
        status: match (plane.resolved, weighted.is_even()) {
            (true, true) => SamplingStatus::Exact,
            (false, _) => SamplingStatus::Unresolved,
            (true, false) => SamplingStatus::Uneven,
        },
        effective_share: *effective_share,
        largest_weight: *largest_weight,
        modes: summarise_modes(&plane, drawn, weights),
        cells: plane.visited,
        levels: plane.level,
        ..PosteriorReport::default()
    };
    let chosen = systematic_resample(weights, options.draws, options.seed);
    let draws = chosen.into_iter().map(|index| drawn[index].theta).collect();
    Some(SampledPosterior { posterior: PosteriorSamples { samples: draws }, report })
}

struct GridDraw {
    theta: Theta,
    log_weight: f64,
    place: CellIndex,
}

/// Draws with weights of sum 1.
struct WeightedDraws {
    drawn: Vec<GridDraw>,
    weights: Vec<f64>,
    effective_share: f64,
    largest_weight: f64,
}

impl WeightedDraws {
    fn new(
        plane: &PosteriorGrid,
        linear: &LinearParameterIntegrator,
        prior: &Prior,
        options: &SamplingOptions,
    ) -> Self {
        let drawn = draw_from_cells(plane, linear, prior, options);
        let best = drawn.iter().map(|draw| draw.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let mut weights: Vec<f64> = drawn.iter().map(|draw| (draw.log_weight - best).exp()).collect();
        let whole: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= whole);
        let effective = weights.iter().map(|weight| weight * weight).sum::<f64>().recip();
        Self {
            effective_share: effective / options.draws as f64,
            largest_weight: weights.iter().copied().fold(0.0, f64::max),
            drawn,
            weights,
        }
    }

    fn is_even(&self) -> bool {
        self.effective_share >= EFFECTIVE && self.largest_weight <= LARGEST
    }
}

/// Draws from the cells in proportion to their masses, with the weights that make them draws from the posterior.
fn draw_from_cells(
    plane: &PosteriorGrid,
    linear: &LinearParameterIntegrator,
    prior: &Prior,
    options: &SamplingOptions,
) -> Vec<GridDraw> {
    let cells: Vec<(&CellIndex, &GridCell)> = plane.cells.iter().collect();
    let best = cells.iter().map(|(_, cell)| cell.log).fold(f64::NEG_INFINITY, f64::max);
    let masses: Vec<f64> = cells.iter().map(|(_, cell)| (cell.log - best).exp()).collect();
    let whole: f64 = masses.iter().sum();
    let even = EVEN / cells.len() as f64;
    let shares: Vec<f64> = masses.iter().map(|mass| mass / whole * (1.0 - EVEN) + even).collect();
    let chosen = systematic_resample(&shares, options.draws, !options.seed);
    let some = |(number, same): (usize, &[usize])| -> Vec<GridDraw> {
        let index = same[0];
        let mut random = Pcg64::new(u128::from(options.seed), number as u128);
        let (&place, cell) = cells[index];
        let [[C, width], [s, height]] = plane.cell_centre_and_size(place);
        let C = C + (random.random::<f64>() - 0.5) * width;
        let s = s + (random.random::<f64>() - 0.5) * height;
        let line = plane.line_density(C, s, Some(&cell.line.shape));
        let ends = plane.log_B_range();
        let mut one = |_: &usize| {
            let (log_B, log_drawn) = line.draw_log_B(ends, &mut random);
            let (integral, log_density) = plane.integrate_at(log_B, C, s);
            let mut theta = prior.centre;
            if prior.free[0] {
                theta[0] = log_B.exp().clamp(prior.bounds.lower[0], prior.bounds.upper[0]);
            }
            theta[1] = C;
            theta[3] = plane.E(s);
            let log_weight = log_density - log_drawn - shares[index].ln()
                + linear.draw_linear_parameters(&mut theta, &integral, &mut random);
            let inside = (ends[0]..=ends[1]).contains(&log_B) && log_weight.is_finite();
            GridDraw { theta, log_weight: if inside { log_weight } else { f64::NEG_INFINITY }, place }
        };
        same.iter().map(&mut one).collect()
    };
    let of_cell = chosen.chunk_by(|a, b| a == b);
    let groups: Vec<_> = of_cell.flat_map(|same| same.chunks(ON_LINE)).enumerate().collect();
    groups.into_par_iter().flat_map_iter(some).collect()
}

fn summarise_modes(plane: &PosteriorGrid, drawn: &[GridDraw], weights: &[f64]) -> Vec<PosteriorMode> {
    let owner = modes::label_modes(plane);
    let mut sums: std::collections::BTreeMap<usize, PosteriorMode> = Default::default();
    for (draw, weight) in drawn.iter().zip(weights) {
        let Some(mode) = owner.get(&draw.place) else { continue };
        let mode = sums.entry(*mode).or_insert(PosteriorMode { mass: 0.0, mean: [0.0; COUNT] });
        mode.mass += weight;
        mode.mean = std::array::from_fn(|i| mode.mean[i] + weight * draw.theta[i]);
    }
    let mut modes: Vec<PosteriorMode> = sums.into_values().filter(|mode| mode.mass > TOLD).collect();
    for mode in &mut modes {
        mode.mean = mode.mean.map(|sum| sum / mode.mass);
    }
    modes.sort_by(|a, b| b.mass.total_cmp(&a.mass));
    modes
}
