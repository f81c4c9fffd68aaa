//! What can be chosen in an identification from closed-loop drives.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use vehicle::Vehicle;

use crate::likelihood::Noise;
use crate::pull::Pull;
use crate::regression::{Target, Weights};
use crate::smoothing::Smoothing;

/// The box of each axle: B [1/rad], C, D, E.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest values.
    pub lower: [f64; 4],
    /// Highest values.
    pub upper: [f64; 4],
}

impl Default for Bounds {
    fn default() -> Self {
        Self { lower: [5.0, 1.0, 0.5, -1.0], upper: [40.0, 2.8, 3.0, 1.0] }
    }
}

/// How tires are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formulation {
    /// Least squares over points along smoothed states.
    Points(Target),
    /// Most probable prediction errors of a filter with the tires inside, started where
    /// [`Target::AccelerationAndYaw`] ends.
    PredictionError,
}

impl Formulation {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::PredictionError,
        Self::Points(Target::AccelerationAndYaw),
        Self::Points(Target::AxleForces),
        Self::Points(Target::Acceleration),
        Self::Points(Target::SmoothedAcceleration),
    ];

    /// As in scenarios and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::PredictionError => "pem",
            Self::Points(Target::AccelerationAndYaw) => "acceleration_and_yaw",
            Self::Points(Target::AxleForces) => "axle_forces",
            Self::Points(Target::Acceleration) => "acceleration",
            Self::Points(Target::SmoothedAcceleration) => "smoothed_acceleration",
        }
    }

    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::PredictionError => "prediction errors",
            Self::Points(Target::AccelerationAndYaw) => "acceleration and yaw",
            Self::Points(Target::AxleForces) => "axle forces",
            Self::Points(Target::Acceleration) => "acceleration",
            Self::Points(Target::SmoothedAcceleration) => "smoothed acceleration",
        }
    }
}

impl Serialize for Formulation {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Formulation {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        let found = Self::ALL.into_iter().find(|formulation| formulation.name() == name);
        found.ok_or_else(|| {
            let known = Self::ALL.map(|formulation| format!("`{}`", formulation.name())).join(", ");
            D::Error::custom(format!("unknown variant `{name}`, expected one of {known}"))
        })
    }
}

/// What is known of the noises.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Noises {
    /// They are estimated, from a first guess by third differences.
    #[default]
    Estimated,
    /// They are these.
    Known(Noise),
}

/// What can be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The car; its own tires are not used.
    pub car: Vehicle,
    /// What decides.
    pub method: Formulation,
    /// What is fitted besides, for comparison.
    pub compare: Vec<Formulation>,
    /// The box of each axle.
    pub bounds: Bounds,
    /// What pulls the parameters.
    pub pull: Pull,
    /// How residuals of points are weighed.
    pub weights: Weights,
    /// Whether fits of points to accelerations have three odd terms besides the tires.
    pub odd: bool,
    /// Starts of fits to points.
    pub starts: usize,
    /// Turns the starts.
    pub seed: u64,
    /// The noises.
    pub noises: Noises,
    /// How states are smoothed for fits to points.
    pub smoothing: Smoothing,
    /// Whether standard deviations, intervals, bands and densities come from the posterior, if there is a likelihood; else from
    /// the curvature.
    pub posterior: bool,
    /// Whether a normal distribution is fitted to that posterior first, by variational inference: it is judged, told, and where the
    /// weighted draws start.
    pub svi: bool,
    /// Whether intervals come from profiles of the likelihood; else from its curvature. Takes as long as two fits.
    pub profile: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            car: Vehicle::default(),
            method: Formulation::PredictionError,
            compare: Vec::new(),
            bounds: Bounds::default(),
            pull: Pull::default(),
            weights: Weights::Plain,
            odd: false,
            starts: 8,
            seed: 1,
            noises: Noises::Estimated,
            smoothing: Smoothing::default(),
            posterior: true,
            svi: false,
            profile: true,
        }
    }
}
