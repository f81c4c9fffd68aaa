//! Describes a wheel without its tire.
#![allow(non_snake_case, reason = "moments of inertia are written as in the equations")]

use serde::{Deserialize, Serialize};

/// What wheels add to their tires.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RimParameters {
    /// Moment of inertia of a wheel about its axis [kg m²].
    pub I_yy: f64,
    /// Shortest relaxation length [m], also for tires that have none.
    pub relaxation_min: f64,
    /// Radius of a wheel whose tire knows none [m].
    pub radius: f64,
}

impl Default for RimParameters {
    fn default() -> Self {
        Self { I_yy: 1.0, relaxation_min: 0.05, radius: 0.3 }
    }
}
