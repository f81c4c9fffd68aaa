//! Says who determines a variable, when it may change, and how its first value comes about, in the words of all versions of FMI.

use fmi_rs::model_description::fmi2;

/// Who determines a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Causality {
    /// The environment, before the run.
    Parameter,
    /// The FMU, from parameters.
    CalculatedParameter,
    /// Another model.
    Input,
    /// The FMU; others may use it.
    Output,
    /// The FMU, for itself.
    Local,
    /// Nobody: it is the time.
    Independent,
}

impl From<fmi2::Causality> for Causality {
    fn from(found: fmi2::Causality) -> Self {
        match found {
            fmi2::Causality::Parameter => Causality::Parameter,
            fmi2::Causality::CalculatedParameter => Causality::CalculatedParameter,
            fmi2::Causality::Input => Causality::Input,
            fmi2::Causality::Output => Causality::Output,
            fmi2::Causality::Local => Causality::Local,
            fmi2::Causality::Independent => Causality::Independent,
        }
    }
}

/// When a variable may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Variability {
    /// Never.
    Constant,
    /// Not after the initialisation.
    Fixed,
    /// Between steps, by the environment.
    Tunable,
    /// At events.
    Discrete,
    /// At any time.
    Continuous,
}

impl From<fmi2::Variability> for Variability {
    fn from(found: fmi2::Variability) -> Self {
        match found {
            fmi2::Variability::Constant => Variability::Constant,
            fmi2::Variability::Fixed => Variability::Fixed,
            fmi2::Variability::Tunable => Variability::Tunable,
            fmi2::Variability::Discrete => Variability::Discrete,
            fmi2::Variability::Continuous => Variability::Continuous,
        }
    }
}

/// How the first value of a variable comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Initial {
    /// It is the start value.
    Exact,
    /// The start value is a guess.
    Approx,
    /// It is computed.
    Calculated,
}

impl From<fmi2::Initial> for Initial {
    fn from(found: fmi2::Initial) -> Self {
        match found {
            fmi2::Initial::Exact => Initial::Exact,
            fmi2::Initial::Approx => Initial::Approx,
            fmi2::Initial::Calculated => Initial::Calculated,
        }
    }
}
