//! The variants of a scenario, by names and numbers.

use crate::document::{Design, Limit, VariantSelection};

/// How the variants of a scenario are made, and what is asked of them.
#[derive(Debug, Clone)]
pub struct SweepPlan {
    /// How they are chosen.
    pub design: Design,
    /// Number of variants that a sample has.
    pub variants: u64,
    /// Seed of the choice.
    pub seed: u64,
    /// What differs among them.
    pub axes: Vec<SweepAxis>,
    /// Correlations of two axes, by their places.
    pub correlations: Vec<(usize, usize, f64)>,
    /// Share that must pass.
    pub pass_share: f64,
    /// Variants that run again with everything recorded.
    pub recorded: VariantSelection,
    /// The search, if the variants are not chosen beforehand.
    pub search: Option<SearchPlan>,
}

/// Something that differs among the variants.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepAxis {
    /// The names that it sets, as `--set` takes them.
    pub names: Vec<String>,
    /// Whether each name has values of its own, that are drawn together; else all get the same.
    pub is_joint: bool,
    /// The unit of each, where the scenario gives it.
    pub units: Vec<Option<String>>,
    /// The values.
    pub values: AxisValues,
    /// Of a list of variants, what each is called.
    pub variant_names: Option<Vec<String>>,
}

/// The values of an axis.
#[derive(Debug, Clone, PartialEq)]
pub enum AxisValues {
    /// Values as `--set` takes them; a row has one for each name. An empty text is none: the value is as in the scenario.
    Levels(Vec<Vec<String>>),
    /// Equally likely numbers between two.
    Uniform([f64; 2]),
    /// Mean and standard deviation.
    Normal([f64; 2]),
    /// Median, and standard deviation of the natural logarithm.
    Lognormal([f64; 2]),
    /// Mean and standard deviation, lowest and highest number.
    Truncated([f64; 4]),
}

/// What a search is for.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchPlan {
    /// What it looks for.
    pub goal: SearchGoal,
    /// Share of the range at which the result is known well enough.
    pub tolerance: f64,
}

/// What a search looks for.
#[derive(Debug, Clone, PartialEq)]
pub enum SearchGoal {
    /// The smallest collected value of this name, or the largest one.
    Extreme {
        /// The name.
        collected: String,
        /// Whether it is to be large.
        largest: bool,
    },
    /// The value up to which a check passes, or all of them.
    Limit {
        /// The side that passes.
        side: Limit,
        /// The check.
        check: Option<String>,
    },
}
