//! Compares the samples with the predictions of the posterior: does the model fit?
//!
//! All that is compared are residuals over their standard deviation, each draw with a noise of its own: given the curve, S/σ² is
//! χ² distributed. Of Student's noise, whose scale is known, residuals first become the normal deviates that are as far out.

use numerics::loss::Loss;
use numerics::statistics::{NORMAL_95, mean};
use numerics::student::student_deviate;
use numerics::text::format_significant;
use preparation::samples::CurveSamples;
use rand_distr::{ChiSquared, Distribution};
use rand_pcg::Pcg64;
use serde::Serialize;

use crate::dependence::SampleDependence;
use crate::kernel::friction_coefficient;
use crate::model::{FitTest, ModelFit, ModelVerdict};
use crate::parameters::{Parameter, Theta};
use crate::posterior::PosteriorSamples;

/// Draws that are looked at.
const DRAWS: usize = 200;
/// Groups of samples with neighbouring slips.
const GROUPS: usize = 20;
const _: () = assert!(GROUPS.is_multiple_of(2), "chi_squared_tail is a finite sum then");
/// Fewer samples say nothing.
const FEWEST: usize = 40;
/// More samples than this are thinned out for the comparison.
const MOST: usize = 20_000;
/// Fewer independent samples do not tell noise from a wrong model.
const INDEPENDENT: f64 = 20.0;
/// The p-value of the shape below which it is not that of the data.
const UNLIKELY: f64 = 0.01;
/// Part of the peak friction by which a curve may be off anywhere and still have the right shape: no tire is measured so well.
const NEGLIGIBLE: f64 = 1e-4;
/// Residuals grow by this factor from small forces to large ones at most, where the noise is that of sensors.
const GROWTH: f64 = 2.0;
/// Fewer residuals have no mean size worth comparing.
const FEW: f64 = 10.0;
/// Beyond, there is one normal residual in 15,787.
const GROSS: f64 = 4.0;

/// What the samples look like under the posterior.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PosteriorPredictiveCheck {
    /// Share of the samples inside the 95 % band of predictions.
    pub inside: f64,
    /// How often samples of the model would leave larger mean residuals in twenty groups of neighbouring slips than these:
    /// the posterior predictive p-value of Σ mean residual² / (σ²/n + the square of what is negligible). Near 0 the curve has the
    /// wrong shape.
    pub p_value: f64,
    /// Share of the samples more than four standard deviations off; of normal noise 0.00006.
    pub gross: f64,
    /// How many more of these are on one side of the curve than on the other, as a share of the samples: they move the curve.
    pub lopsided: f64,
    /// Size of the residuals where the force is large over that where it is small: what it is at least.
    pub growth: f64,
    /// Of residuals of consecutive samples. Above 0 the samples tell less than their number.
    pub autocorrelation: f64,
    /// How many independent samples would tell as much. Standard deviations, intervals and verdicts are those of so many.
    pub independent: f64,
    /// Whether nothing speaks against the model.
    pub fits: bool,
    /// In words.
    pub message: String,
    /// What was looked at.
    #[serde(skip)]
    pub tests: Vec<FitTest>,
}

/// Compares `samples`, whose weights are their relative precisions, in the order in which they were measured. `None` where there
/// are too few samples or no draws. Residuals that hang together count as what they tell. The same seed gives the same numbers.
pub fn check_posterior_predictive(
    samples: &CurveSamples,
    loss: Loss,
    posterior: &PosteriorSamples,
    dependence: SampleDependence,
    seed: u64,
) -> Option<PosteriorPredictiveCheck> {
    let all: Vec<usize> = (0..samples.len()).filter(|&i| samples.weight[i] > 0.0).collect();
    let used: Vec<usize> = all.iter().copied().step_by(all.len().div_ceil(MOST).max(1)).collect();
    // In sweeps a wrong shape leaves residuals that hang together: that is no noise.
    let time = match dependence.sweeps {
        true => dependence.copies,
        false => (dependence.effective_share() * all.len() as f64 / used.len() as f64).min(1.0).recip(),
    };
    let every = posterior.samples.len().div_ceil(DRAWS).max(1);
    let freedom = ChiSquared::new(used.len().checked_sub(1)? as f64).ok()?;
    if used.len() < FEWEST || posterior.samples.is_empty() {
        return None;
    }
    let mut by_slip: Vec<usize> = (0..used.len()).collect();
    by_slip.sort_by(|&i, &j| samples.slip[used[i]].total_cmp(&samples.slip[used[j]]));
    let mut random = Pcg64::new(u128::from(seed), 0);
    let mut tails = 0.0;
    let mut draws = 0.0;
    // Moments of the predictions of each sample, times the root of its weight.
    let mut first = vec![0.0; used.len()];
    let mut second = vec![0.0; used.len()];
    let mut noise = 0.0;
    for theta in posterior.samples.iter().step_by(every) {
        let residual = |&i: &usize| {
            samples.weight[i].sqrt() * (samples.force[i] - friction_coefficient(theta, samples.slip[i]))
        };
        let mut residuals: Vec<f64> = used.iter().map(residual).collect();
        // What residuals are in, and their variance then.
        let (unit, variance) = if let Loss::StudentT { freedom, scale } = loss {
            residuals.iter_mut().for_each(|r| *r = student_deviate(*r / scale, freedom));
            (scale, 1.0)
        } else {
            let squares: f64 = residuals.iter().map(|r| r * r).sum();
            (1.0, squares / freedom.sample(&mut random))
        };
        let negligible = NEGLIGIBLE * theta[Parameter::D as usize] / unit;
        let group = |members: &[usize]| {
            let count = members.len() as f64;
            let mean = members.iter().map(|&i| residuals[i]).sum::<f64>() / count;
            mean.powi(2) / (variance * time / count + negligible.powi(2))
        };
        let groups =
            (0..GROUPS).map(|g| group(&by_slip[g * used.len() / GROUPS..(g + 1) * used.len() / GROUPS]));
        tails += chi_squared_tail(groups.sum());
        draws += 1.0;
        noise += variance;
        for ((first, second), r) in first.iter_mut().zip(&mut second).zip(&residuals) {
            *first += r;
            *second += r * r;
        }
    }
    let [inside, gross, lopsided] = prediction_shares([&first, &second], draws, noise / draws);
    let count = used.len() as f64;
    let found = PosteriorPredictiveCheck {
        inside,
        p_value: tails / draws,
        gross,
        lopsided: lopsided.abs(),
        growth: residual_growth_with_force(samples, &used, &first, &posterior.samples[0], time),
        autocorrelation: lag_one_autocorrelation(&first),
        independent: dependence.effective_share() * all.len() as f64,
        fits: true,
        message: String::new(),
        tests: Vec::new(),
    };
    Some(found.with_conclusion(count / time))
}

/// Probability that χ² of as many degrees of freedom as there are groups is larger: for an even number a sum of Poisson
/// probabilities (Abramowitz and Stegun, 26.4.21).
fn chi_squared_tail(statistic: f64) -> f64 {
    let half = 0.5 * statistic;
    let mut term = (-half).exp();
    let mut sum = term;
    for j in 1..GROUPS / 2 {
        term *= half / j as f64;
        sum += term;
    }
    sum
}

/// Shares of the samples inside of the middle 95 % of predictions, grossly outside, and that on one side more than on the other, from
/// sums of first and second powers of their residuals over draws.
fn prediction_shares([first, second]: [&[f64]; 2], draws: f64, noise: f64) -> [f64; 3] {
    let (mut inside, mut gross, mut lopsided) = (0.0, 0.0, 0.0);
    for (first, second) in first.iter().zip(second) {
        let mean = first / draws;
        let spread = second / draws - mean * mean;
        let off = mean.abs() / (noise + spread.max(0.0)).sqrt();
        inside += f64::from(off <= NORMAL_95);
        gross += f64::from(off > GROSS);
        lopsided += if off > GROSS { mean.signum() } else { 0.0 };
    }
    [inside, gross, lopsided].map(|sum| sum / first.len() as f64)
}

impl PosteriorPredictiveCheck {
    /// Whether the model fits, and why not.
    fn with_conclusion(mut self, independent: f64) -> Self {
        self.tests = self.residual_tests(independent);
        let objections: Vec<_> =
            self.tests.iter().filter(|test| !test.has_passed()).map(|test| test.sentence.clone()).collect();
        self.fits = objections.is_empty();
        self.message = match self.fits {
            true => self.describe_good_fit(),
            false => objections.join(" "),
        };
        self
    }

    fn describe_good_fit(&self) -> String {
        let share = format_significant(100.0 * self.inside, 3);
        format!(
            "Nothing speaks against the model: {share} % of the samples are in the 95 % band of predictions. They tell as much as \
             {} independent ones.",
            format_significant(self.independent, 3)
        )
    }

    /// The verdict on the model.
    pub fn model_verdict(&self) -> ModelVerdict {
        ModelVerdict {
            verdict: if self.fits { ModelFit::Fits } else { ModelFit::DoesNotFit },
            sentence: self.message.clone(),
            tests: self.tests.clone(),
        }
    }
}

/// Mean size of residuals where the force of a tire is above half of its largest one, over that where it is below: what it is at
/// least, by three standard errors of samples of which one in `time` is independent.
fn residual_growth_with_force(
    samples: &CurveSamples,
    used: &[usize],
    residuals: &[f64],
    theta: &Theta,
    time: f64,
) -> f64 {
    let heights: Vec<f64> =
        used.iter().map(|&i| friction_coefficient(theta, samples.slip[i]).abs()).collect();
    let half = 0.5 * heights.iter().copied().fold(0.0, f64::max);
    let (mut sizes, mut counts) = ([0.0; 2], [0.0; 2]);
    for (height, residual) in heights.iter().zip(residuals) {
        let side = usize::from(*height > half);
        sizes[side] += residual.abs();
        counts[side] += 1.0;
    }
    if counts[0] < FEW || counts[1] < FEW {
        return 1.0;
    }
    // A mean of n sizes of normal numbers is known to 0.76/√n of itself.
    let error = 0.76 * (time * (1.0 / counts[0] + 1.0 / counts[1])).sqrt();
    (sizes[1] / counts[1]) / (sizes[0] / counts[0]) / (1.0 + 3.0 * error)
}

/// Correlation of neighbours.
fn lag_one_autocorrelation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let products = values.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean));
    products.sum::<f64>() / values.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
}

impl PosteriorPredictiveCheck {
    /// All tests of the model; a share is known to three standard deviations of that of independent samples.
    fn residual_tests(&self, independent: f64) -> Vec<FitTest> {
        let percent = |share: f64| format_significant(100.0 * share, 3);
        let test = |name: &str, statistic: f64, limit: f64, sentence: String| FitTest {
            name: name.to_owned(),
            statistic,
            limit,
            sentence,
        };
        vec![
            test(
                "shape of the curve",
                1.0 - self.p_value,
                1.0 - UNLIKELY,
                "The curve does not have the shape of the data: residuals at neighbouring slips are on the same side of it."
                    .to_owned(),
            ),
            test(
                "gross outliers on one side",
                self.lopsided,
                // Five such samples, a share that normal noise does not reach, or the chance of a coin. On both sides alike they widen the
                // intervals, and move nothing.
                1e-3_f64.max(5.0 / independent).max(3.0 * (self.gross / independent).sqrt()),
                format!(
                    "{} % of the samples are gross outliers, more on one side of the curve than on the other: try the loss `student_t`.",
                    format_significant(100.0 * self.gross, 2)
                ),
            ),
            test(
                "band of predictions",
                (self.inside - 0.95).abs(),
                0.02_f64.max(3.0 * (0.95 * 0.05 / independent).sqrt()),
                format!("{} % of the samples are in the 95 % band of predictions.", percent(self.inside)),
            ),
            test(
                "noise over force",
                self.growth,
                GROWTH,
                format!(
                    "Residuals are at least {} times as large where the force is large as where it is small: one curve is not that of all samples, as \
                     of tires whose friction falls with the load; identify each load by itself.",
                    format_significant(self.growth, 2)
                ),
            ),
            test(
                "independent samples",
                INDEPENDENT / self.independent,
                1.0,
                format!(
                    "Residuals of consecutive samples correlate by {}: all samples tell as much as {} independent ones, too few to tell \
                     noise from a wrong model, such as a force that differs as the slip rises and falls.",
                    format_significant(self.autocorrelation, 2),
                    format_significant(self.independent, 2)
                ),
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compressed::CompressedSamples;
    use crate::posterior::{SamplingOptions, draw_posterior};
    use crate::prior::Prior;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    fn check(seed: u64, spoil: impl Fn(usize, &mut f64)) -> PosteriorPredictiveCheck {
        let excitation =
            SyntheticExcitation { samples: 600, slip_std: 0.0, seed, ..SyntheticExcitation::default() };
        let mut samples = synthetic_samples(&excitation, 0.3);
        samples.force.iter_mut().enumerate().for_each(|(i, force)| spoil(i, force));
        let data = CompressedSamples::new(&samples);
        let options = SamplingOptions { draws: 512, seed: 0 };
        let posterior = draw_posterior(&data, &Prior::longitudinal(), &[], &options).posterior;
        let dependence = SampleDependence::estimate(&samples, &excitation.truth);
        check_posterior_predictive(&samples, Loss::Square, &posterior, dependence, 0).expect("enough samples")
    }

    #[test]
    fn the_tail_of_chi_squared_is_that_of_tables() {
        for (quantile, tail) in [(0.0, 1.0), (10.851, 0.95), (19.337, 0.5), (37.566, 0.01), (45.315, 0.001)] {
            approx::assert_relative_eq!(chi_squared_tail(quantile), tail, max_relative = 1e-3);
        }
    }

    #[test]
    fn data_of_the_model_fit() {
        let found: Vec<PosteriorPredictiveCheck> = (0..5).map(|seed| check(seed, |_, _| {})).collect();
        assert!(found.iter().all(|one| one.fits), "{found:?}");
        let inside = found.iter().map(|one| one.inside).sum::<f64>() / 5.0;
        assert!((inside - 0.95).abs() < 0.012, "{inside}");
        assert_eq!(found[0], check(0, |_, _| {}));
    }

    #[test]
    fn what_is_wrong_is_told() {
        // A bump that no Magic Formula has.
        let bump = check(0, |i, force| *force += 0.04 * (0.03 * i as f64).sin());
        assert!(!bump.fits && bump.p_value < 0.01, "{bump:?}");
        let outliers = check(0, |i, force| *force += if i % 20 == 7 { 0.8 } else { 0.0 });
        assert!(!outliers.fits && outliers.gross > 0.02, "{outliers:?}");
        assert!(outliers.message.contains("student_t"), "{}", outliers.message);
        let drift = check(0, |i, force| *force += 0.06 * (2.0 * (i as f64).sqrt()).sin());
        assert!(!drift.fits && drift.autocorrelation > 0.2, "{drift:?}");
    }
}
