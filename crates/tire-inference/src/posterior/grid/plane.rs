//! Covers the plane of C and E with cells, finer and finer where the posterior is.
//!
//! E is 1 − 2 s² near 1, so that even cells in s resolve the needle that the posterior often has at E → 1, see [`CurvatureFactorMap`].
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::parameters::{Parameter, Theta};
use crate::posterior::grid::height::CurvatureFactorMap;
use crate::posterior::grid::line::{self, LineDensity, LineShape};
use crate::posterior::grid::linear::{LinearIntegral, LinearParameterIntegrator};
use crate::prior::Prior;

const STIFFNESS: usize = Parameter::B as usize;
const SHAPE: usize = Parameter::C as usize;
const CURVATURE: usize = Parameter::E as usize;

/// Width of C that is covered with as many cells at first as the data ask for.
const SHAPES: f64 = 2.0;
/// Most levels.
const LEVELS: usize = 14;
/// Most cells at a level.
pub const CELLS: usize = 20_000;
/// Nats below the best cell that are kept.
const KEEP: f64 = 12.0;
/// A difference to a neighbour that leaves open what is in between [nat].
const STEEP: f64 = 2.0;
/// The mass that may be in such cells.
const STEEP_MASS: f64 = 0.1;

/// Column and row.
pub type CellIndex = (i32, i32);

/// A cell: its density is that at its centre, or at an optimum in it, if higher.
#[derive(Clone, Debug)]
pub struct GridCell {
    /// Logarithm of the density of C and s, but for a constant.
    pub log: f64,
    /// The line through its centre.
    pub line: LineDensity,
}

/// The cells of a level.
pub struct PosteriorGrid<'a> {
    linear: &'a LinearParameterIntegrator<'a>,
    prior: &'a Prior,
    height: CurvatureFactorMap,
    /// C and s of points that must not be missed.
    seeds: Vec<[f64; 2]>,
    /// Columns and rows of the whole box.
    size: [i32; 2],
    /// The cells, those that hold next to nothing left out.
    pub cells: BTreeMap<CellIndex, GridCell>,
    /// How often cells were split.
    pub level: usize,
    /// Cells of all levels.
    pub visited: usize,
    /// Whether the last level resolves the posterior.
    pub resolved: bool,
}

/// What of the data's likelihood counts at first, for each unit of the noise.
const SOFT: f64 = 1.5e5;

/// Whether noise is so small that not even the wide posterior of a part of the data leaves out any cell: then so many would be split
/// that the grid ends before it resolves anything.
pub fn is_noise_too_small(noise: f64, count: f64) -> bool {
    KEEP / (SOFT * noise) > -0.5 * count * noise.ln()
}

impl<'a> PosteriorGrid<'a> {
    /// Cells about all that counts. `seeds` are optima, `noise` is that of [`LinearParameterIntegrator::relative_noise`] at the best of them.
    pub fn new(
        linear: &'a LinearParameterIntegrator<'a>,
        prior: &'a Prior,
        seeds: &[Theta],
        noise: f64,
    ) -> Self {
        // The posterior's width falls with the root of the noise, and a cell must not be wider than a few of it.
        let finest = (24.0 * (8e-7 / noise).sqrt()).clamp(24.0, 72.0);
        let height = CurvatureFactorMap::new(prior.bounds.range(Parameter::E));
        let [low, high] = prior.bounds.range(Parameter::C);
        let cells = |free: bool, units: f64| {
            if free { (finest * units).ceil().clamp(4.0, 144.0) as i32 } else { 1 }
        };
        let size = [
            cells(prior.free[SHAPE], (high - low) / SHAPES),
            cells(prior.free[CURVATURE], height.range_in_units()),
        ];
        let seed = |theta: &Theta| {
            let shape = if prior.free[SHAPE] { theta[SHAPE] } else { prior.centre[SHAPE] };
            [shape, height.height_of(theta[CURVATURE])]
        };
        let seeds = seeds.iter().map(seed).collect();
        let mut this = Self {
            linear,
            prior,
            height,
            seeds,
            size,
            cells: BTreeMap::new(),
            level: 0,
            visited: 0,
            resolved: false,
        };
        this.refine_to_noise(noise);
        this
    }

    fn refine_to_noise(&mut self, noise: f64) {
        let all = (0..self.size[0]).flat_map(|i| (0..self.size[1]).map(move |k| ((i, k), None)));
        self.evaluate_cells(all.collect());
        // The posterior of fewer data first: it is wide enough for wide cells.
        let mut beta = (SOFT * noise).min(1.0);
        self.resolved = self.size == [1, 1];
        while !self.resolved && self.can_split() {
            self.split_cells(KEEP / beta);
            beta = (4.0 * beta).min(1.0);
            self.fill_neighbours(KEEP / beta);
            self.resolved = self.steep_mass() < STEEP_MASS;
        }
    }

    fn can_split(&self) -> bool {
        self.size != [1, 1] && self.level < LEVELS && self.visited < CELLS * 4 && self.cells.len() < CELLS
    }

    /// Splits the cells once more, if there may be so many.
    pub fn split_once_more(&mut self) -> bool {
        let can = self.can_split();
        if can {
            self.split_cells(KEEP);
            self.fill_neighbours(KEEP);
        }
        can
    }

    /// Looks at cells, each with what is known of the line of a neighbour.
    fn evaluate_cells(&mut self, wanted: BTreeMap<CellIndex, Option<LineShape>>) {
        self.visited += wanted.len();
        let list: Vec<_> = wanted.into_iter().collect();
        let found: Vec<GridCell> =
            list.par_iter().map(|(place, near)| self.evaluate_cell(*place, near.as_ref())).collect();
        self.cells.extend(list.into_iter().map(|(place, _)| place).zip(found));
    }

    fn evaluate_cell(&self, place: CellIndex, near: Option<&LineShape>) -> GridCell {
        let [[C, width], [s, height]] = self.cell_centre_and_size(place);
        let mut line = self.line_density(C, s, near);
        for &[seed_C, seed_s] in &self.seeds {
            if (seed_C - C).abs() <= 0.5 * width && (seed_s - s).abs() <= 0.5 * height {
                let other = self.line_density(seed_C, seed_s.max(s - 0.25 * height), near);
                line = if other.log > line.log { other } else { line };
            }
        }
        GridCell { log: line.log + self.log_jacobian(s), line }
    }

    /// The density along a line of the box.
    pub fn line_density(&self, C: f64, s: f64, near: Option<&LineShape>) -> LineDensity {
        let E = self.E(s);
        // Per ln B.
        let density = |log_B: f64| self.linear.integrate_at(log_B.exp(), C, E).log + log_B;
        line::explore_line_density(&density, self.log_B_range(), near)
    }

    /// Integral over all but B, C and s, as a density of ln B, C and s.
    pub fn integrate_at(&self, log_B: f64, C: f64, s: f64) -> (LinearIntegral, f64) {
        let integral = self.linear.integrate_at(log_B.exp(), C, self.E(s));
        (integral, integral.log + log_B + self.log_jacobian(s))
    }

    /// Ends of ln B.
    pub fn log_B_range(&self) -> [f64; 2] {
        if self.prior.free[STIFFNESS] {
            [self.prior.bounds.lower[STIFFNESS].ln(), self.prior.bounds.upper[STIFFNESS].ln()]
        } else {
            [self.prior.centre[STIFFNESS].ln(); 2]
        }
    }

    /// E at a height of the plane.
    pub fn E(&self, s: f64) -> f64 {
        let held = self.prior.centre[CURVATURE];
        if self.prior.free[CURVATURE] { self.height.curvature_factor_at(s) } else { held }
    }

    /// dE/ds but for a factor.
    fn log_jacobian(&self, s: f64) -> f64 {
        if self.prior.free[CURVATURE] { self.height.log_jacobian(s) } else { 0.0 }
    }

    /// C and s of a cell's centre, with its width and its height.
    pub fn cell_centre_and_size(&self, place: CellIndex) -> [[f64; 2]; 2] {
        let axis = |low: f64, high: f64, index: i32, count: i32| {
            let step = (high - low) / f64::from(count);
            [low + (f64::from(index) + 0.5) * step, step]
        };
        let [low, high] = match self.prior.free[SHAPE] {
            true => [self.prior.bounds.lower[SHAPE], self.prior.bounds.upper[SHAPE]],
            false => [self.prior.centre[SHAPE]; 2],
        };
        [axis(low, high, place.0, self.size[0]), axis(0.0, 1.0, place.1, self.size[1])]
    }

    /// The cells about one that are in the box.
    fn adjacent_indices(&self, (i, k): CellIndex) -> impl Iterator<Item = CellIndex> + use<> {
        let size = self.size;
        (-1..=1)
            .flat_map(move |a| (-1..=1).map(move |b| (i + a, k + b)))
            .filter(move |&(a, b)| (a, b) != (i, k) && a >= 0 && b >= 0 && a < size[0] && b < size[1])
    }

    /// Neighbours that were looked at.
    pub fn evaluated_neighbours(&self, place: CellIndex) -> impl Iterator<Item = (CellIndex, &GridCell)> {
        self.adjacent_indices(place).filter_map(|place| Some((place, self.cells.get(&place)?)))
    }

    fn highest_log_density(&self) -> f64 {
        self.cells.values().map(|cell| cell.log).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Largest difference to a neighbour.
    fn largest_neighbour_difference(&self, place: CellIndex, cell: &GridCell) -> f64 {
        self.evaluated_neighbours(place).map(|(_, other)| (other.log - cell.log).abs()).fold(0.0, f64::max)
    }

    /// Four cells for each that counts, or may count between its centre and the next.
    fn split_cells(&mut self, keep: f64) {
        let least = self.highest_log_density() - keep;
        let kept = self.cells.iter().filter(|(place, cell)| {
            cell.log + 0.6 * self.largest_neighbour_difference(**place, cell) > least
        });
        let parts = |size: i32| if size > 1 { 2 } else { 1 };
        let [across, up] = self.size.map(parts);
        let wanted: BTreeMap<_, _> = kept
            .flat_map(|(&(i, k), cell)| {
                (0..across).flat_map(move |a| {
                    (0..up).map(move |b| ((across * i + a, up * k + b), Some(cell.line.shape.clone())))
                })
            })
            .collect();
        self.size = [self.size[0] * across, self.size[1] * up];
        self.level += 1;
        self.cells.clear();
        self.evaluate_cells(wanted);
        let seeds: BTreeMap<_, _> = self
            .seeds
            .iter()
            .map(|seed| self.cell_index(*seed))
            .filter(|place| !self.cells.contains_key(place))
            .map(|place| (place, None))
            .collect();
        self.evaluate_cells(seeds);
    }

    /// The cell that a point is in.
    fn cell_index(&self, [C, s]: [f64; 2]) -> CellIndex {
        let [[low, width], [_, height]] = self.cell_centre_and_size((0, 0));
        let index = |x: f64, count: i32| {
            if x.is_finite() { (x as i32).clamp(0, count - 1) } else { 0 }
        };
        (index((C - low) / width + 0.5, self.size[0]), index(s / height, self.size[1]))
    }

    /// Looks at all neighbours of cells that count, and at theirs: what a wider cell did not show is not lost.
    fn fill_neighbours(&mut self, keep: f64) {
        while self.cells.len() < CELLS {
            let least = self.highest_log_density() - keep;
            let mut wanted = BTreeMap::new();
            for (&place, cell) in self.cells.iter().filter(|(_, cell)| cell.log > least) {
                for next in self.adjacent_indices(place).filter(|next| !self.cells.contains_key(next)) {
                    wanted.entry(next).or_insert_with(|| Some(cell.line.shape.clone()));
                }
            }
            if wanted.is_empty() {
                return;
            }
            self.evaluate_cells(wanted);
        }
    }

    /// The share of the mass in cells beside much lower or higher ones.
    fn steep_mass(&self) -> f64 {
        let best = self.highest_log_density();
        let (mut steep, mut whole) = (0.0, 0.0);
        for (&place, cell) in &self.cells {
            let mass = (cell.log - best).exp();
            whole += mass;
            if self.largest_neighbour_difference(place, cell) > STEEP {
                steep += mass;
            }
        }
        steep / whole
    }
}
