//! Says which errors are estimated with the tires, and what a fit can be given besides.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use preparation::{ESTIMATED, SystematicError};

/// Whether an error is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EstimationMode {
    /// There is none.
    Off,
    /// In any case.
    On,
    /// Where the data ask for it.
    #[default]
    Evidence,
}

/// Whether each error is estimated, in the order of [`SystematicError`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorSelection(pub [EstimationMode; ESTIMATED]);

impl Default for ErrorSelection {
    /// Those of the car in any case, those of sensors where the data ask for them.
    fn default() -> Self {
        Self(SystematicError::ALL.map(|cause| {
            if SystematicError::CAR.contains(&cause) { EstimationMode::On } else { EstimationMode::Evidence }
        }))
    }
}

impl ErrorSelection {
    /// The mode of an error.
    pub fn mode(&self, cause: SystematicError) -> EstimationMode {
        self.0[cause as usize]
    }

    /// No error at all.
    pub fn none() -> Self {
        Self([EstimationMode::Off; ESTIMATED])
    }
}

/// What a fit can be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelExtension {
    /// An error of a sensor.
    Error(SystematicError),
    /// Relaxation lengths of both axles.
    Relaxation,
    /// Another friction from some row on, counted over all recordings.
    FrictionChange {
        /// The row.
        row: usize,
    },
    /// Noises that last, of the sensors whose innovations do.
    Colour,
}
