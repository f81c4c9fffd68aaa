//! The parameters of the car: what they are, what is known of them before, how much they differ between logs.
#![allow(non_snake_case, reason = "parameters of the Magic Formula are written as in its source")]

use vehicle::Number;
use vehicle::VehicleBody;

/// Number of parameters.
pub const COUNT: usize = 12;
/// The first of them differ between logs.
pub const VARYING: usize = 8;

/// Parameters as they are estimated; stiffness, peak and inertia as logarithms.
pub type ParameterVector = [f64; COUNT];

/// Shortest lag of the steering [s].
pub const LEAST_LAG: f64 = 2e-3;

/// Place of the steering offset in a [`ParameterVector`].
pub(super) const OFFSET: usize = 5;
/// Place of the steering lag in a [`ParameterVector`].
pub const LAG: usize = 7;
/// Names of the parameters, with units, in the order of a [`ParameterVector`].
pub const NAMES: [&str; COUNT] =
    ["ln K_f", "ln K_r", "ln D_f", "ln D_r", "ln I_zz", "offset", "S_r", "lag", "C_f", "C_r", "h", "e"];

/// The parameters, as the equations use them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarParameters<T> {
    /// Cornering stiffness over load, front and rear [1/rad].
    pub K: [T; 2],
    /// Peak of the force over load.
    pub D: [T; 2],
    /// Shape factor.
    pub C: [T; 2],
    /// Yaw moment of inertia [kg m²].
    pub I_zz: T,
    /// What the steering is more than recorded [rad].
    pub offset: T,
    /// Shift of the rear slip angle [rad].
    pub S_r: T,
    /// Height of the centre of gravity that moves forces: less than the real one, since tires under load grip less [m].
    pub h: T,
    /// Share of the friction ellipse that longitudinal force takes: 0 none, 1 all.
    pub e: T,
}

impl<T: Number> CarParameters<T> {
    /// From the numbers that are estimated. The lag is no part of the motion: [`super::motion::LaggedSteering`] has it.
    pub fn new(x: &[T; COUNT]) -> Self {
        Self {
            K: [x[0].exp(), x[1].exp()],
            D: [x[2].exp(), x[3].exp()],
            I_zz: x[4].exp(),
            offset: x[OFFSET],
            S_r: x[6],
            C: [x[8], x[9]],
            h: x[10],
            e: x[11],
        }
    }
}

/// What the steering signal is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SteeringSignalKind {
    /// The angle of the road wheels, measured there.
    #[default]
    Measured,
    /// What an actuator was told.
    Commanded,
}

/// How far apart the logs are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParameterVariation {
    /// Laps of one day: tires warm up and wear.
    #[default]
    Laps,
    /// Days: other floors, tires, trims of the steering.
    Days,
}

/// What is known of the car before any log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarSpecification {
    /// Mass, inertia and lengths.
    pub body: VehicleBody,
    /// Share of the driving force at the front axle.
    pub front_drive: f64,
    /// Share of the braking force at the front axle.
    pub front_brake: f64,
    /// What the steering signal is.
    pub steering: SteeringSignalKind,
    /// How far apart the logs are.
    pub variation: ParameterVariation,
}

/// Prior of θ, spread of b, and the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterPrior {
    /// Mean of θ.
    pub mean: ParameterVector,
    /// Standard deviation of θ.
    pub std: ParameterVector,
    /// Standard deviation of b; 0 where logs do not differ.
    pub between: ParameterVector,
    /// Bounds of θ.
    pub bounds: [ParameterVector; 2],
}

impl ParameterPrior {
    /// Of cars on rubber and asphalt: K 12 per rad, within a factor of two or so, and a peak near 1.
    #[must_use]
    pub fn new(car: &CarSpecification) -> Self {
        let VehicleBody { I_zz, h, .. } = car.body;
        let (lag, lag_std, lag_between) = match car.steering {
            SteeringSignalKind::Measured => (5e-3, 2e-3, 0.0),
            SteeringSignalKind::Commanded => (0.05, 0.02, 0.02),
        };
        // A day changes a rubber floor's peak by 10 % and the trim of a small servo by 0.02 rad; laps change less.
        let b = match car.variation {
            ParameterVariation::Days => [0.2, 0.1, 0.2, 0.02, 0.01],
            ParameterVariation::Laps => [0.1, 0.05, 0.1, 3e-3, 3e-3],
        };
        let (stiffness, inertia) = (12.0_f64.ln(), I_zz.ln());
        // Friction falls with load: of a transfer of load, some 60 % arrives as force.
        let h_acting = 0.6 * h;
        Self {
            mean: [stiffness, stiffness, 0.0, 0.0, inertia, 0.0, 0.0, lag, 1.3, 1.3, h_acting, 0.8],
            std: [0.5, 0.5, 0.3, 0.3, 0.25, 0.02, 0.02, lag_std, 0.2, 0.2, 0.5 * h_acting, 0.3],
            between: [b[0], b[0], b[1], b[1], b[2], b[3], b[4], lag_between, 0.0, 0.0, 0.0, 0.0],
            bounds: [
                [0.0, 0.0, -3.0, -3.0, inertia - 1.0, -0.1, -0.1, LEAST_LAG, 1.0, 1.0, 0.0, 0.0],
                [5.0, 5.0, 1.1, 1.1, inertia + 1.0, 0.1, 0.1, 0.2, 1.9, 1.9, 3.0 * h, 1.5],
            ],
        }
    }
}
