//! The driver of a manoeuvre as a node.

use std::sync::Arc;

use manoeuvre::{DriverOutputInfo, Manoeuvre};

/// The driver of a manoeuvre, whose inputs are what it measures.
#[derive(Debug, Clone)]
pub struct DriverPlan {
    /// The manoeuvre.
    pub manoeuvre: Arc<Manoeuvre>,
    /// Angle of the steering wheel over that of the front wheels.
    pub steering_ratio: f64,
}

impl DriverPlan {
    /// The output after those of [`manoeuvre::OUTPUTS`].
    pub const HAND_WHEEL: DriverOutputInfo = DriverOutputInfo {
        name: "hand_wheel",
        unit: "rad",
        about: "Angle of the steering wheel, positive to the left",
    };

    /// All outputs.
    pub fn output_descriptions() -> impl Iterator<Item = DriverOutputInfo> {
        manoeuvre::OUTPUTS.into_iter().chain([Self::HAND_WHEEL])
    }
}
