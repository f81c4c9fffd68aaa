//! Puts a fit, its verdicts and its posterior together into what is reported of a tire.
//!
//! What the data cannot tell is held at the prior and the rest is fitted again, as Goblirsch et al. (IV 2025) advise. The
//! values are those of this second fit, unless the posterior rejects them: then they are those of its draw that is nearest to what
//! is known. So they are one tire, its numbers are in their intervals, and its curve is in the band. Standard deviations, intervals
//! and covariance are those of the posterior with everything free: holding a parameter teaches nothing about it.

mod bayes;
mod curve_posterior;
pub mod point;

use std::time::{Duration, Instant};

use numerics::convergence::ConvergenceReport;
use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::statistics::std;
use preparation::samples::CurveSamples;
use serde::Serialize;

use crate::compressed::CompressedSamples;
use crate::fit::{FitError, FitSolution};
use crate::model::ModelVerdict;
use crate::parameters::{Parameter, Theta};
use crate::posterior::predictive::PosteriorPredictiveCheck;
use crate::posterior::report::{PosteriorReport, UncertaintySource};
use crate::posterior::{PosteriorSamples, SamplingOptions, draw_posterior};
use crate::prior::Prior;
use crate::quantity::{PerQuantity, Quantity};
use crate::settings::{FitMethod, IdentificationSettings};
use crate::variational::{self, VariationalPosterior};
use crate::verdict::{Identifiability, MeasurementEvidence, QuantityIdentifiability, judge_quantities};
use curve_posterior::CurvePosterior;
use point::PosteriorAgreement;

/// What one method found for one axle in one direction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TireEstimate {
    /// Best values.
    pub mean: PerQuantity,
    /// Standard deviations.
    pub std: PerQuantity,
    /// 95 % intervals, lower and upper end.
    pub interval: PerQuantity<[f64; 2]>,
    /// Rows and columns of `covariance`.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters.
    pub covariance: Vec<Vec<f64>>,
    /// Parameters that stand on a bound.
    pub at_bound: Vec<Parameter>,
    /// Parameters that were held at their prior, since the data cannot tell them.
    pub fixed: Vec<Parameter>,
    /// What the data could tell.
    pub identified: PerQuantity<Identifiability>,
    /// Why.
    pub reason: PerQuantity<String>,
    /// Smallest and largest slip of the data: outside, the curve is an extrapolation.
    pub slip_range: [f64; 2],
    /// How many samples were used.
    pub samples: usize,
    /// Standard deviation of the noise of the friction coefficient [-].
    pub noise_std: f64,
    /// How the method got there.
    pub convergence: ConvergenceReport,
    /// Wall time [s].
    pub seconds: f64,
    /// What the uncertainty is that of.
    pub source: UncertaintySource,
    /// How the posterior was found that verdicts rest on, and standard deviations and intervals unless `source` says
    /// otherwise; absent where they come from the likelihood alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posterior: Option<PosteriorReport>,
    /// What variational inference said, also where it is not to be trusted and the numbers above are the posterior's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub svi: Option<variational::report::VariationalReport>,
}

impl TireEstimate {
    /// Whether a quantity is a parameter that was held at its prior.
    pub fn is_held(&self, quantity: Quantity) -> bool {
        quantity.parameter().is_some_and(|parameter| self.fixed.contains(&parameter))
    }
}

/// What was identified.
#[derive(Clone, Debug)]
pub struct TireIdentification {
    /// What is reported, by method, in the order that was asked for.
    pub estimates: Vec<(FitMethod, TireEstimate)>,
    /// The fit with all parameters free that each method is or starts from.
    pub unrestricted: Vec<(FitMethod, FitSolution)>,
    /// What the data can tell.
    pub judgements: Vec<QuantityIdentifiability>,
    /// What the data and the box say.
    pub posterior: PosteriorSamples,
    /// How that was found.
    pub report: PosteriorReport,
    /// The normal distribution in its place, where the method `svi` was asked for.
    pub variational: Option<VariationalPosterior>,
}

/// Fits, judges, holds what the data cannot tell at the prior, and fits the rest again. The uncertainty of all fits is the
/// same: it is that of the data and of what was known before, not one of a method. `svi` and `reference` hold nothing: they
/// tell means of the posterior.
///
/// # Errors
/// If the samples or the settings leave nothing to fit, see [`FitError`].
pub fn identify_tire(
    samples: &CurveSamples,
    settings: &IdentificationSettings,
    methods: &[FitMethod],
) -> Result<TireIdentification, FitError> {
    let whole = Instant::now();
    settings.check(samples)?;
    let best = settings.fit(samples, &settings.prior, FitMethod::LeastSquares)?;
    let fitting = whole.elapsed();
    let slip_range = samples.slip_range().ok_or(FitError::Empty)?;
    let IdentificationSettings { prior, direction, .. } = settings;

    let begin = Instant::now();
    let CurvePosterior { noisy, data, optima, posterior, report } =
        CurvePosterior::new(samples, settings, &best, slip_range);
    let drawing = begin.elapsed();
    let (noise_std, direction) = (best.noise_std, *direction);
    let evidence = MeasurementEvidence { data: &data, slip_range, noise_std, direction };
    let judgements = judge_quantities(&evidence, prior, &posterior, &best.theta);
    let model = report.predictive.as_ref().map(PosteriorPredictiveCheck::model_verdict).unwrap_or_default();
    let judgements: Vec<_> = judgements.into_iter().map(|it| cap_judgement(it, &model)).collect();
    let band = report.band.as_ref();
    let agreement = PosteriorAgreement { judgements: &judgements, band, posterior: &posterior, prior };

    let held = || parameters_to_fix(&data, prior, &posterior, &judgements, &optima);
    let fixed = if settings.hold { held() } else { Vec::new() };
    let rest = fix_parameters(prior, &fixed);
    let (mut estimates, mut unrestricted) = (Vec::new(), Vec::new());
    let mut variational = None;
    let bayes = bayes::BayesianFit {
        samples: &noisy,
        data: &data,
        settings,
        best: &best,
        judgements: &judgements,
        report: &report,
        plain: assemble_estimate(&best, &[], &judgements, &posterior, slip_range, samples.len()),
        seconds: [fitting, drawing].map(|time| time.as_secs_f64()),
        agreement,
    };
    // Draws, verdicts and what is held are waited for with any method.
    let shared = whole.elapsed() - fitting;
    for &method in methods {
        let begin = Instant::now();
        let (free, before) = match method {
            FitMethod::LeastSquares => (best.clone(), fitting),
            FitMethod::NelderMead => (settings.fit(samples, prior, method)?, Duration::ZERO),
            FitMethod::Svi | FitMethod::Reference => {
                let estimate = match method {
                    FitMethod::Svi => bayes.svi_estimate(variational.insert(bayes.fit_variational())),
                    _ => bayes.posterior_estimate(),
                };
                estimates.push((method, estimate));
                unrestricted.push((method, best.clone()));
                continue;
            }
        };
        let again = if fixed.is_empty() { None } else { Some(settings.fit(samples, &rest, method)?) };
        let seconds = (before + shared + begin.elapsed()).as_secs_f64();
        let solution = again.as_ref().unwrap_or(&free);
        let (solution, fixed) = agreeing_solution(&agreement, solution, &fixed, &free);
        let estimate =
            assemble_estimate(&solution, fixed, &judgements, &posterior, slip_range, samples.len());
        let (source, summary) = (report.uncertainty_source(), Some(report.clone()));
        estimates.push((method, TireEstimate { seconds, source, posterior: summary, ..estimate }));
        unrestricted.push((method, free));
    }
    Ok(TireIdentification { estimates, unrestricted, judgements, posterior, report, variational })
}

/// A fit with what it holds, or the draw nearest to what is known where the posterior rejects that fit.
fn agreeing_solution<'a>(
    agreement: &PosteriorAgreement,
    solution: &FitSolution,
    fixed: &'a [Parameter],
    free: &FitSolution,
) -> (FitSolution, &'a [Parameter]) {
    if agreement.is_accepted(&solution.theta) {
        return (solution.clone(), fixed);
    }
    let theta = agreement.nearest_draw().unwrap_or(solution.theta);
    (FitSolution { theta, ..free.clone() }, &[])
}

/// A judgement that is no better than the model.
fn cap_judgement(mut judgement: QuantityIdentifiability, model: &ModelVerdict) -> QuantityIdentifiability {
    model.cap_verdict_and_reason(&mut judgement.verdict, &mut judgement.reason);
    judgement
}

/// Parameters to hold at the prior, so that the data narrow what remains free.
///
/// One after the other, the one they tell least about first: with E held C is often known, and the curve keeps the stiffness
/// and the peak that are. B is never held: with the others at their prior it carries the stiffness.
pub fn parameters_to_fix(
    data: &CompressedSamples,
    prior: &Prior,
    posterior: &PosteriorSamples,
    judgements: &[QuantityIdentifiability],
    optima: &[Theta],
) -> Vec<Parameter> {
    let unknown = judgements.iter().filter(|judgement| judgement.verdict == Identifiability::NotIdentifiable);
    let mut candidates: Vec<Parameter> =
        unknown.filter_map(|judgement| judgement.quantity.parameter()).collect();
    candidates.retain(|&parameter| parameter != Parameter::B);
    let mut held = Vec::new();
    let mut given = posterior.clone();
    loop {
        let ratio =
            |p: &Parameter| std(&given.quantity_values(Quantity::Parameter(*p))) / prior.difference_unit(*p);
        let wide = candidates.iter().copied().filter(|p| ratio(p) >= MAX_WIDTH_IDENTIFIED);
        let Some(widest) = wide.max_by(|a, b| ratio(a).total_cmp(&ratio(b))) else { return held };
        held.push(widest);
        candidates.retain(|&parameter| parameter != widest);
        let few = SamplingOptions { draws: 1024, ..SamplingOptions::default() };
        given = draw_posterior(data, &fix_parameters(prior, &held), optima, &few).posterior;
    }
}

/// The prior with some parameters held at its centre.
pub fn fix_parameters(prior: &Prior, parameters: &[Parameter]) -> Prior {
    let mut held = *prior;
    for &parameter in parameters {
        held.free[parameter as usize] = false;
    }
    held
}

/// What is reported of a tire whose second fit, with `fixed` held, ended with `solution`. The time and what is reported of the
/// posterior are left to the caller.
pub fn assemble_estimate(
    solution: &FitSolution,
    fixed: &[Parameter],
    judgements: &[QuantityIdentifiability],
    posterior: &PosteriorSamples,
    slip_range: [f64; 2],
    samples: usize,
) -> TireEstimate {
    let free: Vec<Parameter> =
        judgements.iter().filter_map(|judgement| judgement.quantity.parameter()).collect();
    TireEstimate {
        mean: values_by_quantity(judgements, |judgement| judgement.quantity.value(&solution.theta)),
        std: values_by_quantity(judgements, |judgement| judgement.std),
        interval: values_by_quantity(judgements, |judgement| judgement.interval),
        covariance: posterior.covariance(&free),
        parameters: free,
        at_bound: solution.at_bound.clone(),
        fixed: fixed.to_vec(),
        identified: values_by_quantity(judgements, |judgement| judgement.verdict),
        reason: values_by_quantity(judgements, |judgement| judgement.reason.clone()),
        slip_range,
        samples,
        noise_std: solution.noise_std,
        convergence: solution.convergence.clone(),
        seconds: 0.0,
        source: UncertaintySource::Likelihood,
        posterior: None,
        svi: None,
    }
}

/// A value of each judgement, by its quantity.
pub fn values_by_quantity<T>(
    judgements: &[QuantityIdentifiability],
    value: impl Fn(&QuantityIdentifiability) -> T,
) -> PerQuantity<T> {
    judgements.iter().map(|judgement| (judgement.quantity, value(judgement))).collect()
}

#[cfg(test)]
mod tests {
    use preparation::direction::ForceDirection;

    use super::*;
    use crate::fit::SlipNoise;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    fn answer(level: f64) -> TireIdentification {
        let samples = synthetic_samples(
            &SyntheticExcitation { samples: 1500, ..SyntheticExcitation::default() },
            level,
        );
        let slip_noise = Some(SlipNoise::new(0.001));
        let settings = IdentificationSettings {
            slip_noise,
            ..IdentificationSettings::new(ForceDirection::Longitudinal)
        };
        let methods = [FitMethod::LeastSquares, FitMethod::NelderMead];
        identify_tire(&samples, &settings, &methods).expect("fits")
    }

    #[test]
    fn what_low_slip_cannot_tell_is_held_and_the_stiffness_kept() {
        let answer = answer(0.04);
        for (_, estimate) in &answer.estimates {
            assert!(
                [Parameter::C, Parameter::E].iter().all(|fixed| estimate.fixed.contains(fixed)),
                "{estimate:?}"
            );
            assert_eq!(estimate.mean[&Quantity::C], 1.65);
            assert!(
                (estimate.mean[&Quantity::K] / 45.0 - 1.0).abs() < 0.05,
                "{}",
                estimate.mean[&Quantity::K]
            );
            assert!(
                (estimate.mean[&Quantity::K]
                    - estimate.mean[&Quantity::B]
                        * estimate.mean[&Quantity::C]
                        * estimate.mean[&Quantity::D])
                    .abs()
                    < 1e-9
            );
            assert!(estimate.std[&Quantity::E] > 0.2, "holding a parameter does not make it certain");
            assert_eq!(estimate.covariance.len(), estimate.parameters.len());
            assert!(estimate.slip_range[1] < 0.05);
        }
    }

    #[test]
    fn enough_excitation_gives_all_of_the_truth() {
        let answer = answer(1.0);
        let (_, estimate) = &answer.estimates[0];
        assert!(estimate.fixed.is_empty(), "{:?}", estimate.reason);
        for (name, truth) in [
            (Quantity::B, 15.0),
            (Quantity::C, 2.0),
            (Quantity::D, 1.5),
            (Quantity::E, 0.8),
            (Quantity::K, 45.0),
            (Quantity::PeakSlip, 0.0877),
        ] {
            assert_eq!(estimate.identified[&name], Identifiability::Identified, "{}", estimate.reason[&name]);
            assert!(
                (estimate.mean[&name] - truth).abs() < 4.0 * estimate.std[&name],
                "{name}: {}",
                estimate.mean[&name]
            );
        }
        assert!((estimate.noise_std / 0.05 - 1.0).abs() < 0.1);
    }

    fn bayes(level: f64) -> TireIdentification {
        let excitation =
            SyntheticExcitation { samples: 1500, slip_std: 0.0, ..SyntheticExcitation::default() };
        let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
        let methods = [FitMethod::Svi, FitMethod::Reference, FitMethod::LeastSquares];
        identify_tire(&synthetic_samples(&excitation, level), &settings, &methods).expect("fits")
    }

    #[test]
    fn a_normal_distribution_that_can_be_trusted_is_told() {
        let answer = bayes(1.0);
        let [(_, svi), (_, exact), (_, fit)] = &answer.estimates[..] else { panic!("three") };
        let own = svi.svi.as_ref().expect("a report");
        assert!(own.trusted && own.warning.is_none(), "{:?}", own.warning);
        assert_eq!(
            (svi.source, exact.source, fit.source),
            (UncertaintySource::Svi, UncertaintySource::Grid, UncertaintySource::Grid)
        );
        for name in [Quantity::B, Quantity::C, Quantity::D, Quantity::E, Quantity::K] {
            let error = (svi.mean[&name] - exact.mean[&name]) / exact.std[&name];
            assert!(error.abs() < 0.1, "{name}: off by {error} standard deviations");
            let ratio = svi.std[&name] / exact.std[&name];
            assert!((ratio - 1.0).abs() < 0.1, "{name}: {ratio} times the width");
            assert_eq!(exact.std[&name], fit.std[&name]);
        }
        assert!(own.std[&Quantity::C] < 0.9 * svi.std[&Quantity::C], "weights widen what is too narrow");
        assert!(exact.svi.is_none() && fit.svi.is_none() && svi.fixed.is_empty());
    }

    #[test]
    fn a_normal_distribution_that_cannot_be_trusted_gives_way_to_the_posterior() {
        let answer = bayes(0.02);
        let [(_, svi), (_, exact), _] = &answer.estimates[..] else { panic!("three") };
        let own = svi.svi.as_ref().expect("a report");
        assert!(!own.trusted && own.warning.is_some());
        assert_eq!(svi.source, UncertaintySource::Grid);
        assert_eq!((&svi.mean, &svi.interval), (&exact.mean, &exact.interval));
        assert!(own.std[&Quantity::C] < 0.5 * svi.std[&Quantity::C], "what it said itself is kept");
    }
}
