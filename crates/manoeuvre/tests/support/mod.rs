//! A linear car whose answers are known in closed form, and the loop that lets a driver drive it.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::sync::Arc;

use manoeuvre::kind::ManoeuvreKind;
use manoeuvre::{
    Channel, CharacteristicValues, CommonParameters, Direction, Manoeuvre, ManoeuvreDriver, ManoeuvreLog,
    PathFollower, SpeedController,
};

/// The linear single-track car: lateral forces are proportional to slip angles.
#[derive(Debug, Clone, Copy)]
pub struct Car {
    pub m: f64,
    pub I_zz: f64,
    pub l_f: f64,
    pub l_r: f64,
    pub C_f: f64,
    pub C_r: f64,
    /// Drag for the square of the speed [kg/m].
    pub drag: f64,
    /// X, Y, psi, v_x, v_y, r.
    pub state: [f64; 6],
}

#[allow(dead_code, reason = "each file of tests uses a part")]
impl Car {
    pub fn new(v_x: f64) -> Self {
        Car {
            m: 1500.0,
            I_zz: 2500.0,
            l_f: 1.2,
            l_r: 1.5,
            C_f: 90e3,
            C_r: 110e3,
            drag: 0.4,
            state: [0.0, 0.0, 0.0, v_x, 0.0, 0.0],
        }
    }

    pub fn wheelbase(&self) -> f64 {
        self.l_f + self.l_r
    }

    /// m / L (l_r / C_f - l_f / C_r) [rad.s2/m].
    pub fn understeer_gradient(&self) -> f64 {
        self.m / self.wheelbase() * (self.l_r / self.C_f - self.l_f / self.C_r)
    }

    /// Derivatives of the state, and the lateral acceleration.
    fn motion(&self, s: [f64; 6], steer: f64, drive: f64) -> ([f64; 6], f64) {
        let [_, _, psi, v_x, v_y, r] = s;
        let v = v_x.max(1.0);
        let F_f = self.C_f * (steer - (v_y + self.l_f * r) / v);
        let F_r = -self.C_r * (v_y - self.l_r * r) / v;
        let a_y = (F_f + F_r) / self.m;
        let (sin, cos) = psi.sin_cos();
        let place = [v_x * cos - v_y * sin, v_x * sin + v_y * cos, r];
        // The speed is a state of its own: no force of the steering slows it.
        let a_x = (drive - self.drag * v_x * v_x.abs()) / self.m;
        let r_dot = (self.l_f * F_f - self.l_r * F_r) / self.I_zz;
        ([place[0], place[1], place[2], a_x, a_y - v_x * r, r_dot], a_y)
    }

    pub fn advance(&mut self, steer: f64, drive: f64, h: f64) {
        let (s, n) = (self.state, 10);
        let step = h / f64::from(n);
        let add = |a: [f64; 6], b: [f64; 6], f: f64| {
            let mut sum = a;
            sum.iter_mut().zip(b).for_each(|(a, b)| *a += f * b);
            sum
        };
        let f = |s| self.motion(s, steer, drive).0;
        let one = |s: [f64; 6]| {
            let k1 = f(s);
            let k2 = f(add(s, k1, step / 2.0));
            let k3 = f(add(s, k2, step / 2.0));
            let k4 = f(add(s, k3, step));
            let sum = add(add(k1, k2, 2.0), add(k4, k3, 2.0), 1.0);
            add(s, sum, step / 6.0)
        };
        self.state = (0..n).fold(s, |s, _| one(s));
    }

    /// A variable as it is measured, with the steering of the moment.
    pub fn measured(&self, channel: Channel, steer: f64) -> f64 {
        let [X, Y, psi, v_x, v_y, r] = self.state;
        match channel {
            Channel::ForwardSpeed => v_x,
            Channel::SideSpeed => v_y,
            Channel::YawRate => r,
            Channel::LateralAcceleration => self.motion(self.state, steer, 0.0).1,
            Channel::East => X,
            Channel::North => Y,
            Channel::Heading => psi,
        }
    }
}

pub fn common(entry_speed: f64) -> CommonParameters {
    CommonParameters {
        entry_speed,
        speed_tolerance: 0.3,
        settle: 1.0,
        direction: Direction::Left,
        wheelbase: Some(2.7),
        speed_controller: SpeedController::default(),
        path_follower: PathFollower::default(),
        step: 0.01,
        seed: 1,
    }
}

pub fn manoeuvre(common: CommonParameters, kind: impl ManoeuvreKind + 'static) -> Arc<Manoeuvre> {
    let manoeuvre = Manoeuvre { common, kind: Arc::new(kind) };
    manoeuvre.check_parameters().expect("a sound manoeuvre");
    Arc::new(manoeuvre)
}

/// Drives the manoeuvre until `stop` [s], and gives the log of the test.
///
/// # Errors
/// When the test did not take place.
pub fn log(manoeuvre: &Arc<Manoeuvre>, mut car: Car, stop: f64) -> Result<ManoeuvreLog, String> {
    let (mut driver, h) = (ManoeuvreDriver::new(Arc::clone(manoeuvre)), manoeuvre.common.step);
    let channels = manoeuvre.kind.required_channels();
    let (mut time, mut commands, mut inputs) =
        (Vec::new(), [const { Vec::new() }; 3], vec![Vec::new(); channels.len()]);
    let mut steer = 0.0;
    for k in 0..=(stop / h).round() as u32 {
        let t = f64::from(k) * h;
        let measured: Vec<f64> = channels.iter().map(|channel| car.measured(*channel, steer)).collect();
        let outputs = driver.step_commands(t, &measured);
        assert!(outputs.iter().all(|it| it.is_finite()), "{outputs:?} at {t} s");
        time.push(t);
        inputs.iter_mut().zip(&measured).for_each(|(list, value)| list.push(*value));
        commands.iter_mut().zip(outputs).for_each(|(list, value)| list.push(value));
        steer = outputs[0];
        car.advance(outputs[0], outputs[1], h);
    }
    let [steer, drive, phase] = &commands;
    manoeuvre.test_log(&time, [steer, drive, phase], &inputs)
}

/// The characteristic values.
///
/// # Errors
/// When the test did not take place.
pub fn values(manoeuvre: &Arc<Manoeuvre>, car: Car, stop: f64) -> Result<CharacteristicValues, String> {
    let log = log(manoeuvre, car, stop)?;
    let values = manoeuvre.kind.characteristic_values(&manoeuvre.common, &log)?;
    let names: Vec<_> = values.0.iter().map(|(name, _)| *name).collect();
    let known: Vec<_> = manoeuvre.kind.value_descriptions().iter().map(|known| known.name).collect();
    assert_eq!(names, known, "{}", manoeuvre.kind.kind_title());
    Ok(values)
}
