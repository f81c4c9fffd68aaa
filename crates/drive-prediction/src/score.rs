//! Numbers for how well a model predicts a drive.

use serde::Serialize;

use crate::drive::Drive;
use crate::predictor::Predictor;
use crate::rollout::rollouts;

/// Lateral acceleration from measured states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LateralScore {
    /// Root mean square error [m/s²].
    pub rmse: f64,
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
pub fn lateral(model: &dyn Predictor, drive: &Drive) -> Option<LateralScore> {
    let steering = model.steering(drive);
    let mut errors = Vec::new();
    let mut inside = [0_usize; 2];
    let mut banded = 0;
    for row in (0..drive.rows()).filter(|row| drive.counts[*row]) {
        let error = model.a_y(drive, &steering, row)? - drive.a_y[row];
        if let Some(spread) = model.a_y_spread(drive, row) {
            banded += 1;
            for (inside, band) in inside.iter_mut().zip(BAND) {
                *inside += usize::from(error.abs() < band * spread);
            }
        }
        errors.push(error);
    }
    let rows = errors.len();
    let share = |inside: usize| (banded > 0).then(|| inside as f64 / f64::from(banded));
    (rows > 0).then(|| LateralScore {
        rmse: rms(errors.iter().copied()),
        bias: errors.iter().sum::<f64>() / rows as f64,
        coverage: share(inside[0]),
        coverage_half: share(inside[1]),
        rows,
    })
}

/// Scores the open-loop predictions over `horizon` [s]; none if no stretch is as long.
#[must_use]
pub fn open_loop(model: &dyn Predictor, drive: &Drive, horizon: f64) -> Option<RolloutScore> {
    let found = rollouts(model, drive, horizon);
    let count = found.len();
    let measured = |row: usize| [drive.v_y[row], drive.r[row]];
    let errors = |i: usize| {
        found.iter().flat_map(move |rollout| {
            let after = rollout.predicted.iter().enumerate().skip(1);
            after.map(move |(k, state)| state[i] - measured(rollout.start + k)[i])
        })
    };
    let spun = found.iter().filter(|rollout| {
        let ahead = rollout.predicted.len() - 1;
        let end = rollout.start + ahead;
        (rollout.predicted[ahead][0] - drive.v_y[end]).abs() > 0.25 * drive.v_x[end]
    });
    let coverage = |band: f64| {
        let inside = |i: usize| {
            let mut total = [0_usize; 2];
            for rollout in &found {
                let spread = rollout.spread.as_ref()?;
                for (k, state) in rollout.predicted.iter().enumerate().skip(1) {
                    let error = state[i] - measured(rollout.start + k)[i];
                    total[0] += usize::from(error.abs() < band * spread[k][i]);
                    total[1] += 1;
                }
            }
            Some(total[0] as f64 / total[1].max(1) as f64)
        };
        Some([inside(0)?, inside(1)?])
    };
    (count > 0).then(|| RolloutScore {
        horizon,
        v_y: rms(errors(0)),
        r: rms(errors(1)),
        position: rms(found.iter().map(|rollout| rollout.distance)),
        spun: spun.count() as f64 / count as f64,
        coverage: coverage(BAND[0]),
        coverage_half: coverage(BAND[1]),
        count,
    })
}

/// Root mean square.
#[must_use]
pub fn rms(errors: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = errors.fold((0.0, 0_usize), |(sum, n), e| (sum + e * e, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// The root mean square of two parts, of so many values each.
fn both(a: f64, b: f64, [n, k]: [usize; 2]) -> f64 {
    ((a * a * n as f64 + b * b * k as f64) / (n + k).max(1) as f64).sqrt()
}

/// The mean of two parts.
fn mean(a: f64, b: f64, [n, k]: [usize; 2]) -> f64 {
    (a * n as f64 + b * k as f64) / (n + k).max(1) as f64
}

impl LateralScore {
    /// The score over both parts.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let counts = [self.rows, other.rows];
        let share = |a: Option<f64>, b: Option<f64>| Some(mean(a?, b?, counts));
        Self {
            rmse: both(self.rmse, other.rmse, counts),
            bias: mean(self.bias, other.bias, counts),
            coverage: share(self.coverage, other.coverage),
            coverage_half: share(self.coverage_half, other.coverage_half),
            rows: self.rows + other.rows,
        }
    }
}

impl RolloutScore {
    /// The score over both parts, of one horizon.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let counts = [self.count, other.count];
        let shares = |a: Option<[f64; 2]>, b: Option<[f64; 2]>| {
            let (a, b) = (a?, b?);
            Some([0, 1].map(|i| mean(a[i], b[i], counts)))
        };
        Self {
            horizon: self.horizon,
            v_y: both(self.v_y, other.v_y, counts),
            r: both(self.r, other.r, counts),
            position: both(self.position, other.position, counts),
            spun: mean(self.spun, other.spun, counts),
            coverage: shares(self.coverage, other.coverage),
            coverage_half: shares(self.coverage_half, other.coverage_half),
            count: self.count + other.count,
        }
    }
}
