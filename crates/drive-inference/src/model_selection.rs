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
use crate::likelihood::{DerivativeDirection, DriveUnknowns};
use crate::problem::{PredictionErrorFit, PredictionErrorProblem};
use crate::residual_rows::{CostExpansion, ResidualRows};
use crate::tires::SIZE;
use preparation::SystematicError;

/// Gain from which on an error is taken for real [nat]: by chance one of fourteen errors gains more in one of fifty drives.
pub const ENOUGH: f64 = 5.0;
/// Errors that are fitted in each round, and their least share of the best foretold gain.
const TRIALS: usize = 4;
const SHARE: f64 = 0.05;
/// Errors that are fitted in each round although the scatter of blocks explains their gain.
const DOUBTFUL: usize = 2;
/// Rows between the changes of friction that are looked at first, and gain that the likeliest of so many needs [nat].
const CHANGE_STRIDE: usize = 25;
const CHANGE_GAIN: f64 = 12.0;
/// Delays, and low-passes that look like them.
const DELAYS_AND_LOW_PASSES: [(SystematicError, SystematicError); 3] = [
    (SystematicError::SideslipDelay, SystematicError::SideslipLowPass),
    (SystematicError::YawRateDelay, SystematicError::YawRateLowPass),
    (SystematicError::AccelerationDelay, SystematicError::AccelerationLowPass),
];
/// Where a fit of a low-pass starts [s].
const START_LOW_PASS: f64 = 0.02;
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
        let addition = match addition {
            ModelExtension::FrictionChange { .. } => ModelExtension::Error(SystematicError::FrictionChange),
            other => other,
        };
        gains.push((addition, gain));
        outlook = ExtensionCandidates::new(problem, &fit);
    }
    if gains.is_empty() {
        return (first, gains);
    }
    drop_idle(problem, &mut fit, &mut gains);
    for family in [&SystematicError::DELAYS[..], &SystematicError::CLOCKS] {
        if let Some(simpler) = other_clock(problem, &fit, &gains, family) {
            (fit, gains) = simpler;
        }
    }
    (fit, gains)
}

/// The same fit by the clock of the other channels: most channels late by one time are the others early by it, and so are clocks that
/// drift. `None` unless that needs fewer errors of the family; the gains of the delays go to those that replace them.
fn other_clock(
    problem: &PredictionErrorProblem,
    fit: &PredictionErrorFit,
    gains: &[(ModelExtension, f64)],
    family: &[SystematicError],
) -> Option<(PredictionErrorFit, Vec<(ModelExtension, f64)>)> {
    let mut start = problem.fitted_unknowns(fit);
    let is_delay = |cause: &SystematicError| family.contains(cause);
    let mut late: Vec<f64> =
        fit.active.iter().copied().filter(is_delay).map(|cause| start.causes[cause]).collect();
    let is_sought = |cause: &SystematicError| problem.search.mode(*cause) == EstimationMode::Evidence;
    let sought = family.iter().copied().filter(is_sought);
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
        ModelExtension::Error(cause) => {
            active.push(cause);
            if SystematicError::LOW_PASSES.contains(&cause) {
                start.causes[cause] = START_LOW_PASS;
            }
        }
        ModelExtension::Relaxation => {
            active.extend(SystematicError::TIRES);
            start.causes.set_initial_relaxation();
        }
        ModelExtension::FrictionChange { row } => {
            active.push(SystematicError::FrictionChange);
            start.friction_change_row = row;
            let rough = problem.fit_at_fixed_noise(active.clone(), start);
            start = likeliest_friction_change(problem, &problem.fitted_unknowns(&rough));
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

/// The same unknowns with the change of friction at the likeliest row near theirs.
fn likeliest_friction_change(problem: &PredictionErrorProblem, at: &DriveUnknowns) -> DriveUnknowns {
    let cost = |at: &DriveUnknowns| problem.build_likelihood(Some(at)).cost(at);
    let (mut best, mut least) = (*at, cost(at));
    let mut stride = CHANGE_STRIDE / 2;
    while stride > 0 {
        let row = best.friction_change_row;
        for friction_change_row in [row.saturating_sub(stride), row + stride] {
            let mut other = best;
            other.friction_change_row = friction_change_row;
            let cost = cost(&other);
            if cost < least {
                (best, least) = (other, cost);
            }
        }
        if best.friction_change_row == row {
            stride /= 2;
        }
    }
    best
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
            .map(|cause| {
                let addition = match cause {
                    SystematicError::FrictionChange => ModelExtension::FrictionChange { row: 0 },
                    other => ModelExtension::Error(*other),
                };
                (addition, joint.prior_precision(*cause))
            })
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
            if let ModelExtension::FrictionChange { .. } = addition {
                let (sample, gain) = score.likeliest_change(&rows, known + index, *precision)?;
                let row = fit.likelihood.recorded_row(sample);
                return Some((ModelExtension::FrictionChange { row }, gain, true));
            }
            let is_positive = match addition {
                ModelExtension::Error(cause) => SystematicError::LOW_PASSES.contains(cause),
                _ => true,
            };
            let gain = score.likelihood_gain(known + index, *precision, is_positive);
            gain.map(|(gain, sure)| (*addition, gain, sure))
        };
        let mut foretold: Vec<_> = additions.iter().enumerate().filter_map(gain).collect();
        foretold.sort_by(|a, b| b.1.total_cmp(&a.1));
        let worth = |sure: bool, most: usize| -> Vec<ModelExtension> {
            let of_them = || foretold.iter().filter(move |it| it.2 == sure);
            let enough = of_them().next().map_or(0.0, |(_, best, _)| SHARE * best);
            of_them().filter(|it| it.1 >= enough).take(most).map(|it| it.0).collect()
        };
        let mut promising = worth(true, TRIALS);
        // A low-pass looks like a delay; which of both it is only a fit can tell.
        for (delay, low_pass) in DELAYS_AND_LOW_PASSES {
            let of = |error| ModelExtension::Error(error);
            if promising.contains(&of(delay))
                && candidates.contains(&low_pass)
                && !promising.contains(&of(low_pass))
            {
                promising.push(of(low_pass));
            }
        }
        let doubtful = if is_any_channel_correlated(&lasting) { worth(false, DOUBTFUL) } else { Vec::new() };
        Self { promising, doubtful, lasting }
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
        let by_cost = |additions: &[ModelExtension]| {
            let mut tried: Vec<_> = additions.iter().copied().map(try_out).collect();
            tried.sort_by(|a, b| fit_cost(&a.1).total_cmp(&fit_cost(&b.1)));
            tried
        };
        let full = |(addition, tried): (ModelExtension, PredictionErrorFit)| {
            let better = problem.fit_delayed_rows(tried.active.clone(), problem.fitted_unknowns(&tried));
            let gain = fit_cost(fit) - fit_cost(&better);
            // A gain that is no number is none.
            (gain >= ENOUGH).then_some((addition, gain, better))
        };
        let mut promising = by_cost(&self.promising).into_iter();
        let mut best = promising.next();
        let partner = best.as_ref().and_then(|it| delay_or_low_pass(it.0));
        let mut rival = promising.find(|it| Some(it.0) == partner);
        let colour = || self.is_coloured_noise_allowed(problem, fit).then(|| try_out(ModelExtension::Colour));
        let ahead = |it: &(ModelExtension, PredictionErrorFit),
                     other: &Option<(ModelExtension, PredictionErrorFit)>| {
            other.as_ref().is_none_or(|other| fit_cost(&it.1) < fit_cost(&other.1))
        };
        let mut noise = None;
        if let Some(doubtful) = by_cost(&self.doubtful).into_iter().next().filter(|it| ahead(it, &best)) {
            noise = colour();
            if noise.is_some() && ahead(&doubtful, &noise) {
                (best, rival) = (Some(doubtful), None);
            }
        }
        // Noises tell a low-pass from a delay, and only a full fit estimates them.
        let fitted = [best, rival].into_iter().flatten().filter_map(full);
        fitted.max_by(|a, b| a.1.total_cmp(&b.1)).or_else(|| noise.or_else(colour).and_then(full))
    }

    /// Whether noise that lasts may be tried.
    fn is_coloured_noise_allowed(&self, problem: &PredictionErrorProblem, fit: &PredictionErrorFit) -> bool {
        let white = fit.noise.coloured.iter().all(|it| it.share == 0.0);
        problem.noise.is_estimated() && white && is_any_channel_correlated(&self.lasting)
    }
}

/// The low-pass that looks like a delay, or the other way round.
fn delay_or_low_pass(addition: ModelExtension) -> Option<ModelExtension> {
    let ModelExtension::Error(error) = addition else { return None };
    let other = |(delay, low_pass)| match error {
        _ if error == delay => Some(low_pass),
        _ if error == low_pass => Some(delay),
        _ => None,
    };
    DELAYS_AND_LOW_PASSES.into_iter().find_map(other).map(ModelExtension::Error)
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
    /// is more than the scatter of blocks explains; none that is small, or where what is positive would be negative.
    fn likelihood_gain(&self, index: usize, precision: f64, is_positive: bool) -> Option<(f64, bool)> {
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
        let backwards = is_positive && slope < 0.0;
        let sure = by(information.max(spread)) > ENOUGH;
        (by(information) > ENOUGH && !backwards).then(|| (by(information), sure))
    }

    /// The sample from which on an unknown most likely has another value, and the gain [nat]; `index` is the direction in which it has it
    /// throughout.
    fn likeliest_change(&self, rows: &ResidualRows, index: usize, precision: f64) -> Option<(usize, f64)> {
        let zero = DVector::zeros(self.known);
        let fitted = self.blocks.iter().fold(zero, |sum, block| sum + block.rows(0, self.known));
        let mut tail: Option<CostExpansion> = None;
        let mut best: Option<(usize, f64)> = None;
        for from in (CHANGE_STRIDE..rows.len().saturating_sub(CHANGE_STRIDE)).step_by(CHANGE_STRIDE).rev() {
            let end = match &tail {
                None => rows.len(),
                Some(_) => from + CHANGE_STRIDE,
            };
            let part = rows.partial_expansion(from..end);
            let sum = match tail.take() {
                None => part,
                Some(sum) => sum.plus(&part),
            };
            let cross = sum.information.view((0, index), (self.known, 1)).into_owned();
            let follow = &self.fitted * &cross;
            let information = sum.information[(index, index)] - cross.dot(&follow);
            let slope = follow.column(0).dot(&fitted) - sum.gradient[index];
            let gain = 0.5 * slope * slope / (information.max(0.0) + precision);
            if gain > best.map_or(CHANGE_GAIN, |(_, gain)| gain) {
                best = Some((from, gain));
            }
            tail = Some(sum);
        }
        best
    }
}
