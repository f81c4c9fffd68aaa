//! Estimates true slips from noisy ones: mean and variance of the true slip at each measured one.
//!
//! The density of the true slips is a row of weights on a fine grid, estimated from all measured slips by expectation
//! maximisation (deconvolution of Richardson and Lucy). With it the conditional mean is x + σ² d/dx ln p(x) for a density p of the
//! measured slips that really is one with noise (Tweedie's formula; Efron, Tweedie's Formula and Selection Bias, 2011); the
//! derivative of an estimated density would be needed otherwise, whose smoothing would cut the ends of the range.
//! Few iterations are the regularisation: detail finer than the noise would come last.

/// Cells of the grid per standard deviation of the noise.
const FINENESS: f64 = 4.0;
/// Most cells: with noise below 1/5000 of the range nothing is left to correct.
const MOST_CELLS: f64 = 20_000.0;
/// Normal noise ends here, in standard deviations.
const REACH: f64 = 5.0;
const ITERATIONS: usize = 30;

/// Mean and variance of a true slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueSlipMoments {
    pub mean: f64,
    pub variance: f64,
}

/// The density of true slips.
struct TrueSlipDensity {
    first: f64,
    cell: f64,
    noise: f64,
    weights: Vec<f64>,
}

/// The moments of the true slip behind each measured one, for normal noise of a standard deviation.
pub fn true_slip_moments(slip: &[f64], noise: f64) -> Vec<TrueSlipMoments> {
    let density = TrueSlipDensity::estimate(slip, noise);
    slip.iter().map(|&x| density.moments_given_measured(x)).collect()
}

impl TrueSlipDensity {
    fn estimate(slip: &[f64], noise: f64) -> Self {
        let low = slip.iter().copied().fold(f64::INFINITY, f64::min);
        let high = slip.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let cell = (noise / FINENESS).max((high - low) / MOST_CELLS);
        let cells = ((high - low) / cell).ceil() as usize + 1;
        let mut counts = vec![0.0; cells];
        for x in slip {
            counts[((x - low) / cell).round() as usize] += 1.0 / slip.len() as f64;
        }
        let reach = (REACH * noise / cell).ceil() as usize;
        let kernel: Vec<f64> =
            (0..=reach).map(|k| (-0.5 * (k as f64 * cell / noise).powi(2)).exp()).collect();
        let blur = |values: &[f64]| -> Vec<f64> {
            let near = |j: usize| {
                (j.saturating_sub(reach)..=(j + reach).min(cells - 1)).map(move |k| (k, j.abs_diff(k)))
            };
            (0..cells).map(|j| near(j).map(|(k, distance)| kernel[distance] * values[k]).sum()).collect()
        };
        let mut weights = vec![1.0 / cells as f64; cells];
        for _ in 0..ITERATIONS {
            let expected = blur(&weights);
            let ratio: Vec<f64> =
                counts.iter().zip(&expected).map(|(c, e)| if *c > 0.0 { c / e } else { 0.0 }).collect();
            for (weight, gain) in weights.iter_mut().zip(blur(&ratio)) {
                *weight *= gain;
            }
        }
        Self { first: low, cell, noise, weights }
    }

    fn moments_given_measured(&self, x: f64) -> TrueSlipMoments {
        let index = (x - self.first) / self.cell;
        let reach = REACH * self.noise / self.cell;
        let from = (index - reach).ceil().max(0.0) as usize;
        let to = ((index + reach).floor() as usize).min(self.weights.len() - 1);
        let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
        for k in from..=to {
            let offset = (k as f64 - index) * self.cell;
            let weight = self.weights[k] * (-0.5 * (offset / self.noise).powi(2)).exp();
            total += weight;
            first += weight * offset;
            second += weight * offset * offset;
        }
        if total > 0.0 {
            let mean = first / total;
            TrueSlipMoments { mean: x + mean, variance: second / total - mean * mean }
        } else {
            TrueSlipMoments { mean: x, variance: 0.0 }
        }
    }
}
