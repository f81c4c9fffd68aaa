//! What can predict a drive, and the two models that need no tires.

use crate::drive::EvenDrive;
use crate::lag::first_order_lag;

/// Velocity to the left [m/s] and yaw rate [rad/s].
pub type LateralState = [f64; 2];

/// A model that predicts lateral motion from measured speed and steering.
pub trait MotionPredictor: Sync {
    /// For people.
    fn name(&self) -> &str;

    /// Time constant with which the road wheels follow the recorded steering angle [s].
    fn steering_lag(&self) -> f64 {
        0.0
    }

    /// The steering angle of the road wheels [rad], one for each row: what the model makes of the recorded one.
    fn road_wheel_angles(&self, drive: &EvenDrive) -> Vec<f64> {
        first_order_lag(&drive.motion.delta, self.steering_lag(), drive.step)
    }

    /// The states at `start` and the `rows` after it. It begins with the measured state; after it, it sees speed and steering alone.
    /// What the drive says before `start` may be used.
    fn simulate_states(
        &self,
        drive: &EvenDrive,
        steering: &[f64],
        start: usize,
        rows: usize,
    ) -> Vec<LateralState>;

    /// The lateral acceleration [m/s²] in a row from its measured state; of a model without forces none.
    fn a_y(&self, drive: &EvenDrive, steering: &[f64], row: usize) -> Option<f64>;

    /// Standard deviations of [`MotionPredictor::simulate_states`] at the same instants, where the model says any.
    fn state_stds(&self, _drive: &EvenDrive, _start: usize, _rows: usize) -> Option<Vec<LateralState>> {
        None
    }

    /// The model along one drive, if it learns from the past of it. Then that is asked in its place.
    fn adapted_to_drive<'a>(&'a self, _drive: &EvenDrive) -> Option<Box<dyn MotionPredictor + 'a>> {
        None
    }

    /// Standard deviation of [`MotionPredictor::a_y`] [m/s²], where the model says any.
    fn a_y_std(&self, _drive: &EvenDrive, _row: usize) -> Option<f64> {
        None
    }
}

/// Nothing changes.
#[derive(Clone, Copy, Debug)]
pub struct PersistenceModel;

impl MotionPredictor for PersistenceModel {
    fn name(&self) -> &str {
        "persistence"
    }

    fn simulate_states(&self, drive: &EvenDrive, _: &[f64], start: usize, rows: usize) -> Vec<LateralState> {
        vec![[drive.motion.v_y[start], drive.motion.r[start]]; rows + 1]
    }

    fn a_y(&self, _: &EvenDrive, _: &[f64], _: usize) -> Option<f64> {
        None
    }
}

/// Wheels go where they point: r = v_x tan δ / L, v_y = l_r r.
#[derive(Clone, Copy, Debug)]
pub struct KinematicModel {
    /// Distance between the axles [m].
    pub wheelbase: f64,
    /// Distance of the rear axle behind the centre of gravity [m].
    pub l_r: f64,
    /// Time constant of the steering [s].
    pub steering_lag: f64,
}

impl MotionPredictor for KinematicModel {
    fn name(&self) -> &str {
        "kinematic"
    }

    fn steering_lag(&self) -> f64 {
        self.steering_lag
    }

    fn simulate_states(
        &self,
        drive: &EvenDrive,
        steering: &[f64],
        start: usize,
        rows: usize,
    ) -> Vec<LateralState> {
        let state = |row: usize| {
            let r = drive.motion.v_x[row] * steering[row].tan() / self.wheelbase;
            [self.l_r * r, r]
        };
        let first = [drive.motion.v_y[start], drive.motion.r[start]];
        std::iter::once(first).chain((start + 1..=start + rows).map(state)).collect()
    }

    fn a_y(&self, _: &EvenDrive, _: &[f64], _: usize) -> Option<f64> {
        None
    }
}
