//! Defines causality, variability and initial of a variable, common to all versions of FMI, in the words of FMI 2.0 and 3.0.

use serde::{Deserialize, Serialize};

/// Who determines a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Causality {
    /// The environment, before the run.
    Parameter,
    /// The environment, before anything else: sizes of arrays follow from it (FMI 3.0).
    StructuralParameter,
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
