//! Prepares a recording: the order of the steps, and what is reported of each.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;

use crate::car::AxleRow;
use crate::direction::Direction;
use crate::drive_log::DriveLog;
use crate::error::Error;
use crate::mask::{self, Limits, RowCounts};
use crate::offset::{self, Offset};
use crate::points::{self, Counts, Curve, Points};
use crate::row::{self, Row, Signals};
use crate::settings::Pipeline;
use crate::span::Span;
use crate::stage::{self, Stage};

/// Points of one axle.
#[derive(Clone, Debug, PartialEq)]
pub struct Axle {
    /// Slip angle and lateral force.
    pub lateral: Points,
    /// Slip ratio and longitudinal force, where both wheel speeds are known.
    pub longitudinal: Option<Points>,
}

impl Axle {
    /// Of both directions.
    pub fn points(&self) -> impl Iterator<Item = &Points> {
        std::iter::once(&self.lateral).chain(&self.longitudinal)
    }
}

/// What a recording was turned into.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// Front axle.
    pub front: Axle,
    /// Rear axle.
    pub rear: Axle,
    /// What went into and came out of each step.
    pub stages: Vec<Stage>,
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
    pub stretches: Vec<Span>,
    /// Rows at common instants.
    pub rows: usize,
    /// Offsets of r, a_x, a_y and sideslip.
    pub offsets: [Offset; 4],
    /// What became of the rows, by axle and direction.
    pub points: Vec<Counts>,
}

impl Pipeline {
    /// Prepares a recording.
    ///
    /// # Errors
    /// If a signal is missing or unusable, a setting makes no sense, or nothing is left.
    pub fn run(&self, recording: &DriveLog) -> Result<Prepared, Error> {
        self.check()?;
        if self.car.differential.is_some() {
            ["omega_rl", "omega_rr"]
                .iter()
                .find_map(|name| recording.lacks(name))
                .map_or(Ok(()), Err)?;
        }
        let mut signals: Signals =
            recording.checked()?.into_iter().map(|(n, s)| (n, s.borrowed())).collect();
        let mut stages = Vec::new();
        let held = self.drop_held(&mut signals, &mut stages);
        let held_v_x = held.get("v_x").copied().unwrap_or(0);
        let (stretches, gear_shifts, lost) = mask::stretches(&signals, held_v_x, &self.limits());
        stages.push(stage("stretches", &signals, &stage::within(&signals, &stretches)));
        let raw = self.common_rows(&signals, &stretches, &mut stages);
        if raw.is_empty() {
            return Err(self.nothing_left(&lost));
        }
        let time: Arc<[f64]> = raw.iter().map(|row| row.time).collect();
        let offsets = offset::estimate(&raw, &self.car, &self.offsets);
        let axles = self.axle_rows(&time, &raw, offsets.map(|o| o.value), &mut stages);
        let front = self.axle(&time, &axles, 0, &mut stages)?;
        let rear = self.axle(&time, &axles, 1, &mut stages)?;
        let points =
            [&front, &rear].into_iter().flat_map(Axle::points).map(|p| p.counts.clone()).collect();
        let report = PreparationReport {
            lost,
            held,
            gear_shifts,
            stretches,
            rows: raw.len(),
            offsets,
            points,
        };
        Ok(Prepared { front, rear, stages, report })
    }

    /// Takes the offsets off and computes what the axles did.
    fn axle_rows(
        &self,
        time: &Arc<[f64]>,
        raw: &[Row],
        offsets: [f64; 4],
        stages: &mut Vec<Stage>,
    ) -> Vec<AxleRow> {
        let rows: Vec<Row> = raw.iter().map(|row| offset::correct(row, offsets)).collect();
        let [inputs, corrected] = [raw, &rows].map(|rows| stage::rows(time, rows, &stage::MOTION));
        stages.push(Stage { name: "offsets".into(), inputs, outputs: corrected.clone() });
        let axles: Vec<AxleRow> = rows.iter().map(|row| self.car.axles(row)).collect();
        let mut outputs = stage::rows(time, &axles, &stage::AXLES);
        for (axle, view) in stage::SLIP_RATIOS.iter().enumerate() {
            if axles.iter().all(|row| row.kappa[axle].is_some()) {
                outputs.extend(stage::rows(time, &axles, &[*view]));
            }
        }
        stages.push(Stage { name: "axle forces and slips".into(), inputs: corrected, outputs });
        axles
    }

    fn limits(&self) -> Limits {
        let Self { min_speed, gear_shift, gap, shortest, .. } = *self;
        Limits { min_speed, gear_shift, gap, shortest }
    }

    fn drop_held(
        &self,
        signals: &mut Signals,
        stages: &mut Vec<Stage>,
    ) -> BTreeMap<&'static str, usize> {
        if !self.drop_held {
            return BTreeMap::new();
        }
        let before = signals.clone();
        let held = mask::drop_held(signals);
        stages.push(stage("repeated rows", &before, signals));
        held
    }

    /// Smooths each stretch for itself and brings its signals to common instants.
    fn common_rows(
        &self,
        signals: &Signals,
        stretches: &[Span],
        stages: &mut Vec<Stage>,
    ) -> Vec<Row> {
        let origin = signals["v_x"].time.first().copied().unwrap_or(0.0);
        let [mut raw, mut smoothed, mut common] = [const { Signals::new() }; 3];
        let mut rows = Vec::new();
        for (number, stretch) in stretches.iter().enumerate() {
            let part = row::cut(signals, stretch);
            let smooth = row::smooth(&part, &self.smooth);
            let at = row::instants(&smooth, origin, self.rate);
            let together = row::resample(&smooth, &at, self.interpolation);
            rows.extend(row::rows(&together, &at, number));
            append(&mut raw, &part);
            append(&mut smoothed, &smooth);
            append(&mut common, &together);
        }
        stages.push(stage("smoothing", &raw, &smoothed));
        stages.push(stage("common instants", &smoothed, &common));
        rows
    }

    fn axle(
        &self,
        time: &[f64],
        rows: &[AxleRow],
        axle: usize,
        stages: &mut Vec<Stage>,
    ) -> Result<Axle, Error> {
        let mut points = |direction, slip: Vec<f64>| {
            points::collect(self, Curve { axle, direction }, time, rows, &slip, stages)
        };
        let slip_angles = rows.iter().map(|row| row.alpha[axle]).collect();
        let slip_ratios: Option<Vec<f64>> = rows.iter().map(|row| row.kappa[axle]).collect();
        Ok(Axle {
            lateral: points(Direction::Lateral, slip_angles)?,
            longitudinal: slip_ratios
                .map(|slip| points(Direction::Longitudinal, slip))
                .transpose()?,
        })
    }

    fn nothing_left(&self, lost: &RowCounts) -> Error {
        let RowCounts { rows, held, slow, gear_shift, gap, short, .. } = *lost;
        let longest =
            self.gap.map_or_else(|| "3.5 usual steps".to_owned(), |gap| format!("{gap} s"));
        let lost = format!(
            "{held} repeat the row before, {slow} are slower than {} m/s, {gear_shift} are around gear shifts, \
             {gap} lie where a signal has a gap of more than {longest} or is not there, {short} in shorter stretches",
            self.min_speed
        );
        Error::NothingLeft { shortest: self.shortest, rows, lost }
    }
}

fn stage(name: &str, inputs: &Signals, outputs: &Signals) -> Stage {
    Stage { name: name.into(), inputs: stage::signals(inputs), outputs: stage::signals(outputs) }
}

fn append(all: &mut Signals<'static>, part: &Signals) {
    for (&name, part) in part {
        let signal = all.entry(name).or_default();
        signal.time.to_mut().extend(&*part.time);
        signal.value.to_mut().extend(&*part.value);
    }
}
