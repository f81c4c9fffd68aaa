//! Describes the car of a lap: a body on four tires, loads that move at once or with a body that swings, and what its actuators can do.
#![allow(non_snake_case, reason = "forces and lengths are written as in the equations")]

use num_dual::DualNum;
use tire::Number;
use track::RoadGeometry;
use vehicle::dual_track::{AxleLoads, HeaveRollPitch, LoadTransferForces, SprungMassForces, Suspension};
use vehicle::{G, VehicleBody};

use crate::aero::{LapAero, SpringLoad};
use crate::node::{BodyMotion, NodeMotion, NodeVariables};
use crate::spline::BSplineCurve;
use crate::tires::{AxleSlip, LapTire, StageNumber, TirePeaks, capped_transfer};

/// Share of the weight within which a driving force turns into a braking one: they act at other axles, and derivatives have to
/// exist between them.
const SPLIT_WIDTH: f64 = 0.005;

/// A car that is driven at its limit.
///
/// Each axle has two tires with the same slip angle. Brakes act alike on both sides, and so does an open differential. Load moves between the axles by the longitudinal force and within them by the lateral
/// acceleration: without delay, or as springs and dampers of a body that swings pass it on. Without track widths none moves within the axles,
/// and the car is a single track.
#[derive(Clone, Debug)]
pub struct LapCar {
    /// Rigid body.
    pub body: VehicleBody,
    /// Drag and downforce.
    pub aero: LapAero,
    /// Track widths of the axles [m]; without one no load moves across.
    pub track_widths: [f64; 2],
    /// Roll stiffness of the axles [N m/rad], by which they share the load that moves across; without one by their load.
    pub roll_stiffness: [f64; 2],
    /// Springs, dampers and links of a body that swings; without them load moves without delay.
    pub suspension: Option<Suspension>,
    /// Part of a braking force that acts at the front.
    pub brake_balance: BrakeBalance,
    /// Part of a driving force that acts at the front [-].
    pub drive_front_share: f64,
    /// What locks the differentials of the axles; open ones where there is nothing.
    pub differentials: [Option<LapDifferential>; 2],
    /// A tire of the front and one of the rear axle, as they are on the left side.
    pub tires: [LapTire; 2],
    /// What the engine can give, where it is not the same at all speeds.
    pub engine_power: Option<EnginePower>,
    /// What the actuators can do.
    pub limits: ActuatorLimits,
}

/// Power of an engine with a table.
#[derive(Clone, Debug)]
pub struct EnginePower {
    /// Largest power at the wheels [W] over the speed of the car [m/s].
    pub curve: BSplineCurve,
    /// Speed of the engine over that of the car [rad/m].
    pub gear: f64,
    /// Last speed of the table [rad/s]; none of a table of one point.
    pub table_end: Option<f64>,
}

impl EnginePower {
    /// Says that the engine turns faster than its table tells, at this speed of the driven wheels [m/s]: it may be none there.
    pub fn excess_message(&self, wheel_speed: f64) -> Option<String> {
        const RPM: f64 = 30.0 / std::f64::consts::PI;
        let [speed, end] = [self.gear * wheel_speed * RPM, self.table_end? * RPM];
        (speed > end).then(|| {
            format!("the engine turns at up to {speed:.0} rpm; drive.map ends at {end:.0} rpm, and its last torque holds from there on")
        })
    }
}

/// A limited-slip differential, by forces and speeds at the road: the faster wheel hands torque to the slower one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LapDifferential {
    /// Difference of the forces of both wheels over their sum while driving [-].
    pub drive_lock: f64,
    /// Difference of the forces without load [N].
    pub preload: f64,
    /// Growth of the locking with the difference of the speeds [s/m].
    pub sensitivity: f64,
}

impl LapDifferential {
    /// Force of the right wheel minus that of the left one [N] at these speeds of both [m/s]. The larger one of load and preload counts, as in the
    /// plant, with a rounded corner between them.
    #[inline]
    fn force_difference<T: Number>(&self, driving: T, [left, right]: [T; 2]) -> T {
        let locked = driving * self.drive_lock;
        let most = (locked * locked + self.preload * self.preload + LEAST_LOCK * LEAST_LOCK).sqrt();
        most * ((left - right) * self.sensitivity).tanh()
    }
}

/// Force at which the root of a lock without preload is rounded [N]: it has no derivative at 0.
const LEAST_LOCK: f64 = 1.0;

/// How the axles share a braking force.
#[derive(Clone, Debug)]
pub enum BrakeBalance {
    /// Part of the front axle [-].
    FrontShare(f64),
    /// Force at the front axle [N] over that of both, each without its sign.
    FrontForce(BSplineCurve),
}

impl BrakeBalance {
    /// Force at the front axle [N] of a braking force [N], both without sign.
    #[inline]
    fn front_force<T: Number>(&self, force: T) -> T {
        match self {
            BrakeBalance::FrontShare(share) => force * *share,
            BrakeBalance::FrontForce(curve) => curve.value(force),
        }
    }
}

/// Bounds of what driver, engine and brakes do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorLimits {
    /// Largest steering angle of the front wheels [rad].
    pub delta: f64,
    /// Largest steering rate of the front wheels [rad/s].
    pub delta_rate: f64,
    /// Largest rate of the longitudinal force [N/s].
    pub F_x_rate: f64,
    /// Largest driving force [N].
    pub drive_force: f64,
    /// Largest braking force [N], positive.
    pub brake_force: f64,
    /// Largest power at the wheels [W].
    pub power: f64,
}

impl LapCar {
    /// Splits a longitudinal force [N] into those that are asked of the front and the rear axle.
    #[inline]
    pub fn split_force<T: Number>(&self, F_x: T) -> [T; 2] {
        let driving = self.driving_force(F_x);
        let front = driving * self.drive_front_share - self.brake_balance.front_force(driving - F_x);
        [front, F_x - front]
    }

    /// The part of a longitudinal force [N] that drives, with derivatives where driving turns into braking.
    #[inline]
    fn driving_force<T: Number>(&self, F_x: T) -> T {
        let width = SPLIT_WIDTH * self.body.m * G;
        (F_x + (F_x * F_x + width * width).sqrt()) * 0.5
    }

    /// Parts of a driving force that act at the axles [-].
    fn drive_shares(&self) -> [f64; 2] {
        [self.drive_front_share, 1.0 - self.drive_front_share]
    }

    /// Longitudinal slip of the driven wheels [-], by which the engine turns faster than the road.
    #[inline]
    pub fn driven_slip<T: Number>(&self, [front_left, front_right, rear_left, rear_right]: &[T; 4]) -> T {
        let [front, rear] = self.drive_shares();
        (*front_left + *front_right) * (0.5 * front) + (*rear_left + *rear_right) * (0.5 * rear)
    }

    /// Largest power at the wheels [W] at a speed [m/s].
    pub fn available_power(&self, v_x: f64) -> f64 {
        self.engine_power.as_ref().map_or(self.limits.power, |engine| engine.curve.value(v_x))
    }

    /// Power at the wheels beyond what the engine can give, over the largest one [-].
    pub fn excess_power<T: StageNumber>(&self, power: &T, wheel_speed: &T) -> T {
        let most = self.limits.power;
        let [excess] = T::compose([power, wheel_speed], |[power, wheel_speed]| {
            let available =
                self.engine_power.as_ref().map_or(most.into(), |engine| engine.curve.value(wheel_speed));
            [(power - available) / most]
        });
        excess
    }

    /// Load that a lateral acceleration of 1 m/s² moves from one wheel of each axle to the other [N].
    fn load_transfer_gains(&self) -> [f64; 2] {
        let [k_f, k_r] = self.roll_stiffness;
        let front = if k_f + k_r > 0.0 { k_f / (k_f + k_r) } else { self.body.l_r / self.body.wheelbase() };
        let gain = |share: f64, width: f64| {
            if width > 0.0 { share * self.body.m * self.body.h / width } else { 0.0 }
        };
        [gain(front, self.track_widths[0]), gain(1.0 - front, self.track_widths[1])]
    }

    /// Peaks of the tires of both axles under their load at rest.
    pub fn tire_peaks(&self) -> [TirePeaks; 2] {
        let loads = self.body.static_loads();
        [0, 1].map(|axle| self.tires[axle].peaks(0.5 * loads[axle], 20.0))
    }

    /// The motion at a node, by the station s of the line instead of time.
    ///
    /// With ṡ = (v_x cos ξ − v_y sin ξ) / (1 − n κ): n' = (v_x sin ξ + v_y cos ξ) / ṡ, ξ' = r / ṡ − κ, and Newton's and Euler's
    /// equations in body axes, each over ṡ (R. Lot and F. Biral, IFAC Proceedings 47 (2014), 7559).
    #[inline]
    pub fn motion<T: StageNumber>(&self, z: &NodeVariables<T>, road: &RoadGeometry) -> NodeMotion<T> {
        let VehicleBody { m, I_zz, l_f, l_r, .. } = self.body;
        let NodeVariables { n, xi, v_x, v_y, r, delta, F_x, delta_rate, F_x_rate, .. } = z;
        let curvature = road.kappa * road.bank.cos();
        let [slowness, n_slope] = T::compose([n, xi, v_x, v_y], |[n, xi, v_x, v_y]| {
            let (sin_xi, cos_xi) = xi.sin_cos();
            let slowness = (-n * curvature + 1.0) / (v_x * cos_xi - v_y * sin_xi);
            [slowness, (v_x * sin_xi + v_y * cos_xi) * slowness]
        });
        let BodyLoads { drag, axles, body_rates, contact_speeds } = match (&z.body, &self.suspension) {
            (Some(motion), Some(suspension)) => self.swinging_loads(suspension, motion, z, road),
            _ => self.quasi_steady_loads(z, road),
        };
        // ISO-W: the slip angle is positive while the contact point moves to the left.
        let alpha = |x: f64, speed: &T| {
            T::compose([v_x, v_y, r, speed], |[v_x, v_y, r, speed]| [((v_y + r * x + speed) / v_x).atan()])[0]
        };
        let alphas = [alpha(l_f, &contact_speeds[0]) - *delta, alpha(-l_r, &contact_speeds[1])];
        let [kappa_fl, kappa_fr, kappa_rl, kappa_rr] = &z.kappas;
        let forces = |axle: usize, kappas: [&T; 2]| {
            let AxleLoads { mean, across } = &axles[axle];
            T::axle_forces(&self.tires[axle], AxleSlip { kappas, alpha: &alphas[axle], mean, across, v_x })
        };
        let [F_xf, F_yf, difference_f] = forces(0, [kappa_fl, kappa_fr]);
        let [F_xr, F_yr, difference_r] = forces(1, [kappa_rl, kappa_rr]);
        let [along_f, across_f] = T::compose([&F_xf, &F_yf, delta], |[F_x, F_y, delta]| {
            let (sin_delta, cos_delta) = delta.sin_cos();
            [F_x * cos_delta - F_y * sin_delta, F_y * cos_delta + F_x * sin_delta]
        });
        let [a_x] = T::compose([&along_f, &F_xr, &drag], |[front, rear, drag]| [(front + rear - drag) / m]);
        let [tire_a_y] = T::compose([&across_f, &F_yr], |[front, rear]| [(front + rear) / m]);
        let yaw = [&across_f, &F_yr, &difference_f, &difference_r];
        let [yaw_acceleration] = T::compose(yaw, |[front, rear, difference_f, difference_r]| {
            let [track_f, track_r] = self.track_widths;
            let across = difference_f * (0.5 * track_f) + difference_r * (0.5 * track_r);
            [(front * l_f - rear * l_r + across) / I_zz]
        });
        let [v_x_slope] = T::compose([&a_x, v_y, r, &slowness], |[a_x, v_y, r, slowness]| {
            [(a_x + v_y * r - G * road.grade.sin()) * slowness]
        });
        let [v_y_slope] = T::compose([&tire_a_y, v_x, r, &slowness], |[a_y, v_x, r, slowness]| {
            [(a_y - v_x * r - G * road.bank.sin()) * slowness]
        });
        let slope = |rate: &T| T::compose([rate, &slowness], |[rate, slowness]| [rate * slowness])[0];
        let weight = m * G;
        let residual = |force: &T, axle: usize| {
            T::compose([force, F_x], |[force, F_x]| [(force - self.split_force(F_x)[axle]) / weight])[0]
        };
        let lock_residual = |axle: usize, difference: &T, kappas: [&T; 2]| match &self.differentials[axle] {
            None => *difference / weight,
            Some(lock) => {
                let inputs = [difference, F_x, v_x, r, kappas[0], kappas[1]];
                T::compose(inputs, |[difference, F_x, v_x, r, left, right]| {
                    let side = r * (0.5 * self.track_widths[axle]);
                    let speeds = [(v_x - side) * (left + 1.0), (v_x + side) * (right + 1.0)];
                    let driving = self.driving_force(F_x) * self.drive_shares()[axle];
                    [(difference - lock.force_difference(driving, speeds)) / weight]
                })[0]
            }
        };
        let driven_slip = self.driven_slip(&z.kappas);
        let [power, wheel_speed] = T::compose([F_x, v_x, &driven_slip], |[F_x, v_x, slip]| {
            let wheel_speed = v_x * (slip + 1.0);
            [F_x * wheel_speed, wheel_speed]
        });
        NodeMotion {
            slowness,
            slopes: [
                n_slope,
                slope(r) - curvature,
                v_x_slope,
                v_y_slope,
                slope(&yaw_acceleration),
                slope(delta_rate),
                slope(F_x_rate),
            ],
            body_slopes: body_rates.map(|rates| rates.map(|rate| slope(&rate))),
            force_residuals: [
                residual(&F_xf, 0),
                residual(&F_xr, 1),
                lock_residual(0, &difference_f, [kappa_fl, kappa_fr]),
                lock_residual(1, &difference_r, [kappa_rl, kappa_rr]),
                (tire_a_y - z.a_y) / G,
            ],
            alphas,
            power,
            wheel_speed,
            a_x,
        }
    }

    /// What presses the car on the road [N]: its weight, and the bend of a banked road.
    fn pressing_force<T: Number>(&self, v_x: T, road: &RoadGeometry) -> T {
        (v_x * v_x * (-road.kappa * road.bank.sin()) + G * road.grade.cos() * road.bank.cos()) * self.body.m
    }

    /// Loads that move without delay.
    fn quasi_steady_loads<T: StageNumber>(&self, z: &NodeVariables<T>, road: &RoadGeometry) -> BodyLoads<T> {
        let VehicleBody { l_f, l_r, h, .. } = self.body;
        let L = l_f + l_r;
        let [drag, front, rear] = T::compose([&z.v_x, &z.F_x], |[v_x, F_x]| {
            let pressing = self.pressing_force(v_x, road);
            let load = |pressure| SpringLoad { pressure, pressing, F_x };
            let (drag, [down_f, down_r]) = self.aero.drag_and_downforce(&self.body, v_x, load);
            let moved = (F_x - drag) * (h / L);
            let (front, rear) =
                (down_f - moved + pressing * (l_r / L), down_r + moved + pressing * (l_f / L));
            [drag, front * 0.5, rear * 0.5]
        });
        let [gain_f, gain_r] = self.load_transfer_gains();
        let axles = [
            AxleLoads { mean: front, across: z.a_y * gain_f },
            AxleLoads { mean: rear, across: z.a_y * gain_r },
        ];
        BodyLoads { drag, axles, body_rates: None, contact_speeds: [T::zero(); 2] }
    }

    /// Loads that springs, dampers and links pass on, and how the body moves under them: the equations of the dual track.
    ///
    /// The links of an axle know its lateral force as its part of m a_y in steady cornering.
    fn swinging_loads<T: StageNumber>(
        &self,
        suspension: &Suspension,
        motion: &BodyMotion<T>,
        z: &NodeVariables<T>,
        road: &RoadGeometry,
    ) -> BodyLoads<T> {
        let body = &self.body;
        let BodyMotion { attitude: q, rates } = motion;
        let inputs = [&z.v_x, &z.F_x, &z.a_y, &q.z, &q.phi, &q.theta, &rates.z, &rates.phi, &rates.theta];
        let outputs = T::compose(inputs, |[v_x, F_x, a_y, motion @ ..]| {
            let BodyMotion { attitude, rates } = BodyMotion::from(motion);
            let compression = [0, 1].map(|axle| Suspension::spring_compression(body, axle, &attitude));
            let (drag, downforce) = self.aero.drag_and_downforce_at(v_x, compression);
            let (F_x, F_y) = (F_x - drag, a_y * body.m);
            let share = |way: f64| F_y * (way / body.wheelbase());
            let links = LoadTransferForces { F_x, F_yf: share(body.l_r), F_yr: share(body.l_f) };
            let [front, rear] = suspension.axle_loads(body, &attitude, &rates, &links);
            let [moved_f, moved_r] = [front, rear].map(|loads| capped_transfer(loads.across, loads.mean));
            let forces = SprungMassForces {
                F_x,
                F_y,
                M_x: 0.0.into(),
                F_z: [front.mean - moved_f, front.mean + moved_f, rear.mean - moved_r, rear.mean + moved_r],
                downforce,
                weight: self.pressing_force(v_x, road),
            };
            let HeaveRollPitch { z, phi, theta } =
                suspension.attitude_accelerations(body, &attitude, &forces);
            let (_, [speed_f, speed_r]) = suspension.roll_pitch_contact_speeds(body, &rates);
            [drag, front.mean, front.across, rear.mean, rear.across, z, phi, theta, speed_f, speed_r]
        });
        let [drag, mean_f, across_f, mean_r, across_r, z, phi, theta, speed_f, speed_r] = outputs;
        BodyLoads {
            drag,
            axles: [
                AxleLoads { mean: mean_f, across: across_f },
                AxleLoads { mean: mean_r, across: across_r },
            ],
            body_rates: Some(BodyMotion { attitude: *rates, rates: HeaveRollPitch { z, phi, theta } }),
            contact_speeds: [speed_f, speed_r],
        }
    }

    /// How the body stands while the loads of a node hold, for the start of a search.
    pub fn steady_attitude(
        &self,
        suspension: &Suspension,
        z: &NodeVariables,
        road: &RoadGeometry,
    ) -> HeaveRollPitch {
        let VehicleBody { m, l_f, l_r, h, .. } = self.body;
        let BodyLoads { drag, axles, .. } = self.quasi_steady_loads(z, road);
        let rest = self.body.static_loads();
        let linked = 0.5 * (z.F_x - drag) * suspension.pitch_centre / (l_f + l_r);
        let compression = |axle: usize, linked: f64| {
            (axles[axle].mean - 0.5 * rest[axle] + linked) / suspension.ride_stiffness[axle]
        };
        let [front, rear] = [compression(0, linked), compression(1, -linked)];
        let theta = (front - rear) / (l_f + l_r);
        let [roll_f, roll_r] = suspension.roll_centre;
        let lever = h - (l_r * roll_f + l_f * roll_r) / (l_f + l_r);
        let stiffness =
            suspension.roll_stiffness.iter().sum::<f64>() - self.pressing_force(z.v_x, road) * lever;
        HeaveRollPitch { z: theta * l_f - front, phi: m * z.a_y * lever / stiffness, theta }
    }
}

/// What the body hands on to the wheels.
struct BodyLoads<T> {
    /// Drag [N].
    drag: T,
    /// Loads of the wheels, as if each could carry less than none.
    axles: [AxleLoads<T>; 2],
    /// Rates of the motion of a body that swings.
    body_rates: Option<BodyMotion<T>>,
    /// Speeds to the left that rolling adds to the contact points of both axles [m/s].
    contact_speeds: [T; 2],
}
