//! Collects the points of each tire curve and says what became of them.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use std::sync::Arc;

use serde::Serialize;

use crate::car::AxleRow;
use crate::direction::Direction;
use crate::error::Error;
use crate::samples::Samples;
use crate::settings::Pipeline;
use crate::shift::{Shift, Shifts, from_line};
use crate::stage::{Column, Stage};

/// Points of one axle in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// What to fit; not shifted.
    pub samples: Samples,
    /// All points but outliers in the order of time, before their density was evened out.
    pub series: Series,
    /// What the fit is to hold S_h and S_v at, if they were asked for beforehand.
    pub shift: Option<Shift>,
    /// Where they come from.
    pub counts: Counts,
}

/// What became of the rows of one axle in one direction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counts {
    /// `front` or `rear`.
    pub axle: &'static str,
    /// Direction.
    pub direction: Direction,
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
pub struct Curve {
    /// 0 front, 1 rear.
    pub axle: usize,
    /// Direction.
    pub direction: Direction,
}

impl Curve {
    fn name(self) -> String {
        let direction = match self.direction {
            Direction::Lateral => "lateral",
            Direction::Longitudinal => "longitudinal",
        };
        format!("{} {direction}", AXLES[self.axle])
    }

    fn slip_unit(self) -> &'static str {
        match self.direction {
            Direction::Lateral => "rad",
            Direction::Longitudinal => "-",
        }
    }

    /// Force over load [-], in the direction of the curve and in the other one.
    fn forces(self, row: &AxleRow) -> (f64, f64) {
        let [own, other] = match self.direction {
            Direction::Lateral => [row.force.F_y, row.force.F_x],
            Direction::Longitudinal => [row.force.F_x, row.force.F_y],
        };
        let load = row.F_z[self.axle];
        (own[self.axle] / load, other[self.axle] / load)
    }
}

/// Points in the order of time, and what else the axle did. All columns are of the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Time stamps [s].
    pub time: Vec<f64>,
    /// The points.
    pub samples: Samples,
    /// Load of the axle [N].
    pub load: Vec<f64>,
    /// Force in the other direction over the load [-].
    pub other: Vec<f64>,
}

impl Series {
    fn filtered(&self, keep: &[bool]) -> Self {
        let rows: Vec<usize> = (0..keep.len()).filter(|&row| keep[row]).collect();
        self.pick(&rows)
    }

    /// The points of some rows, in their order.
    pub fn pick(&self, rows: &[usize]) -> Self {
        let of = |column: &[f64]| rows.iter().map(|&row| column[row]).collect();
        Self {
            time: of(&self.time),
            samples: self.samples.pick(rows),
            load: of(&self.load),
            other: of(&self.other),
        }
    }

    fn columns(&self, slip_unit: &'static str) -> Vec<Column> {
        let time: Arc<[f64]> = self.time.as_slice().into();
        let Samples { slip, force, weight } = &self.samples;
        [("slip", slip_unit, slip), ("force over load", "-", force), ("weight", "-", weight)]
            .map(|(name, unit, values)| Column {
                name: name.into(),
                unit,
                time: time.clone(),
                values: values.clone(),
            })
            .into()
    }
}

/// Points of a curve from what the axles did at some instants, with the slip at each.
pub fn collect(
    pipeline: &Pipeline,
    curve: Curve,
    time: &[f64],
    rows: &[AxleRow],
    slip: &[f64],
    stages: &mut Vec<Stage>,
) -> Result<Points, Error> {
    let axle = curve.axle;
    let least = LEAST_LOAD * pipeline.car.body.static_loads()[axle];
    let carries: Vec<bool> = rows.iter().map(|row| row.F_z[axle] > least).collect();
    let (force, other) = rows.iter().map(|row| curve.forces(row)).unzip();
    let load: Vec<f64> = rows.iter().map(|row| row.F_z[axle]).collect();
    let weight = pipeline.noise.weights(&load);
    let samples = Samples { weight, ..Samples::new(slip.to_vec(), force) };
    let all = Series { time: time.to_vec(), samples, load, other };
    let loaded = all.filtered(&carries);
    let inliers = loaded.filtered(&pipeline.outliers.keep(&loaded.samples));
    let used = pipeline.slip_resampling.apply(&inliers.samples);
    let selected: Vec<bool> =
        pipeline.slip_resampling.weights(&inliers.samples).iter().map(|w| *w > 0.0).collect();
    let resampled = Series { samples: used, ..inliers.filtered(&selected) };

    let [inputs, passed, outputs] =
        [&loaded, &inliers, &resampled].map(|p| p.columns(curve.slip_unit()));
    let name = curve.name();
    stages.push(Stage { name: format!("{name}: outliers"), inputs, outputs: passed.clone() });
    stages.push(Stage { name: format!("{name}: evening out"), inputs: passed, outputs });

    let shift = match pipeline.shifts {
        Shifts::Joint => None,
        Shifts::TwoStep { limit, horizontal_share } => {
            Some(from_line(&inliers.samples, limit, horizontal_share, &name)?)
        }
    };
    let [rows, loaded, kept] = [&all, &loaded, &inliers].map(|p| p.samples.len());
    let counts = Counts {
        axle: AXLES[axle],
        direction: curve.direction,
        rows,
        unloaded: rows - loaded,
        outliers: loaded - kept,
        used: resampled.samples.len(),
        slip_range: resampled.samples.slip_range(),
    };
    Ok(Points { samples: resampled.samples, series: inliers, shift, counts })
}
