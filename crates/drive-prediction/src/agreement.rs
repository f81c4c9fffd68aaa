//! Rates how a model agrees with drives by ISO/TS 18571, piece by piece.

use rating::{Grade, Rating, rating};
use serde::Serialize;

use crate::drive::EvenDrive;
use crate::predictor::Predictor;
use crate::rollout::rollouts;

/// Time of a piece of the lateral acceleration [s].
const PIECE: f64 = 10.0;
/// Something happens in a piece that reaches this share of what 95 % of the rows do not exceed.
const EVENT: f64 = 0.5;
const MOST_ROWS: f64 = 0.95;
/// Pieces that have an interval.
const FEWEST: usize = 5;
/// 97.5 % quantile of the normal distribution.
const Z_95: f64 = 1.96;

/// Means of the scores over all pieces in which something happens, from 0 to 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// R = 0.4 Z + 0.2 EP + 0.2 EM + 0.2 ES.
    pub overall: f64,
    /// Its 95 % interval, from the scatter of the pieces.
    pub interval: Option<[f64; 2]>,
    /// Corridor, Z.
    pub corridor: f64,
    /// Phase, EP.
    pub phase: f64,
    /// Magnitude, EM.
    pub magnitude: f64,
    /// Slope, ES.
    pub slope: f64,
    /// The grade of `overall`.
    pub grade: String,
    /// Pieces.
    pub pieces: usize,
}

/// The ratings of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Ratings {
    /// Of the lateral acceleration from measured states, in pieces of 10 s.
    pub a_y: Option<Agreement>,
    /// Of v_y in open-loop predictions, one after the other.
    pub v_y: Option<Agreement>,
    /// Of the yaw rate in the same predictions.
    pub r: Option<Agreement>,
}

/// Rates a model on the rows that count; predictions over `horizon` [s].
#[must_use]
pub fn ratings(model: &dyn Predictor, drives: &[EvenDrive], horizon: f64) -> Ratings {
    let [mut v_y, mut r] = [
        PieceRatings::of(drives, |it| &it.motion.v_y),
        PieceRatings::of(drives, |it| &it.motion.r),
    ];
    for drive in drives {
        let mut free = 0;
        for rollout in rollouts(model, drive, horizon) {
            if rollout.start < free {
                continue;
            }
            let rows = rollout.start..rollout.start + rollout.predicted.len();
            free = rows.end - 1;
            let predicted = |i: usize| rollout.predicted.iter().map(|it| it[i]).collect();
            v_y.add(&drive.motion.v_y[rows.clone()], predicted(0), drive.step);
            r.add(&drive.motion.r[rows], predicted(1), drive.step);
        }
    }
    Ratings { a_y: lateral(model, drives), v_y: v_y.mean(), r: r.mean() }
}

fn lateral(model: &dyn Predictor, drives: &[EvenDrive]) -> Option<Agreement> {
    let mut pieces = PieceRatings::of(drives, |it| &it.motion.a_y);
    for drive in drives {
        let along = model.along(drive);
        let model = along.as_deref().unwrap_or(model);
        let steering = model.steering(drive);
        let length = (PIECE / drive.step).round() as usize;
        let mut row = 0;
        while row + length <= drive.rows() {
            let rows = row..row + length;
            if let Some(gap) = rows.clone().rev().find(|row| !drive.counts[*row]) {
                row = gap + 1;
                continue;
            }
            let predicted: Option<Vec<f64>> =
                rows.clone().map(|row| model.a_y(drive, &steering, row)).collect();
            pieces.add(&drive.motion.a_y[rows], predicted?, drive.step);
            row += length;
        }
    }
    pieces.mean()
}

/// Ratings of pieces in which something happens.
struct PieceRatings {
    /// What one of their values reaches.
    least: f64,
    ratings: Vec<Rating>,
}

impl PieceRatings {
    fn of(drives: &[EvenDrive], channel: impl Fn(&EvenDrive) -> &Vec<f64>) -> Self {
        let sizes = drives.iter().flat_map(|it| it.counted(channel(it)).map(f64::abs));
        let mut sizes: Vec<f64> = sizes.filter(|it| it.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        let place = (MOST_ROWS * sizes.len().saturating_sub(1) as f64) as usize;
        let least = EVENT * sizes.get(place).copied().unwrap_or(f64::INFINITY);
        Self { least, ratings: Vec::new() }
    }

    /// Rates a piece. A spin may leave the finite numbers: that piece scores 0.
    fn add(&mut self, measured: &[f64], predicted: Vec<f64>, step: f64) {
        if !measured.iter().any(|it| it.abs() >= self.least) {
            return;
        }
        let nothing = Rating {
            corridor: 0.0,
            phase: 0.0,
            magnitude: 0.0,
            slope: 0.0,
            overall: 0.0,
            grade: Grade::Poor,
            delay: 0.0,
        };
        match rating(measured, &predicted, step) {
            Ok(rating) => self.ratings.push(rating),
            Err(_) if predicted.iter().any(|it| !it.is_finite()) => self.ratings.push(nothing),
            Err(_) => {}
        }
    }

    fn mean(&self) -> Option<Agreement> {
        let pieces = self.ratings.len();
        let mean =
            |of: fn(&Rating) -> f64| self.ratings.iter().map(of).sum::<f64>() / pieces as f64;
        let overall = mean(|it| it.overall);
        let squares = self.ratings.iter().map(|it| (it.overall - overall).powi(2)).sum::<f64>();
        let half = Z_95 * (squares / (pieces * pieces.saturating_sub(1)) as f64).sqrt();
        let interval = [(overall - half).max(0.0), (overall + half).min(1.0)];
        (pieces > 0).then(|| Agreement {
            overall,
            interval: (pieces >= FEWEST).then_some(interval),
            corridor: mean(|it| it.corridor),
            phase: mean(|it| it.phase),
            magnitude: mean(|it| it.magnitude),
            slope: mean(|it| it.slope),
            grade: Grade::of(overall).to_string(),
            pieces,
        })
    }
}

#[cfg(test)]
mod tests {
    use preparation::Drive;

    use super::*;
    use crate::predictor::{Persistence, State};

    /// A slalom of 60 s with a straight before it.
    fn slalom() -> EvenDrive {
        let n = 9000;
        let time: Vec<f64> = (0..n).map(|k| f64::from(k) * 0.01).collect();
        let wave = |t: &f64| if *t < 30.0 { 0.001 } else { (2.0 * t).sin() };
        EvenDrive {
            step: 0.01,
            counts: vec![true; n as usize],
            motion: Drive {
                v_x: vec![20.0; n as usize],
                v_y: time.iter().map(|t| 0.1 * wave(t)).collect(),
                r: time.iter().map(|t| 0.3 * wave(t)).collect(),
                a_y: time.iter().map(|t| 6.0 * wave(t)).collect(),
                delta: vec![0.0; n as usize],
                t: time,
                ..Drive::default()
            },
            ..EvenDrive::default()
        }
    }

    /// What was measured, some rows later and larger by a factor.
    struct Late(usize, f64);

    impl Late {
        fn at(&self, column: &[f64], row: usize) -> f64 {
            self.1 * column[row.saturating_sub(self.0)]
        }
    }

    impl Predictor for Late {
        fn name(&self) -> &str {
            "late"
        }
        fn steering(&self, drive: &EvenDrive) -> Vec<f64> {
            drive.motion.delta.clone()
        }
        fn a_y(&self, drive: &EvenDrive, _: &[f64], row: usize) -> Option<f64> {
            Some(self.at(&drive.motion.a_y, row))
        }
        fn roll(&self, drive: &EvenDrive, _: &[f64], start: usize, ahead: usize) -> Vec<State> {
            let state = |row| [self.at(&drive.motion.v_y, row), self.at(&drive.motion.r, row)];
            (start..=start + ahead).map(state).collect()
        }
    }

    #[test]
    fn only_pieces_in_which_something_happens_are_rated() {
        let found = ratings(&Late(0, 1.0), &[slalom()], 3.0);
        let a_y = found.a_y.expect("pieces");
        assert_eq!((a_y.overall, a_y.pieces, a_y.grade.as_str()), (1.0, 6, "excellent"));
        let r = found.r.expect("predictions");
        assert!(r.overall == 1.0 && (19..=20).contains(&r.pieces), "{r:?}");
    }

    #[test]
    fn an_error_costs_the_score_that_it_is_an_error_of() {
        let late = ratings(&Late(20, 1.0), &[slalom()], 3.0).a_y.expect("pieces");
        // 20 of 200 rows that count for the phase.
        assert!((late.phase - 0.9).abs() < 0.01 && late.magnitude > 0.95, "{late:?}");
        let large = ratings(&Late(0, 1.2), &[slalom()], 3.0).a_y.expect("pieces");
        // The slopes are 20 % too large: half as much is lost.
        assert!(large.phase == 1.0 && (large.slope - 0.9).abs() < 1e-6, "{large:?}");
        assert!(large.magnitude < 0.95 && large.corridor < 0.7, "{large:?}");
        let none = ratings(&Persistence, &[slalom()], 3.0);
        let r = none.r.expect("predictions");
        assert!(none.a_y.is_none() && r.overall < 0.58 && r.grade == "poor", "{r:?}");
    }

    #[test]
    fn a_prediction_that_is_no_number_scores_nothing() {
        let wild = ratings(&Late(0, f64::NAN), &[slalom()], 3.0);
        assert_eq!(wild.r.expect("predictions").overall, 0.0);
        assert!(ratings(&Late(0, 1.0), &[], 3.0) == Ratings::default());
    }
}
