//! Holds what a likelihood depends on: tires, errors of sensors and car, and noises, plain or with derivatives.

use numerics::tangent::Tangent;

use crate::filter::Variances;
use crate::tires::{self, Tires};
use crate::wide::Colour;
use preparation::{SystematicError, SystematicErrors};

/// Shortest relaxation length that is looked at [m].
pub const SHORTEST: f64 = 0.03;

/// Noises of a recording, as standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DriveNoise {
    /// Of measured v_x, v_y, r and a_y [m/s, m/s, rad/s, m/s²].
    pub sensor: [f64; 4],
    /// Of the random walk that v_x, v_y, r and ξ_x do besides the model, after one second [m/s, m/s, rad/s, N].
    pub process: [f64; 4],
    /// Correlation from row to row of the part of each sensor's noise that lasts, and the share of that part in its variance;
    /// 0 where noises are white.
    pub colour: [[f64; 2]; 4],
}

impl DriveNoise {
    /// These sensors, on a car that the model describes well.
    pub fn of_sensors(sensor: [f64; 4]) -> Self {
        Self { sensor, process: [1e-5, 1e-5, 1e-5, 30.0], colour: [[0.0; 2]; 4] }
    }

    /// With the process multiplied by a factor.
    pub fn with_process(&self, factor: f64) -> Self {
        Self { process: self.process.map(|std| std * factor), ..*self }
    }

    /// How much of each sensor's noise lasts.
    pub fn colours(&self) -> [Colour<f64>; 4] {
        self.colour.map(|[correlation, share]| Colour { correlation, share })
    }

    /// As variances.
    pub fn variances(&self) -> Variances<f64> {
        let square = |std: f64| std * std;
        Variances { process: self.process.map(square), sensor: self.sensor.map(square) }
    }
}

/// What the likelihood depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknowns {
    /// The tires.
    pub tires: Tires,
    /// Errors of sensors and car.
    pub causes: SystematicErrors,
    /// The noises.
    pub noise: DriveNoise,
}

impl Unknowns {
    /// Tires and noises, where nothing else is wrong.
    pub fn new(tires: &Tires, noise: &DriveNoise) -> Self {
        Self { tires: *tires, causes: SystematicErrors::default(), noise: *noise }
    }

    /// Whether sensors are right and their noises white.
    pub fn is_plain(&self) -> bool {
        Width::of(&self.causes, &self.noise, &[]) == Width::Narrow
    }

    /// Whether the filter needs more states than those of the car.
    pub fn is_wide(&self) -> bool {
        !matches!(Width::of(&self.causes, &self.noise, &[]), Width::Narrow | Width::Erring)
    }

    /// As numbers with derivatives along up to eight directions.
    pub fn seeded<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        directions: &[Direction],
    ) -> Numbers<Tangent<S, N>> {
        let seed = |value: f64, direction: Direction, rate: f64| match directions
            .iter()
            .position(|known| *known == direction)
        {
            Some(index) => Tangent::<S, N>::seed(simd, value, index, rate),
            None => Tangent::seed(simd, value, 0, 0.0),
        };
        let Self { tires, causes, noise } = self;
        let theta = tires::to_array(*tires);
        let sensor = |i: usize| {
            let variance = noise.sensor[i].powi(2);
            seed(variance, Direction::Noise(i), 2.0 * variance)
        };
        let process = |i: usize| seed(noise.process[i].powi(2), Direction::Noise(4 + i), 1.0);
        let error = |cause: SystematicError| {
            seed(causes[cause], Direction::SystematicError(cause), cause.describe().std)
        };
        let colour = |i: usize| {
            let [correlation, share] =
                std::array::from_fn(|j| seed(noise.colour[i][j], Direction::Colour(i, j), 1.0));
            Colour { correlation, share }
        };
        Numbers {
            tires: tires::from_array(std::array::from_fn(|i| {
                seed(theta[i], Direction::Tire(i), 1.0)
            })),
            causes: SystematicErrors(SystematicError::ALL.map(error)),
            noise: Variances {
                sensor: std::array::from_fn(sensor),
                process: std::array::from_fn(process),
            },
            colours: std::array::from_fn(colour),
        }
    }
}

/// An unknown along which a derivative is taken, in its own unit but for the logarithms of the standard deviations of sensors
/// and the variances of the process: those may be 0, where the logarithm would have no slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direction {
    /// A parameter of the tires, by its number in [`crate::tires`].
    Tire(usize),
    /// An error, in its standard deviations before any data.
    SystematicError(SystematicError),
    /// A noise: those of sensors before those of the process.
    Noise(usize),
    /// Correlation or share of the lasting noise of a sensor.
    Colour(usize, usize),
}

/// [`Unknowns`] as numbers of some kind.
pub struct Numbers<T> {
    /// The tires.
    pub tires: Tires<T>,
    /// Errors of sensors and car.
    pub causes: SystematicErrors<T>,
    /// The noises.
    pub noise: Variances<T>,
    /// How much of them lasts.
    pub colours: [Colour<T>; 4],
}

/// Which filter a point needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// That of four states.
    Narrow,
    /// The same with errors of sensors and inputs.
    Erring,
    /// One with noises that last.
    Coloured,
    /// One with slips that relax.
    Relaxed,
    /// One with both.
    Full,
}

impl Width {
    /// For some unknowns, and derivatives along these directions.
    pub fn of(causes: &SystematicErrors, noise: &DriveNoise, directions: &[Direction]) -> Self {
        let along = directions.iter().any(|it| matches!(it, Direction::Colour(..)));
        let lasts = noise.colour.iter().any(|[_, share]| *share > 0.0);
        let of_sensor = |cause: &SystematicError| !SystematicError::CAR.contains(cause);
        let errs = SystematicError::ALL.iter().any(|it| of_sensor(it) && causes[*it] != 0.0);
        let sought = |direction: &Direction| matches!(direction, Direction::SystematicError(cause) if of_sensor(cause));
        if SystematicError::TIRES.iter().any(|cause| causes[*cause] > 0.0) {
            if along || lasts { Self::Full } else { Self::Relaxed }
        } else if along || lasts {
            Self::Coloured
        } else if errs || directions.iter().any(sought) {
            Self::Erring
        } else {
            Self::Narrow
        }
    }

    /// The one that serves two points.
    pub fn widest(self, other: Self) -> Self {
        let coloured = |it| matches!(it, Self::Coloured | Self::Full);
        let relaxed = |it| matches!(it, Self::Relaxed | Self::Full);
        let any = |is: fn(Self) -> bool| is(self) || is(other);
        match (any(relaxed), any(coloured)) {
            (true, true) => Self::Full,
            (true, false) => Self::Relaxed,
            (false, true) => Self::Coloured,
            (false, false) if self == Self::Narrow => other,
            (false, false) => self,
        }
    }
}
