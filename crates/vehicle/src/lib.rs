//! Models a car in the plane: states and inputs go in; slips, loads, tire forces, accelerations and later states
//! come out. The nominal model with linear tires serves estimation and control.
//!
//! Everything is in SI units and radians, in the axes of ISO 8855: x forward, y to the left, z up,
//! so a left turn has positive yaw rate, lateral acceleration and steering angle.
//!
//! The nonlinear car ([`SingleTrackCar`]) is generic over its [`Number`] type: with `f64` it is a plant,
//! with dual numbers the same lines yield exact derivatives with respect to states, inputs and tire
//! parameters.
//!
//! ```
//! use vehicle::{PlanarState, SingleTrackCar, SingleTrackInput};
//!
//! let car = SingleTrackCar::default();
//! let start = PlanarState { v_x: 20.0, ..PlanarState::default() };
//! let left = SingleTrackInput { F_x: 0.0, delta: 0.02 };
//! let end = car.advance(&start, &left, 0.5, 2e-3);
//! assert!(end.r > 0.0 && end.Y > 0.0);
//! ```
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod axle;
mod body;
pub mod detailed_track;
mod driven;
pub mod dual_track;
mod integrate;
mod linear;
mod road;
mod single_track;
mod slip;
mod table;
mod tire_car;
mod wheel;

pub use axle::AxleForces;
pub use body::{Aerodynamics, G, VehicleBody};
pub use integrate::rk4_step;
pub use linear::NominalCar;
pub use road::RoadConditions;

pub use single_track::{PlanarState, SingleTrackCar, SingleTrackEvaluation, SingleTrackInput};
pub use slip::SLIP_SPEED_FLOOR;
pub use table::{BadTable, BilinearMap, PiecewiseLinearCurve};
pub use tire::{MagicFormula, Number};
pub use tire_car::{TireCar, VelocityDual};
pub use wheel::{DifferentialLock, LimitedSlipDifferential, WheelRadiusModel, slip_ratio};
