//! Puts a fit, its verdicts and its posterior together into what is told of a tire.
//!
//! What the data cannot tell is held at the prior and the rest is fitted again, as Goblirsch et al. (IV 2025) advise. The
//! values are those of this second fit: the curve to use where data are. Standard deviations, intervals and covariance are
//! those of the posterior with everything free: holding a parameter teaches nothing about it.

use std::time::Instant;

use crate::compressed::Compressed;
use crate::direction::Direction;
use crate::effective::effective;
use crate::fit::{FitError, Options, Problem, SlipNoise, Solution, least_squares, nelder_mead};
use crate::parameters::Parameter;
use crate::posterior::{Posterior, std, tempered};
use crate::prior::Prior;
use crate::quantity::Quantity;
use crate::result::{ByName, Estimate, Verdict};
use crate::samples::Samples;
use crate::verdict::{Evidence, Judgement, NARROWED, judge};

/// What is to be identified, from what.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// The samples.
    pub samples: &'a Samples,
    /// What was known before.
    pub prior: Prior,
    /// Which force.
    pub direction: Direction,
    /// Standard deviation of the noise in the slip, in its unit; 0 for none.
    pub slip_std: f64,
    /// Of the starts and the draws.
    pub seed: u64,
}

/// What was identified.
#[derive(Clone, Debug)]
pub struct Answer {
    /// By bounded least squares.
    pub least_squares: Estimate,
    /// By the simplex of Nelder and Mead, from the centre of the prior.
    pub nelder_mead: Estimate,
    /// Least squares with all parameters free.
    pub unrestricted: Solution,
    /// Nelder-Mead with all parameters free.
    pub unrestricted_simplex: Solution,
    /// What the data can tell.
    pub judgements: Vec<Judgement>,
    /// What the data and the box say.
    pub posterior: Posterior,
}

/// Fits, judges, holds what the data cannot tell at the prior, and fits the rest again.
///
/// # Errors
/// If the samples or the box leave nothing to fit, see [`FitError`].
pub fn identify(question: &Question) -> Result<Answer, FitError> {
    let options = Options { seed: question.seed, ..Options::default() };
    let start = Options::from_start(question.prior.centre);
    let begin = Instant::now();
    let unrestricted = least_squares(&question.problem(&question.prior, true), &options)?;
    let fitting = begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let simplex = nelder_mead::fit(&question.problem(&question.prior, false), &start)?;
    let walking = begin.elapsed().as_secs_f64();

    let samples =
        effective(question.samples, &unrestricted.theta, question.slip_std, unrestricted.noise_std);
    let data = Compressed::new(&samples);
    let draws = tempered::Options { seed: question.seed, ..tempered::Options::default() };
    let posterior = tempered::draw(&data, &question.prior, &draws);
    let slip_range = question.samples.slip_range().unwrap_or([f64::NAN; 2]);
    let evidence = Evidence {
        data: &data,
        slip_range,
        noise_std: unrestricted.noise_std,
        direction: question.direction,
    };
    let judgements = judge(&evidence, &question.prior, &posterior, &unrestricted.theta);

    let fixed = to_hold(&data, &question.prior, &posterior, &judgements);
    let rest = hold(&question.prior, &fixed);
    let told = |solution: Solution, seconds| {
        let mut estimate = assemble(
            &solution,
            &fixed,
            &judgements,
            &posterior,
            slip_range,
            question.samples.len(),
        );
        estimate.seconds = seconds;
        estimate
    };
    let begin = Instant::now();
    let again = least_squares(&question.problem(&rest, true), &options)?;
    let fitting = fitting + begin.elapsed().as_secs_f64();
    let begin = Instant::now();
    let again_simplex = nelder_mead::fit(&question.problem(&rest, false), &start)?;
    let walking = walking + begin.elapsed().as_secs_f64();
    Ok(Answer {
        least_squares: told(again, fitting),
        nelder_mead: told(again_simplex, walking),
        unrestricted,
        unrestricted_simplex: simplex,
        judgements,
        posterior,
    })
}

impl Question<'_> {
    /// With noise in the slip where the method can take it.
    fn problem(&self, prior: &Prior, with_slip_noise: bool) -> Problem<'_> {
        let slip_noise =
            (with_slip_noise && self.slip_std > 0.0).then(|| SlipNoise::new(self.slip_std));
        let Prior { bounds, free, centre } = *prior;
        Problem { bounds, free, held: centre, slip_noise, ..Problem::new(self.samples) }
    }
}

/// Parameters to hold at the prior, so that the data narrow what remains free.
///
/// One after the other, the one they tell least about first: with E held C is often known, and the curve keeps the stiffness
/// and the peak that are. B is never held: with the others at their prior it carries the stiffness.
pub fn to_hold(
    data: &Compressed,
    prior: &Prior,
    posterior: &Posterior,
    judgements: &[Judgement],
) -> Vec<Parameter> {
    let unknown =
        judgements.iter().filter(|judgement| judgement.verdict == Verdict::NotIdentifiable);
    let mut candidates: Vec<Parameter> =
        unknown.filter_map(|judgement| judgement.quantity.parameter()).collect();
    candidates.retain(|&parameter| parameter != Parameter::B);
    let mut held = Vec::new();
    let mut given = posterior.clone();
    loop {
        let ratio = |p: &Parameter| std(&given.values(Quantity::Parameter(*p))) / prior.std(*p);
        let wide = candidates.iter().copied().filter(|p| ratio(p) >= NARROWED);
        let Some(widest) = wide.max_by(|a, b| ratio(a).total_cmp(&ratio(b))) else { return held };
        held.push(widest);
        candidates.retain(|&parameter| parameter != widest);
        let few = tempered::Options { members: 256, ..tempered::Options::default() };
        given = tempered::draw(data, &hold(prior, &held), &few);
    }
}

/// The prior with some parameters held at its centre.
pub fn hold(prior: &Prior, parameters: &[Parameter]) -> Prior {
    let mut held = *prior;
    for &parameter in parameters {
        held.free[parameter as usize] = false;
    }
    held
}

/// What is told of a tire whose second fit, with `fixed` held, ended with `solution`. The time is left to the caller.
pub fn assemble(
    solution: &Solution,
    fixed: &[Parameter],
    judgements: &[Judgement],
    posterior: &Posterior,
    slip_range: [f64; 2],
    samples: usize,
) -> Estimate {
    fn by_name<T>(judgements: &[Judgement], of: impl Fn(&Judgement) -> T) -> ByName<T> {
        judgements
            .iter()
            .map(|judgement| (judgement.quantity.name().to_owned(), of(judgement)))
            .collect()
    }
    let names = |parameters: &[Parameter]| parameters.iter().map(|p| p.name().to_owned()).collect();
    let free: Vec<Parameter> =
        judgements.iter().filter_map(|judgement| judgement.quantity.parameter()).collect();
    Estimate {
        mean: by_name(judgements, |judgement| judgement.quantity.value(&solution.theta)),
        std: by_name(judgements, |judgement| judgement.std),
        interval: by_name(judgements, |judgement| judgement.interval),
        parameters: names(&free),
        covariance: posterior.covariance(&free),
        at_bound: names(&solution.at_bound),
        fixed: names(fixed),
        identified: by_name(judgements, |judgement| judgement.verdict),
        reason: by_name(judgements, |judgement| judgement.reason.clone()),
        slip_range,
        samples,
        noise_std: solution.noise_std,
        convergence: solution.convergence.clone(),
        seconds: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::excitation::{Excitation, samples};

    fn answer(level: f64) -> Answer {
        let samples = samples(&Excitation { samples: 1500, ..Excitation::default() }, level);
        let prior = Prior::longitudinal();
        let direction = Direction::Longitudinal;
        identify(&Question { samples: &samples, prior, direction, slip_std: 0.001, seed: 1 })
            .expect("fits")
    }

    #[test]
    fn what_low_slip_cannot_tell_is_held_and_the_stiffness_kept() {
        let answer = answer(0.04);
        for estimate in [&answer.least_squares, &answer.nelder_mead] {
            assert!(
                ["C", "E"].iter().all(|name| estimate.fixed.iter().any(|fixed| fixed == name)),
                "{estimate:?}"
            );
            assert_eq!(estimate.mean["C"], 1.65);
            assert!((estimate.mean["K"] / 45.0 - 1.0).abs() < 0.05, "{}", estimate.mean["K"]);
            assert!(
                (estimate.mean["K"] - estimate.mean["B"] * estimate.mean["C"] * estimate.mean["D"])
                    .abs()
                    < 1e-9
            );
            assert!(estimate.std["E"] > 0.2, "holding a parameter does not make it certain");
            assert_eq!(estimate.covariance.len(), estimate.parameters.len());
            assert!(estimate.slip_range[1] < 0.05);
        }
    }

    #[test]
    fn enough_excitation_gives_all_of_the_truth() {
        let answer = answer(1.0);
        let estimate = &answer.least_squares;
        assert!(estimate.fixed.is_empty(), "{:?}", estimate.reason);
        for (name, truth) in
            [("B", 15.0), ("C", 2.0), ("D", 1.5), ("E", 0.8), ("K", 45.0), ("peak_slip", 0.0877)]
        {
            assert_eq!(estimate.identified[name], Verdict::Identified, "{}", estimate.reason[name]);
            assert!(
                (estimate.mean[name] - truth).abs() < 4.0 * estimate.std[name],
                "{name}: {}",
                estimate.mean[name]
            );
        }
        assert!((estimate.noise_std / 0.05 - 1.0).abs() < 0.1);
    }
}
