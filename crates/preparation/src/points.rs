//! Collects the points of each tire curve and says what became of them.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use std::sync::Arc;

use serde::Serialize;

use crate::car::AxleSample;
use crate::direction::ForceDirection;
use crate::error::Error;
use crate::samples::CurveSamples;
use crate::settings::PreparationPipeline;
use crate::shift::{CurveShift, ShiftEstimation, from_line};
use crate::stage::{PreparationStage, StageColumn};

/// Points of one axle in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePoints {
    /// What to fit; not shifted.
    pub samples: CurveSamples,
    /// All points but outliers in the order of time, before their density was evened out.
    pub series: PointTimeSeries,
    /// What the fit is to hold S_h and S_v at, if they were asked for beforehand.
    pub shift: Option<CurveShift>,
    /// Where they come from.
    pub counts: CurvePointCounts,
}

/// What became of the rows of one axle in one direction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurvePointCounts {
    /// `front` or `rear`.
    pub axle: &'static str,
    /// Direction.
    pub direction: ForceDirection,
    /// Rows that there were.
    pub rows: usize,
    /// Left out because the axle carried less than a twentieth of its load at rest.
    pub unloaded: usize,
    /// Left out because the force did not belong to the slip.
    pub outliers: usize,
    /// Points that are used, each of them once.
    pub used: usize,
    /// Smallest and largest slip in use.
    pub slip_range: Option<[f64; 2]>,
}

/// An axle carrying less than this part of its load at rest is as good as off the road: force over load is noise.
const LEAST_LOAD: f64 = 0.05;

const AXLES: [&str; 2] = ["front", "rear"];

/// Whose curve it is, and in which direction.
#[derive(Clone, Copy)]
pub struct CurveId {
    /// 0 front, 1 rear.
    pub axle: usize,
    /// Direction.
    pub direction: ForceDirection,
}

impl CurveId {
    fn curve_name(self) -> String {
        let direction = match self.direction {
            ForceDirection::Lateral => "lateral",
            ForceDirection::Longitudinal => "longitudinal",
        };
        format!("{} {direction}", AXLES[self.axle])
    }

    fn slip_unit(self) -> &'static str {
        match self.direction {
            ForceDirection::Lateral => "rad",
            ForceDirection::Longitudinal => "-",
        }
    }

    /// Force over load [-], in the direction of the curve and in the other one.
    fn normalised_forces(self, row: &AxleSample) -> (f64, f64) {
        let [own, other] = match self.direction {
            ForceDirection::Lateral => [row.force.F_y, row.force.F_x],
            ForceDirection::Longitudinal => [row.force.F_x, row.force.F_y],
        };
        let load = row.F_z[self.axle];
        (own[self.axle] / load, other[self.axle] / load)
    }
}

/// Points in the order of time, and what else the axle did. All columns are of the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointTimeSeries {
    /// Time stamps [s].
    pub time: Vec<f64>,
    /// The points.
    pub samples: CurveSamples,
    /// Load of the axle [N].
    pub load: Vec<f64>,
    /// Force in the other direction over the load [-].
    pub other: Vec<f64>,
}

impl PointTimeSeries {
    fn filter_points(&self, keep: &[bool]) -> Self {
        let rows: Vec<usize> = (0..keep.len()).filter(|&row| keep[row]).collect();
        self.select_rows(&rows)
    }

    /// The points of some rows, in their order.
    pub fn select_rows(&self, rows: &[usize]) -> Self {
        let of = |column: &[f64]| rows.iter().map(|&row| column[row]).collect();
        Self {
            time: of(&self.time),
            samples: self.samples.select_rows(rows),
            load: of(&self.load),
            other: of(&self.other),
        }
    }

    fn to_columns(&self, slip_unit: &'static str) -> Vec<StageColumn> {
        let time: Arc<[f64]> = self.time.as_slice().into();
        let CurveSamples { slip, force, weight } = &self.samples;
        [("slip", slip_unit, slip), ("force over load", "-", force), ("weight", "-", weight)]
            .map(|(name, unit, values)| StageColumn {
                name: name.into(),
                unit,
                time: time.clone(),
                values: values.clone(),
            })
            .into()
    }
}

/// Points of a curve from what the axles did at some instants, with the slip at each.
pub fn collect_curve_points(
    pipeline: &PreparationPipeline,
    curve: CurveId,
    time: &[f64],
    rows: &[AxleSample],
    slip: &[f64],
    stages: &mut Vec<PreparationStage>,
) -> Result<CurvePoints, Error> {
    let axle = curve.axle;
    let least = LEAST_LOAD * pipeline.car.body.static_loads()[axle];
    let carries: Vec<bool> = rows.iter().map(|row| row.F_z[axle] > least).collect();
    let (force, other) = rows.iter().map(|row| curve.normalised_forces(row)).unzip();
    let load: Vec<f64> = rows.iter().map(|row| row.F_z[axle]).collect();
    let weight = pipeline.noise.point_weights(&load);
    let samples = CurveSamples { weight, ..CurveSamples::new(slip.to_vec(), force) };
    let all = PointTimeSeries { time: time.to_vec(), samples, load, other };
    let loaded = all.filter_points(&carries);
    let inliers = loaded.filter_points(&pipeline.outliers.inlier_mask(&loaded.samples));
    let used = pipeline.slip_resampling.resample_points(&inliers.samples);
    let selected: Vec<bool> =
        pipeline.slip_resampling.point_weights(&inliers.samples).iter().map(|w| *w > 0.0).collect();
    let resampled = PointTimeSeries { samples: used, ..inliers.filter_points(&selected) };

    let [inputs, passed, outputs] = [&loaded, &inliers, &resampled].map(|p| p.to_columns(curve.slip_unit()));
    let name = curve.curve_name();
    stages.push(PreparationStage { name: format!("{name}: outliers"), inputs, outputs: passed.clone() });
    stages.push(PreparationStage { name: format!("{name}: evening out"), inputs: passed, outputs });

    let shift = match pipeline.shifts {
        ShiftEstimation::Joint => None,
        ShiftEstimation::TwoStep { limit, horizontal_share } => {
            Some(from_line(&inliers.samples, limit, horizontal_share, &name)?)
        }
    };
    let [rows, loaded, kept] = [&all, &loaded, &inliers].map(|p| p.samples.len());
    let counts = CurvePointCounts {
        axle: AXLES[axle],
        direction: curve.direction,
        rows,
        unloaded: rows - loaded,
        outliers: loaded - kept,
        used: resampled.samples.len(),
        slip_range: resampled.samples.slip_range(),
    };
    Ok(CurvePoints { samples: resampled.samples, series: inliers, shift, counts })
}
