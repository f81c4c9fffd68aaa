//! Computes the g-g-v diagram, the steady-state slip angles and the drag of the car from its parameters.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use fmu_export::{log, warn};
use serde::{Deserialize, Serialize};
use tire_file::TireSpecification;
use track::{AccelerationLimits, Error, GgvDiagram, SteadyStateHandling};
use vehicle::{Aerodynamics, G, MagicFormula, SingleTrackCar, VehicleBody};

use crate::axle::TireAxle;

/// Speeds of the diagram.
const ROWS: i32 = 60;
/// Rows of the table of slip angles.
const SLIPS: i32 = 40;
/// Share of the peak friction up to which slip angles are tabulated: at the peak itself the angle is no function of the force.
const USED: f64 = 0.98;

/// Limits of the commands and of the engine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CommandLimits {
    /// Highest speed [m/s].
    pub v: f64,
    /// Strongest braking [N].
    pub F_x_min: f64,
    /// Strongest driving [N].
    pub F_x_max: f64,
    /// Power of the engine at the wheels [W].
    pub power: f64,
    /// Largest road-wheel angle [rad].
    pub delta: f64,
    /// Fastest change of the road-wheel angle [rad/s].
    pub delta_rate: f64,
}

impl Default for CommandLimits {
    fn default() -> Self {
        CommandLimits { v: 80.0, F_x_min: -15e3, F_x_max: 6e3, power: 250e3, delta: 0.5, delta_rate: 1.0 }
    }
}

/// Parameters of the car that the driver plans with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriverCar {
    /// Mass and lengths.
    pub body: VehicleBody,
    /// Drag and downforce.
    pub aero: Aerodynamics,
    /// Share of the brakes at the front axle [-].
    pub brake_front_share: f64,
    /// Tires of both axles without a file.
    pub plain: [MagicFormula; 2],
    /// Tires of both axles by files.
    pub files: [TireSpecification; 2],
    /// Track widths of both axles [m]; without one no load moves across.
    pub tracks: [f64; 2],
    /// Roll stiffness of both axles [N m/rad], by which they share the load that moves across; without one by the load.
    pub roll_stiffness: [f64; 2],
}

impl Default for DriverCar {
    fn default() -> Self {
        let SingleTrackCar { body, aero, brake_front_share, tire_f, tire_r, .. } = SingleTrackCar::default();
        DriverCar {
            body,
            aero,
            brake_front_share,
            plain: [tire_f, tire_r],
            files: <[TireSpecification; 2]>::default(),
            tracks: [0.0; 2],
            roll_stiffness: [0.0; 2],
        }
    }
}

impl DriverCar {
    /// The tires of both axles.
    ///
    /// # Errors
    /// In words, when a file cannot be read or is no tire.
    pub fn build_axles(&self) -> Result<[TireAxle; 2], String> {
        if self.files.iter().all(|file| file.tir.is_empty()) {
            return Ok(self.plain.map(TireAxle::from_magic_formula));
        }
        let [front, rear] = &self.files;
        let [(front, told_f), (rear, told_r)] =
            [front.load_tire("tire_f.tir")?, rear.load_tire("tire_r.tir")?];
        told_f.into_iter().chain(told_r).for_each(|message| message.send_to_log(log, warn));
        Ok([TireAxle::from_tire_file(front), TireAxle::from_tire_file(rear)])
    }

    /// The load that a lateral acceleration [m/s2] moves from one wheel of each axle to the other [N].
    fn load_transfer(&self, a_y: f64) -> [f64; 2] {
        let DriverCar { body, tracks, roll_stiffness: [k_f, k_r], .. } = self;
        let front = if k_f + k_r > 0.0 { k_f / (k_f + k_r) } else { body.l_r / body.wheelbase() };
        let across = body.m * a_y.abs() * body.h;
        let of = |share: f64, track: f64| if track > 0.0 { share * across / track } else { 0.0 };
        [of(front, tracks[0]), of(1.0 - front, tracks[1])]
    }

    /// The largest lateral acceleration [m/s2] with these loads of the axles [N], by which both find their share of
    /// m a_y: fixed-point iteration, since the load that moves across costs grip.
    fn max_lateral_acceleration(&self, axles: &[TireAxle; 2], loads: [f64; 2]) -> f64 {
        /// A step of the iteration changes the result by some hundredths of the one before.
        const PASSES: usize = 12;
        let VehicleBody { m, l_f, l_r, .. } = self.body;
        let shares = [l_r, l_f].map(|lever| m * lever / (l_f + l_r));
        (0..PASSES).fold(0.0, |a_y, _| {
            let moved = self.load_transfer(a_y);
            let of = |i: usize| axles[i].lateral_peak(loads[i], moved[i]).force / shares[i];
            of(0).min(of(1))
        })
    }
}

/// The g-g-v diagram: what tires and engine let the car do at each speed.
///
/// In a steady turn m a_y l_r / L acts on the front axle and m a_y l_f / L on the rear one; along the line, the axle that slides first ends it,
/// with the share of the brakes that it has and the load that the acceleration moves.
///
/// # Errors
/// When the parameters give no limits, for example without friction.
pub fn ggv_diagram(
    car: &DriverCar,
    axles: &[TireAxle; 2],
    limit: &CommandLimits,
) -> Result<GgvDiagram, Error> {
    let (m, L, front) = (car.body.m, car.body.wheelbase(), car.brake_front_share);
    let lever = car.body.h / L;
    let row = |i: i32| {
        let v = limit.v * f64::from(i) / f64::from(ROWS);
        let [Z_f, Z_r] = car.body.static_loads();
        let [down_f, down_r] = car.aero.downforce(v);
        let drag = car.aero.drag(v);
        // Drag decelerates, too, and so moves load to the front.
        let moved = drag * lever;
        let loads = [Z_f + down_f, Z_r + down_r];
        let along = [loads[0] + moved, loads[1] - moved];
        let lateral = car.max_lateral_acceleration(axles, loads);
        let drive = converged_force(|force| {
            let mu = axles[1].longitudinal_friction(along[1] + force * lever);
            sliding_force(mu * along[1], 1.0 - mu * lever)
        });
        let brake = converged_force(|force| {
            let [mu_f, mu_r] = [
                axles[0].longitudinal_friction(along[0] + force * lever),
                axles[1].longitudinal_friction(along[1] - force * lever),
            ];
            sliding_force(mu_f * along[0], front - mu_f * lever)
                .min(sliding_force(mu_r * along[1], 1.0 - front + mu_r * lever))
        });
        AccelerationLimits {
            v,
            lateral,
            drive: drive / m,
            brake: brake.min(-limit.F_x_min) / m,
            engine: limit.F_x_max.min(limit.power / v) / m,
            drag: drag / m,
            downforce: (down_f + down_r) / m,
        }
    };
    GgvDiagram::new((0..=ROWS).map(row).collect(), 2.0)
}

/// A force that depends on the friction at the loads that it makes: friction changes little with load, so few passes do.
fn converged_force(force: impl Fn(f64) -> f64) -> f64 {
    (0..4).fold(0.0, |last, _| force(last))
}

/// The force at which an axle slides, whose share of it grows by `share` less what the load gives: never, when the load
/// gives more.
fn sliding_force(force: f64, share: f64) -> f64 {
    /// Beyond all cars [N].
    const NEVER: f64 = 1e9;
    if share > 0.0 { (force / share).clamp(0.0, NEVER) } else { NEVER }
}

/// Slip angles of a steady turn without downforce.
///
/// # Errors
/// When the parameters give no friction.
pub fn steady_state_handling(car: &DriverCar, axles: &[TireAxle; 2]) -> Result<SteadyStateHandling, Error> {
    let (body, loads) = (&car.body, car.body.static_loads());
    let most = USED * car.max_lateral_acceleration(axles, loads);
    let row = |i: i32| {
        let a_y = most * f64::from(i) / f64::from(SLIPS);
        let moved = car.load_transfer(a_y);
        let angle = |axle: usize| {
            let force = loads[axle] / G * a_y;
            axles[axle].slip_angle_for_force(force, loads[axle], moved[axle])
        };
        [a_y, angle(0), angle(1)]
    };
    let mut rows: Vec<_> = (0..=SLIPS).map(row).collect();
    rows[0] = [0.0; 3];
    SteadyStateHandling::with_slip_angle_table(body.wheelbase(), body.l_r, rows)
}

/// Slip angle of the front tires beyond which more steering gives less force [rad].
pub fn peak_front_slip(car: &DriverCar, axles: &[TireAxle; 2]) -> f64 {
    axles[0].lateral_peak(car.body.static_loads()[0], 0.0).slip_angle
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * b.abs()
    }

    #[test]
    fn limits_are_those_at_which_an_axle_slides() {
        let car = DriverCar {
            aero: Aerodynamics { C_lf: 0.4, C_lr: 0.6, ..Aerodynamics::default() },
            ..DriverCar::default()
        };
        let axles = car.build_axles().expect("tires");
        let limits =
            ggv_diagram(&car, &axles, &CommandLimits::default()).expect("limits").limits_at_speed(40.0);
        let body = car.body;
        let (down, drag) = (car.aero.downforce(40.0), car.aero.drag(40.0));
        // Driving: the rear axle gives all of its load times its friction.
        let F_x = limits.drive * body.m;
        let [_, rear] = body.axle_loads(down, F_x - drag, 0.0, 0.0);
        assert!(close(F_x, 1.6 * rear), "{F_x} {rear}");
        // Braking: one axle does, the other one has something left.
        let F_x = -limits.brake * body.m;
        let loads = body.axle_loads(down, F_x - drag, 0.0, 0.0);
        let used = [0.6 * -F_x / loads[0], 0.4 * -F_x / loads[1]];
        assert!(close(used[0].max(used[1]), 1.6), "{used:?}");
        assert!(close(limits.engine, 6000.0 / body.m) && close(limits.drag, drag / body.m));
    }

    #[test]
    fn steady_slip_angles_give_the_lateral_forces() {
        let car = DriverCar::default();
        let handling = steady_state_handling(&car, &car.build_axles().expect("tires")).expect("slip angles");
        for a_y in [3.0, 9.0, 14.0] {
            let [front, rear] = handling.steady_slip_angles(a_y);
            assert!((car.plain[0].friction_coefficient(front) * G - a_y).abs() < 0.1, "{front}");
            assert!((car.plain[1].friction_coefficient(rear) * G - a_y).abs() < 0.1, "{rear}");
        }
    }

    #[test]
    fn a_car_without_friction_is_refused() {
        let tire = MagicFormula { D: 0.0, ..MagicFormula::default() };
        let car = DriverCar { plain: [tire, MagicFormula::default()], ..DriverCar::default() };
        assert!(steady_state_handling(&car, &car.build_axles().expect("tires")).is_err());
    }

    #[test]
    fn load_that_moves_across_costs_grip_of_tires_with_load_sensitivity() {
        let file = TireSpecification {
            LMUX: 1.0,
            tir: include_str!("../../../scenarios/cars/sport/front.tir").to_owned().into(),
            ..TireSpecification::default()
        };
        let narrow = DriverCar {
            files: [file.clone(), file],
            tracks: [1.5; 2],
            body: VehicleBody { h: 0.5, ..DriverCar::default().body },
            ..DriverCar::default()
        };
        let single = DriverCar { tracks: [0.0; 2], ..narrow.clone() };
        let lateral = |car: &DriverCar| {
            ggv_diagram(car, &car.build_axles().expect("tires"), &CommandLimits::default())
                .expect("limits")
                .limits_at_speed(0.0)
                .lateral
        };
        let (narrow, single) = (lateral(&narrow), lateral(&single));
        assert!(narrow < 0.99 * single && narrow > 0.8 * single, "{narrow} {single}");
    }
}
