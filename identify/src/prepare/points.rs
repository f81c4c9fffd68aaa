//! Collects the points of each tire curve and says what became of them.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use std::sync::Arc;

use serde::Serialize;

use super::Pipeline;
use super::car::AxleRow;
use super::error::Error;
use super::outlier::filtered;
use super::shift::{Shift, Shifts, from_line};
use super::stage::{Column, Stage};
use crate::samples::Samples;

/// Direction of the force and the slip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Force across the wheels against the slip angle.
    Lateral,
    /// Force along the wheels against the slip ratio.
    Longitudinal,
}

/// Points of one axle in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// What to fit; not shifted.
    pub samples: Samples,
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

/// Points of an axle (0 front, 1 rear) in a direction, with the slip of each row.
pub fn collect(
    pipeline: &Pipeline,
    time: &[f64],
    rows: &[AxleRow],
    axle: usize,
    direction: Direction,
    slip: &[f64],
    stages: &mut Vec<Stage>,
) -> Result<Points, Error> {
    let lateral = direction == Direction::Lateral;
    let least = LEAST_LOAD * pipeline.car.body.static_loads()[axle];
    let carrying: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].F_z[axle] > least).collect();
    let force = |row: &AxleRow| if lateral { row.force.F_y[axle] } else { row.force.F_x[axle] };
    let of =
        |value: &dyn Fn(usize) -> f64| carrying.iter().map(|&i| value(i)).collect::<Vec<f64>>();
    let instants = of(&|i| time[i]);
    let all = Samples::new(of(&|i| slip[i]), of(&|i| force(&rows[i]) / rows[i].F_z[axle]));

    let name = format!("{} {}", AXLES[axle], if lateral { "lateral" } else { "longitudinal" });
    let keep = pipeline.outliers.keep(&all);
    let inliers = filtered(&all, &keep);
    let kept: Vec<f64> = instants.iter().zip(&keep).filter(|(_, k)| **k).map(|(t, _)| *t).collect();
    let weight = pipeline.even.weights(&inliers);
    let samples = pipeline.even.apply(&inliers);
    let used: Vec<f64> =
        kept.iter().zip(&weight).filter(|(_, w)| **w > 0.0).map(|(t, _)| *t).collect();

    let columns = [(&instants, &all), (&kept, &inliers), (&used, &samples)]
        .map(|(t, s)| as_columns(t, s, lateral));
    let [inputs, passed, outputs] = columns;
    stages.push(Stage { name: format!("{name}: outliers"), inputs, outputs: passed.clone() });
    stages.push(Stage { name: format!("{name}: evening out"), inputs: passed, outputs });

    let shift = match pipeline.shifts {
        Shifts::Joint => None,
        Shifts::TwoStep { limit, horizontal_share } => {
            Some(from_line(&inliers, limit, horizontal_share, &name)?)
        }
    };
    let counts = Counts {
        axle: AXLES[axle],
        direction,
        rows: rows.len(),
        unloaded: rows.len() - all.len(),
        outliers: all.len() - inliers.len(),
        used: samples.len(),
        slip_range: samples.slip_range(),
    };
    Ok(Points { samples, shift, counts })
}

fn as_columns(time: &[f64], samples: &Samples, lateral: bool) -> Vec<Column> {
    let time: Arc<[f64]> = time.into();
    let column = |name: &str, unit, values: &[f64]| Column {
        name: name.into(),
        unit,
        time: time.clone(),
        values: values.to_vec(),
    };
    vec![
        column("slip", if lateral { "rad" } else { "-" }, &samples.slip),
        column("force over load", "-", &samples.force),
        column("weight", "-", &samples.weight),
    ]
}
