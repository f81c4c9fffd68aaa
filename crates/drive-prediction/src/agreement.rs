//! Rates how a model agrees with drives by ISO/TS 18571, piece by piece.

use rating::{RatingGrade, SignalRating, rate_signal};
use serde::Serialize;

use crate::drive::EvenDrive;
use crate::predictor::MotionPredictor;
use crate::rollout::simulate_rollouts;

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
pub struct AgreementRating {
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
pub struct ChannelRatings {
    /// Of the lateral acceleration from measured states, in pieces of 10 s.
    pub a_y: Option<AgreementRating>,
    /// Of v_y in open-loop predictions, one after the other.
    pub v_y: Option<AgreementRating>,
    /// Of the yaw rate in the same predictions.
    pub r: Option<AgreementRating>,
}

/// Rates a model on the rows that count; predictions over `horizon` [s].
#[must_use]
pub fn rate_model(model: &dyn MotionPredictor, drives: &[EvenDrive], horizon: f64) -> ChannelRatings {
    let [mut v_y, mut r] = [
        PieceRatings::for_channel(drives, |it| &it.motion.v_y),
        PieceRatings::for_channel(drives, |it| &it.motion.r),
    ];
    for drive in drives {
        let mut free = 0;
        for rollout in simulate_rollouts(model, drive, horizon) {
            if rollout.start < free {
                continue;
            }
            let rows = rollout.start..rollout.start + rollout.predicted.len();
            free = rows.end - 1;
            let predicted = |i: usize| rollout.predicted.iter().map(|it| it[i]).collect();
            v_y.rate_piece(&drive.motion.v_y[rows.clone()], predicted(0), drive.step);
            r.rate_piece(&drive.motion.r[rows], predicted(1), drive.step);
        }
    }
    ChannelRatings {
        a_y: rate_lateral_acceleration(model, drives),
        v_y: v_y.mean_agreement(),
        r: r.mean_agreement(),
    }
}

fn rate_lateral_acceleration(model: &dyn MotionPredictor, drives: &[EvenDrive]) -> Option<AgreementRating> {
    let mut pieces = PieceRatings::for_channel(drives, |it| &it.motion.a_y);
    for drive in drives {
        let along = model.adapted_to_drive(drive);
        let model = along.as_deref().unwrap_or(model);
        let steering = model.road_wheel_angles(drive);
        let length = (PIECE / drive.step).round() as usize;
        let mut row = 0;
        while row + length <= drive.row_count() {
            let rows = row..row + length;
            if let Some(gap) = rows.clone().rev().find(|row| !drive.counts[*row]) {
                row = gap + 1;
                continue;
            }
            let predicted: Option<Vec<f64>> =
                rows.clone().map(|row| model.a_y(drive, &steering, row)).collect();
            pieces.rate_piece(&drive.motion.a_y[rows], predicted?, drive.step);
            row += length;
        }
    }
    pieces.mean_agreement()
}

/// Ratings of pieces in which something happens.
struct PieceRatings {
    /// What one of their values reaches.
    least: f64,
    ratings: Vec<SignalRating>,
}

impl PieceRatings {
    fn for_channel(drives: &[EvenDrive], channel: impl Fn(&EvenDrive) -> &Vec<f64>) -> Self {
        let sizes = drives.iter().flat_map(|it| it.counted_values(channel(it)).map(f64::abs));
        let mut sizes: Vec<f64> = sizes.filter(|it| it.is_finite()).collect();
        sizes.sort_by(f64::total_cmp);
        let place = (MOST_ROWS * sizes.len().saturating_sub(1) as f64) as usize;
        let least = EVENT * sizes.get(place).copied().unwrap_or(f64::INFINITY);
        Self { least, ratings: Vec::new() }
    }

    /// Rates a piece. A spin may leave the finite numbers: that piece scores 0.
    fn rate_piece(&mut self, measured: &[f64], predicted: Vec<f64>, step: f64) {
        if !measured.iter().any(|it| it.abs() >= self.least) {
            return;
        }
        let nothing = SignalRating {
            corridor: 0.0,
            phase: 0.0,
            magnitude: 0.0,
            slope: 0.0,
            overall: 0.0,
            grade: RatingGrade::Poor,
            delay: 0.0,
        };
        match rate_signal(measured, &predicted, step) {
            Ok(rating) => self.ratings.push(rating),
            Err(_) if predicted.iter().any(|it| !it.is_finite()) => self.ratings.push(nothing),
            Err(_) => {}
        }
    }

    fn mean_agreement(&self) -> Option<AgreementRating> {
        let pieces = self.ratings.len();
        let mean = |of: fn(&SignalRating) -> f64| self.ratings.iter().map(of).sum::<f64>() / pieces as f64;
        let overall = mean(|it| it.overall);
        let squares = self.ratings.iter().map(|it| (it.overall - overall).powi(2)).sum::<f64>();
        let half = Z_95 * (squares / (pieces * pieces.saturating_sub(1)) as f64).sqrt();
        let interval = [(overall - half).max(0.0), (overall + half).min(1.0)];
        (pieces > 0).then(|| AgreementRating {
            overall,
            interval: (pieces >= FEWEST).then_some(interval),
            corridor: mean(|it| it.corridor),
            phase: mean(|it| it.phase),
            magnitude: mean(|it| it.magnitude),
            slope: mean(|it| it.slope),
            grade: RatingGrade::from_overall(overall).to_string(),
            pieces,
        })
    }
}

#[cfg(test)]
mod tests {
    use preparation::Drive;

    use super::*;
    use crate::predictor::{LateralState, PersistenceModel};

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

    impl MotionPredictor for Late {
        fn name(&self) -> &str {
            "late"
        }
        fn road_wheel_angles(&self, drive: &EvenDrive) -> Vec<f64> {
            drive.motion.delta.clone()
        }
        fn a_y(&self, drive: &EvenDrive, _: &[f64], row: usize) -> Option<f64> {
            Some(self.at(&drive.motion.a_y, row))
        }
        fn simulate_states(
            &self,
            drive: &EvenDrive,
            _: &[f64],
            start: usize,
            ahead: usize,
        ) -> Vec<LateralState> {
            let state = |row| [self.at(&drive.motion.v_y, row), self.at(&drive.motion.r, row)];
            (start..=start + ahead).map(state).collect()
        }
    }

    #[test]
    fn only_pieces_in_which_something_happens_are_rated() {
        let found = rate_model(&Late(0, 1.0), &[slalom()], 3.0);
        let a_y = found.a_y.expect("pieces");
        assert_eq!((a_y.overall, a_y.pieces, a_y.grade.as_str()), (1.0, 6, "excellent"));
        let r = found.r.expect("predictions");
        assert!(r.overall == 1.0 && (19..=20).contains(&r.pieces), "{r:?}");
    }

    #[test]
    fn an_error_costs_the_score_that_it_is_an_error_of() {
        let late = rate_model(&Late(20, 1.0), &[slalom()], 3.0).a_y.expect("pieces");
        // 20 of 200 rows that count for the phase.
        assert!((late.phase - 0.9).abs() < 0.01 && late.magnitude > 0.95, "{late:?}");
        let large = rate_model(&Late(0, 1.2), &[slalom()], 3.0).a_y.expect("pieces");
        // The slopes are 20 % too large: half as much is lost.
        assert!(large.phase == 1.0 && (large.slope - 0.9).abs() < 1e-6, "{large:?}");
        assert!(large.magnitude < 0.95 && large.corridor < 0.7, "{large:?}");
        let none = rate_model(&PersistenceModel, &[slalom()], 3.0);
        let r = none.r.expect("predictions");
        assert!(none.a_y.is_none() && r.overall < 0.58 && r.grade == "poor", "{r:?}");
    }

    #[test]
    fn a_prediction_that_is_no_number_scores_nothing() {
        let wild = rate_model(&Late(0, f64::NAN), &[slalom()], 3.0);
        assert_eq!(wild.r.expect("predictions").overall, 0.0);
        assert!(rate_model(&Late(0, 1.0), &[], 3.0) == ChannelRatings::default());
    }
}
