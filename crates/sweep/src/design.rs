//! Design of experiments: grid, corners, Latin hypercube, Sobol, Monte Carlo and Saltelli designs.

mod copula;
mod points;

pub use points::Points;

use diagnostics::Error;

use crate::distribution::Distribution;

/// The most corners of a design.
const MOST_CORNERS: u64 = 1 << 20;
/// The most points of a design: those of Sobol's sequence.
const MOST_POINTS: u64 = numerics::sobol::POINTS;

/// The most values of a Latin hypercube, of which the shares of all are in memory: 1 GB.
const MOST_SHARES: u64 = 1 << 28;

/// A design of experiments: axes, method, size and seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// How the points are chosen.
    pub method: Method,
    /// What varies.
    pub axes: Vec<Axis>,
    /// How many variants are wanted. Grid and corners count themselves; Saltelli takes as many whole blocks as there is room for.
    pub variants: u64,
    /// The same seed gives the same points.
    pub seed: u64,
    /// Of axes that do not vary independently; those that are not named do.
    pub correlations: Vec<Correlation>,
}

/// How the points of a design are chosen.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Method {
    /// Each level of each axis with each of all others, the last axis fastest.
    Grid,
    /// Each end of each axis with each of all others, the last axis fastest.
    Corners,
    /// Random, with one variant in each of as many equal shares of each axis as there are variants. Axes that are correlated with
    /// an earlier one are random only.
    LatinHypercube,
    /// Sobol's sequence, scrambled.
    Sobol,
    /// Random.
    MonteCarlo,
    /// Blocks of variants for Sobol's first and total indices: two points A and B of a scrambled Sobol sequence, then A with each
    /// value of B in turn.
    Saltelli,
}

/// Something that varies.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name, for errors.
    pub name: String,
    /// What its values are drawn from.
    pub distribution: Distribution,
}

/// Two axes that vary together: a Gaussian copula. Between normal distributions it is their correlation; between others, that of the
/// normal scores of their values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// Index of one axis.
    pub first: usize,
    /// Index of the other.
    pub second: usize,
    /// Between −1 and 1.
    pub coefficient: f64,
}

impl Method {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Method::Grid => "grid",
            Method::Corners => "corners",
            Method::LatinHypercube => "latin_hypercube",
            Method::Sobol => "sobol",
            Method::MonteCarlo => "monte_carlo",
            Method::Saltelli => "saltelli",
        }
    }
}

impl Design {
    /// Its points, one for each variant.
    ///
    /// # Errors
    /// When an axis does not suit the method, there are too many points or none, or the correlations are those of nothing.
    pub fn points(&self) -> Result<Points, Error> {
        for Axis { name, distribution } in &self.axes {
            distribution.check().map_err(|what| Error::input(format!("`{name}`: {what}")))?;
        }
        let method = self.method.name();
        let independent = matches!(self.method, Method::Grid | Method::Corners | Method::Saltelli);
        if independent && !self.correlations.is_empty() {
            let message = format!("expected no correlations in a design `{method}`");
            return Err(
                Error::input(message).help("use the method sobol, latin_hypercube or monte_carlo")
            );
        }
        Points::new(self)
    }

    /// The levels of each axis of a grid or of corners.
    fn levels(&self) -> Result<Vec<Vec<f64>>, Error> {
        let levels = self.axes.iter().map(|Axis { name, distribution }| {
            if self.method == Method::Corners {
                let [low, high] = distribution.bounds();
                return match (low.is_finite() && high.is_finite(), low < high) {
                    (true, true) => Ok(vec![low, high]),
                    (true, false) => Ok(vec![low]),
                    (false, _) => Err(Error::input(format!(
                        "`{name}`: expected two ends, found a distribution from {low} to {high}"
                    ))
                    .help("corners need ends: give it a uniform or truncated distribution")),
                };
            }
            match *distribution {
                Distribution::Values(count) => Ok((0..count).map(|k| k as f64).collect()),
                _ => Err(Error::input(format!(
                    "`{name}`: expected a list of values, found a distribution"
                ))
                .help("a grid needs lists: give one, or use another method")),
            }
        });
        levels.collect()
    }

    /// How many points a product of levels has.
    fn product(&self, levels: &[Vec<f64>]) -> Result<u64, Error> {
        let most = if self.method == Method::Corners { MOST_CORNERS } else { MOST_POINTS };
        let counts = levels.iter().map(|levels| levels.len() as u64);
        let count = counts.fold(1_u64, u64::saturating_mul);
        if count > most {
            let method = self.method.name();
            let message = format!(
                "expected at most {most} variants in a design `{method}`, found {count} of {} axes",
                levels.len()
            );
            return Err(Error::input(message).help("vary fewer values, or use the method sobol"));
        }
        Ok(count)
    }

    /// How many blocks of so many variants there is room for.
    fn blocks(&self, size: u64) -> Result<u64, Error> {
        let method = self.method.name();
        let blocks = self.variants / size;
        let most = match self.method {
            Method::LatinHypercube => MOST_SHARES / self.axes.len().max(1) as u64,
            _ => MOST_POINTS,
        };
        if blocks == 0 || blocks > most {
            let message = format!(
                "expected between {size} and {} variants in a design `{method}` of {} axes, found {}",
                most.saturating_mul(size),
                self.axes.len(),
                self.variants
            );
            return Err(Error::input(message));
        }
        Ok(blocks)
    }
}
