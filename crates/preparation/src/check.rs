//! Refuses settings that make no sense, before anything is done with them.

use crate::error::Error;
use crate::filter::ZeroPhaseFilter;
use crate::settings::PreparationPipeline;
use crate::shift::ShiftEstimation;
use crate::slip_resampling::SlipResampling;

fn check_positive(name: &str, found: f64) -> Result<(), Error> {
    Error::check_setting(found > 0.0 && found.is_finite(), name, found, "a positive number")
}

fn not_negative(name: &str, found: f64) -> Result<(), Error> {
    Error::check_setting(found >= 0.0, name, found, "zero or a positive number")
}

fn check_filter(name: &str, filter: ZeroPhaseFilter) -> Result<(), Error> {
    let key = |key: &str| format!("{name}.{key}");
    match filter {
        ZeroPhaseFilter::None => Ok(()),
        ZeroPhaseFilter::SavitzkyGolay { window, order } => {
            Error::check_setting(order <= 8, &key("order"), order as f64, "a degree of at most 8")?;
            check_positive(&key("window"), window)
        }
        ZeroPhaseFilter::MovingAverage { window } => check_positive(&key("window"), window),
        ZeroPhaseFilter::Gaussian { sigma } => check_positive(&key("sigma"), sigma),
    }
}

impl PreparationPipeline {
    /// Whether the settings make sense.
    ///
    /// # Errors
    /// With the name of the first that does not, what was expected and what was found.
    pub fn check_settings(&self) -> Result<(), Error> {
        self.car.check()?;
        check_positive("rate", self.rate)?;
        check_positive("shortest", self.shortest)?;
        if let Some(gap) = self.gap {
            check_positive("gap", gap)?;
            let enough = "at least five times `gap`, so that no signal has fewer than five rows in a stretch";
            Error::check_setting(self.shortest >= 5.0 * gap, "shortest", self.shortest, enough)?;
        }
        check_positive("min_speed", self.min_speed)?;
        not_negative("gear_shift", self.gear_shift)?;
        self.smooth.named_filters().into_iter().try_for_each(|(name, found)| check_filter(name, found))?;
        check_positive("offsets.straight", self.offsets.straight)?;
        not_negative("offsets.steady", self.offsets.steady)?;
        check_positive("offsets.enough", self.offsets.enough)?;
        let neighbours = self.outliers.neighbours;
        Error::check_setting(neighbours >= 10, "outliers.neighbours", neighbours as f64, "at least 10")?;
        check_positive("outliers.threshold", self.outliers.threshold)?;
        not_negative("outliers.floor", self.outliers.floor)?;
        if let ShiftEstimation::TwoStep { limit, horizontal_share } = self.shifts {
            check_positive("shifts.limit", limit)?;
            let right = (0.0..=1.0).contains(&horizontal_share);
            Error::check_setting(right, "shifts.horizontal_share", horizontal_share, "0 to 1")?;
        }
        match self.slip_resampling {
            SlipResampling::Nearest { count } | SlipResampling::Weighted { count } => {
                Error::check_setting(count >= 2, "slip_resampling.count", count as f64, "at least 2")
            }
            SlipResampling::Off => Ok(()),
        }
    }
}
