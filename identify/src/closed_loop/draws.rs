//! Draws tires from what the curvature of the cost says of them, within the box.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use super::likelihood::Theta8;
use crate::posterior::Posterior;

/// How many there are.
const DRAWS: usize = 2048;
/// How often a draw outside the box is made again before it is moved to its border.
const TRIES: usize = 200;

/// Draws of the front and the rear axle from the normal distribution about the best parameters, as far as it is in the box;
/// none if its covariance is not positive definite.
pub fn draws(
    best: &Theta8,
    covariance: &DMatrix<f64>,
    [lower, upper]: &[DVector<f64>; 2],
    seed: u64,
) -> [Posterior; 2] {
    let mut rng = Pcg64::seed_from_u64(seed);
    [0, 4].map(|o| {
        let own = covariance.view((o, o), (4, 4)).into_owned();
        let Some(factor) = Cholesky::new(own) else { return Posterior::default() };
        let best = DVector::from_column_slice(&best[o..o + 4]);
        let inside =
            |x: &DVector<f64>| (0..4).all(|i| (lower[o + i]..=upper[o + i]).contains(&x[i]));
        let mut normal = || {
            let z = DVector::from_fn(4, |_, _| rng.sample::<f64, _>(StandardNormal));
            &best + factor.l() * z
        };
        let mut draw = |_| {
            let mut x = normal();
            for _ in 0..TRIES {
                if inside(&x) {
                    break;
                }
                x = normal();
            }
            let x: [f64; 4] = std::array::from_fn(|i| x[i].clamp(lower[o + i], upper[o + i]));
            [x[0], x[1], x[2], x[3], 0.0, 0.0]
        };
        Posterior { draws: (0..DRAWS).map(&mut draw).collect() }
    })
}
