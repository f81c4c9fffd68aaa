//! Open-loop predictions from many instants of a drive.

use rayon::prelude::*;

use crate::drive::EvenDrive;
use crate::predictor::{LateralState, MotionPredictor};

/// Time between two starts [s].
const EVERY: f64 = 0.5;

/// One prediction and what happened.
#[derive(Clone, Debug)]
pub struct Rollout {
    /// Its first row.
    pub start: usize,
    /// Predicted states, that of the start first.
    pub predicted: Vec<LateralState>,
    /// Standard deviations of them, where the model says any.
    pub spread: Option<Vec<LateralState>>,
    /// Distance between both displacements at the end [m].
    pub distance: f64,
}

/// The rows at which predictions over `horizon` [s] start: all their rows count. Also the number of rows ahead.
#[must_use]
pub fn prediction_starts(drive: &EvenDrive, horizon: f64) -> (Vec<usize>, usize) {
    let ahead = (horizon / drive.step).round() as usize;
    let mut wrong = vec![0_usize];
    wrong.extend(drive.counts.iter().scan(0, |sum, counts| {
        *sum += usize::from(!counts);
        Some(*sum)
    }));
    let at = (0..).map(|k| (f64::from(k) * EVERY / drive.step).round() as usize);
    let fits = |start: &usize| start + ahead + 1 < drive.row_count();
    let starts = at.take_while(fits).filter(|start| wrong[start + ahead + 1] == wrong[*start]);
    (starts.collect(), ahead)
}

/// All predictions of a model over `horizon` [s].
#[must_use]
pub fn simulate_rollouts(model: &dyn MotionPredictor, drive: &EvenDrive, horizon: f64) -> Vec<Rollout> {
    let (starts, ahead) = prediction_starts(drive, horizon);
    let along = model.adapted_to_drive(drive);
    let model = along.as_deref().unwrap_or(model);
    let steering = model.road_wheel_angles(drive);
    let roll = |start: &usize| {
        let start = *start;
        let predicted = model.simulate_states(drive, &steering, start, ahead);
        let spread = model.state_stds(drive, start, ahead);
        let measured: Vec<LateralState> =
            (start..=start + ahead).map(|row| [drive.motion.v_y[row], drive.motion.r[row]]).collect();
        let v_x = &drive.motion.v_x[start..=start + ahead];
        let [a, b] = [&predicted, &measured].map(|states| displacement(v_x, states, drive.step));
        Rollout { start, predicted, spread, distance: (a[0] - b[0]).hypot(a[1] - b[1]) }
    };
    starts.par_iter().map(roll).collect()
}

/// The displacement [m] along the first row's axes, by the trapezoidal rule.
fn displacement(v_x: &[f64], states: &[LateralState], step: f64) -> [f64; 2] {
    let mut yaw = 0.0;
    let mut last: Option<(f64, [f64; 2])> = None;
    let mut sum = [0.0; 2];
    for (v_x, [v_y, r]) in v_x.iter().zip(states) {
        if let Some((r_before, _)) = last {
            yaw += 0.5 * step * (r_before + r);
        }
        let (sin, cos) = f64::sin_cos(yaw);
        let velocity = [v_x * cos - v_y * sin, v_x * sin + v_y * cos];
        if let Some((_, before)) = last {
            for (sum, (a, b)) in sum.iter_mut().zip(before.iter().zip(velocity)) {
                *sum += 0.5 * step * (a + b);
            }
        }
        last = Some((*r, velocity));
    }
    sum
}

#[cfg(test)]
mod tests {
    use preparation::Drive;

    use super::*;
    use crate::predictor::PersistenceModel;

    fn circle() -> EvenDrive {
        let n = 1000;
        EvenDrive {
            step: 0.01,
            counts: vec![true; n as usize],
            motion: Drive {
                t: (0..n).map(|i| f64::from(i) * 0.01).collect(),
                v_x: vec![2.0; n as usize],
                v_y: vec![0.1; n as usize],
                r: vec![0.5; n as usize],
                delta: vec![0.1; n as usize],
                ..Drive::default()
            },
            ..EvenDrive::default()
        }
    }

    #[test]
    fn persistence_is_right_in_a_steady_circle() {
        let found = simulate_rollouts(&PersistenceModel, &circle(), 3.0);
        assert_eq!(found.len(), 14);
        assert!(found.iter().all(|rollout| rollout.distance == 0.0));
        let [x, y] = displacement(&vec![2.0; 158], &vec![[0.0, 2.0]; 158], 0.01);
        // Half a circle of radius 1 m.
        assert!((x - 0.0).abs() < 4e-3 && (y - 2.0).abs() < 1e-3, "{x} {y}");
    }

    #[test]
    fn rows_that_do_not_count_are_not_driven_through() {
        let mut drive = circle();
        drive.counts[500] = false;
        let (starts, ahead) = prediction_starts(&drive, 3.0);
        assert_eq!(ahead, 300);
        assert!(starts.iter().all(|start| !(*start..=start + ahead).contains(&500)));
        assert_eq!(starts, [0, 50, 100, 150, 550, 600, 650]);
    }
}
