//! Parts of drives that have parameters of their own, and how much each of them says.

use std::sync::Arc;

use crate::car::information::RolloutErrors;
use crate::car::motion::{DriveWithRates, WARM_UP};
use crate::drive::EvenDrive;
use crate::predictor::LateralState;

/// A drive is divided into sections of about this long [s]: tires change within minutes.
const LENGTH: f64 = 80.0;
/// Shorter drives stay one section, even if it is the only one [s].
const SHORTEST: f64 = 20.0;
/// Time between two starts of the fit's rollouts [s], and how long they last [s].
const EVERY: f64 = 1.0;
pub(super) const HORIZON: f64 = 1.5;
/// More rollouts say little more, and take long.
const MOST_ROLLOUTS: usize = 1000;
/// Correlations below this are noise.
const UNCORRELATED: f64 = 0.05;

/// A part of a drive.
#[derive(Clone, Debug)]
pub struct DriveSection {
    /// The drive, of which only the rows of the part count.
    pub driven: Arc<DriveWithRates>,
    /// First rows of the rollouts.
    pub starts: Vec<usize>,
    /// Rows of each.
    pub ahead: usize,
    /// How many independent rollouts one of them is worth.
    pub weight: f64,
}

impl DriveSection {
    /// How much it says: independent rollouts.
    #[must_use]
    pub fn independent_rollout_count(&self) -> f64 {
        self.weight * self.starts.len() as f64
    }

    /// Weighs it by the time for which the errors of its rollouts stay alike: one-way circles say the same again and again.
    pub fn set_weight(&mut self, errors: &[RolloutErrors]) {
        let means: Vec<LateralState> = errors.iter().map(RolloutErrors::mean_errors).collect();
        let alike = |i: usize| correlation_length(&means.iter().map(|mean| mean[i]).collect::<Vec<_>>());
        self.weight = 1.0 / alike(0).max(alike(1));
    }
}

/// The sections of drives that have rollouts.
#[must_use]
pub fn split_into_sections(drives: &[EvenDrive]) -> Vec<DriveSection> {
    let all: Vec<DriveWithRates> = drives.iter().map(DriveWithRates::new).collect();
    let mut sections: Vec<DriveSection> =
        all.iter().flat_map(|driven| sections_of_drive(&driven.drive, all.len() == 1)).collect();
    let rollouts: usize = sections.iter().map(|section| section.starts.len()).sum();
    for section in &mut sections {
        let kept = section.starts.iter().step_by(rollouts.div_ceil(MOST_ROLLOUTS).max(1));
        section.starts = kept.copied().collect();
    }
    sections
}

/// The sections of one drive.
fn sections_of_drive(drive: &EvenDrive, alone: bool) -> Vec<DriveSection> {
    let rows: Vec<usize> = (0..drive.row_count()).filter(|row| drive.counts[*row]).collect();
    let seconds = rows.len() as f64 * drive.step;
    let mut parts = (seconds / LENGTH).round().max(1.0) as usize;
    if alone && seconds >= 2.0 * SHORTEST {
        // One section alone cannot be left out.
        parts = parts.max(2);
    }
    let part = |part: usize| {
        let [from, to] = [part, part + 1].map(|it| it * rows.len() / parts);
        let (first, last) = (*rows.get(from)?, *rows.get(to.checked_sub(1)?)?);
        let one = restrict_counted_rows(drive, first, last);
        let (starts, ahead) = rollout_starts(&one, HORIZON, EVERY);
        let driven = Arc::new(DriveWithRates::new(&one));
        (!starts.is_empty()).then_some(DriveSection { driven, starts, ahead, weight: 1.0 })
    };
    (0..parts).filter_map(part).collect()
}

/// The rows from `first` to `last` alone count; of the others only those stay that a lag of the steering remembers.
fn restrict_counted_rows(drive: &EvenDrive, first: usize, last: usize) -> EvenDrive {
    let begin = first.saturating_sub((WARM_UP / drive.step).ceil() as usize);
    let end = (last + 2).min(drive.row_count());
    EvenDrive {
        name: drive.name.clone(),
        log: drive.log,
        step: drive.step,
        motion: drive.motion.slice(begin..end),
        r_dot: drive.r_dot.get(begin..end).map_or(Vec::new(), <[f64]>::to_vec),
        counts: (begin..end).map(|row| (first..=last).contains(&row) && drive.counts[row]).collect(),
        lap: None,
        sensors: None,
    }
}

/// The first rows of rollouts over `horizon` [s], one each `every` [s], all of whose rows count; and their number of rows.
pub(super) fn rollout_starts(drive: &EvenDrive, horizon: f64, every: f64) -> (Vec<usize>, usize) {
    let rows = |time: f64| ((time / drive.step).round() as usize).max(1);
    let (ahead, every) = (rows(horizon), rows(every));
    let mut starts = Vec::new();
    let mut row = 0;
    while row + ahead + 1 < drive.row_count() {
        match (row..=row + ahead).rev().find(|it| !drive.counts[*it]) {
            // The next start that can be free of this row.
            Some(wrong) => row = (wrong + 1).div_ceil(every) * every,
            None => {
                starts.push(row);
                row += every;
            }
        }
    }
    (starts, ahead)
}

/// For how many of its steps a series stays alike: 1 + 2 Σ of its correlations about zero.
fn correlation_length(series: &[f64]) -> f64 {
    let square: f64 = series.iter().map(|x| x * x).sum::<f64>() / series.len().max(1) as f64;
    if square <= 0.0 {
        return 1.0;
    }
    let correlation = |lag: usize| {
        let pairs = series.iter().zip(&series[lag..]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / ((series.len() - lag) as f64 * square)
    };
    let kept = (1..series.len() / 3).map(correlation).take_while(|it| *it > UNCORRELATED);
    1.0 + 2.0 * kept.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use preparation::Drive;

    use super::*;

    #[test]
    fn a_constant_error_is_one_error() {
        let n = 90;
        let constant = correlation_length(&vec![0.3; n]);
        assert!(constant > 0.6 * n as f64, "{constant}");
        let alternating: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(correlation_length(&alternating), 1.0);
        assert_eq!(correlation_length(&[]), 1.0);
    }

    #[test]
    fn rollouts_avoid_rows_that_do_not_count() {
        let n = 1000;
        let mut drive = EvenDrive {
            step: 0.01,
            counts: vec![true; n as usize],
            motion: Drive {
                t: (0..n).map(|i| f64::from(i) * 0.01).collect(),
                v_x: vec![2.0; n as usize],
                v_y: vec![0.0; n as usize],
                ..Drive::default()
            },
            ..EvenDrive::default()
        };
        drive.counts[420] = false;
        let (starts, ahead) = rollout_starts(&drive, 1.5, 1.0);
        assert_eq!((starts, ahead), (vec![0, 100, 200, 500, 600, 700, 800], 150));
    }

    #[test]
    fn a_long_drive_has_sections_that_hold_only_their_rows() {
        let n = 40_000;
        let mut drive = EvenDrive {
            step: 0.01,
            r_dot: vec![0.0; n],
            counts: vec![true; n],
            motion: Drive {
                t: vec![0.0; n],
                v_x: vec![2.0; n],
                v_y: vec![0.1; n],
                r: vec![0.5; n],
                a_y: vec![1.0; n],
                delta: vec![0.1; n],
                ..Drive::default()
            },
            ..EvenDrive::default()
        };
        drive.motion.v_y[100] = f64::NAN;
        let sections = split_into_sections(&[drive]);
        assert_eq!(sections.len(), 5);
        for section in &sections {
            let rows = section.driven.drive.row_count();
            assert!((7_999..8_300).contains(&rows), "{rows}");
            assert!(section.starts.len() >= 77, "{}", section.starts.len());
        }
        let first = &sections[0];
        assert!(first.starts.iter().all(|start| !(*start..=start + 150).contains(&100)));
    }
}
