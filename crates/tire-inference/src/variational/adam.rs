//! Says how Adam goes for a tire.

use numerics::variational::adam::Schedule;
use serde::{Deserialize, Deserializer};

use crate::parameters::{Theta, from_parameters};

/// How Adam goes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Adam {
    /// Length of a step, in the coordinates of the fit.
    pub step: f64,
    /// How many.
    pub steps: usize,
    /// Whether the result is the mean over the second half of the steps, in which the noise of single draws fades (Polyak and
    /// Juditsky 1992); else it is where the last step led.
    pub average: bool,
    /// Samples that are looked at in a step; all of them unless given.
    pub batch: Option<usize>,
    /// First mean; the typical values unless given.
    #[serde(deserialize_with = "start")]
    pub start: Option<Theta>,
}

fn start<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Theta>, D::Error> {
    from_parameters(from).map(Some)
}

impl Default for Adam {
    /// Goblirsch et al. (IV 2025).
    fn default() -> Self {
        Self { step: 8.25e-4, steps: 50_000, average: false, batch: None, start: None }
    }
}

impl Adam {
    /// Its steps.
    pub fn schedule(&self) -> Schedule {
        let Self { step, steps, average, .. } = *self;
        Schedule { step, steps, average }
    }
}
