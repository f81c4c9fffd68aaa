//! Says the noise of the force: its distribution, and estimates of the unknown parts of it.

use numerics::loss::Loss;
use preparation::samples::CurveSamples;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fit::{FitError, FitOptions};
use crate::kernel::friction_coefficient;
use crate::settings::{FitMethod, IdentificationSettings};

/// Noise of the force, by its loss. Numbers without a value are estimated by maximum likelihood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum NoiseModel {
    /// Normal noise: the sum of squares.
    #[default]
    Square,
    /// Normal up to a threshold, exponential beyond it (Huber 1964).
    Huber {
        /// Residual at the threshold, in the unit of the force column.
        threshold: f64,
    },
    /// Student's t-distribution, for gross outliers.
    StudentT {
        /// Degrees of freedom ν [-].
        freedom: Option<f64>,
        /// Scale of the distribution, in the unit of the force column.
        scale: Option<f64>,
    },
}

/// Degrees of freedom that an estimate may be between: Cauchy's distribution, and as good as the normal one.
const FREEDOM: [f64; 2] = [1.0, 200.0];
/// What an estimate starts from.
const FIRST_FREEDOM: f64 = 4.0;
/// Relative change of the estimates at which they are found.
const TOLERANCE: f64 = 1e-4;
const ROUNDS: usize = 50;
/// Samples that are enough for the noise: its scale is known to a hundredth.
const ENOUGH: usize = 20_000;
/// Share of the golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl NoiseModel {
    /// Whether the numbers that are reported make sense.
    pub fn is_valid(self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match self {
            Self::Square => true,
            Self::Huber { threshold } => positive(threshold),
            Self::StudentT { freedom, scale } => [freedom, scale].into_iter().flatten().all(positive),
        }
    }

    /// The settings with this noise. Curve and noise are estimated in turns (ECME, Liu and Rubin 1995).
    ///
    /// # Errors
    /// If the samples or the settings leave nothing to fit, see [`FitError`].
    pub fn apply_to_settings(
        self,
        settings: IdentificationSettings,
        samples: &CurveSamples,
    ) -> Result<IdentificationSettings, FitError> {
        let fixed = match self {
            Self::Square => Some(Loss::Square),
            Self::Huber { threshold } => Some(Loss::Huber { threshold }),
            Self::StudentT { freedom: Some(freedom), scale: Some(scale) } => {
                Some(Loss::StudentT { freedom, scale })
            }
            Self::StudentT { .. } => None,
        };
        if let Some(loss) = fixed {
            return Ok(IdentificationSettings { loss, ..settings });
        }
        settings.check(samples)?;
        let some = (samples.len() > ENOUGH).then(|| samples.select_rows(&samples.rows_by_slip(ENOUGH)));
        let samples = some.as_ref().unwrap_or(samples);
        let mut fit = settings.fit(samples, &settings.prior, FitMethod::LeastSquares)?;
        let mut loss = Loss::Square;
        for _ in 0..ROUNDS {
            let next = self.fit_student_loss(&weighted_residuals(samples, &fit.theta), loss);
            let found = is_loss_converged(loss, next);
            loss = next;
            if found {
                break;
            }
            let starts = FitOptions { start: Some(fit.theta), starts: 1, ..settings.options };
            let given = IdentificationSettings { loss, options: starts, ..settings.clone() };
            fit = given.fit(samples, &settings.prior, FitMethod::LeastSquares)?;
        }
        Ok(IdentificationSettings { loss, ..settings })
    }

    /// Student's distribution that makes residuals with their weights most likely, near one that was found before.
    fn fit_student_loss(self, residuals: &[[f64; 2]], before: Loss) -> Loss {
        let Self::StudentT { freedom: given, scale: known } = self else { return before };
        let (mut freedom, mut scale) = match before {
            Loss::StudentT { freedom, scale } => (freedom, scale),
            _ => (given.unwrap_or(FIRST_FREEDOM), known.unwrap_or(robust_std(residuals))),
        };
        let whole: f64 = residuals.iter().map(|[_, weight]| weight).sum();
        for _ in 0..20 {
            if known.is_none() {
                let loss = Loss::StudentT { freedom, scale };
                let squares = residuals.iter().map(|[r, w]| w * loss.weight(*r) * r * r);
                scale = ((freedom + 1.0) / freedom * squares.sum::<f64>() / whole).sqrt();
            }
        }
        if given.is_none() {
            let log_likelihood = |log_freedom: f64| {
                let freedom = log_freedom.exp();
                let loss = Loss::StudentT { freedom, scale };
                let cost: f64 = residuals.iter().map(|[r, w]| w * loss.cost(*r)).sum();
                whole * student_log_peak_density(freedom) - cost / loss.cost_divisor(scale)
            };
            freedom = golden_section_maximum(log_likelihood, FREEDOM.map(f64::ln)).exp();
        }
        Loss::StudentT { freedom, scale }
    }
}

/// Of each sample, with its weight.
fn weighted_residuals(samples: &CurveSamples, theta: &crate::parameters::Theta) -> Vec<[f64; 2]> {
    let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight);
    points.map(|((slip, force), weight)| [friction_coefficient(theta, *slip) - force, *weight]).collect()
}

/// Standard deviation of normal residuals with the same median size.
fn robust_std(residuals: &[[f64; 2]]) -> f64 {
    let mut sizes: Vec<f64> =
        residuals.iter().filter(|r| r[1] > 0.0).map(|[r, w]| r.abs() * w.sqrt()).collect();
    sizes.sort_by(f64::total_cmp);
    numerics::statistics::quantile(&sizes, 0.5) / 0.674_489_750_196_081_7
}

fn is_loss_converged(before: Loss, after: Loss) -> bool {
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < TOLERANCE;
    match (before, after) {
        (Loss::StudentT { freedom: a, scale: s }, Loss::StudentT { freedom: b, scale: t }) => {
            same(a, b) && same(s, t)
        }
        _ => false,
    }
}

/// Where a function with one summit is highest, by golden section.
fn golden_section_maximum(of: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    let [mut a, mut b] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let [mut at_a, mut at_b] = [of(a), of(b)];
    while high - low > 0.1 * TOLERANCE {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - GOLDEN * (high - low);
            at_a = of(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + GOLDEN * (high - low);
            at_b = of(b);
        }
    }
    0.5 * (low + high)
}

/// Logarithm of the density of Student's distribution at 0, for scale 1.
fn student_log_peak_density(freedom: f64) -> f64 {
    log_gamma(0.5 * (freedom + 1.0)) - log_gamma(0.5 * freedom) - 0.5 * (freedom * std::f64::consts::PI).ln()
}

/// ln Γ(x) of x > 0: Stirling's series, after steps up to where it is exact.
fn log_gamma(mut x: f64) -> f64 {
    let mut steps = 0.0;
    while x < 10.0 {
        steps += x.ln();
        x += 1.0;
    }
    let y = x.powi(-2);
    let series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - steps
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use preparation::direction::ForceDirection;
    use rand_distr::{Distribution, StudentT};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    #[test]
    fn log_gamma_is_that_of_factorials_and_roots_of_pi() {
        assert_relative_eq!(log_gamma(5.0), 24_f64.ln(), max_relative = 1e-11);
        let half = 0.5 * std::f64::consts::PI.ln();
        assert_relative_eq!(log_gamma(0.5), half, max_relative = 1e-11);
        // Cauchy's distribution is 1/π high.
        assert_relative_eq!(student_log_peak_density(1.0), -std::f64::consts::PI.ln(), max_relative = 1e-11);
    }

    #[test]
    fn freedom_and_scale_of_the_noise_are_found() {
        let excitation = SyntheticExcitation {
            samples: 4000,
            slip_std: 0.0,
            force_std: 0.0,
            ..SyntheticExcitation::default()
        };
        let mut samples = synthetic_samples(&excitation, 0.5);
        let noise = StudentT::new(3.0).expect("a distribution");
        let mut random = Pcg64::new(1, 1);
        samples.force.iter_mut().for_each(|force| *force += 0.04 * noise.sample(&mut random));
        let unknown = NoiseModel::StudentT { freedom: None, scale: None };
        let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
        let settled = unknown.apply_to_settings(settings, &samples).expect("fits");
        let Loss::StudentT { freedom, scale } = settled.loss else { panic!("{:?}", settled.loss) };
        // Standard errors of 4000 samples: 0.2 and 0.0008.
        assert!((freedom - 3.0).abs() < 0.6, "{freedom}");
        assert!((scale - 0.04).abs() < 0.0025, "{scale}");
    }
}
