//! Reads logs, fits curves of axles to them by least squares, and replays them into the estimator.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

pub mod fit;
pub mod log;
pub mod replay;
