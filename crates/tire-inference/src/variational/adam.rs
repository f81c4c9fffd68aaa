//! Configures the optimiser Adam for the variational fit of a tire: step length, number of steps, batches of samples.

use numerics::variational::adam::AdamSchedule;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::parameters::{Theta, Tire};

/// Settings of Adam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Adam {
    /// Step size, in the dimensionless coordinates of the fit [-].
    pub step: f64,
    /// Number of steps.
    pub steps: usize,
    /// Takes the mean over the second half of the steps, with less noise (Polyak and Juditsky 1992), not the last step.
    pub average: bool,
    /// Points per step; all of them by default.
    pub batch: Option<usize>,
    /// First mean: B, C, D, E and, if not 0, S_h and S_v; the typical values by default.
    #[serde(deserialize_with = "read_start", serialize_with = "write_start")]
    #[schemars(with = "Option<Tire>")]
    pub start: Option<Theta>,
}

fn read_start<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Theta>, D::Error> {
    Ok(Option::<Tire>::deserialize(from)?.map(Theta::from))
}

fn write_start<S: Serializer>(start: &Option<Theta>, to: S) -> Result<S::Ok, S::Error> {
    start.map(Tire::from).serialize(to)
}

impl Default for Adam {
    /// Goblirsch et al. (IV 2025).
    fn default() -> Self {
        Self { step: 8.25e-4, steps: 50_000, average: false, batch: None, start: None }
    }
}

impl Adam {
    /// Its steps.
    pub fn schedule(&self) -> AdamSchedule {
        let Self { step, steps, average, .. } = *self;
        AdamSchedule { step, steps, average }
    }
}
