//! Mistakes in a problem, found before any optimiser runs, with their cures.

use thiserror::Error;

use crate::fit::CurveFitProblem;
use crate::parameters::Parameter;
use crate::regularisation::Regularisation;

/// Why there is nothing to fit.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    /// No samples.
    #[error("there are no samples to fit; check which rows the filters of the data leave over")]
    Empty,
    /// Columns of different length.
    #[error("slip, force and weight need one value for each sample, found {slip}, {force} and {weight}")]
    Columns {
        /// Length of the column of slips.
        slip: usize,
        /// Length of the column of forces.
        force: usize,
        /// Length of the column of weights.
        weight: usize,
    },
    /// Fewer samples than parameters.
    #[error(
        "{found} samples of positive weight cannot determine {free} parameters; at least {} are needed: \
         add data or hold parameters",
        free + 1
    )]
    TooFew {
        /// Samples of positive weight.
        found: usize,
        /// Free parameters.
        free: usize,
    },
    /// A number that is none.
    #[error("{column}[{row}] is {value}; remove rows that are not finite before fitting")]
    NotFinite {
        /// Name of the column.
        column: &'static str,
        /// Index of the sample.
        row: usize,
        /// What stands there.
        value: f64,
    },
    /// A weight below 0.
    #[error("weight[{row}] is {value}; weights are 0 or above")]
    Weight {
        /// Index of the sample.
        row: usize,
        /// What stands there.
        value: f64,
    },
    /// Slips that are none.
    #[error(
        "expected slips up to {most:.3}, found {largest:.4}; if the column is in {unit}, say so: unit = \"{unit}\""
    )]
    Slip {
        /// The largest one.
        largest: f64,
        /// The largest one that there can be.
        most: f64,
        /// The unit that it may be in.
        unit: &'static str,
    },
    /// Forces that are not divided by the load.
    #[error(
        "expected forces over load up to {most}, found {size:.3} in one of ten samples: divide a force in N or kN by the load, as \
         gain = 1 / load does where the load is constant"
    )]
    Force {
        /// The size that a tenth of the samples exceeds.
        size: f64,
        /// The largest one.
        most: f64,
    },
    /// A force without the bend of a tire.
    #[error(
        "expected a force that bends like that of a tire, found one that rises in a straight line up to the slip {largest:.3} (the slope in \
         the last third is {ratio:.2} of that in the first, of the softest tire {softest:.2}): if the column, or one that the slip \
         comes from, is in {unit}, say so: unit = \"{unit}\""
    )]
    Straight {
        /// The largest slip.
        largest: f64,
        /// Slope at large slips over that at small ones.
        ratio: f64,
        /// The same of the softest tire.
        softest: f64,
        /// The unit that it may be in.
        unit: &'static str,
    },
    /// A force that hardly rises.
    #[error(
        "expected a force over load that rises by {least} for each unit of slip at least, as on ice, found {slope:.3}: if the slip \
         column, or one that it comes from, is in {unit}, say so: unit = \"{unit}\""
    )]
    Soft {
        /// Slope at small slips.
        slope: f64,
        /// The least one.
        least: f64,
        /// The unit that it may be in.
        unit: &'static str,
    },
    /// A force that falls with the slip.
    #[error(
        "expected a force that rises with the slip, found one that falls (correlation {correlation:.2}): turn one of them round, \
         sign = -1"
    )]
    Mirrored {
        /// Correlation of slip and force about the origin.
        correlation: f64,
    },
    /// A force that has nothing to do with the slip.
    #[error(
        "expected a force that rises with the slip, found no relation beyond chance (correlation {correlation:.3} of {count} samples): \
         check which columns slip and force are, and that they belong to the same instants"
    )]
    Unrelated {
        /// Correlation of slip and force about the origin.
        correlation: f64,
        /// Number of samples.
        count: f64,
    },
    /// All samples at one slip.
    #[error(
        "all samples have the slip {slip}: one point of a curve does not determine it; add data at other slips"
    )]
    SameSlip {
        /// That slip.
        slip: f64,
    },
    /// No free parameter.
    #[error("no parameter is free; free at least one")]
    NothingFree,
    /// Bounds that hold nothing, or logarithms of what is not positive.
    #[error("{name} needs finite bounds, lower ≤ upper{}, found [{lower}, {upper}]", if *positive { ", above 0" } else { "" })]
    Bounds {
        /// The parameter.
        name: &'static str,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
        /// Whether it must be positive.
        positive: bool,
    },
    /// A value that is held but makes no curve.
    #[error("{name} is held at {value}; it must be finite{}", if *positive { " and above 0" } else { "" })]
    Held {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Whether it must be positive.
        positive: bool,
    },
    /// A setting out of its range.
    #[error("{setting}: {problem}")]
    Setting {
        /// Which one.
        setting: &'static str,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Constraints that no point of the box meets.
    #[error(
        "no point within the bounds meets the constraints on stiffness and peak slip (violated by {violation:.2e} at best); \
         widen the bounds or the constraints"
    )]
    Infeasible {
        /// Smallest violation found.
        violation: f64,
    },
    /// No start led anywhere.
    #[error("the cost is not finite at any start; check the scale of the samples")]
    NoStart,
}

/// Checks everything that does not depend on the optimiser.
pub fn check_problem(problem: &CurveFitProblem) -> Result<(), FitError> {
    check_samples(problem)?;
    for parameter in Parameter::ALL {
        let i = parameter as usize;
        let (name, positive) = (parameter.symbol(), i < 3);
        let (lower, upper) = (problem.bounds.lower[i], problem.bounds.upper[i]);
        let sound = |x: f64| x.is_finite() && (!positive || x > 0.0);
        if problem.free[i] && !(sound(lower) && sound(upper) && lower <= upper) {
            return Err(FitError::Bounds { name, lower, upper, positive });
        }
        if !problem.free[i] && !sound(problem.held[i]) {
            return Err(FitError::Held { name, value: problem.held[i], positive });
        }
    }
    check_settings(problem)
}

fn check_samples(problem: &CurveFitProblem) -> Result<(), FitError> {
    let samples = problem.samples;
    let (slip, force, weight) = (samples.slip.len(), samples.force.len(), samples.weight.len());
    if slip != force || slip != weight {
        return Err(FitError::Columns { slip, force, weight });
    }
    if samples.is_empty() {
        return Err(FitError::Empty);
    }
    for (column, values) in [("slip", &samples.slip), ("force", &samples.force), ("weight", &samples.weight)]
    {
        if let Some(row) = values.iter().position(|x| !x.is_finite()) {
            return Err(FitError::NotFinite { column, row, value: values[row] });
        }
    }
    if let Some(row) = samples.weight.iter().position(|&w| w < 0.0) {
        return Err(FitError::Weight { row, value: samples.weight[row] });
    }
    let free = problem.free.iter().filter(|&&free| free).count();
    if free == 0 {
        return Err(FitError::NothingFree);
    }
    let used: Vec<f64> =
        samples.slip.iter().zip(&samples.weight).filter(|(_, w)| **w > 0.0).map(|(s, _)| *s).collect();
    if used.len() <= free {
        return Err(FitError::TooFew { found: used.len(), free });
    }
    if used.iter().all(|&slip| slip == used[0]) {
        return Err(FitError::SameSlip { slip: used[0] });
    }
    Ok(())
}

fn check_settings(problem: &CurveFitProblem) -> Result<(), FitError> {
    let wrong = |setting, problem| Err(FitError::Setting { setting, problem });
    if !problem.loss.is_valid() {
        return wrong("loss", "threshold, degrees of freedom and scale must be finite and above 0");
    }
    if !problem.regularisation.iter().all(Regularisation::is_valid) {
        return wrong(
            "regularisation",
            "means must be finite, standard deviations above 0, the weight 0 or above",
        );
    }
    if let Some([low, high]) = problem.constraints.stiffness
        && !(low > 0.0 && low <= high && high.is_finite())
    {
        return wrong("constraints.stiffness", "needs 0 < lowest ≤ highest");
    }
    if let Some([low, high]) = problem.constraints.peak_slip
        && !(low.is_finite() && low < high)
    {
        return wrong("constraints.peak_slip", "needs lowest < highest");
    }
    if let Some(noise) = problem.slip_noise {
        if !(noise.std > 0.0 && noise.std.is_finite()) {
            return wrong("slip_noise.std", "must be finite and above 0");
        }
        if problem.loss != numerics::loss::Loss::Square {
            return wrong("slip_noise", "is a likelihood of normal noise and goes with the square loss only");
        }
    }
    Ok(())
}
