//! Holds the settings of the preparation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::car::Car;
use crate::noise::ConstantNoiseQuantity;
use crate::offset::OffsetSettings;
use crate::outlier::OutlierRejection;
use crate::resample::Interpolation;
use crate::row::SignalFilters;
use crate::shift::ShiftEstimation;
use crate::slip_resampling::SlipResampling;

/// Steps from signals to points of tire curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PreparationPipeline {
    /// The car.
    #[serde(skip)]
    pub car: Car,
    /// Rate of the common instants [Hz].
    pub rate: f64,
    /// Longest time between two rows of a signal without a gap [s]. By default 3.5 times the step that 95 % of the steps of the
    /// signal do not exceed.
    pub gap: Option<f64>,
    /// Shortest stretch without a gap [s], at least five times the longest time without a gap; shorter ones are dropped.
    pub shortest: f64,
    /// Drops rows that repeat the row before: their values are older than their time stamps.
    pub drop_held: bool,
    /// Slowest forward speed [m/s]; slower rows are dropped.
    pub min_speed: f64,
    /// Duration of the disturbance by a gear shift [s]; its rows are dropped.
    pub gear_shift: f64,
    /// Filters of the signals.
    pub smooth: SignalFilters,
    /// Interpolation to the common instants.
    pub interpolation: Interpolation,
    /// Constant errors of the sensors, known or estimated.
    pub offsets: OffsetSettings,
    /// Rejection of outliers.
    pub outliers: OutlierRejection,
    /// Quantity with the same noise at all loads.
    pub noise: ConstantNoiseQuantity,
    /// Estimation of the shifts S_h and S_v.
    pub shifts: ShiftEstimation,
    /// Evens out the density of points over slip.
    pub slip_resampling: SlipResampling,
}

impl Default for PreparationPipeline {
    fn default() -> Self {
        Self {
            car: Car::default(),
            rate: 100.0,
            gap: None,
            shortest: 1.0,
            drop_held: true,
            min_speed: 10.0,
            gear_shift: 0.2,
            smooth: SignalFilters::default(),
            interpolation: Interpolation::default(),
            offsets: OffsetSettings::default(),
            outliers: OutlierRejection::default(),
            noise: ConstantNoiseQuantity::default(),
            shifts: ShiftEstimation::default(),
            slip_resampling: SlipResampling::default(),
        }
    }
}
