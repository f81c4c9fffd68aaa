//! Holds the settings of the preparation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::car::Car;
use crate::noise::NoiseOf;
use crate::offset::Offsets;
use crate::outlier::Outliers;
use crate::resample::Interpolation;
use crate::row::SignalFilters;
use crate::shift::Shifts;
use crate::slip_resampling::SlipResampling;

/// Steps from signals to points of tire curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Pipeline {
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
    pub offsets: Offsets,
    /// Rejection of outliers.
    pub outliers: Outliers,
    /// Quantity with the same noise at all loads.
    pub noise: NoiseOf,
    /// Estimation of the shifts S_h and S_v.
    pub shifts: Shifts,
    /// Evens out the density of points over slip.
    pub slip_resampling: SlipResampling,
}

impl Default for Pipeline {
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
            offsets: Offsets::default(),
            outliers: Outliers::default(),
            noise: NoiseOf::default(),
            shifts: Shifts::default(),
            slip_resampling: SlipResampling::default(),
        }
    }
}
