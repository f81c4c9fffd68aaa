//! What is known or decided before a fit without v_y: the car, its sensors, and the Gauss–Markov processes of its disturbances.

use vehicle::VehicleBody;

/// A disturbance that wanders about zero: a Gauss–Markov process of first order (Ornstein–Uhlenbeck).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaussMarkov {
    /// Standard deviation, in the unit of the quantity.
    pub std: f64,
    /// Correlation time [s].
    pub time: f64,
}

impl GaussMarkov {
    /// Correlation over `h` [s], and the variance that it gains in that time.
    pub(super) fn correlation_and_variance(&self, h: f64) -> (f64, f64) {
        let gained = -(-2.0 * h / self.time).exp_m1();
        ((-h / self.time).exp(), self.std * self.std * gained)
    }
}

/// What disturbs the motion. Yaw rate and a_y cannot tell these sizes, so they are engineering, not estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbances {
    /// Gravity along the car: grade [m/s²].
    pub grade: GaussMarkov,
    /// Gravity across the car: bank [m/s²].
    pub bank: GaussMarkov,
    /// Errors of the slip angles of the front and rear axle [rad].
    pub slip: [GaussMarkov; 2],
    /// Error of the slip angles of both axles alike [rad].
    pub common_slip: GaussMarkov,
    /// The standard deviation that the same error has in estimates [rad]. It is larger: a fit that allows for more than yaw rate and a_y can
    /// tell finds tires that are too soft, while an estimate must hold what curves get wrong.
    pub blind_slip: f64,
    /// Steering angle at which the car goes straight; constant in a drive [rad].
    pub trim: f64,
}

impl Disturbances {
    /// Of a car on a road or race track.
    pub const ROAD: Self = Self {
        grade: GaussMarkov { std: 0.04, time: 3.0 },
        bank: GaussMarkov { std: 0.2, time: 4.0 },
        slip: [GaussMarkov { std: 0.0015, time: 2.0 }; 2],
        common_slip: GaussMarkov { std: 0.002, time: 2.0 },
        blind_slip: 0.004,
        trim: 0.01,
    };

    /// Of a small car on a flat floor whose steering has play.
    pub const SMALL: Self = Self {
        grade: GaussMarkov { std: 1e-3, time: 1.0 },
        bank: GaussMarkov { std: 0.01, time: 1.0 },
        slip: [GaussMarkov { std: 0.015, time: 1.0 }, GaussMarkov { std: 0.01, time: 1.0 }],
        common_slip: GaussMarkov { std: 0.003, time: 1.0 },
        blind_slip: 0.003,
        trim: 0.02,
    };
}

/// The car and its sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatorSetup {
    /// Mass and lengths; yaw inertia and height of the centre of gravity are first guesses.
    pub body: VehicleBody,
    /// How far the true yaw inertia and height may be from the guesses: standard deviations of their logarithms.
    pub body_uncertainty: [f64; 2],
    /// Time constant of the steering [s].
    pub steering_lag: f64,
    /// Deceleration by drag over the square of the speed [1/m].
    pub drag: f64,
    /// Share of the driving force at the front axle.
    pub front_drive_share: f64,
    /// Share of the braking force at the front axle.
    pub front_brake_share: f64,
    /// Rows that are slower restart the filter [m/s].
    pub least_speed: f64,
    /// Standard deviations of course [rad] and ground speed [m/s].
    pub gnss: [f64; 2],
    /// By how much the clocks of r and a_y may differ from that of the steering: standard deviation [s].
    pub delay: f64,
    /// First guesses of the standard deviations of r [rad/s], a_y [m/s²] and v_x [m/s].
    pub sensor_noise: [f64; 3],
    /// First guess of the white yaw acceleration [rad/s per root second].
    pub yaw_process: f64,
    /// What disturbs the motion.
    pub disturbances: Disturbances,
}

impl EstimatorSetup {
    /// A rear-driven car on a road.
    #[must_use]
    pub fn road_car(body: VehicleBody) -> Self {
        Self {
            body,
            body_uncertainty: [0.05, 0.1],
            steering_lag: 0.0,
            drag: 8e-4,
            front_drive_share: 0.0,
            front_brake_share: 0.6,
            least_speed: 8.0,
            gnss: [0.01, 0.05],
            delay: 0.02,
            sensor_noise: [2e-3, 0.5, 6e-3],
            yaw_process: 0.04,
            disturbances: Disturbances::ROAD,
        }
    }

    /// A small car without a longitudinal accelerometer.
    #[must_use]
    pub fn small_car(body: VehicleBody) -> Self {
        Self {
            body_uncertainty: [0.3, 0.2],
            drag: 0.0,
            front_drive_share: 0.5,
            least_speed: 0.6,
            sensor_noise: [0.08, 2.5, 0.03],
            yaw_process: 2.0,
            disturbances: Disturbances::SMALL,
            ..Self::road_car(body)
        }
    }
}
