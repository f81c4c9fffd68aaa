//! Design of experiments: grid, corners, Latin hypercube, Sobol, Monte Carlo and Saltelli designs.

mod copula;
mod points;

pub use points::DesignPoints;

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
pub struct ExperimentDesign {
    /// How the points are chosen.
    pub method: DesignMethod,
    /// What varies.
    pub axes: Vec<DesignAxis>,
    /// How many variants are wanted. Grid and corners count themselves; Saltelli takes as many whole blocks as there is room for.
    pub variants: u64,
    /// The same seed gives the same points.
    pub seed: u64,
    /// Of axes that do not vary independently; those that are not named do.
    pub correlations: Vec<AxisCorrelation>,
}

/// How the points of a design are chosen.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum DesignMethod {
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
pub struct DesignAxis {
    /// Its name, for errors.
    pub name: String,
    /// What its values are drawn from.
    pub distribution: Distribution,
}

/// Two axes that vary together: a Gaussian copula. Between normal distributions it is their correlation; between others, that of the
/// normal scores of their values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisCorrelation {
    /// Index of one axis.
    pub first: usize,
    /// Index of the other.
    pub second: usize,
    /// Between −1 and 1.
    pub coefficient: f64,
}

impl DesignMethod {
    /// In words.
    #[must_use]
    pub fn display_name(self) -> &'static str {
        match self {
            DesignMethod::Grid => "grid",
            DesignMethod::Corners => "corners",
            DesignMethod::LatinHypercube => "latin_hypercube",
            DesignMethod::Sobol => "sobol",
            DesignMethod::MonteCarlo => "monte_carlo",
            DesignMethod::Saltelli => "saltelli",
        }
    }
}

impl ExperimentDesign {
    /// Its points, one for each variant.
    ///
    /// # Errors
    /// When an axis does not suit the method, there are too many points or none, or the correlations are those of nothing.
    pub fn design_points(&self) -> Result<DesignPoints, Error> {
        for DesignAxis { name, distribution } in &self.axes {
            distribution
                .check_parameters()
                .map_err(|what| Error::invalid_input(format!("`{name}`: {what}")))?;
        }
        let method = self.method.display_name();
        let independent =
            matches!(self.method, DesignMethod::Grid | DesignMethod::Corners | DesignMethod::Saltelli);
        if independent && !self.correlations.is_empty() {
            let message = format!("expected no correlations in a design `{method}`");
            return Err(Error::invalid_input(message)
                .with_help("use the method sobol, latin_hypercube or monte_carlo"));
        }
        DesignPoints::new(self)
    }

    /// The levels of each axis of a grid or of corners.
    fn axis_levels(&self) -> Result<Vec<Vec<f64>>, Error> {
        let levels = self.axes.iter().map(|DesignAxis { name, distribution }| {
            if self.method == DesignMethod::Corners {
                let [low, high] = distribution.support();
                return match (low.is_finite() && high.is_finite(), low < high) {
                    (true, true) => Ok(vec![low, high]),
                    (true, false) => Ok(vec![low]),
                    (false, _) => Err(Error::invalid_input(format!(
                        "`{name}`: expected two ends, found a distribution from {low} to {high}"
                    ))
                    .with_help("corners need ends: give it a uniform or truncated distribution")),
                };
            }
            match *distribution {
                Distribution::Values(count) => Ok((0..count).map(|k| k as f64).collect()),
                _ => Err(Error::invalid_input(format!(
                    "`{name}`: expected a list of values, found a distribution"
                ))
                .with_help("a grid needs lists: give one, or use another method")),
            }
        });
        levels.collect()
    }

    /// How many points a product of levels has.
    fn grid_point_count(&self, levels: &[Vec<f64>]) -> Result<u64, Error> {
        let most = if self.method == DesignMethod::Corners { MOST_CORNERS } else { MOST_POINTS };
        let counts = levels.iter().map(|levels| levels.len() as u64);
        let count = counts.fold(1_u64, u64::saturating_mul);
        if count > most {
            let method = self.method.display_name();
            let message = format!(
                "expected at most {most} variants in a design `{method}`, found {count} of {} axes",
                levels.len()
            );
            return Err(Error::invalid_input(message).with_help("vary fewer values, or use the method sobol"));
        }
        Ok(count)
    }

    /// How many blocks of so many variants there is room for.
    fn block_count(&self, size: u64) -> Result<u64, Error> {
        let method = self.method.display_name();
        let blocks = self.variants / size;
        let most = match self.method {
            DesignMethod::LatinHypercube => MOST_SHARES / self.axes.len().max(1) as u64,
            _ => MOST_POINTS,
        };
        if blocks == 0 || blocks > most {
            let message = format!(
                "expected between {size} and {} variants in a design `{method}` of {} axes, found {}",
                most.saturating_mul(size),
                self.axes.len(),
                self.variants
            );
            return Err(Error::invalid_input(message));
        }
        Ok(blocks)
    }
}
