//! Finds constant errors of the sensors from straight driving, where the car itself says what they should show.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::car::Car;
use crate::robust::{fit_robust_line, median, robust_std};
use crate::row::MotionSample;

/// Offsets of the sensors. Those without a value are estimated from straight driving.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OffsetSettings {
    /// Offset of the yaw rate [rad/s].
    pub r: Option<f64>,
    /// Offset of the longitudinal acceleration [m/s²].
    pub a_x: Option<f64>,
    /// Offset of the lateral acceleration [m/s²].
    pub a_y: Option<f64>,
    /// λ_v: offset of the sideslip angle [rad].
    pub sideslip: Option<f64>,
    /// Largest yaw rate of straight driving [rad/s].
    pub straight: f64,
    /// Shortest stretch of straight driving [s].
    pub steady: f64,
    /// Least time of straight driving for an estimate [s].
    pub enough: f64,
}

impl Default for OffsetSettings {
    fn default() -> Self {
        Self { r: None, a_x: None, a_y: None, sideslip: None, straight: 0.03, steady: 0.5, enough: 2.0 }
    }
}

/// Where an offset comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum OffsetSource {
    /// The user gave it.
    Given,
    /// From straight driving.
    Estimated,
    /// There is too little straight driving to tell; zero was taken.
    TooFewStraightSamples,
}

/// An offset that was taken off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorOffset {
    /// Its name in [`OffsetSettings`].
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it is.
    pub value: f64,
    /// Where it comes from.
    pub source: OffsetSource,
    /// How many samples of straight driving there are.
    pub samples: usize,
    /// Standard deviation of the bulk of single samples about it; none if it was given or could not be reported.
    pub spread: Option<f64>,
}

/// Values of r, a_x, a_y and sideslip, in this order.
const NAMES: [(&str, &str); 4] = [("r", "rad/s"), ("a_x", "m/s²"), ("a_y", "m/s²"), ("sideslip", "rad")];

/// Takes the offsets, in the order of [`estimate_offsets`], off a row.
pub fn subtract_offsets(row: &MotionSample, [r, a_x, a_y, sideslip]: [f64; 4]) -> MotionSample {
    let (sin, cos) = sideslip.sin_cos();
    let turn = |x: f64, y: f64| (x * cos + y * sin, y * cos - x * sin);
    let (v_x, v_y) = turn(row.v_x, row.v_y);
    let (v_x_dot, v_y_dot) = turn(row.v_x_dot, row.v_y_dot);
    MotionSample { v_x, v_y, v_x_dot, v_y_dot, r: row.r - r, a_x: row.a_x - a_x, a_y: row.a_y - a_y, ..*row }
}

/// Offsets of r, a_x, a_y and of the sideslip angle, in this order.
///
/// While driving straight, the yaw rate is zero at the median; the accelerations are v_x' − v_y r and v_y' + v_x r; and
/// the rear axle has no slip where there is no lateral acceleration: sideslip is the intercept of its slip angle over
/// a_y. A shift S_h of the rear tires' curve is the same to all signals as a turned velocity sensor, and goes with it.
/// All of it by medians and Tukey's weights, round and round until each knows the others.
///
/// On a level road the rest a_y − v_y' − v_x r over v_x would tell the yaw rate's error from the acceleration's by slope
/// and intercept. Real straights fall to one side, and fast ones are not slow ones: on the track of
/// `scenarios/replay_250lm.toml` that slope says 0.007 rad/s, where the turn of two whole laps says −0.0007 rad/s and
/// the median −0.0005 rad/s. Hence the median; what the road falls goes into the offset of a_y.
pub fn estimate_offsets(rows: &[MotionSample], car: &Car, settings: &OffsetSettings) -> [SensorOffset; 4] {
    let given = [settings.r, settings.a_x, settings.a_y, settings.sideslip];
    let mut value = given.map(|g| g.unwrap_or(0.0));
    let mut scatter = [None; 4];
    let mut samples = 0;
    let mut enough = false;
    for _ in 0..10 {
        let straight = straight_driving_rows(rows, value[0], settings);
        samples = straight.len();
        enough = total_duration(&straight) >= settings.enough;
        if !enough {
            break;
        }
        for i in 0..4 {
            let now: Vec<MotionSample> = straight.iter().map(|row| subtract_offsets(row, value)).collect();
            if let (None, Some((error, std))) = (given[i], remaining_offset(i, &now, car)) {
                value[i] += error;
                scatter[i] = Some(std);
            }
        }
    }
    std::array::from_fn(|i| {
        let (name, unit) = NAMES[i];
        let source = match given[i] {
            Some(_) => OffsetSource::Given,
            None if enough => OffsetSource::Estimated,
            None => OffsetSource::TooFewStraightSamples,
        };
        // Rounds that ended early leave nothing half done.
        let estimated = source != OffsetSource::TooFewStraightSamples;
        let value = if estimated { value[i] } else { 0.0 };
        SensorOffset { name, unit, value, source, samples, spread: scatter[i].filter(|_| estimated) }
    })
}

/// What is left of offset `i` in corrected rows, and the spread of single samples.
fn remaining_offset(i: usize, rows: &[MotionSample], car: &Car) -> Option<(f64, f64)> {
    let rear = |row: &MotionSample| (row.v_y - car.body.l_r * row.r).atan2(row.v_x);
    let errors: Vec<f64> = match i {
        0 => rows.iter().map(|row| row.r).collect(),
        1 => rows.iter().map(|row| row.a_x - (row.v_x_dot - row.v_y * row.r)).collect(),
        2 => rows.iter().map(|row| row.a_y - (row.v_y_dot + row.v_x * row.r)).collect(),
        _ => {
            let a_y: Vec<f64> = rows.iter().map(|row| row.a_y).collect();
            let slip: Vec<f64> = rows.iter().map(rear).collect();
            let slope = fit_robust_line(&a_y, &slip).map_or(0.0, |[_, slope]| slope);
            slip.iter().zip(&a_y).map(|(s, a)| s - slope * a).collect()
        }
    };
    let centre = median(&mut errors.clone())?;
    Some((centre, robust_std(&errors, centre)?))
}

/// Rows of stretches in which the yaw rate stays small for long enough.
fn straight_driving_rows(rows: &[MotionSample], r: f64, settings: &OffsetSettings) -> Vec<MotionSample> {
    let is_straight = |row: &MotionSample| (row.r - r).abs() <= settings.straight;
    rows.chunk_by(|a, b| a.stretch == b.stretch && is_straight(a) == is_straight(b))
        .filter(|run| is_straight(&run[0]) && run[run.len() - 1].time - run[0].time >= settings.steady)
        .flatten()
        .copied()
        .collect()
}

/// Time that neighbouring rows cover [s].
fn total_duration(rows: &[MotionSample]) -> f64 {
    let steps: Vec<f64> = rows.windows(2).map(|w| w[1].time - w[0].time).collect();
    median(&mut steps.clone()).map_or(0.0, |step| step * rows.len() as f64)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// A car at varying speed that goes straight, with some wander, but for corners of `share` of the time.
    fn drive(share: f64) -> Vec<MotionSample> {
        let row = |i: usize| {
            let time = 0.01 * i as f64;
            let corner = (time % 10.0) / 10.0 < share;
            let (v_x, v_x_dot) = (40.0 + 10.0 * (0.3 * time).sin(), 3.0 * (0.3 * time).cos());
            let wander = 0.01 * (std::f64::consts::PI * time).sin();
            let r = if corner { 0.5 } else { wander };
            // Rear tires of 14 per rad carry the lateral acceleration.
            let a_y = v_x * r;
            let v_y = 1.6 * r - v_x * a_y / (14.0 * 9.81);
            let a_x = v_x_dot - v_y * r;
            MotionSample { time, v_x, v_y, v_x_dot, r, a_x, a_y, a_z: 9.81, ..MotionSample::default() }
        };
        (0..6000).map(row).collect()
    }

    const TRUE: [f64; 4] = [-0.004, -0.11, 0.16, 0.0035];

    fn disturbed(row: &MotionSample) -> MotionSample {
        let clean = subtract_offsets(row, [0.0, 0.0, 0.0, -TRUE[3]]);
        MotionSample { r: row.r + TRUE[0], a_x: row.a_x + TRUE[1], a_y: row.a_y + TRUE[2], ..clean }
    }

    #[test]
    fn found_from_straights() {
        let rows: Vec<MotionSample> = drive(0.4).iter().map(disturbed).collect();
        let found = estimate_offsets(&rows, &Car::default(), &OffsetSettings::default());
        for (offset, (expected, close)) in found.iter().zip(TRUE.iter().zip([3e-4, 0.01, 0.03, 3e-4])) {
            assert_eq!(offset.source, OffsetSource::Estimated);
            assert!(offset.samples > 2000, "{offset:?}");
            assert_relative_eq!(offset.value, *expected, epsilon = close);
        }
    }

    #[test]
    fn given_ones_are_taken() {
        let rows: Vec<MotionSample> = drive(0.4).iter().map(disturbed).collect();
        let settings = OffsetSettings { a_y: Some(0.5), r: Some(-0.004), ..OffsetSettings::default() };
        let found = estimate_offsets(&rows, &Car::default(), &settings);
        assert_eq!((found[2].value, found[2].source), (0.5, OffsetSource::Given));
        assert_eq!(found[0].value, -0.004);
        assert_relative_eq!(found[1].value, TRUE[1], epsilon = 0.01);
    }

    #[test]
    fn too_few_straight_samples_are_said() {
        let rows = drive(1.0);
        for offset in estimate_offsets(&rows, &Car::default(), &OffsetSettings::default()) {
            assert_eq!((offset.value, offset.source), (0.0, OffsetSource::TooFewStraightSamples));
            assert_eq!((offset.samples, offset.spread), (0, None));
        }
    }

    #[test]
    fn correction_is_what_takes_the_disturbance_off() {
        for row in drive(0.4).iter().step_by(97) {
            let found = subtract_offsets(&disturbed(row), TRUE);
            assert_relative_eq!(found.v_x, row.v_x, epsilon = 1e-12);
            assert_relative_eq!(found.v_y, row.v_y, epsilon = 1e-12);
            assert_relative_eq!(found.a_y, row.a_y, epsilon = 1e-12);
        }
    }
}
