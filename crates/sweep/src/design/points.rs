//! Computes the points of a design with random access by index.

use diagnostics::Error;
use numerics::sobol::{DIMENSIONS, ScrambledSobol};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

use super::copula::GaussianCopula;
use super::{DesignMethod, ExperimentDesign};
use crate::distribution::{Distribution, standard_normal};

/// The points of a design. Latin hypercubes keep 4 bytes for each value, all others nothing.
#[derive(Clone, Debug)]
pub struct DesignPoints {
    axes: Vec<Distribution>,
    count: u64,
    source: PointSource,
    copula: Option<GaussianCopula>,
}

#[derive(Clone, Debug)]
enum PointSource {
    /// The levels of each axis.
    Product(Vec<Vec<f64>>),
    /// Random numbers, and for each axis which share of it a variant has.
    Strata(Pcg64, Vec<Vec<u32>>),
    Random(Pcg64),
    Sobol(ScrambledSobol),
    /// A sequence of twice as many dimensions as there are axes.
    Saltelli(ScrambledSobol),
}

impl DesignPoints {
    pub(super) fn new(design: &ExperimentDesign) -> Result<Self, Error> {
        let axes: Vec<_> = design.axes.iter().map(|axis| axis.distribution.clone()).collect();
        let copula = GaussianCopula::from_correlations(&design.axes, &design.correlations)?;
        let mut random = Pcg64::seed_from_u64(design.seed);
        let (count, source) = match design.method {
            DesignMethod::Grid | DesignMethod::Corners => {
                let levels = design.axis_levels()?;
                (design.grid_point_count(&levels)?, PointSource::Product(levels))
            }
            DesignMethod::LatinHypercube => {
                let count = design.block_count(1)?;
                let shuffled: Vec<Vec<u32>> = (0..axes.len())
                    .map(|_| {
                        let mut shares: Vec<u32> = (0..=(count - 1) as u32).collect();
                        shares.shuffle(&mut random);
                        shares
                    })
                    .collect();
                (count, PointSource::Strata(random, shuffled))
            }
            DesignMethod::MonteCarlo => (design.block_count(1)?, PointSource::Random(random)),
            DesignMethod::Sobol => {
                (design.block_count(1)?, PointSource::Sobol(scrambled_sobol_sequence(design, axes.len())?))
            }
            DesignMethod::Saltelli => {
                let size = axes.len() as u64 + 2;
                let sequence = scrambled_sobol_sequence(design, 2 * axes.len())?;
                (design.block_count(size)? * size, PointSource::Saltelli(sequence))
            }
        };
        Ok(Self { axes, count, source, copula })
    }

    /// How many there are.
    #[must_use]
    pub fn point_count(&self) -> u64 {
        self.count
    }

    /// A point: a value for each axis, the index of one where the axis has a list.
    #[must_use]
    pub fn point(&self, index: u64) -> Vec<f64> {
        let mut point = vec![0.0; self.axes.len()];
        self.write_point(index, &mut point);
        point
    }

    /// The same into a slice of as many values as there are axes.
    pub fn write_point(&self, index: u64, point: &mut [f64]) {
        match &self.source {
            PointSource::Product(levels) => {
                let mut left = index;
                for (value, levels) in point.iter_mut().zip(levels).rev() {
                    let count = levels.len() as u64;
                    *value = levels[(left % count) as usize];
                    left /= count;
                }
                return;
            }
            PointSource::Strata(random, shares) => {
                self.fill_with_uniform_numbers(random, index, point);
                let count = self.count as f64;
                for (place, shares) in point.iter_mut().zip(shares) {
                    // The largest sum would round to 1.
                    let share = (f64::from(shares[index as usize]) + *place) / count;
                    *place = share.min(1.0 - f64::EPSILON / 2.0);
                }
            }
            PointSource::Random(random) => self.fill_with_uniform_numbers(random, index, point),
            PointSource::Sobol(sequence) => sequence.write_point(index as u32, point),
            PointSource::Saltelli(sequence) => {
                let axes = self.axes.len();
                let (block, member) = (index / (axes as u64 + 2), index % (axes as u64 + 2));
                let mut both = vec![0.0; 2 * axes];
                sequence.write_point(block as u32, &mut both);
                let (a, b) = both.split_at(axes);
                point.copy_from_slice(if member == 1 { b } else { a });
                if let Some(changed) = member.checked_sub(2) {
                    point[changed as usize] = b[changed as usize];
                }
            }
        }
        self.apply_quantiles(point);
    }

    /// Numbers of the open unit interval: those that the stream has at this point.
    fn fill_with_uniform_numbers(&self, stream: &Pcg64, index: u64, point: &mut [f64]) {
        let mut stream = stream.clone();
        stream.advance(u128::from(index) * self.axes.len() as u128);
        for place in point {
            // 52 bits and a half: the sum is exact, and never 0 or 1.
            *place = ((stream.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64;
        }
    }

    /// Turns a point of the unit cube into values.
    fn apply_quantiles(&self, point: &mut [f64]) {
        let Some(copula) = &self.copula else {
            for (place, axis) in point.iter_mut().zip(&self.axes) {
                *place = axis.quantile(*place);
            }
            return;
        };
        let scores: Vec<f64> = point.iter().map(|&u| standard_normal::normal_quantile(u)).collect();
        for (index, (place, axis)) in point.iter_mut().zip(&self.axes).enumerate() {
            *place = match copula.is_correlated(index) {
                true => axis.at_score(copula.correlated_score(index, &scores)),
                false => axis.quantile(*place),
            };
        }
    }
}

fn scrambled_sobol_sequence(design: &ExperimentDesign, dimensions: usize) -> Result<ScrambledSobol, Error> {
    ScrambledSobol::new(dimensions, design.seed).ok_or_else(|| {
        let (method, axes) = (design.method.display_name(), design.axes.len());
        let message = format!(
            "expected at most {DIMENSIONS} dimensions in a design `{method}`, found {dimensions} of {axes} axes"
        );
        Error::invalid_input(message).with_help("vary fewer values, or use the method latin_hypercube")
    })
}
