//! What can be chosen in an identification from closed-loop drives.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use tire_inference::prior::Prior;
use vehicle::SingleTrackCar;

use crate::likelihood::DriveNoise;
use crate::model_selection::ErrorSelection;
use crate::regression::{RegressionTarget, ResidualWeights};
use crate::regularisation::TireRegularisation;
use crate::smoothing::SmootherOptions;
use crate::uncertainty::CarUncertainty;
use preparation::{SystematicError, SystematicErrors};

/// How tires are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitFormulation {
    /// Least squares over points along smoothed states.
    Points(RegressionTarget),
    /// Most probable prediction errors of a filter with the tires inside, started where
    /// [`RegressionTarget::AccelerationAndYaw`] ends.
    PredictionError,
}

impl FitFormulation {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::PredictionError,
        Self::Points(RegressionTarget::AccelerationAndYaw),
        Self::Points(RegressionTarget::AxleForces),
        Self::Points(RegressionTarget::Acceleration),
        Self::Points(RegressionTarget::SmoothedAcceleration),
    ];

    /// As in scenarios and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::PredictionError => "pem",
            Self::Points(RegressionTarget::AccelerationAndYaw) => "acceleration_and_yaw",
            Self::Points(RegressionTarget::AxleForces) => "axle_forces",
            Self::Points(RegressionTarget::Acceleration) => "acceleration",
            Self::Points(RegressionTarget::SmoothedAcceleration) => "smoothed_acceleration",
        }
    }

    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::PredictionError => "prediction errors",
            Self::Points(RegressionTarget::AccelerationAndYaw) => "acceleration and yaw",
            Self::Points(RegressionTarget::AxleForces) => "axle forces",
            Self::Points(RegressionTarget::Acceleration) => "acceleration",
            Self::Points(RegressionTarget::SmoothedAcceleration) => "smoothed acceleration",
        }
    }
}

impl FitFormulation {
    /// For the reference of the configuration.
    fn description(self) -> &'static str {
        match self {
            Self::PredictionError => {
                "Prediction-error method (PEM): maximum likelihood of the innovations of a Kalman filter."
            }
            Self::Points(RegressionTarget::AccelerationAndYaw) => {
                "Least squares over the measured lateral acceleration and the change of the measured yaw rate."
            }
            Self::Points(RegressionTarget::AxleForces) => {
                "Least squares over the lateral forces of the axles, from smoothed states."
            }
            Self::Points(RegressionTarget::Acceleration) => {
                "Least squares over the measured lateral acceleration."
            }
            Self::Points(RegressionTarget::SmoothedAcceleration) => {
                "Least squares over the lateral acceleration of smoothed states."
            }
        }
    }
}

impl JsonSchema for FitFormulation {
    fn schema_name() -> Cow<'static, str> {
        "Formulation".into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        let choice = |it: Self| json_schema!({ "const": it.name(), "description": it.description() });
        json_schema!({
            "description": "Way to find the tires.",
            "type": "string",
            "oneOf": Self::ALL.map(choice),
        })
    }
}

impl Serialize for FitFormulation {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for FitFormulation {
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
pub enum NoiseOption {
    /// They are estimated, from a first guess by third differences.
    #[default]
    Estimated,
    /// They are these.
    Known(DriveNoise),
}

/// What is known of errors of sensors and car.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorOptions {
    /// Which are estimated.
    pub wanted: ErrorSelection,
    /// Their standard deviations before any data; 0 where there is no error.
    pub std: SystematicErrors,
}

impl Default for ErrorOptions {
    fn default() -> Self {
        let std = SystematicErrors(SystematicError::ALL.map(|cause| cause.describe().std));
        Self { wanted: ErrorSelection::default(), std }
    }
}

/// What can be chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveOptions {
    /// The car; its own tires are not used.
    pub car: SingleTrackCar,
    /// How well the car is known.
    pub uncertainty: CarUncertainty,
    /// What decides.
    pub method: FitFormulation,
    /// What is fitted besides, for comparison.
    pub compare: Vec<FitFormulation>,
    /// What is known of each tire before any data: the box, and typical values.
    pub prior: Prior,
    /// λ_reg: what draws each tire to the typical values, see [`tire_inference::regularisation`].
    pub regularisation: f64,
    /// λ_sim: what draws both tires to each other.
    pub axle_coupling: f64,
    /// How residuals of points are weighed.
    pub weights: ResidualWeights,
    /// Whether fits of points to accelerations have three odd terms besides the tires.
    pub odd_terms: bool,
    /// Starts of fits to points.
    pub starts: usize,
    /// Turns the starts.
    pub seed: u64,
    /// The noises.
    pub noises: NoiseOption,
    /// How states are smoothed for fits to points.
    pub smoothing: SmootherOptions,
    /// Whether standard deviations, intervals, bands and densities come from the posterior, if there is a likelihood; else from
    /// the curvature.
    pub posterior: bool,
    /// Whether a normal distribution is fitted to that posterior first, by variational inference: it is judged, reported, and where the
    /// weighted draws start.
    pub svi: bool,
    /// Errors of sensors and car.
    pub causes: ErrorOptions,
    /// Whether intervals come from profiles of the likelihood; else from its curvature. Takes longer than the fit.
    pub profile: bool,
}

impl DriveOptions {
    /// Standard deviations of all errors before any data; those of the car are its own.
    pub fn error_std(&self) -> SystematicErrors {
        let CarUncertainty { m, cg, I_zz, h, F_x_gain } = self.uncertainty;
        let mut std = self.causes.std;
        let of_car = [
            (SystematicError::Mass, m),
            (SystematicError::CentreOfGravity, cg),
            (SystematicError::Inertia, I_zz),
            (SystematicError::Height, h),
            (SystematicError::ForceGain, F_x_gain),
        ];
        of_car.into_iter().for_each(|(cause, known)| std[cause] = known);
        std
    }

    /// What is expected of both tires.
    pub fn tire_regularisation(&self) -> TireRegularisation {
        TireRegularisation::new(&self.prior, self.regularisation, self.axle_coupling)
    }
}

impl Default for DriveOptions {
    fn default() -> Self {
        Self {
            car: SingleTrackCar::default(),
            uncertainty: CarUncertainty::default(),
            method: FitFormulation::PredictionError,
            compare: Vec::new(),
            prior: Prior::lateral(),
            regularisation: 0.0,
            axle_coupling: 0.0,
            weights: ResidualWeights::Plain,
            odd_terms: false,
            starts: 8,
            seed: 1,
            noises: NoiseOption::Estimated,
            smoothing: SmootherOptions::default(),
            posterior: true,
            svi: false,
            causes: ErrorOptions::default(),
            profile: false,
        }
    }
}
