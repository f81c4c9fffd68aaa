//! Reads logs, fits curves of axles to them by least squares, and replays them into the estimator.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]
#![allow(dead_code, reason = "each test and example uses a part")]

pub mod fit;
pub mod log;
pub mod replay;
