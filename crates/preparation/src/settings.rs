//! Holds the settings of the preparation.

use serde::{Deserialize, Serialize};

use crate::car::Car;
use crate::noise::NoiseOf;
use crate::offset::Offsets;
use crate::outlier::Outliers;
use crate::resample::Interpolation;
use crate::row::Smoothing;
use crate::shift::Shifts;
use crate::slip_resampling::SlipResampling;

/// Settings of the preparation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pipeline {
    /// The car.
    pub car: Car,
    /// Rate of the common instants [Hz].
    pub rate: f64,
    /// Longest time between two rows of a signal that belong together [s].
    pub gap: f64,
    /// Shortest stretch that is used [s].
    pub shortest: f64,
    /// Whether rows that repeat the one before are dropped: they are older than their time stamp says.
    pub drop_held: bool,
    /// Slowest speed that is used [m/s].
    pub min_speed: f64,
    /// How long a gear shift disturbs [s].
    pub gear_shift: f64,
    /// Filters.
    pub smooth: Smoothing,
    /// How to get to the common instants.
    pub interpolation: Interpolation,
    /// Constant errors of the sensors.
    pub offsets: Offsets,
    /// Which points do not belong.
    pub outliers: Outliers,
    /// What the noise is proportional to.
    pub noise: NoiseOf,
    /// Who finds S_h and S_v.
    pub shifts: Shifts,
    /// How to even out the density over slip.
    pub slip_resampling: SlipResampling,
}

impl Default for Pipeline {
    fn default() -> Self {
        Self {
            car: Car::default(),
            rate: 100.0,
            gap: 0.1,
            shortest: 1.0,
            drop_held: true,
            min_speed: 10.0,
            gear_shift: 0.2,
            smooth: Smoothing::default(),
            interpolation: Interpolation::default(),
            offsets: Offsets::default(),
            outliers: Outliers::default(),
            noise: NoiseOf::default(),
            shifts: Shifts::default(),
            slip_resampling: SlipResampling::default(),
        }
    }
}
