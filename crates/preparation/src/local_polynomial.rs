//! Fits a polynomial to the neighbours of a sample by weighted least squares, as weights of their values.

/// Weights h for which Σ h y is the value (`derivative` 0) or the first derivative (1) at offset 0 of the polynomial
/// that fits values y at these offsets best, with these weights of their squared residuals.
///
/// By orthogonal polynomials on the offsets (Forsythe, "Generation and use of orthogonal polynomials for data-fitting
/// with a digital computer", 1957). The degree is lowered where the offsets cannot tell the wanted one.
pub fn local_polynomial_weights(
    offsets: &[f64],
    weights: &[f64],
    degree: usize,
    derivative: usize,
) -> Vec<f64> {
    let reach = offsets.iter().fold(0.0f64, |most, t| most.max(t.abs()));
    let scale = if reach > 0.0 { reach } else { 1.0 };
    let x: Vec<f64> = offsets.iter().map(|t| t / scale).collect();
    let mut h = vec![0.0; x.len()];
    let (mut before, mut p) = (vec![0.0; x.len()], vec![1.0; x.len()]);
    // Value and derivative at offset 0 of the last polynomial and the one before.
    let (mut at_before, mut at) = ([0.0; 2], [1.0, 0.0]);
    let mut norm_before = 1.0;
    for k in 0..=degree {
        let norm: f64 = weights.iter().zip(&p).map(|(w, p)| w * p * p).sum();
        let total: f64 = weights.iter().sum();
        if norm <= 1e-14 * total {
            break;
        }
        for ((h, w), p) in h.iter_mut().zip(weights).zip(&p) {
            *h += w * p * at[derivative] / norm;
        }
        let a = x.iter().zip(weights).zip(&p).map(|((x, w), p)| w * x * p * p).sum::<f64>() / norm;
        let b = if k == 0 { 0.0 } else { norm / norm_before };
        let next = x.iter().zip(&p).zip(&before).map(|((x, p), q)| (x - a) * p - b * q).collect();
        before = std::mem::replace(&mut p, next);
        let at_next = [-a * at[0] - b * at_before[0], at[0] - a * at[1] - b * at_before[1]];
        at_before = std::mem::replace(&mut at, at_next);
        norm_before = norm;
    }
    if derivative == 1 {
        h.iter_mut().for_each(|h| *h /= scale);
    }
    h
}

/// Remembers the weights of the last window: with even time stamps they serve for the next one as well.
#[derive(Default)]
pub struct WindowWeightCache {
    offsets: Vec<f64>,
    weights: Vec<f64>,
}

impl WindowWeightCache {
    /// Weights for a window of time stamps around `centre` [s].
    pub fn cached_weights(
        &mut self,
        time: &[f64],
        centre: f64,
        compute: impl FnOnce(&[f64]) -> Vec<f64>,
    ) -> &[f64] {
        let width = time[time.len() - 1] - time[0];
        // Stamps k h differ from even ones by rounding; what that does to the weights is of the same order.
        let even = |(t, o): (&f64, &f64)| (t - centre - o).abs() <= 1e-10 * width;
        if time.len() != self.offsets.len() || !time.iter().zip(&self.offsets).all(even) {
            self.offsets = time.iter().map(|t| t - centre).collect();
            self.weights = compute(&self.offsets);
        }
        &self.weights
    }
}
