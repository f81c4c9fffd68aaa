//! Numbers for how well a model predicts a drive.

use serde::Serialize;

use crate::drive::EvenDrive;
use crate::predictor::MotionPredictor;
use crate::rollout::{Rollout, simulate_rollouts};

/// Lateral acceleration from measured states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LateralScore {
    /// Root mean square error [m/s²].
    pub rmse: f64,
    /// Its 95 % interval, from blocks of rows.
    pub rmse_interval: Option<[f64; 2]>,
    /// Mean of predicted minus measured [m/s²].
    pub bias: f64,
    /// Share inside the 95 % band, where the model has one.
    pub coverage: Option<f64>,
    /// Share inside the 50 % band.
    pub coverage_half: Option<f64>,
    /// Rows.
    pub rows: usize,
}

/// Open-loop predictions over one horizon.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RolloutScore {
    /// Horizon [s].
    pub horizon: f64,
    /// Root mean square error of v_y after the start [m/s].
    pub v_y: f64,
    /// That of the yaw rate [rad/s].
    pub r: f64,
    /// Root mean square distance at the end [m].
    pub position: f64,
    /// The 95 % intervals of these three, from blocks of predictions.
    pub intervals: Option<[[f64; 2]; 3]>,
    /// Share of the predictions that end in a spin: v_y is wrong by more than a quarter of the speed.
    pub spun: f64,
    /// Shares of v_y and yaw rate inside their 95 % bands, where the model has them.
    pub coverage: Option<[f64; 2]>,
    /// Shares inside their 50 % bands.
    pub coverage_half: Option<[f64; 2]>,
    /// Predictions.
    pub count: usize,
}

/// Half widths of bands that hold 95 % and 50 % of a normal distribution, in standard deviations.
pub const BAND: [f64; 2] = [1.959_964, 0.674_490];

/// Scores a model on the rows that count; none without forces or rows.
#[must_use]
pub fn score_lateral_acceleration(model: &dyn MotionPredictor, drives: &[EvenDrive]) -> Option<LateralScore> {
    let mut errors = Vec::new();
    let mut inside = [0_usize; 2];
    let mut banded = 0_usize;
    for drive in drives {
        let along = model.adapted_to_drive(drive);
        let model = along.as_deref().unwrap_or(model);
        let steering = model.road_wheel_angles(drive);
        for row in (0..drive.row_count()).filter(|row| drive.counts[*row]) {
            let error = model.a_y(drive, &steering, row)? - drive.motion.a_y[row];
            if let Some(spread) = model.a_y_std(drive, row) {
                banded += 1;
                for (inside, band) in inside.iter_mut().zip(BAND) {
                    *inside += usize::from(error.abs() < band * spread);
                }
            }
            errors.push(error);
        }
    }
    let rows = errors.len();
    let share = |inside: usize| (banded > 0).then(|| inside as f64 / banded as f64);
    let squares: Vec<f64> = errors.iter().map(|error| error * error).collect();
    (rows > 0).then(|| LateralScore {
        rmse: mean(&squares).sqrt(),
        rmse_interval: rms_interval(&squares),
        bias: mean(&errors),
        coverage: share(inside[0]),
        coverage_half: share(inside[1]),
        rows,
    })
}

/// Scores the open-loop predictions over `horizon` [s]; none if no stretch is as long.
#[must_use]
pub fn open_loop(model: &dyn MotionPredictor, drives: &[EvenDrive], horizon: f64) -> Option<RolloutScore> {
    let mut sums = RolloutErrorSums::default();
    for drive in drives {
        simulate_rollouts(model, drive, horizon).iter().for_each(|rollout| sums.add_rollout(rollout, drive));
    }
    let [v_y, r, position] = [0, 1, 2].map(|i| mean(&sums.squares[i]).sqrt());
    let count = sums.squares[0].len();
    let intervals = sums.squares.each_ref().map(|it| rms_interval(it));
    let intervals = match intervals {
        [Some(v_y), Some(r), Some(position)] => Some([v_y, r, position]),
        _ => None,
    };
    let share = |band: usize| {
        let rows = sums.banded;
        (rows > 0).then(|| sums.inside[band].map(|inside| inside as f64 / rows as f64))
    };
    (count > 0).then(|| RolloutScore {
        horizon,
        v_y,
        r,
        position,
        intervals,
        spun: sums.spun as f64 / count as f64,
        coverage: share(0),
        coverage_half: share(1),
        count,
    })
}

/// What predictions sum up to.
#[derive(Default)]
struct RolloutErrorSums {
    /// For each prediction, the mean squares of the errors of v_y and yaw rate, and the square of the distance at the end.
    squares: [Vec<f64>; 3],
    /// Rows of v_y and yaw rate inside both bands.
    inside: [[usize; 2]; 2],
    /// Rows with bands.
    banded: usize,
    spun: usize,
}

impl RolloutErrorSums {
    fn add_rollout(&mut self, rollout: &Rollout, drive: &EvenDrive) {
        let mut squares = [0.0; 2];
        let ahead = rollout.predicted.len() - 1;
        for (k, state) in rollout.predicted.iter().enumerate().skip(1) {
            let row = rollout.start + k;
            let errors = [state[0] - drive.motion.v_y[row], state[1] - drive.motion.r[row]];
            for (square, error) in squares.iter_mut().zip(errors) {
                *square += error * error / ahead as f64;
            }
            let Some(spread) = &rollout.spread else { continue };
            self.banded += 1;
            for (inside, band) in self.inside.iter_mut().zip(BAND) {
                for i in 0..2 {
                    inside[i] += usize::from(errors[i].abs() < band * spread[k][i]);
                }
            }
        }
        let end = rollout.start + ahead;
        let wrong = (rollout.predicted[ahead][0] - drive.motion.v_y[end]).abs();
        self.spun += usize::from(wrong > 0.25 * drive.motion.v_x[end]);
        let all = [squares[0], squares[1], rollout.distance * rollout.distance];
        self.squares.iter_mut().zip(all).for_each(|(of, square)| of.push(square));
    }
}

/// Blocks of a log: each is longer than its errors are correlated, in a usual log.
const BLOCKS: usize = 20;
/// 97.5 % quantile of Student's distribution with 19 degrees of freedom.
const T_95: f64 = 2.093;

/// The 95 % interval of the root of the mean of squares whose neighbours depend on each other, from the scatter of the means of
/// blocks; none for too few.
fn rms_interval(squares: &[f64]) -> Option<[f64; 2]> {
    if squares.len() < 2 * BLOCKS {
        return None;
    }
    let all = mean(squares);
    let block = |k: usize| {
        let ends = [k, k + 1].map(|it| it * squares.len() / BLOCKS);
        mean(&squares[ends[0]..ends[1]])
    };
    let scatter: f64 = (0..BLOCKS).map(|k| (block(k) - all).powi(2)).sum();
    let half = T_95 * (scatter / (BLOCKS * (BLOCKS - 1)) as f64).sqrt();
    Some([(all - half).max(0.0).sqrt(), (all + half).sqrt()])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use rand::prelude::*;
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    use super::*;

    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        let mut random = Pcg64::seed_from_u64(3);
        let held = (0..400).filter(|_| {
            // Errors that last for ten rows.
            let mut error = 0.0;
            let mut next = || {
                let white: f64 = random.sample(StandardNormal);
                error = 0.9 * error + (1.0_f64 - 0.81).sqrt() * white;
                error * error
            };
            let squares: Vec<f64> = (0..2000).map(|_| next()).collect();
            let [low, high] = rms_interval(&squares).expect("they are enough");
            (low..high).contains(&1.0)
        });
        let held = held.count();
        assert!((364..=396).contains(&held), "{held} of 400");
        assert!(rms_interval(&[1.0; 39]).is_none());
    }
}
