//! Finds the influence of each parameter at each slip: the paper's Figure 4.

use serde::Serialize;
use tire_inference::parameters::{Theta, by_parameter, theta_from_magic_formula};
use vehicle::MagicFormula;

use crate::sobol::{SobolIndices, sobol_indices};

/// Sobol's indices over slip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensitivityStudy {
    /// The tire.
    #[serde(serialize_with = "by_parameter")]
    pub centre: Theta,
    /// Half the range of each of B, C, D and E over its value.
    pub spread: f64,
    /// At slips from `limit` / `count` to `limit`.
    pub indices: Vec<SobolIndices>,
}

/// The study for `count` slips up to a limit.
pub fn run_sensitivity_study(
    curve: &MagicFormula,
    spread: f64,
    limit: f64,
    count: usize,
) -> SensitivityStudy {
    let slips: Vec<f64> = (1..=count).map(|i| limit * i as f64 / count as f64).collect();
    SensitivityStudy {
        centre: theta_from_magic_formula(curve),
        spread,
        indices: sobol_indices(curve, spread, &slips),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_is_shared_at_low_slip_the_peak_is_d_and_the_sliding_range_is_c() {
        let study = run_sensitivity_study(
            &MagicFormula { B: 15.0, C: 2.0, D: 1.5, E: 0.8, S_h: 0.0, S_v: 0.0 },
            0.1,
            1.0,
            100,
        );
        assert_eq!(study.indices.len(), 100);
        let total = |percent: usize| study.indices[percent - 1].total;
        let low = total(1);
        assert!(low[..3].iter().all(|share| (share - 1.0 / 3.0).abs() < 0.03), "{low:?}");
        assert!(total(9)[2] > 0.98);
        assert!((20..=100).step_by(10).all(|percent| total(percent)[1] > total(percent)[3]));
    }
}
