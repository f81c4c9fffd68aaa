//! The parameters of CommonRoad's cars, and the limits of their inputs.

use std::collections::HashMap;

use libtest_mimic::Failed;
use serde_json::Value;
use vehicle::VehicleBody;

/// Parameters of a car by their names in the documentation, such as `m` or `tire.p_cx1`.
pub struct Car(HashMap<String, f64>);

/// Steering rate [rad/s] and acceleration [m/s2].
#[derive(Clone, Copy)]
pub struct Demand {
    pub steer: f64,
    pub a: f64,
}

impl Car {
    pub fn new(all: &Value, number: &str) -> Result<Self, Failed> {
        let car = all["vehicles"][number].as_object().ok_or_else(|| format!("no vehicle {number}"))?;
        let mut values = HashMap::new();
        for (name, value) in car {
            let inner = value.as_object().into_iter().flatten();
            let inner = inner.filter_map(|(key, value)| Some((format!("{name}.{key}"), value.as_f64()?)));
            values.extend(inner.chain(value.as_f64().map(|value| (name.clone(), value))));
        }
        Ok(Car(values))
    }

    /// A parameter; not a number, so that no comparison holds, without one.
    pub fn get(&self, name: &str) -> f64 {
        self.0.get(name).copied().unwrap_or(f64::NAN)
    }

    pub fn wheelbase(&self) -> f64 {
        self.get("a") + self.get("b")
    }

    /// Masses and lengths, with the height at which ST and STD transfer load.
    pub fn body(&self) -> VehicleBody {
        VehicleBody {
            m: self.get("m"),
            I_zz: self.get("I_z"),
            l_f: self.get("a"),
            l_r: self.get("b"),
            h: self.get("h_s"),
        }
    }

    /// The inputs within their limits: the engine's power bounds the acceleration above `v_switch`.
    pub fn limited(&self, delta: f64, v: f64, wanted: Demand) -> Demand {
        let of = |name: &str| self.get(name);
        let within = |value: f64, low: f64, high: f64| value.max(low).min(high);
        let stops = |at: f64, low: f64, high: f64, rate: f64| {
            (at <= low && rate <= 0.0) || (at >= high && rate >= 0.0)
        };
        let steer = match stops(delta, of("steering.min"), of("steering.max"), wanted.steer) {
            true => 0.0,
            false => within(wanted.steer, of("steering.v_min"), of("steering.v_max")),
        };
        let (a_max, v_switch) = (of("longitudinal.a_max"), of("longitudinal.v_switch"));
        let most = if v > v_switch { a_max * v_switch / v } else { a_max };
        let a = match stops(v, of("longitudinal.v_min"), of("longitudinal.v_max"), wanted.a) {
            true => 0.0,
            false => within(wanted.a, -a_max, most),
        };
        Demand { steer, a }
    }

    /// Torques at the front and the rear axle [N m] for an acceleration [m/s2].
    pub fn torques(&self, a: f64) -> [f64; 2] {
        let torque = self.get("m") * self.get("R_w") * a;
        let front = self.get(if a > 0.0 { "T_se" } else { "T_sb" });
        [front * torque, (1.0 - front) * torque]
    }
}
