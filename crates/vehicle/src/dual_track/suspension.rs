//! Carries the body: heave, roll and pitch on springs, and the loads that reach the wheels.
#![allow(non_snake_case, reason = "forces and moments of inertia are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::state::{DualTrackState, HeaveRollPitch, LoadTransferForces};
use super::{FRONT, PerAxle, PerWheel, REAR, SIDES, axle_of, side_of};
use crate::body::VehicleBody;

/// Roll and pitch angle [rad] from which on a stop holds the body, with the stiffness of all springs: a car that
/// tips over is outside of the model, but its state stays finite.
pub const STOP: f64 = 0.3;

/// Springs, dampers and links of both axles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suspension {
    /// Distance between the wheels of each axle [m].
    pub track: PerAxle<f64>,
    /// Moment of inertia of the body about its x axis [kg m²].
    pub I_xx: f64,
    /// Moment of inertia of the body about its y axis [kg m²].
    pub I_yy: f64,
    /// Vertical stiffness at each wheel [N/m], tire included.
    pub ride_stiffness: PerAxle<f64>,
    /// Vertical damping at each wheel [N s/m].
    pub ride_damping: PerAxle<f64>,
    /// Roll stiffness of each axle, springs, anti-roll bar and tires together [N m/rad].
    pub roll_stiffness: PerAxle<f64>,
    /// Roll damping of each axle [N m s/rad].
    pub roll_damping: PerAxle<f64>,
    /// Height of the roll centre of each axle [m].
    pub roll_centre: PerAxle<f64>,
    /// Height of the pitch centre [m]: longitudinal forces at this height pitch the body no more.
    pub pitch_centre: f64,
    /// Whether heave, roll and pitch swing. Otherwise the body goes to its steady attitude with the time constant
    /// `lag`.
    pub dynamic: bool,
    /// Time that links take to pass a force on to the loads [s]. It opens the loop of loads and tire forces.
    pub lag: f64,
}

impl Default for Suspension {
    fn default() -> Self {
        Self {
            track: [1.5, 1.5],
            I_xx: 180.0,
            I_yy: 850.0,
            ride_stiffness: [60e3, 60e3],
            ride_damping: [4e3, 4e3],
            roll_stiffness: [80e3, 75e3],
            roll_damping: [4.5e3, 4.5e3],
            roll_centre: [0.03, 0.05],
            pitch_centre: 0.03,
            dynamic: true,
            lag: 0.005,
        }
    }
}

/// What moves the body on its springs.
pub struct SprungMassForces<T> {
    /// Sum of longitudinal tire forces and drag [N], along the body's x axis.
    pub F_x: T,
    /// Sum of lateral tire forces [N], along the body's y axis.
    pub F_y: T,
    /// Sum of the overturning moments of the tires [N m].
    pub M_x: T,
    /// Loads of the wheels [N].
    pub F_z: PerWheel<T>,
    /// Downforce on each axle [N].
    pub downforce: PerAxle<T>,
    /// Part of the weight that is normal to the road [N].
    pub weight: T,
}

/// Loads of the wheels of an axle [N]: the right one carries their mean and what moves across, the left one the rest.
#[derive(Clone, Copy, Debug)]
pub struct AxleLoads<T = f64> {
    /// Mean of both wheels.
    pub mean: T,
    /// What moves across.
    pub across: T,
}

/// Distances of the axles from the centre of gravity [m], positive forward.
pub(crate) fn axle_positions(body: &VehicleBody) -> PerAxle<f64> {
    [body.l_f, -body.l_r]
}

impl Suspension {
    /// Compression of the springs of an axle [m], the mean of its wheels, by heave and pitch; or its rate.
    #[inline]
    pub fn spring_compression<T: Number>(body: &VehicleBody, axle: usize, q: &HeaveRollPitch<T>) -> T {
        q.theta * axle_positions(body)[axle] - q.z
    }

    /// Way of each wheel towards the body [m].
    #[inline]
    pub(crate) fn wheel_travel<T: Number>(&self, body: &VehicleBody, q: &HeaveRollPitch<T>) -> PerWheel<T> {
        std::array::from_fn(|i| {
            let axle = axle_of(i);
            Self::spring_compression(body, axle, q) - q.phi * (0.5 * side_of(i) * self.track[axle])
        })
    }

    /// Loads of the wheels: weight at rest, springs, dampers, and what the links pass on. They are below 0 where a spring would pull.
    #[inline]
    pub fn axle_loads<T: Number>(
        &self,
        body: &VehicleBody,
        q: &HeaveRollPitch<T>,
        rate: &HeaveRollPitch<T>,
        links: &LoadTransferForces<T>,
    ) -> PerAxle<AxleLoads<T>> {
        let rest = body.static_loads();
        let F_y = [links.F_yf, links.F_yr];
        let along = links.F_x * (0.5 * self.pitch_centre / body.wheelbase());
        [FRONT, REAR].map(|axle| {
            let mean = Self::spring_compression(body, axle, q) * self.ride_stiffness[axle]
                + Self::spring_compression(body, axle, rate) * self.ride_damping[axle]
                + 0.5 * rest[axle]
                + if axle == FRONT { -along } else { along };
            let moment = q.phi * self.roll_stiffness[axle]
                + rate.phi * self.roll_damping[axle]
                + F_y[axle] * self.roll_centre[axle];
            AxleLoads { mean, across: moment / self.track[axle] }
        })
    }

    /// Loads of the wheels [N]. A wheel in the air has none.
    #[inline]
    pub(crate) fn wheel_loads<T: Number>(
        &self,
        body: &VehicleBody,
        state: &DualTrackState<T>,
    ) -> PerWheel<T> {
        let axles = self.axle_loads(body, &state.attitude, &state.rates, &state.transfer);
        let mut loads = [T::zero(); 4];
        for (axle, AxleLoads { mean, across }) in axles.into_iter().enumerate() {
            for (side, sign) in SIDES.into_iter().enumerate() {
                let load = mean - across * sign;
                loads[2 * axle + side] = if load > 0.0 { load } else { T::zero() };
            }
        }
        loads
    }

    /// Speeds that rolling and pitching add to the contact points of each axle [m/s]: forward (of both), and to the left.
    ///
    /// The links turn the wheels about roll centre and pitch centre, and velocities are those of the centre of gravity.
    #[inline]
    pub fn roll_pitch_contact_speeds<T: Number>(
        &self,
        body: &VehicleBody,
        rate: &HeaveRollPitch<T>,
    ) -> (T, PerAxle<T>) {
        let sideways = |axle: usize| rate.phi * (body.h - self.roll_centre[axle]);
        (-rate.theta * (body.h - self.pitch_centre), [sideways(FRONT), sideways(REAR)])
    }

    /// Force that lifts the body [N], and moments that roll and pitch it [N m].
    #[inline]
    fn heave_roll_pitch_loads<T: Number>(
        &self,
        body: &VehicleBody,
        q: &HeaveRollPitch<T>,
        on: &SprungMassForces<T>,
    ) -> HeaveRollPitch<T> {
        let VehicleBody { l_f, l_r, h, .. } = *body;
        let F_z = &on.F_z;
        let axle = [F_z[0] + F_z[1], F_z[2] + F_z[3]];
        let [D_f, D_r] = on.downforce;
        let lift = axle[0] + axle[1] - on.weight - D_f - D_r;
        let roll_axis = (l_r * self.roll_centre[0] + l_f * self.roll_centre[1]) / (l_f + l_r);
        let roll = on.F_y * h
            + on.M_x
            + on.weight * (h - roll_axis) * q.phi
            + (F_z[0] - F_z[1]) * (0.5 * self.track[0])
            + (F_z[2] - F_z[3]) * (0.5 * self.track[1])
            - angle_beyond_stops(q.phi) * self.heave_roll_stiffness().phi;
        let pitch = -on.F_x * h - (axle[0] - D_f) * l_f
            + (axle[1] - D_r) * l_r
            + on.weight * (h - self.pitch_centre) * q.theta
            - angle_beyond_stops(q.theta) * self.pitch_stiffness(body);
        HeaveRollPitch { z: lift, phi: roll, theta: pitch }
    }

    /// Accelerations of heave, roll and pitch [m/s², rad/s²].
    ///
    /// m z'' = Σ F_z − W − D, I_xx φ'' = h F_y + Σ y F_z + M_x + W (h − h_ra) φ,
    /// I_yy θ'' = −h F_x − Σ x F_z + l_f D_f − l_r D_r + W (h − h_pc) θ.
    #[inline]
    pub fn attitude_accelerations<T: Number>(
        &self,
        body: &VehicleBody,
        q: &HeaveRollPitch<T>,
        on: &SprungMassForces<T>,
    ) -> HeaveRollPitch<T> {
        let HeaveRollPitch { z, phi, theta } = self.heave_roll_pitch_loads(body, q, on);
        HeaveRollPitch { z: z / body.m, phi: phi / self.I_xx, theta: theta / self.I_yy }
    }

    /// Rates of attitude and of its rates, which follow from the forces on the body.
    #[inline]
    pub(crate) fn attitude_rates<T: Number>(
        &self,
        body: &VehicleBody,
        state: &DualTrackState<T>,
        on: &SprungMassForces<T>,
    ) -> (HeaveRollPitch<T>, HeaveRollPitch<T>) {
        if self.dynamic {
            return (state.rates, self.attitude_accelerations(body, &state.attitude, on));
        }
        let HeaveRollPitch { z: lift, phi: roll, theta: pitch } =
            self.heave_roll_pitch_loads(body, &state.attitude, on);
        let K = self.heave_roll_stiffness();
        let towards = |push: T, stiffness: f64| push / (stiffness * self.lag);
        let rates = HeaveRollPitch {
            z: towards(lift, K.z),
            phi: towards(roll, K.phi),
            theta: towards(pitch, self.pitch_stiffness(body)),
        };
        (rates, HeaveRollPitch { z: T::zero(), phi: T::zero(), theta: T::zero() })
    }

    /// Stiffness of heave [N/m] and roll [N m/rad].
    fn heave_roll_stiffness(&self) -> HeaveRollPitch {
        HeaveRollPitch {
            z: 2.0 * (self.ride_stiffness[0] + self.ride_stiffness[1]),
            phi: self.roll_stiffness[0] + self.roll_stiffness[1],
            theta: 0.0,
        }
    }

    /// Pitch stiffness of the springs [N m/rad].
    pub(crate) fn pitch_stiffness(&self, body: &VehicleBody) -> f64 {
        let [k_f, k_r] = self.ride_stiffness;
        2.0 * (k_f * body.l_f * body.l_f + k_r * body.l_r * body.l_r)
    }

    /// Upper bound of the poles of the body on its springs and dampers [1/s].
    pub(crate) fn fastest_pole(&self, body: &VehicleBody) -> f64 {
        if !self.dynamic {
            return 4.0 / self.lag;
        }
        let K = self.heave_roll_stiffness();
        let [c_f, c_r] = self.ride_damping;
        let C_theta = 2.0 * (c_f * body.l_f * body.l_f + c_r * body.l_r * body.l_r);
        let C_phi = self.roll_damping[0] + self.roll_damping[1];
        let pole = |K: f64, C: f64, m: f64| C / m + (K / m).sqrt();
        let heave = pole(K.z, 2.0 * (c_f + c_r), body.m);
        let pitch = pole(self.pitch_stiffness(body), C_theta, self.I_yy);
        // Heave and pitch are coupled: the sum bounds both.
        (heave + pitch).max(pole(K.phi, C_phi, self.I_xx)) + 1.0 / self.lag
    }
}

/// How far an angle is beyond the stops.
#[inline]
fn angle_beyond_stops<T: Number>(angle: T) -> T {
    if angle > STOP {
        angle - STOP
    } else if angle < -STOP {
        angle + STOP
    } else {
        T::zero()
    }
}
