//! Turns the raw signals of a car into the points of its tires' curves: signals with their own time stamps go in; slip, force over
//! load and weight of each axle and direction come out, with what each step did.
//!
//! The steps, in their order: repeated rows dropped, stretches without gaps, slow driving and gear shifts found in the
//! raw signals, each stretch smoothed and brought to common instants, offsets taken off, forces, loads and slips of the
//! axles, outliers rejected, the density over slip evened out. They are those of Goblirsch et al., "Bayesian
//! Optimization-based Tire Parameter and Uncertainty Estimation for Real-World Data", IV 2025, with its signs in eq. 11
//! corrected: l_f F_yf − l_r F_yr + M_LSD = I_zz r' gives F_yf = (l_r m a_y + I_zz r' − M_LSD) / l. Its F_x,cog (eq. 8)
//! holds the part of the front's lateral force that points backwards, too, which is not shared like a braking force.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod car;
mod check;
pub mod direction;
mod drive;
mod drive_log;
mod error;
mod filter;
mod gap;
mod local_polynomial;
mod mask;
mod noise;
mod offset;
mod outlier;
mod pipeline;
mod points;
mod resample;
mod robust;
mod row;
pub mod samples;
mod settings;
mod shift;
mod slip_resampling;
mod span;
mod stage;
mod systematic_error;
#[cfg(test)]
mod tests;

pub use car::{AxleSample, BrakeShare, Car, ShareRule};
pub use drive::{Drive, DriveError, InputInterpolation, InputInterpolations, SHORTEST};
pub use drive_log::{DriveLog, SIGNALS, Signal};
pub use error::Error;
pub use filter::ZeroPhaseFilter;
pub use gap::longest_step;
pub use mask::RowCounts;
pub use noise::ConstantNoiseQuantity;
pub use offset::{OffsetSettings, OffsetSource, SensorOffset};
pub use outlier::OutlierRejection;
pub use pipeline::{AxleCurvePoints, PreparationReport, PreparedRecording};
pub use points::{CurvePointCounts, CurvePoints, PointTimeSeries};
pub use resample::{Interpolation, Resampler, local_mean_or_interpolation};
pub use robust::{difference_noise, median};
pub use row::{MotionSample, SignalFilters};
pub use settings::PreparationPipeline;
pub use shift::{CurveShift, ShiftEstimation};
pub use slip_resampling::SlipResampling;
pub use span::TimeInterval;
pub use stage::{PreparationStage, StageColumn};
pub use systematic_error::{
    ColumnKey, ESTIMATED, ErrorDescription, ErrorKind, START_RELAXATION_LENGTH, SystematicError,
    SystematicErrors,
};
