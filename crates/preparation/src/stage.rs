//! Keeps the input and output of each step of the preparation, for diagrams.

use std::sync::Arc;

use crate::car::AxleSample;
use crate::drive_log::Signal;
use crate::row::{MotionSample, SignalMap};
use crate::span::TimeInterval;

/// Values over time that went into or came out of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StageColumn {
    /// Name of the signal.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Time stamps [s]; columns of the same stamps share them.
    pub time: Arc<[f64]>,
    /// Values, one for each stamp.
    pub values: Vec<f64>,
}

/// A step of the preparation.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparationStage {
    /// What was done.
    pub name: String,
    /// What went in.
    pub inputs: Vec<StageColumn>,
    /// What came out, which may have other time stamps.
    pub outputs: Vec<StageColumn>,
}

/// A column of rows: name, unit, and what it shows of a row.
pub type ColumnAccessor<R> = (&'static str, &'static str, fn(&R) -> f64);

/// Unit of a signal or a derivative by its name.
fn signal_unit(name: &str) -> &'static str {
    match name {
        "v_x" | "v_y" => "m/s",
        "a_x" | "a_y" | "a_z" | "v_x_dot" | "v_y_dot" => "m/s²",
        "delta" => "rad",
        "r_dot" => "rad/s²",
        "gear" => "-",
        _ => "rad/s",
    }
}

/// Signals as columns.
pub fn signal_columns(signals: &SignalMap) -> Vec<StageColumn> {
    let column = |(name, signal): (&&'static str, &Signal)| StageColumn {
        name: name.to_string(),
        unit: signal_unit(name),
        time: signal.time[..].into(),
        values: signal.value.to_vec(),
    };
    signals.iter().map(column).collect()
}

/// Rows as columns over the same stamps.
pub fn row_columns<R>(time: &Arc<[f64]>, rows: &[R], views: &[ColumnAccessor<R>]) -> Vec<StageColumn> {
    let column = |(name, unit, of): &ColumnAccessor<R>| StageColumn {
        name: name.to_string(),
        unit,
        time: time.clone(),
        values: rows.iter().map(of).collect(),
    };
    views.iter().map(column).collect()
}

/// The signals of the car at common instants.
pub const MOTION: [ColumnAccessor<MotionSample>; 7] = [
    ("v_x", "m/s", |row| row.v_x),
    ("v_y", "m/s", |row| row.v_y),
    ("a_x", "m/s²", |row| row.a_x),
    ("a_y", "m/s²", |row| row.a_y),
    ("r", "rad/s", |row| row.r),
    ("r_dot", "rad/s²", |row| row.r_dot),
    ("delta", "rad", |row| row.delta),
];

/// What the axles do.
pub const AXLES: [ColumnAccessor<AxleSample>; 8] = [
    ("F_zf", "N", |row| row.F_z[0]),
    ("F_zr", "N", |row| row.F_z[1]),
    ("F_xf", "N", |row| row.force.F_x[0]),
    ("F_xr", "N", |row| row.force.F_x[1]),
    ("F_yf", "N", |row| row.force.F_y[0]),
    ("F_yr", "N", |row| row.force.F_y[1]),
    ("alpha_f", "rad", |row| row.alpha[0]),
    ("alpha_r", "rad", |row| row.alpha[1]),
];

/// Slip ratios of the front and the rear axle, where they are known.
pub const SLIP_RATIOS: [ColumnAccessor<AxleSample>; 2] = [
    ("kappa_f", "-", |row| row.kappa[0].unwrap_or(f64::NAN)),
    ("kappa_r", "-", |row| row.kappa[1].unwrap_or(f64::NAN)),
];

/// The rows of a signal that are in one of the stretches, which rise.
pub fn restrict_to_stretches(signals: &SignalMap, stretches: &[TimeInterval]) -> SignalMap<'static> {
    let part = |signal: &Signal| signal.select_rows(stretches.iter().flat_map(|s| s.row_range(&signal.time)));
    signals.iter().map(|(name, signal)| (*name, part(signal))).collect()
}
