//! Tires and sideslip of a car whose v_y nobody measured: an extended Kalman filter whose prediction errors are the likelihood.
//!
//! The tires must explain yaw rate and lateral acceleration; beside them stand two relations that know no tire,
//! v̇_y = a_y − v_x r − g sin(bank) and v̇_x = a_x + r v_y − g sin(grade). What each gets wrong wanders: grade and bank as accelerations,
//! the tires as errors of their slip angles, of each axle and of both. The error of both is invisible to yaw rate and a_y, so its size is a
//! setting, not an estimate.

mod bank;
mod bank_learning;
mod car;
mod filter;
mod fit;
mod likelihood;
mod parameters;
mod setup;
mod signals;
mod smoother;
mod track;

pub use bank::BankMap;
pub use fit::{Error, IntervalEstimate, SideslipFit, fit_sideslip_model};
pub use parameters::{AxleTire, NAMES, SideslipModelParameters};
pub use setup::{Disturbances, EstimatorSetup, GaussMarkov};
pub use signals::{SensorChannel, SensorSignals};
pub use track::{SideslipEstimate, filter_sideslip, smooth_sideslip};
