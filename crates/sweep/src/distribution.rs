//! Probability distributions of varied parameters, by their quantile functions.

pub mod standard_normal;

/// The distribution of a varied parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// Anything between two ends.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A normal distribution.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
    },
    /// Its logarithm is normal.
    LogNormal {
        /// Median, positive.
        median: f64,
        /// Standard deviation of the natural logarithm.
        std_log: f64,
    },
    /// What of a normal distribution lies between two ends, of which one may be infinite.
    Truncated {
        /// Mean of the whole normal distribution.
        mean: f64,
        /// Standard deviation of the whole.
        std: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// One of so many things, each as likely: the levels of a value, or the rows of a table that are taken as a whole, such as draws
    /// of a posterior. What comes out is its index, from 0.
    Values(usize),
}

impl Distribution {
    /// Whether there is such a distribution.
    ///
    /// # Errors
    /// A sentence about what is wrong.
    pub fn check_parameters(&self) -> Result<(), String> {
        let positive = |name: &str, value: f64| match value.is_finite() && value > 0.0 {
            true => Ok(()),
            false => Err(format!("expected a positive number as `{name}`, found {value}")),
        };
        let finite = |name: &str, value: f64| match value.is_finite() {
            true => Ok(()),
            false => Err(format!("expected a finite number as `{name}`, found {value}")),
        };
        let ascending = |low: f64, high: f64| match low < high {
            true => Ok(()),
            false => Err(format!("expected `low` below `high`, found {low} and {high}")),
        };
        match *self {
            Self::Uniform { low, high } => {
                finite("low", low)?;
                finite("high", high)?;
                ascending(low, high)
            }
            Self::Normal { mean, std } => finite("mean", mean).and(positive("std", std)),
            Self::LogNormal { median, std_log } => {
                positive("median", median).and(positive("std_log", std_log))
            }
            Self::Truncated { mean, std, low, high } => {
                finite("mean", mean)?;
                positive("std", std)?;
                match low.is_finite() || high.is_finite() {
                    true => ascending(low, high),
                    false => Err(format!("expected a finite end, found {low} and {high}")),
                }
            }
            Self::Values(0) => Err("expected at least one value, found none".to_owned()),
            Self::Values(_) => Ok(()),
        }
    }

    /// The value with this probability below it, 0 < u < 1: to 1e-12 of the value, or of the standard deviation where that is larger.
    #[must_use]
    pub fn quantile(&self, u: f64) -> f64 {
        match *self {
            Self::Uniform { low, high } => (low * (1.0 - u) + high * u).clamp(low, high),
            Self::Normal { .. } | Self::LogNormal { .. } => {
                self.at_score(standard_normal::normal_quantile(u))
            }
            Self::Truncated { mean, std, low, high } => {
                let [a, b] = [low, high].map(|end| (end - mean) / std);
                let (from_low, distance) = standard_normal::truncated_quantile_from_end(u, a, b);
                // A sum with the nearer end keeps digits that one with the mean would lose.
                let end = if from_low { low } else { high };
                (end + std * distance).clamp(low, high)
            }
            Self::Values(count) => {
                let last = count.saturating_sub(1) as f64;
                (u * count as f64).floor().clamp(0.0, last)
            }
        }
    }

    /// The quantile that has the probability of a standard normal number below it.
    #[must_use]
    pub fn at_score(&self, z: f64) -> f64 {
        match *self {
            Self::Normal { mean, std } => mean + std * z,
            Self::LogNormal { median, std_log } => median * libm::exp(std_log * z),
            _ => {
                let u = standard_normal::normal_cdf(z);
                self.quantile(u.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0))
            }
        }
    }

    /// The least and the largest value, infinite where there is no end.
    #[must_use]
    pub fn support(&self) -> [f64; 2] {
        match *self {
            Self::Uniform { low, high } | Self::Truncated { low, high, .. } => [low, high],
            Self::Normal { .. } => [f64::NEG_INFINITY, f64::INFINITY],
            Self::LogNormal { .. } => [0.0, f64::INFINITY],
            Self::Values(count) => [0.0, count.saturating_sub(1) as f64],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truncated(mean: f64, std: f64, low: f64, high: f64) -> Distribution {
        Distribution::Truncated { mean, std, low, high }
    }

    #[test]
    fn quantiles_are_those_of_tables() {
        // mpmath 1.3 with 50 digits.
        let known = [
            (Distribution::Uniform { low: -2.0, high: 6.0 }, 0.25, 0.0),
            (Distribution::Normal { mean: 1500.0, std: 30.0 }, 0.025, 1441.2010804637985),
            (Distribution::LogNormal { median: 2.0, std_log: 0.5 }, 0.9, 3.7959054146694213),
            (truncated(0.0, 1.0, -1.0, 2.0), 0.3, -0.24240381788922682),
            (truncated(0.0, 1.0, 38.5, f64::INFINITY), 0.7, 38.531238309674315),
            (truncated(-1000.0, 1.0, 0.0, 1.0), 0.5, 0.0006931462471894646),
            (truncated(5.0, 0.25, 1.0, 2.0), 0.01, 1.9061599311410669),
            (truncated(0.8, 0.1, 0.1, 1.1), 0.999, 1.0827104734154889),
            (Distribution::Values(3), 0.34, 1.0),
            (Distribution::Values(3), 1.0 - 1e-16, 2.0),
        ];
        for (distribution, u, expected) in known {
            let found = distribution.quantile(u);
            let wrong = (found - expected).abs();
            assert!(wrong <= 1e-12 * expected.abs(), "{distribution:?} {u} {found} {expected}");
        }
    }

    #[test]
    fn truncated_numbers_stay_between_their_ends_and_ascend() {
        for (low, high) in [(-1.0, 2.0), (3.0, 5.0), (-60.0, -40.0), (40.0, f64::INFINITY)] {
            let own = truncated(0.0, 1.0, low, high);
            let mut last = low;
            for k in 1..1000 {
                let value = own.quantile(f64::from(k) / 1000.0);
                assert!(last < value && value < high, "{low} {high} {k}: {last} {value}");
                last = value;
            }
            // Symmetric to the one on the other side.
            let other = truncated(0.0, 1.0, -high, -low);
            for u in [0.1, 0.5, 0.75] {
                let [a, b] = [own.quantile(u), -other.quantile(1.0 - u)];
                assert!((a - b).abs() <= 1e-12 * a.abs().max(1.0), "{a} {b}");
            }
        }
    }

    #[test]
    fn what_is_no_distribution_is_named() {
        let wrong = [
            (Distribution::Uniform { low: 1.0, high: 1.0 }, "`low` below `high`"),
            (Distribution::Uniform { low: 1.0, high: f64::INFINITY }, "`high`, found inf"),
            (Distribution::Normal { mean: 0.0, std: -1.0 }, "`std`, found -1"),
            (Distribution::LogNormal { median: 0.0, std_log: 1.0 }, "`median`, found 0"),
            (truncated(f64::NAN, 1.0, 0.0, 1.0), "`mean`, found NaN"),
            (Distribution::Values(0), "at least one value"),
        ];
        for (distribution, expected) in wrong {
            let error = distribution.check_parameters().expect_err("no distribution");
            assert!(error.contains(expected), "{error}");
        }
        assert!(truncated(0.0, 1.0, 3.0, f64::INFINITY).check_parameters().is_ok());
    }
}
