//! Derives what the driver has to know of the car from its parameters: the g-g-v diagram, steady slip angles, drag.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::{Deserialize, Serialize};
use track::{Error, G, Ggv, Handling, Limits};
use vehicle::{MagicFormula, Vehicle};

/// Speeds of the diagram.
const ROWS: i32 = 60;
/// Rows of the table of slip angles.
const SLIPS: i32 = 40;
/// Share of the peak friction up to which slip angles are tabulated: at the peak itself the angle is no function of the force.
const USED: f64 = 0.98;

/// Limits of the commands, and of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limit {
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

impl Default for Limit {
    fn default() -> Self {
        Limit { v: 80.0, F_x_min: -15e3, F_x_max: 6e3, power: 250e3, delta: 0.5, delta_rate: 1.0 }
    }
}

/// Peak friction of a tire on its weaker side [-], and its slip angle there [rad].
fn peak(tire: &MagicFormula) -> (f64, f64) {
    let slip = tire.peak_slip().unwrap_or(0.5);
    let left = tire.coefficient(slip);
    let mirrored = MagicFormula { S_h: -tire.S_h, S_v: -tire.S_v, ..*tire };
    let slip = mirrored.peak_slip().unwrap_or(0.5).min(slip);
    (left.min(mirrored.coefficient(slip)), slip)
}

/// What tires and engine let the car do at each speed.
///
/// In a steady turn m a_y l_r / L acts on the front axle and m a_y l_f / L on the rear one; along the line, the axle that slides first ends it,
/// with the share of the brakes that it has and the load that the acceleration moves.
///
/// # Errors
/// When the parameters give no limits, for example without friction.
pub fn ggv(car: &Vehicle, limit: &Limit) -> Result<Ggv, Error> {
    let ([mu_f, mu_r], m) = ([peak(&car.tire_f).0, peak(&car.tire_r).0], car.body.m);
    let (L, front) = (car.body.wheelbase(), car.brake_front_share);
    let [up_f, up_r] = [mu_f, mu_r].map(|mu| mu * car.body.h / L);
    let row = |i: i32| {
        let v = limit.v * f64::from(i) / f64::from(ROWS);
        let [Z_f, Z_r] = car.body.static_loads();
        let [down_f, down_r] = car.aero.downforce(v);
        let drag = car.aero.drag(v);
        // Drag decelerates, too, and so moves load to the front.
        let moved = drag * car.body.h / L;
        let (F_f, F_r) = (mu_f * (Z_f + down_f + moved), mu_r * (Z_r + down_r - moved));
        let lateral = (mu_f * (Z_f + down_f) * L / car.body.l_r)
            .min(mu_r * (Z_r + down_r) * L / car.body.l_f);
        let brake = over(F_f, front - up_f).min(over(F_r, 1.0 - front + up_r));
        Limits {
            v,
            lateral: lateral / m,
            drive: over(F_r, 1.0 - up_r) / m,
            brake: brake.min(-limit.F_x_min) / m,
            engine: limit.F_x_max.min(limit.power / v) / m,
            drag: drag / m,
            downforce: (down_f + down_r) / m,
        }
    };
    Ggv::new((0..=ROWS).map(row).collect(), 2.0)
}

/// The force at which an axle slides, whose share of it grows by `share` less what the load gives: never, when the load
/// gives more.
fn over(force: f64, share: f64) -> f64 {
    /// Beyond all cars [N].
    const NEVER: f64 = 1e9;
    if share > 0.0 { (force / share).clamp(0.0, NEVER) } else { NEVER }
}

/// Slip angles of a steady turn.
///
/// # Errors
/// When the parameters give no friction.
pub fn handling(car: &Vehicle) -> Result<Handling, Error> {
    let body = &car.body;
    let most = [&car.tire_f, &car.tire_r]
        .map(|tire| peak(tire).0)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let angle = |tire: &MagicFormula, mu: f64| {
        let tire = MagicFormula { S_h: 0.0, S_v: 0.0, ..*tire };
        let (mut low, mut high) = (0.0, tire.peak_slip().unwrap_or(0.5));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match tire.coefficient(middle) < mu {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    };
    let row = |i: i32| {
        let mu = USED * most * f64::from(i) / f64::from(SLIPS);
        // Without downforce both axles of a steady turn use the same friction.
        [mu * G, angle(&car.tire_f, mu), angle(&car.tire_r, mu)]
    };
    let mut rows: Vec<_> = (0..=SLIPS).map(row).collect();
    rows[0] = [0.0; 3];
    Handling::tabulated(body.wheelbase(), body.l_r, rows)
}

/// Slip angle of the front tires beyond which more steering gives less force [rad].
pub fn most_front_slip(car: &Vehicle) -> f64 {
    peak(&car.tire_f).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use vehicle::Aero;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * b.abs()
    }

    #[test]
    fn limits_are_those_at_which_an_axle_slides() {
        let car = Vehicle {
            aero: Aero { C_lf: 0.4, C_lr: 0.6, ..Aero::default() },
            ..Vehicle::default()
        };
        let limits = ggv(&car, &Limit::default()).expect("limits").at(40.0);
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
        let car = Vehicle::default();
        let handling = handling(&car).expect("slip angles");
        for a_y in [3.0, 9.0, 14.0] {
            let [front, rear] = handling.slips(a_y);
            assert!((car.tire_f.coefficient(front) * G - a_y).abs() < 0.1, "{front}");
            assert!((car.tire_r.coefficient(rear) * G - a_y).abs() < 0.1, "{rear}");
        }
    }

    #[test]
    fn a_car_without_friction_is_refused() {
        let tire = MagicFormula { D: 0.0, ..MagicFormula::default() };
        let car = Vehicle { tire_f: tire, ..Vehicle::default() };
        assert!(handling(&car).is_err());
    }
}
