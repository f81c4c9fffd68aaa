//! CommonRoad's multi-body car: a sprung body, two unsprung axles that roll, heave and move sideways, and four wheels
//! (R. Wade Allen et al., "Analytical modeling of driver response in crash avoidance maneuvering", DOT HS 807 270). Axes as there: z points down.
#![allow(non_snake_case, reason = "symbols as in the documentation")]

use vehicle::G;

use crate::car::{Car, Demand};
use crate::single_track::rolling;
use crate::tires::{Contact, forces};

/// Below it wheels have no slip [m/s].
const SLOW: f64 = 0.1;

/// The motion of an axle in its own state: roll, roll rate, lateral speed, height, vertical speed.
struct Axle<'x> {
    x: &'x [f64],
    /// Where it is before the centre of gravity [m].
    at: f64,
    track: f64,
    delta: f64,
    /// Roll centre over the wheel centre [m], and how far the springs moved it to the side [m].
    raised: f64,
    aside: f64,
    name: char,
}

/// The forces of an axle: those of both wheels together along and across the body [N], the yaw moment of their difference along it
/// [N m], the springs, the lateral link, and what moves the axle itself.
struct Pushed {
    X: f64,
    Y: f64,
    N: f64,
    springs: [f64; 2],
    link: f64,
    /// Roll moment of the body from the link [N m].
    L: f64,
    /// Rates of the axle.
    rates: [f64; 5],
    /// Longitudinal forces of the wheels [N].
    F_x: [f64; 2],
    /// Lateral speed of the axle under the body [m/s].
    slides: f64,
}

impl Axle<'_> {
    /// Compression of a suspension [m] on the left (1) or right (-1) side, and its rate.
    fn compression(&self, car: &Car, x: &[f64], side: f64) -> [f64; 2] {
        let R = car.get("R_w");
        let h = car.get("h_s");
        let up = (h - R + self.x[3] - x[11]) / x[6].cos() - h + R;
        let z = up + self.at * x[8] + side * 0.5 * (x[6] - self.x[0]) * self.track;
        let rate = self.x[4] - x[12] + self.at * x[9] + side * 0.5 * (x[7] - self.x[1]) * self.track;
        [z, rate]
    }

    /// Load, longitudinal and lateral force of a wheel [N].
    fn wheel(&self, car: &Car, x: &[f64], side: f64, omega: f64) -> [f64; 3] {
        let of = |name: &str| car.get(&format!("{name}_{}", self.name));
        let R = car.get("R_w");
        let [roll, roll_rate, _, z, _] = [self.x[0], self.x[1], self.x[2], self.x[3], self.x[4]];
        let F_z = (z + R * (roll.cos() - 1.0) - side * 0.5 * self.track * roll.sin()) * car.get("K_zt");
        let v_x = x[3] + side * 0.5 * self.track * x[5];
        let v_y = x[10] + self.at * x[5];
        let along = (v_x * self.delta.cos() + v_y * self.delta.sin()).max(0.0);
        let slow = x[3].abs() < SLOW;
        let s = if slow { 0.0 } else { 1.0 - R * omega / along };
        let alpha = if slow { 0.0 } else { ((v_y - roll_rate * (R - z)) / v_x).atan() - self.delta };
        let [bump, _] = self.compression(car, x, side);
        let gamma = x[6] + side * (of("D") * bump + of("E") * bump * bump);
        let [F_x, F_y] = forces(car, Contact { s, alpha, gamma, F_z });
        [F_z, F_x, F_y]
    }

    /// All forces of the axle.
    fn pushed(&self, car: &Car, x: &[f64], omegas: [f64; 2]) -> Pushed {
        let of = |name: &str| car.get(&format!("{name}{}", self.name));
        let (R, phi) = (car.get("R_w"), x[6]);
        let (sin, cos) = self.delta.sin_cos();
        let wheels = [self.wheel(car, x, 1.0, omegas[0]), self.wheel(car, x, -1.0, omegas[1])];
        let [[Z_l, X_l, Y_l], [Z_r, X_r, Y_r]] = wheels;
        let (roll, z) = (self.x[0], self.x[3]);
        // The lateral link, which is a spring and a damper between the body and the roll centre.
        let dz = car.get("h_s") - R + z - x[11];
        let (twist, twist_rate) = (phi - roll, x[7] - self.x[1]);
        let slides = x[10] + self.at * x[5] - self.x[2];
        let stretch = dz * phi.sin() - self.aside * phi.cos() - self.raised * twist.sin();
        let rate = (dz * phi.cos() + self.aside * phi.sin()) * x[7] + (self.x[4] - x[12]) * phi.sin()
            - slides * phi.cos()
            - self.raised * twist.cos() * twist_rate;
        let link = stretch * car.get("K_ras") + rate * car.get("K_rad");
        let share = car.get(if self.name == 'f' { "b" } else { "a" }) / car.wheelbase();
        let springs = [1.0, -1.0].map(|side| {
            let [bump, bump_rate] = self.compression(car, x, side);
            0.5 * car.get("m_s") * G * share - bump * of("K_s") - bump_rate * of("K_sd")
                + side * twist * of("K_ts") / self.track
        });
        let [S_l, S_r] = springs;
        let Y = (Y_l + Y_r) * cos + (X_l + X_r) * sin;
        let half = 0.5 * self.track;
        let across = car.get("K_lt");
        let moment = half * (S_r - S_l) - link * self.raised
            + Z_l * (R * roll.sin() + half * roll.cos() - across * Y_l)
            - Z_r * (half * roll.cos() - R * roll.sin() + across * Y_r)
            - Y * (R - z);
        let m = of("m_u");
        let down = Z_l + Z_r + link * phi.sin() - (S_l + S_r) * phi.cos();
        let aside = Y - link * phi.cos() - (S_l + S_r) * phi.sin();
        Pushed {
            X: (X_l + X_r) * cos - (Y_l + Y_r) * sin,
            Y,
            N: half * ((Y_r - Y_l) * sin + (X_l - X_r) * cos),
            springs,
            link,
            L: half * (S_l - S_r) - link / phi.cos() * (dz - x_raised(self, roll)),
            rates: [self.x[1], moment / of("I_u"), aside / m - x[5] * x[3], self.x[4], G - down / m],
            F_x: [X_l, X_r],
            slides,
        }
    }
}

/// The height of the roll centre under a rolled axle [m].
fn x_raised(axle: &Axle, roll: f64) -> f64 {
    axle.raised * roll.cos()
}

/// The 29 states of the documentation.
pub fn mb(car: &Car, x: &[f64], wanted: Demand) -> Vec<f64> {
    let demand = car.limited(x[2], x[3], wanted);
    let R = car.get("R_w");
    let axle = |name: char, states, at: f64, delta: f64, aside: f64| Axle {
        x: states,
        at,
        track: car.get(&format!("T_{name}")),
        delta,
        raised: car.get(&format!("h_ra{name}")) - R,
        aside,
        name,
    };
    let front = axle('f', &x[13..18], car.get("a"), x[2], x[27]).pushed(car, x, [x[23], x[24]]);
    let rear = axle('r', &x[18..23], -car.get("b"), 0.0, x[28]).pushed(car, x, [x[25], x[26]]);
    let (a, b) = (car.get("a"), car.get("b"));
    let N = front.Y * a - rear.Y * b + front.N + rear.N;
    let (X, L) = (front.X + rear.X, front.L + rear.L);
    let (S_f, S_r): (f64, f64) = (front.springs.iter().sum(), rear.springs.iter().sum());
    let link = front.link + rear.link;
    let (sin, cos) = x[6].sin_cos();
    let [I_z, I_x, I_xz] = ["I_z", "I_Phi_s", "I_xz_s"].map(|name| car.get(name));
    let mut rates = if x[3].abs() < SLOW {
        // The roll angle stands there where the sideslip angle belongs.
        rolling(car, x, demand, x[6])[..6].to_vec()
    } else {
        let (course, v) = ((x[10] / x[3]).atan() + x[4], x[3].hypot(x[10]));
        let yaw = (N + I_xz / I_x * L) / (I_z - I_xz * I_xz / I_x);
        let speed = X / car.get("m") + x[5] * x[10];
        vec![course.cos() * v, course.sin() * v, demand.steer, speed, x[5], yaw]
    };
    let m_s = car.get("m_s");
    let pitch = (a * S_f - b * S_r + X * (car.get("h_s") - x[11])) / car.get("I_y_s");
    rates.extend([
        x[7],
        (I_xz / I_z * N + L) / (I_x - I_xz * I_xz / I_z),
        x[9],
        pitch,
        (link * cos + (S_f + S_r) * sin) / m_s - x[5] * x[3],
        x[12],
        G - ((S_f + S_r) * cos - link * sin) / m_s,
    ]);
    rates.extend(front.rates.iter().chain(&rear.rates));
    let torques = car.torques(demand.a);
    for (place, F_x) in front.F_x.iter().chain(&rear.F_x).enumerate() {
        let rate = (0.5 * torques[place / 2] - R * F_x) / car.get("I_y_w");
        rates.push(if x[23 + place] < 0.0 { 0.0 } else { rate });
    }
    rates.extend([front.slides, rear.slides]);
    rates
}
