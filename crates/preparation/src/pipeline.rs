//! Prepares a recording: the order of the steps, and what is reported of each.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;

use crate::car::AxleSample;
use crate::direction::ForceDirection;
use crate::drive_log::DriveLog;
use crate::error::Error;
use crate::mask::{self, ExclusionLimits, RowCounts};
use crate::offset::{self, SensorOffset};
use crate::points::{self, CurveId, CurvePointCounts, CurvePoints};
use crate::row::{self, MotionSample, SignalMap};
use crate::settings::PreparationPipeline;
use crate::span::TimeInterval;
use crate::stage::{self, PreparationStage};

/// Points of one axle.
#[derive(Clone, Debug, PartialEq)]
pub struct AxleCurvePoints {
    /// Slip angle and lateral force.
    pub lateral: CurvePoints,
    /// Slip ratio and longitudinal force, where both wheel speeds are known.
    pub longitudinal: Option<CurvePoints>,
}

impl AxleCurvePoints {
    /// Of both directions.
    pub fn points_by_direction(&self) -> impl Iterator<Item = &CurvePoints> {
        std::iter::once(&self.lateral).chain(&self.longitudinal)
    }
}

/// What a recording was turned into.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedRecording {
    /// Front axle.
    pub front: AxleCurvePoints,
    /// Rear axle.
    pub rear: AxleCurvePoints,
    /// What went into and came out of each step.
    pub stages: Vec<PreparationStage>,
    /// What was done to the recording as a whole.
    pub report: PreparationReport,
}

/// What was done to a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PreparationReport {
    /// Rows of `v_x`, and why some are not used.
    pub lost: RowCounts,
    /// Repeated rows that were dropped, by signal.
    pub held: BTreeMap<&'static str, usize>,
    /// Gear shifts.
    pub gear_shifts: usize,
    /// Stretches that are used.
    pub stretches: Vec<TimeInterval>,
    /// Rows at common instants.
    pub rows: usize,
    /// Offsets of r, a_x, a_y and sideslip.
    pub offsets: [SensorOffset; 4],
    /// What became of the rows, by axle and direction.
    pub points: Vec<CurvePointCounts>,
}

impl PreparationPipeline {
    /// Prepares a recording.
    ///
    /// # Errors
    /// If a signal is missing or unusable, a setting makes no sense, or nothing is left.
    pub fn prepare(&self, recording: &DriveLog) -> Result<PreparedRecording, Error> {
        self.check_settings()?;
        if self.car.differential.is_some() {
            ["omega_rl", "omega_rr"]
                .iter()
                .find_map(|name| recording.error_if_missing(name))
                .map_or(Ok(()), Err)?;
        }
        let mut signals: SignalMap =
            recording.checked_signals()?.into_iter().map(|(n, s)| (n, s.borrowed())).collect();
        let mut stages = Vec::new();
        let held = self.drop_repeated_rows(&mut signals, &mut stages);
        let held_v_x = held.get("v_x").copied().unwrap_or(0);
        let (stretches, gear_shifts, lost) =
            mask::usable_stretches(&signals, held_v_x, &self.exclusion_limits());
        stages.push(signal_stage("stretches", &signals, &stage::restrict_to_stretches(&signals, &stretches)));
        let raw = self.resample_to_common_instants(&signals, &stretches, &mut stages);
        if raw.is_empty() {
            return Err(self.no_points_error(&lost));
        }
        let time: Arc<[f64]> = raw.iter().map(|row| row.time).collect();
        let offsets = offset::estimate_offsets(&raw, &self.car, &self.offsets);
        let axles = self.axle_samples(&time, &raw, offsets.map(|o| o.value), &mut stages);
        let front = self.axle_curve_points(&time, &axles, 0, &mut stages)?;
        let rear = self.axle_curve_points(&time, &axles, 1, &mut stages)?;
        let points = [&front, &rear]
            .into_iter()
            .flat_map(AxleCurvePoints::points_by_direction)
            .map(|p| p.counts.clone())
            .collect();
        let report =
            PreparationReport { lost, held, gear_shifts, stretches, rows: raw.len(), offsets, points };
        Ok(PreparedRecording { front, rear, stages, report })
    }

    /// Takes the offsets off and computes what the axles did.
    fn axle_samples(
        &self,
        time: &Arc<[f64]>,
        raw: &[MotionSample],
        offsets: [f64; 4],
        stages: &mut Vec<PreparationStage>,
    ) -> Vec<AxleSample> {
        let rows: Vec<MotionSample> = raw.iter().map(|row| offset::subtract_offsets(row, offsets)).collect();
        let [inputs, corrected] = [raw, &rows].map(|rows| stage::row_columns(time, rows, &stage::MOTION));
        stages.push(PreparationStage { name: "offsets".into(), inputs, outputs: corrected.clone() });
        let axles: Vec<AxleSample> = rows.iter().map(|row| self.car.axle_sample(row)).collect();
        let mut outputs = stage::row_columns(time, &axles, &stage::AXLES);
        for (axle, view) in stage::SLIP_RATIOS.iter().enumerate() {
            if axles.iter().all(|row| row.kappa[axle].is_some()) {
                outputs.extend(stage::row_columns(time, &axles, &[*view]));
            }
        }
        stages.push(PreparationStage { name: "axle forces and slips".into(), inputs: corrected, outputs });
        axles
    }

    fn exclusion_limits(&self) -> ExclusionLimits {
        let Self { min_speed, gear_shift, gap, shortest, .. } = *self;
        ExclusionLimits { min_speed, gear_shift, gap, shortest }
    }

    fn drop_repeated_rows(
        &self,
        signals: &mut SignalMap,
        stages: &mut Vec<PreparationStage>,
    ) -> BTreeMap<&'static str, usize> {
        if !self.drop_held {
            return BTreeMap::new();
        }
        let before = signals.clone();
        let held = mask::drop_repeated_rows(signals);
        stages.push(signal_stage("repeated rows", &before, signals));
        held
    }

    /// Smooths each stretch for itself and brings its signals to common instants.
    fn resample_to_common_instants(
        &self,
        signals: &SignalMap,
        stretches: &[TimeInterval],
        stages: &mut Vec<PreparationStage>,
    ) -> Vec<MotionSample> {
        let origin = signals["v_x"].time.first().copied().unwrap_or(0.0);
        let [mut raw, mut smoothed, mut common] = [const { SignalMap::new() }; 3];
        let mut rows = Vec::new();
        for (number, stretch) in stretches.iter().enumerate() {
            let part = row::cut_to_stretch(signals, stretch);
            let smooth = row::smooth_signals(&part, &self.smooth);
            let at = row::common_instants(&smooth, origin, self.rate);
            let together = row::resample_signals(&smooth, &at, self.interpolation);
            rows.extend(row::motion_samples(&together, &at, number));
            append_signals(&mut raw, &part);
            append_signals(&mut smoothed, &smooth);
            append_signals(&mut common, &together);
        }
        stages.push(signal_stage("smoothing", &raw, &smoothed));
        stages.push(signal_stage("common instants", &smoothed, &common));
        rows
    }

    fn axle_curve_points(
        &self,
        time: &[f64],
        rows: &[AxleSample],
        axle: usize,
        stages: &mut Vec<PreparationStage>,
    ) -> Result<AxleCurvePoints, Error> {
        let mut points = |direction, slip: Vec<f64>| {
            points::collect_curve_points(self, CurveId { axle, direction }, time, rows, &slip, stages)
        };
        let slip_angles = rows.iter().map(|row| row.alpha[axle]).collect();
        let slip_ratios: Option<Vec<f64>> = rows.iter().map(|row| row.kappa[axle]).collect();
        Ok(AxleCurvePoints {
            lateral: points(ForceDirection::Lateral, slip_angles)?,
            longitudinal: slip_ratios.map(|slip| points(ForceDirection::Longitudinal, slip)).transpose()?,
        })
    }

    fn no_points_error(&self, lost: &RowCounts) -> Error {
        let RowCounts { rows, held, slow, gear_shift, gap, short, .. } = *lost;
        let longest = self.gap.map_or_else(|| "3.5 usual steps".to_owned(), |gap| format!("{gap} s"));
        let lost = format!(
            "{held} repeat the row before, {slow} are slower than {} m/s, {gear_shift} are around gear shifts, \
             {gap} lie where a signal has a gap of more than {longest} or is not there, {short} in shorter stretches",
            self.min_speed
        );
        Error::NothingLeft { shortest: self.shortest, rows, lost }
    }
}

fn signal_stage(name: &str, inputs: &SignalMap, outputs: &SignalMap) -> PreparationStage {
    PreparationStage {
        name: name.into(),
        inputs: stage::signal_columns(inputs),
        outputs: stage::signal_columns(outputs),
    }
}

fn append_signals(all: &mut SignalMap<'static>, part: &SignalMap) {
    for (&name, part) in part {
        let signal = all.entry(name).or_default();
        signal.time.to_mut().extend(&*part.time);
        signal.value.to_mut().extend(&*part.value);
    }
}
