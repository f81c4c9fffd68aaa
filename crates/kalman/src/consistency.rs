//! Judges a filter while it runs: are its innovations as large as it says?

use serde::{Deserialize, Serialize};

/// Weighted mean of the normalised innovations squared (NIS) of measurements with `M` components, and the band that
/// it keeps to when the model is right.
///
/// For a consistent filter each NIS follows χ² with `M` degrees of freedom, independently of the others. Older values
/// count less, by a constant factor for each step, so that the mean has the weight of n = (Σw)² / Σw² values and n
/// times the mean follows χ² with n M degrees of freedom, nearly (Bar-Shalom, Li and Kirubarajan, Estimation with
/// Applications to Tracking and Navigation, section 5.4.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NisConsistency<const M: usize> {
    sum: f64,
    weights: f64,
    squared_weights: f64,
}

/// Where a mean of normalised innovations squared stands [-].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanNis {
    /// The mean; `M` on average for a consistent filter.
    pub mean: f64,
    /// Lower end of the band: below it the noises are smaller than the filter says.
    pub low: f64,
    /// Upper end of the band: above it the model is wrong, or the noises are larger than the filter says.
    pub high: f64,
}

impl MeanNis {
    /// Whether the mean is in its band; NaN is not.
    pub fn is_consistent(&self) -> bool {
        (self.low..=self.high).contains(&self.mean)
    }
}

impl<const M: usize> NisConsistency<M> {
    /// Takes the NIS of one step, after all earlier ones have lost the share 1 − `kept` of their weight, and judges
    /// the mean by a band of ± `deviations` standard deviations of a normal variable of the same probability.
    ///
    /// `kept` is from 0 to 1; with e^(−h/τ) the mean remembers the time τ.
    pub fn update_mean_nis(&mut self, nis: f64, kept: f64, deviations: f64) -> MeanNis {
        self.sum = kept * self.sum + nis;
        self.weights = kept * self.weights + 1.0;
        self.squared_weights = kept * kept * self.squared_weights + 1.0;
        let freedom = M as f64 * self.weights * self.weights / self.squared_weights;
        let quantile = |z: f64| M as f64 * reduced_chi_squared_quantile(freedom, z);
        MeanNis { mean: self.sum / self.weights, low: quantile(-deviations), high: quantile(deviations) }
    }
}

/// Quantile of χ² over its degrees of freedom, at the probability of the standard normal quantile `z` (Wilson and
/// Hilferty 1931).
fn reduced_chi_squared_quantile(freedom: f64, z: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + z * spread.sqrt()).max(0.0).powi(3)
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use rand::SeedableRng;
    use rand_distr::{ChiSquared, Distribution};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Share of steps, after the first thousand, in which the mean of χ² values with 4 degrees of freedom, each times
    /// `factor`, is outside of its band.
    fn outside(factor: f64, deviations: f64) -> f64 {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let chi_squared = ChiSquared::new(4.0).expect("4 > 0");
        let mut consistency = NisConsistency::<4>::default();
        let steps = 400_000;
        let found = (0..steps).filter(|_| {
            let nis = factor * chi_squared.sample(&mut random);
            !consistency.update_mean_nis(nis, 0.99, deviations).is_consistent()
        });
        found.count() as f64 / f64::from(steps)
    }

    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, z, expected) in
            [(4.0, 1.959_964, 11.143), (4.0, -1.959_964, 0.484), (100.0, 2.326_348, 135.807)]
        {
            let found = freedom * reduced_chi_squared_quantile(freedom, z);
            assert_abs_diff_eq!(found, expected, epsilon = 0.05);
        }
    }

    #[test]
    fn a_consistent_filter_leaves_the_band_as_often_as_it_says() {
        let found = outside(1.0, 1.959_964);
        assert!((0.035..0.065).contains(&found), "{found}");
        assert_eq!(outside(1.0, 6.0), 0.0);
    }

    #[test]
    fn innovations_of_a_wrong_size_leave_the_band() {
        assert!(outside(1.6, 4.0) > 0.7, "{}", outside(1.6, 4.0));
        assert!(outside(0.5, 4.0) > 0.95, "{}", outside(0.5, 4.0));
    }

    #[test]
    fn the_first_value_is_judged_by_its_own_band() {
        let judged = NisConsistency::<4>::default().update_mean_nis(4.0, 0.99, 2.0);
        assert_eq!(judged.mean, 4.0);
        assert!(judged.low < 1.0 && judged.high > 10.0, "{judged:?}");
        assert!(!NisConsistency::<4>::default().update_mean_nis(f64::NAN, 0.99, 2.0).is_consistent());
    }
}
