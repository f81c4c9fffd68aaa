//! The car that predicts: a single track whose parameters differ a little from log to log, and follow a log while it is driven.
//!
//! Each axle has F_y = F_z D sin(C atan(K / (C D) α)) √(1 − e (F_x / (F_z D))²): the Magic Formula without curvature, weakened by the
//! longitudinal force that the measured speed demands. Loads move with the longitudinal acceleration. The steering is late and has an offset.
//!
//! The parameters of a log are θ + b, where θ is common to all logs and b ~ N(0, s_b²) is its own: tires, floors and steering differ from
//! day to day. [`fit_car`] finds θ from several logs by their errors in open loop. On a log that it never saw, [`parameter_track`] estimates b
//! from predictions that have ended already, so a prediction knows nothing that lies behind its start. [`bands`] says how far
//! predictions are off, calibrated on logs that were left out of the fit.

pub mod adaptive_predictor;
pub mod bands;
pub mod calibration;
pub mod car_predictor;
pub mod fit;
pub mod hierarchy;
pub mod information;
pub mod motion;
pub mod parameter_track;
pub mod parameters;
pub mod section;

pub use adaptive_predictor::AdaptivePredictor;
pub use car_predictor::CarPredictor;
pub use fit::{FittedCar, fit_car};
pub use parameters::{CarSpecification, ParameterVariation, SteeringSignalKind};
