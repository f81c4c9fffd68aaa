//! Holds what a likelihood depends on: tires, errors of sensors and car, and noises, plain or with derivatives.

use kalman::augmented::ColouredNoise;
use numerics::tangent::Tangent;

use crate::tires::{self, Tires};
use preparation::{SystematicError, SystematicErrors};

/// Shortest relaxation length that is looked at [m].
pub const SHORTEST: f64 = 0.03;

/// Variances of the noises.
#[derive(Clone, Copy, Debug)]
pub struct NoiseVariances<T> {
    /// Growth of the variances of v_x, v_y, r and ξ_x [their squares per second].
    pub process: [T; 4],
    /// Of the measured v_x, v_y, r and a_y [their squares].
    pub sensor: [T; 4],
}

/// Noises of a recording, as standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DriveNoise {
    /// Of measured v_x, v_y, r and a_y [m/s, m/s, rad/s, m/s²].
    pub sensor: [f64; 4],
    /// Of the random walk that v_x, v_y, r and ξ_x do besides the model, after one second [m/s, m/s, rad/s, N].
    pub process: [f64; 4],
    /// How much of each sensor's noise lasts.
    #[serde(rename = "colour")]
    pub coloured: [ColouredNoise<f64>; 4],
}

impl DriveNoise {
    /// These sensors, on a car that the model describes well.
    pub fn from_sensor_stds(sensor: [f64; 4]) -> Self {
        Self { sensor, process: [1e-5, 1e-5, 1e-5, 30.0], coloured: [ColouredNoise::WHITE; 4] }
    }

    /// With the process multiplied by a factor.
    pub fn scale_process_noise(&self, factor: f64) -> Self {
        Self { process: self.process.map(|std| std * factor), ..*self }
    }

    /// As variances.
    pub fn variances(&self) -> NoiseVariances<f64> {
        let square = |std: f64| std * std;
        NoiseVariances { process: self.process.map(square), sensor: self.sensor.map(square) }
    }
}

/// What the likelihood depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveUnknowns {
    /// The tires.
    pub tires: Tires,
    /// Errors of sensors and car.
    pub causes: SystematicErrors,
    /// The noises.
    pub noise: DriveNoise,
    /// The row from which on the friction is another one, counted over all recordings.
    pub friction_change_row: usize,
}

impl DriveUnknowns {
    /// Tires and noises, where nothing else is wrong.
    pub fn new(tires: &Tires, noise: &DriveNoise) -> Self {
        let causes = SystematicErrors::default();
        Self { tires: *tires, causes, noise: *noise, friction_change_row: 0 }
    }

    /// Whether sensors are right, their noises white and slips those of the motion.
    pub fn has_no_errors(&self) -> bool {
        FilterStructure::required_for(&self.causes, &self.noise, &[]) == FilterStructure::Base
    }

    /// Whether the filter needs more states than those of the car.
    pub fn has_augmented_state(&self) -> bool {
        !matches!(
            FilterStructure::required_for(&self.causes, &self.noise, &[]),
            FilterStructure::Base | FilterStructure::SensorBias
        )
    }

    /// As numbers with derivatives along up to eight directions.
    pub fn with_derivative_seeds<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        directions: &[DerivativeDirection],
    ) -> FilterParameters<Tangent<S, N>> {
        let seed = |value: f64, direction: DerivativeDirection, rate: f64| match directions
            .iter()
            .position(|known| *known == direction)
        {
            Some(index) => Tangent::<S, N>::seed(simd, value, index, rate),
            None => Tangent::seed(simd, value, 0, 0.0),
        };
        let Self { tires, causes, noise, .. } = self;
        let theta = tires::to_array(*tires);
        let sensor = |i: usize| {
            let variance = noise.sensor[i].powi(2);
            seed(variance, DerivativeDirection::Noise(i), 2.0 * variance)
        };
        let process = |i: usize| seed(noise.process[i].powi(2), DerivativeDirection::Noise(4 + i), 1.0);
        let error = |cause: SystematicError| {
            seed(causes[cause], DerivativeDirection::Error(cause), cause.describe().std)
        };
        let coloured = |i: usize| {
            let ColouredNoise { correlation, share } = noise.coloured[i];
            ColouredNoise {
                correlation: seed(correlation, DerivativeDirection::Correlation(i), 1.0),
                share: seed(share, DerivativeDirection::LastingShare(i), 1.0),
            }
        };
        FilterParameters {
            tires: tires::from_array(std::array::from_fn(|i| {
                seed(theta[i], DerivativeDirection::Tire(i), 1.0)
            })),
            causes: SystematicErrors(SystematicError::ALL.map(error)),
            noise: NoiseVariances {
                sensor: std::array::from_fn(sensor),
                process: std::array::from_fn(process),
            },
            coloured_noise: std::array::from_fn(coloured),
        }
    }
}

/// An unknown along which a derivative is taken, in its own unit but for the logarithms of the standard deviations of sensors
/// and the variances of the process: those may be 0, where the logarithm would have no slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DerivativeDirection {
    /// A parameter of the tires, by its number in [`crate::tires`].
    Tire(usize),
    /// An error, in its standard deviations before any data.
    Error(SystematicError),
    /// A noise: those of sensors before those of the process.
    Noise(usize),
    /// Correlation of the lasting noise of a sensor.
    Correlation(usize),
    /// Share of the lasting noise in the variance of a sensor.
    LastingShare(usize),
}

/// [`DriveUnknowns`] as the filter takes them, in numbers of some kind.
pub struct FilterParameters<T> {
    /// The tires.
    pub tires: Tires<T>,
    /// Errors of sensors and car.
    pub causes: SystematicErrors<T>,
    /// The noises.
    pub noise: NoiseVariances<T>,
    /// How much of them lasts.
    pub coloured_noise: [ColouredNoise<T>; 4],
}

/// The variant of the augmented filter that some unknowns need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterStructure {
    /// The states of the car: v_x, v_y, r, ξ_x.
    Base,
    /// The same with errors of sensors and inputs.
    SensorBias,
    /// One with coloured noises of the sensors.
    ColouredNoise,
    /// One with slips that relax.
    TransientSlip,
    /// One with both.
    ColouredTransientSlip,
}

impl FilterStructure {
    /// For some unknowns, and derivatives along these directions.
    pub fn required_for(
        causes: &SystematicErrors,
        noise: &DriveNoise,
        directions: &[DerivativeDirection],
    ) -> Self {
        let is_colour = |it: &DerivativeDirection| {
            matches!(it, DerivativeDirection::Correlation(_) | DerivativeDirection::LastingShare(_))
        };
        let along = directions.iter().any(is_colour);
        let lasts = noise.coloured.iter().any(|it| it.share > 0.0);
        let of_sensor = |cause: &SystematicError| !SystematicError::CAR.contains(cause);
        let errs = SystematicError::ALL.iter().any(|it| of_sensor(it) && causes[*it] != 0.0);
        let sought = |direction: &DerivativeDirection| matches!(direction, DerivativeDirection::Error(cause) if of_sensor(cause));
        if SystematicError::TIRES.iter().any(|cause| causes[*cause] > 0.0) {
            if along || lasts { Self::ColouredTransientSlip } else { Self::TransientSlip }
        } else if along || lasts {
            Self::ColouredNoise
        } else if errs || directions.iter().any(sought) {
            Self::SensorBias
        } else {
            Self::Base
        }
    }

    /// The one that serves two points.
    pub fn covering_both(self, other: Self) -> Self {
        let coloured = |it| matches!(it, Self::ColouredNoise | Self::ColouredTransientSlip);
        let relaxed = |it| matches!(it, Self::TransientSlip | Self::ColouredTransientSlip);
        let any = |is: fn(Self) -> bool| is(self) || is(other);
        match (any(relaxed), any(coloured)) {
            (true, true) => Self::ColouredTransientSlip,
            (true, false) => Self::TransientSlip,
            (false, true) => Self::ColouredNoise,
            (false, false) if self == Self::Base => other,
            (false, false) => self,
        }
    }
}
