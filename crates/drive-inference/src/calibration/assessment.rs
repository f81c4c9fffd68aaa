//! Assesses calibrated errors: by the sides that were driven, by both halves of the drive, and by the channels that show them.

use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use serde::Serialize;
use tire_inference::verdict::Identifiability;
use vehicle::SingleTrackCar;

use super::{CalibratedError, SensorCalibration, Z_95, calibrate_sensors, wide_error_stds};
use crate::error::Error;
use preparation::{Drive, SystematicError};

/// Turning to one side begins there [m/s²], and each side has at least this share of the rows.
const TURNS: f64 = 1.0;
const SIDE: f64 = 0.1;
/// Difference of both halves, in its standard deviations, that one in a hundred drives without a change exceeds.
const APART: f64 = 2.58;

/// Why nothing is told of delays that do not settle, nor of what is estimated with them.
const UNSETTLED: &str = "The delays did not settle: give fewer errors at once, or a longer drive.";

/// An error of a sensor that was estimated, and what speaks for it.
#[derive(Clone, Debug, Serialize)]
pub struct SensorErrorAssessment {
    /// What was estimated.
    #[serde(flatten)]
    pub error: CalibratedError,
    /// Values of the first and the second half with their standard deviations; `None` of a half that is too short.
    pub halves: Option<[[f64; 2]; 2]>,
    /// The verdict.
    pub verdict: Identifiability,
    /// Why, and what to drive.
    pub reason: String,
}

/// Estimates errors of sensors by [`calibrate_sensors`], from the whole and from both halves. Nothing is corrected.
///
/// # Errors
///
/// [`Error`] if the recordings are unusable.
pub fn assess_sensor_errors(
    car: &SingleTrackCar,
    recordings: &[Drive],
    wanted: &[SystematicError],
) -> Result<Vec<SensorErrorAssessment>, Error> {
    let SensorCalibration { errors: whole, settled, .. } = calibrate_sensors(car, recordings, wanted)?;
    let halves = split_into_halves(recordings).map(|half| calibrate_sensors(car, &half, wanted).ok());
    let turned = turn_direction_shares(recordings);
    let judged = |(place, error): (usize, CalibratedError)| {
        let of = |half: &Option<SensorCalibration>| {
            half.as_ref().and_then(|it| it.errors.get(place)).map(|it| [it.value, it.std])
        };
        let halves = match (of(&halves[0]), of(&halves[1])) {
            (Some(first), Some(second)) => Some([first, second]),
            _ => None,
        };
        let (verdict, reason) = match settled {
            true => calibration_verdict(&error, halves, turned),
            false => (Identifiability::NotIdentifiable, UNSETTLED.to_owned()),
        };
        SensorErrorAssessment { error, halves, verdict, reason }
    };
    Ok(whole.into_iter().enumerate().map(judged).collect())
}

fn calibration_verdict(
    error: &CalibratedError,
    halves: Option<[[f64; 2]; 2]>,
    turned: [f64; 2],
) -> (Identifiability, String) {
    let told = |verdict, reason: &str| (verdict, reason.to_owned());
    if turned.iter().any(|share| *share < SIDE) {
        return told(
            Identifiability::NotIdentifiable,
            "The drive turns to one side, where an offset, a lever arm and the curve of a tire look alike: turn to both sides.",
        );
    }
    if error.std > MAX_WIDTH_IDENTIFIED * wide_error_stds()[error.cause] {
        return told(
            Identifiability::NotIdentifiable,
            "The drive says little of it: drive slaloms to both sides at two speeds.",
        );
    }
    let Some([first, second]) = halves else {
        return told(
            Identifiability::Weak,
            "The halves of the drive are too short to be compared: drive longer.",
        );
    };
    let apart = (first[0] - second[0]).abs();
    if apart > APART * first[1].hypot(second[1]) {
        let (factor, unit) = error.cause.describe().display;
        let half =
            |[value, std]: [f64; 2]| format!("{:.3} ± {:.3} {unit}", factor * value, factor * Z_95 * std);
        let reason = format!(
            "The halves of the drive disagree: {} and {}, so it is no constant.",
            half(first),
            half(second)
        );
        return (Identifiability::NotIdentifiable, reason);
    }
    let of_v_y =
        [SystematicError::SideslipOffset, SystematicError::SideslipLever, SystematicError::SideslipDelay];
    match of_v_y.contains(&error.cause) {
        true => told(
            Identifiability::Weak,
            "No other channel witnesses it, and an error of the steering looks like it: measure the place of the sensor with a tape.",
        ),
        false => told(Identifiability::Identified, "The drive turns to both sides, and its halves agree."),
    }
}

/// Shares of rows that turn to the left and to the right.
fn turn_direction_shares(recordings: &[Drive]) -> [f64; 2] {
    let rows = recordings.iter().map(Drive::len).sum::<usize>().max(1) as f64;
    let share = |side: f64| {
        let turns = recordings.iter().flat_map(|drive| &drive.a_y);
        turns.filter(|a_y| side * **a_y > TURNS).count() as f64 / rows
    };
    [share(1.0), share(-1.0)]
}

/// The first and the second half of all rows.
fn split_into_halves(recordings: &[Drive]) -> [Vec<Drive>; 2] {
    let half = recordings.iter().map(Drive::len).sum::<usize>() / 2;
    let (mut halves, mut before) = ([Vec::new(), Vec::new()], 0);
    for drive in recordings {
        let at = half.saturating_sub(before).min(drive.len());
        before += drive.len();
        for (half, part) in halves.iter_mut().zip([0..at, at..drive.len()]) {
            if !part.is_empty() {
                half.push(drive.slice(part));
            }
        }
    }
    // What is left of a recording at the border is too short to be one.
    halves.map(|half| half.into_iter().filter(|drive| drive.check_columns().is_ok()).collect())
}
