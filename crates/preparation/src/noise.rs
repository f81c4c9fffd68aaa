//! Weighs points by what is known of their noise.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The quantity with the same noise at all loads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConstantNoiseQuantity {
    /// Force over load: the noise of the force grows with the load.
    #[default]
    Coefficient,
    /// Force: points are weighted with the square of their load over the mean load.
    Force,
}

impl ConstantNoiseQuantity {
    /// Weights of points with these loads.
    pub fn point_weights(self, loads: &[f64]) -> Vec<f64> {
        let mean = loads.iter().sum::<f64>() / loads.len() as f64;
        let weight = |load: &f64| match self {
            Self::Coefficient => 1.0,
            Self::Force => (load / mean).powi(2),
        };
        loads.iter().map(weight).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_count_by_the_noise_of_their_coefficient() {
        assert_eq!(ConstantNoiseQuantity::Coefficient.point_weights(&[2e3, 6e3]), [1.0, 1.0]);
        // A force of the same noise, over half the load: twice the noise.
        assert_eq!(ConstantNoiseQuantity::Force.point_weights(&[2e3, 6e3]), [0.25, 2.25]);
    }
}
