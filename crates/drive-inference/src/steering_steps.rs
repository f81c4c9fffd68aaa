//! Finds the steps in which a steering angle was recorded, and how much of the noise they are.

use preparation::Drive;
use tire_inference::model::FitTest;
use vehicle::SingleTrackCar;

use crate::likelihood::DriveUnknowns;

/// Share of rows that repeat the angle before from which on steps are coarse.
const REPEATED: f64 = 0.05;
/// Share of a step by which angles may be off it.
const ROUNDING: f64 = 0.02;
/// Standard deviation of what steps do to a_y, over that of its noise, above which their errors, which are not white, bend the tires.
const MATTERS: f64 = 0.5;

/// Name of the test.
pub const STEERING_STEPS: &str = "steering_steps";

/// The step of a grid on which all steering angles lie [rad]. `None` where they lie on none that is coarse.
fn steering_step(recordings: &[Drive]) -> Option<f64> {
    let changes = || {
        let pairs = recordings.iter().flat_map(|drive| drive.delta.windows(2));
        pairs.map(|pair| (pair[1] - pair[0]).abs())
    };
    let largest = changes().fold(0.0, f64::max);
    let is_change = |change: &f64| *change > 1e-9 * largest;
    let step = changes().filter(is_change).fold(f64::INFINITY, f64::min);
    let repeated = changes().filter(|change| !is_change(change)).count() as f64;
    let is_on_grid = |change: f64| {
        let steps = change / step;
        (steps - steps.round()).abs() < ROUNDING * steps.max(1.0)
    };
    let coarse = repeated > REPEATED * changes().count() as f64;
    (step.is_finite() && coarse && changes().filter(is_change).all(is_on_grid)).then_some(step)
}

/// The test whether such steps matter beside the noise of a_y.
pub fn steering_step_test(recordings: &[Drive], car: &SingleTrackCar, at: &DriveUnknowns) -> FitTest {
    let step = steering_step(recordings).unwrap_or(0.0);
    let [load, _] = car.body.static_loads();
    let a_y = at.tires.front.stiffness() * load / car.body.m * step / 12_f64.sqrt();
    FitTest {
        name: STEERING_STEPS.to_owned(),
        statistic: a_y / at.noise.sensor[3],
        limit: MATTERS,
        sentence: format!(
            "The steering angle is recorded in steps of {:.2} deg: their errors are {a_y:.2} m/s² of a_y, beside a noise of {:.2} m/s².",
            step.to_degrees(),
            at.noise.sensor[3]
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(delta: impl Fn(f64) -> f64) -> Vec<Drive> {
        let t: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let delta = t.iter().map(|t| delta(*t)).collect();
        vec![Drive { t, delta, ..Drive::default() }]
    }

    #[test]
    fn a_grid_is_found_and_a_held_angle_is_none() {
        let angle = |t: f64| 0.1 * (2.0 * t).sin() + 0.03 * (5.0 * t).sin();
        assert_eq!(steering_step(&drive(angle)), None);
        let found = steering_step(&drive(|t| (angle(t) / 0.01).round() * 0.01)).expect("a grid");
        assert!((found - 0.01).abs() < 1e-6, "{found}");
        // A new value each fifth row.
        assert_eq!(steering_step(&drive(|t| angle((t * 20.0).floor() / 20.0))), None);
    }
}
