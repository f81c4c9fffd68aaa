//! Refuses settings that make no sense, before anything is done with them.

use crate::error::Error;
use crate::filter::Filter;
use crate::settings::Pipeline;
use crate::shift::Shifts;
use crate::slip_resampling::SlipResampling;

fn positive(name: &str, found: f64) -> Result<(), Error> {
    Error::unless(found > 0.0 && found.is_finite(), name, found, "a positive number")
}

fn not_negative(name: &str, found: f64) -> Result<(), Error> {
    Error::unless(found >= 0.0, name, found, "zero or a positive number")
}

fn filter(name: &str, filter: Filter) -> Result<(), Error> {
    let key = |key: &str| format!("{name}.{key}");
    match filter {
        Filter::None => Ok(()),
        Filter::SavitzkyGolay { window, order } => {
            Error::unless(order <= 8, &key("order"), order as f64, "a degree of at most 8")?;
            positive(&key("window"), window)
        }
        Filter::MovingAverage { window } => positive(&key("window"), window),
        Filter::Gaussian { sigma } => positive(&key("sigma"), sigma),
    }
}

impl Pipeline {
    /// Whether the settings make sense.
    ///
    /// # Errors
    /// With the name of the first that does not, what was expected and what was found.
    pub fn check(&self) -> Result<(), Error> {
        self.car.check()?;
        positive("rate", self.rate)?;
        positive("shortest", self.shortest)?;
        if let Some(gap) = self.gap {
            positive("gap", gap)?;
            let enough = "at least five times `gap`, so that no signal has fewer than five rows in a stretch";
            Error::unless(self.shortest >= 5.0 * gap, "shortest", self.shortest, enough)?;
        }
        positive("min_speed", self.min_speed)?;
        not_negative("gear_shift", self.gear_shift)?;
        self.smooth.filters().into_iter().try_for_each(|(name, found)| filter(name, found))?;
        positive("offsets.straight", self.offsets.straight)?;
        not_negative("offsets.steady", self.offsets.steady)?;
        positive("offsets.enough", self.offsets.enough)?;
        let neighbours = self.outliers.neighbours;
        Error::unless(neighbours >= 10, "outliers.neighbours", neighbours as f64, "at least 10")?;
        positive("outliers.threshold", self.outliers.threshold)?;
        not_negative("outliers.floor", self.outliers.floor)?;
        if let Shifts::TwoStep { limit, horizontal_share } = self.shifts {
            positive("shifts.limit", limit)?;
            let right = (0.0..=1.0).contains(&horizontal_share);
            Error::unless(right, "shifts.horizontal_share", horizontal_share, "0 to 1")?;
        }
        match self.slip_resampling {
            SlipResampling::Nearest { count } | SlipResampling::Weighted { count } => {
                Error::unless(count >= 2, "slip_resampling.count", count as f64, "at least 2")
            }
            SlipResampling::Off => Ok(()),
        }
    }
}
