//! Chooses the errors of sensors that the data ask for: each by the likelihood that it gains once everything else has followed.
//!
//! The gain is first foretold by a score test, ½ s²/i with the score s of an error and its information i after all other unknowns have
//! followed. Residuals that are not white overstate it; so i is at least the variance of the scores of blocks. The most
//! promising errors are then fitted, since a large error bends the likelihood further than a score can see. An error whose
//! scores scatter too much for that test is still real when it gains more than noise that lasts does.

use kalman::augmented::ColouredNoise;
use nalgebra::{DMatrix, DVector};

use crate::adequacy::COLOURED;
pub use crate::error_selection::{ErrorSelection, EstimationMode, ModelExtension};
use crate::joint_posterior::JointPosterior;
use crate::laplace::inverse_hessian;
use crate::likelihood::DerivativeDirection;
use crate::problem::{PredictionErrorFit, PredictionErrorProblem};
use crate::residual_rows::ResidualRows;
use crate::tires::SIZE;
use preparation::SystematicError;

/// Gain from which on an error is taken for real [nat]: by chance one of fourteen errors gains more in one of fifty drives.
const ENOUGH: f64 = 5.0;
/// Errors that are fitted in each round, and their least share of the best foretold gain.
const TRIALS: usize = 4;
const SHARE: f64 = 0.05;
/// Errors that are fitted in each round although the scatter of blocks explains their gain.
const DOUBTFUL: usize = 2;
/// Most errors that are taken.
const MOST: usize = 8;
/// Where a fit of noise that lasts starts: its correlation from row to row, and its share of the variance.
const COLOUR: ColouredNoise<f64> = ColouredNoise { correlation: 0.8, share: 0.5 };

/// Adds errors to a rough fit as long as the data ask for them; what each gained. Costs with and without delays are of the same rows:
/// those that are left with any delay. Noise that lasts explains away every error a little, so that its turn is the last.
pub fn select_errors(
    problem: &PredictionErrorProblem,
    first: PredictionErrorFit,
) -> (PredictionErrorFit, Vec<(ModelExtension, f64)>) {
    let mut gains: Vec<(ModelExtension, f64)> = Vec::new();
    let mut outlook = ExtensionCandidates::new(problem, &first);
    let nothing = outlook.promising.is_empty() && outlook.doubtful.is_empty();
    if nothing && !outlook.is_coloured_noise_allowed(problem, &first) {
        return (first, gains);
    }
    let mut fit = problem.fit_delayed_rows(first.active.clone(), problem.fitted_unknowns(&first));
    while gains.len() < MOST && !problem.cancel.is_cancelled() {
        let Some((addition, gain, better)) = outlook.best_extension(problem, &fit) else { break };
        fit = better;
        gains.push((addition, gain));
        outlook = ExtensionCandidates::new(problem, &fit);
    }
    if gains.is_empty() {
        return (first, gains);
    }
    drop_idle(problem, &mut fit, &mut gains);
    match other_clock(problem, &fit, &gains) {
        Some(simpler) => simpler,
        None => (fit, gains),
    }
}

/// The same fit by the clock of the other channels: most channels late by one time are the others early by it. `None` unless that
/// needs fewer errors; the gains of the delays go to those that replace them.
fn other_clock(
    problem: &PredictionErrorProblem,
    fit: &PredictionErrorFit,
    gains: &[(ModelExtension, f64)],
) -> Option<(PredictionErrorFit, Vec<(ModelExtension, f64)>)> {
    let mut start = problem.fitted_unknowns(fit);
    let is_delay = |cause: &SystematicError| SystematicError::DELAYS.contains(cause);
    let mut late: Vec<f64> =
        fit.active.iter().copied().filter(is_delay).map(|cause| start.causes[cause]).collect();
    let sought = SystematicError::DELAYS
        .into_iter()
        .filter(|cause| problem.search.mode(*cause) == EstimationMode::Evidence);
    let rest: Vec<SystematicError> = sought.filter(|cause| !fit.active.contains(cause)).collect();
    if rest.is_empty() || late.len() <= rest.len() {
        return None;
    }
    late.sort_by(f64::total_cmp);
    let common = late[late.len() / 2];
    let mut active = fit.active.clone();
    active.extend(&rest);
    active.iter().filter(|cause| is_delay(cause)).for_each(|cause| start.causes[*cause] -= common);
    let mut other = problem.fit_delayed_rows(active, start);
    let of_delay = |(addition, _): &(ModelExtension, f64)| matches!(addition, ModelExtension::Error(cause) if is_delay(cause));
    let total: f64 = gains.iter().filter(|it| of_delay(it)).map(|(_, gain)| gain).sum();
    let mut found: Vec<_> =
        rest.iter().map(|cause| (ModelExtension::Error(*cause), total / rest.len() as f64)).collect();
    found.extend_from_slice(gains);
    drop_idle(problem, &mut other, &mut found);
    let saved = gains.len().checked_sub(found.len()).filter(|saved| *saved > 0)?;
    (fit_cost(&other) < fit_cost(fit) + ENOUGH * saved as f64).then_some((other, found))
}

fn fit_cost(fit: &PredictionErrorFit) -> f64 {
    fit.minimum.model.cost
}

/// A fit with one more addition; `lasting` are the correlations of its innovations from row to row.
fn fit_with_extension(
    problem: &PredictionErrorProblem,
    fit: &PredictionErrorFit,
    addition: ModelExtension,
    lasting: &[f64; 4],
) -> PredictionErrorFit {
    let mut active = fit.active.clone();
    let mut start = problem.fitted_unknowns(fit);
    match addition {
        ModelExtension::Error(cause) => active.push(cause),
        ModelExtension::Relaxation => {
            active.extend(SystematicError::TIRES);
            start.causes.set_initial_relaxation();
        }
        ModelExtension::Colour => {
            for (colour, correlation) in start.noise.coloured.iter_mut().zip(lasting) {
                if *correlation > COLOURED {
                    *colour = COLOUR;
                }
            }
            (start.noise, _) = problem.noise.estimate_noise(&fit.likelihood, &start);
        }
    }
    problem.fit_at_fixed_noise(active, start)
}

/// Takes out errors of sensors that later ones made idle.
fn drop_idle(
    problem: &PredictionErrorProblem,
    fit: &mut PredictionErrorFit,
    gains: &mut Vec<(ModelExtension, f64)>,
) {
    while gains.len() > 1 {
        let covariance = inverse_hessian(&fit.minimum.model.hessian);
        let height = |(addition, _): &(ModelExtension, f64)| {
            let ModelExtension::Error(cause) = *addition else { return None };
            let index = SIZE + fit.active.iter().position(|it| *it == cause)?;
            Some((cause, 0.5 * fit.minimum.x[index].powi(2) / covariance[(index, index)]))
        };
        let least = gains.iter().filter_map(height).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((cause, _)) = least.filter(|(_, height)| *height < ENOUGH) else { return };
        let active = fit.active.iter().copied().filter(|it| *it != cause).collect();
        let mut start = problem.fitted_unknowns(fit);
        start.causes[cause] = 0.0;
        *fit = problem.fit_delayed_rows(active, start);
        gains.retain(|(it, _)| *it != ModelExtension::Error(cause));
    }
}

/// What a fit leaves to hope for.
struct ExtensionCandidates {
    /// What is worth a fit, that with the largest foretold gain first.
    promising: Vec<ModelExtension>,
    /// What would be, if its scores did not scatter so; only where innovations last.
    doubtful: Vec<ModelExtension>,
    /// Correlations of innovations from row to row.
    lasting: [f64; 4],
}

impl ExtensionCandidates {
    fn new(problem: &PredictionErrorProblem, fit: &PredictionErrorFit) -> Self {
        let sought = |cause: &SystematicError| problem.search.mode(*cause) == EstimationMode::Evidence;
        let candidates: Vec<SystematicError> = SystematicError::ALL
            .into_iter()
            .filter(|cause| sought(cause) && problem.std[*cause] > 0.0)
            // At no length the slip has no state to take a derivative by.
            .filter(|cause| !fit.active.contains(cause) && !SystematicError::TIRES.contains(cause))
            .collect();
        let joint = problem.joint_posterior(&fit.likelihood, fit.noise, &fit.active);
        let mut directions = joint.variable_directions();
        let known = directions.len();
        directions.extend(candidates.iter().copied().map(DerivativeDirection::Error));
        let at = joint.unknowns_at(&fit.minimum.x);
        let mut rows = fit.likelihood.residual_rows(&at, &directions);
        let lasting = std::array::from_fn(|channel| rows.whitened_autocorrelation(channel));
        let mut additions: Vec<(ModelExtension, f64)> = candidates
            .iter()
            .map(|cause| (ModelExtension::Error(*cause), joint.prior_precision(*cause)))
            .collect();
        let rigid = SystematicError::TIRES.iter().all(|it| sought(it) && !fit.active.contains(it));
        if rigid && is_any_channel_correlated(&lasting) {
            let mut relaxed = at;
            relaxed.causes.set_initial_relaxation();
            rows.add_secant_direction(&fit.likelihood.residual_rows(&relaxed, &directions[..1]));
            additions.push((ModelExtension::Relaxation, 0.0));
        }
        let score = ScoreTest::new(&rows, &joint, known);
        let gain = |(index, (addition, precision)): (usize, &(ModelExtension, f64))| {
            score.likelihood_gain(known + index, *precision).map(|(gain, sure)| (*addition, gain, sure))
        };
        let mut foretold: Vec<_> = additions.iter().enumerate().filter_map(gain).collect();
        foretold.sort_by(|a, b| b.1.total_cmp(&a.1));
        let worth = |sure: bool, most: usize| -> Vec<ModelExtension> {
            let of_them = || foretold.iter().filter(move |it| it.2 == sure);
            let enough = of_them().next().map_or(0.0, |(_, best, _)| SHARE * best);
            of_them().filter(|it| it.1 >= enough).take(most).map(|it| it.0).collect()
        };
        let doubtful = if is_any_channel_correlated(&lasting) { worth(false, DOUBTFUL) } else { Vec::new() };
        Self { promising: worth(true, TRIALS), doubtful, lasting }
    }

    /// The addition that gains most, its gain once everything has followed, and the fit with it; none that gains too little. A
    /// doubtful one has to gain more than noise that lasts.
    fn best_extension(
        &self,
        problem: &PredictionErrorProblem,
        fit: &PredictionErrorFit,
    ) -> Option<(ModelExtension, f64, PredictionErrorFit)> {
        let try_out =
            |addition: ModelExtension| (addition, fit_with_extension(problem, fit, addition, &self.lasting));
        let least = |tried: &[ModelExtension]| {
            let tried = tried.iter().copied().map(try_out);
            tried.min_by(|a, b| fit_cost(&a.1).total_cmp(&fit_cost(&b.1)))
        };
        let full = |(addition, tried): (ModelExtension, PredictionErrorFit)| {
            let better = problem.fit_delayed_rows(tried.active.clone(), problem.fitted_unknowns(&tried));
            let gain = fit_cost(fit) - fit_cost(&better);
            // A gain that is no number is none.
            (gain >= ENOUGH).then_some((addition, gain, better))
        };
        let mut best = least(&self.promising);
        let colour = || self.is_coloured_noise_allowed(problem, fit).then(|| try_out(ModelExtension::Colour));
        let ahead = |it: &(ModelExtension, PredictionErrorFit),
                     other: &Option<(ModelExtension, PredictionErrorFit)>| {
            other.as_ref().is_none_or(|other| fit_cost(&it.1) < fit_cost(&other.1))
        };
        let mut noise = None;
        if let Some(doubtful) = least(&self.doubtful).filter(|it| ahead(it, &best)) {
            noise = colour();
            if noise.is_some() && ahead(&doubtful, &noise) {
                best = Some(doubtful);
            }
        }
        best.and_then(full).or_else(|| noise.or_else(colour).and_then(full))
    }

    /// Whether noise that lasts may be tried.
    fn is_coloured_noise_allowed(&self, problem: &PredictionErrorProblem, fit: &PredictionErrorFit) -> bool {
        let white = fit.noise.coloured.iter().all(|it| it.share == 0.0);
        problem.noise.is_estimated() && white && is_any_channel_correlated(&self.lasting)
    }
}

/// Whether some channel's innovations do.
fn is_any_channel_correlated(correlations: &[f64; 4]) -> bool {
    correlations.iter().any(|correlation| *correlation > COLOURED)
}

/// Scores of blocks, with what is known of everything that follows.
struct ScoreTest {
    blocks: Vec<DVector<f64>>,
    information: DMatrix<f64>,
    /// Covariance of the unknowns that are fitted.
    fitted: DMatrix<f64>,
    known: usize,
}

impl ScoreTest {
    fn new(rows: &ResidualRows, joint: &JointPosterior, known: usize) -> Self {
        let information = rows.total_expansion().information;
        let mut fitted = information.view((0, 0), (known, known)).into_owned();
        for (i, cause) in joint.active.iter().enumerate() {
            let index = SIZE + i;
            fitted[(index, index)] += joint.prior_precision(*cause);
        }
        Self { blocks: rows.block_scores(), fitted: inverse_hessian(&fitted), information, known }
    }

    /// Gain of the likelihood by an addition of some precision before any data, with everything else following [nat], and whether it
    /// is more than the scatter of blocks explains; none that is small, or where a length would be negative.
    fn likelihood_gain(&self, index: usize, precision: f64) -> Option<(f64, bool)> {
        let cross = self.information.view((0, index), (self.known, 1)).into_owned();
        let follow = &self.fitted * &cross;
        let information = self.information[(index, index)] - cross.dot(&follow);
        let scores: Vec<f64> = self
            .blocks
            .iter()
            .map(|block| follow.column(0).dot(&block.rows(0, self.known)) - block[index])
            .collect();
        let slope: f64 = scores.iter().sum();
        let mean = slope / scores.len() as f64;
        let spread: f64 = scores.iter().map(|score| (score - mean).powi(2)).sum();
        let by = |variance: f64| 0.5 * slope * slope / (variance + precision);
        let backwards = precision == 0.0 && slope < 0.0;
        let sure = by(information.max(spread)) > ENOUGH;
        (by(information) > ENOUGH && !backwards).then(|| (by(information), sure))
    }
}
