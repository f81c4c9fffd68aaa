//! Chooses the errors of sensors that the data ask for: each by the likelihood that it gains once everything else has followed.
//!
//! The gain is first foretold by a score test, ½ s²/i with the score s of an error and its information i after all other unknowns have
//! followed. Residuals that are not white overstate it; so i is at least the variance of the scores of blocks. The most
//! promising errors are then fitted, since a large error bends the likelihood further than a score can see.

use nalgebra::{DMatrix, DVector};

use crate::adequacy::COLOURED;
use crate::cause::Cause;
use crate::explored::inverse;
use crate::joint::Joint;
use crate::likelihood::Direction;
use crate::problem::{Fit, Problem};
use crate::rows::Rows;
use crate::tires::SIZE;
pub use crate::wanted::{Addition, Mode, Wanted};

/// Gain from which on an error is taken for real [nat]: by chance one of fourteen errors gains more in one of fifty drives.
const ENOUGH: f64 = 5.0;
/// Errors that are fitted in each round, and their least share of the best foretold gain.
const TRIALS: usize = 4;
const SHARE: f64 = 0.05;
/// Most errors that are taken.
const MOST: usize = 8;
/// Where a fit of noise that lasts starts: its correlation from row to row, and its share of the variance.
const COLOUR: [f64; 2] = [0.8, 0.5];

/// Adds errors to a rough fit as long as the data ask for them; what each gained. Costs with and without delays are of the same rows:
/// those that are left with any delay. Noise that lasts explains away every error a little, so that its turn is the last.
pub fn select(problem: &Problem, first: Fit) -> (Fit, Vec<(Addition, f64)>) {
    let mut gains: Vec<(Addition, f64)> = Vec::new();
    let mut outlook = Outlook::new(problem, &first);
    if outlook.promising.is_empty() && !outlook.coloured(problem, &first) {
        return (first, gains);
    }
    let mut fit = problem.refit(first.active.clone(), problem.unknowns(&first));
    while gains.len() < MOST && !problem.cancel.is_cancelled() {
        let before = cost(&fit);
        let full = |(addition, tried): (Addition, Fit)| {
            let fit = problem.refit(tried.active.clone(), problem.unknowns(&tried));
            let gain = before - cost(&fit);
            // A gain that is no number is none.
            (gain >= ENOUGH).then_some((addition, gain, fit))
        };
        let try_out =
            |addition: Addition| (addition, trial(problem, &fit, addition, &outlook.lasting));
        let tried = outlook.promising.iter().copied().map(try_out);
        let best = tried.min_by(|a, b| cost(&a.1).total_cmp(&cost(&b.1)));
        let best = best.and_then(full).or_else(|| {
            outlook.coloured(problem, &fit).then(|| full(try_out(Addition::Colour))).flatten()
        });
        let Some((addition, gain, better)) = best else { break };
        fit = better;
        gains.push((addition, gain));
        outlook = Outlook::new(problem, &fit);
    }
    if gains.is_empty() {
        return (first, gains);
    }
    drop_idle(problem, &mut fit, &mut gains);
    (fit, gains)
}

fn cost(fit: &Fit) -> f64 {
    fit.minimum.model.cost
}

/// A fit with one more addition; `lasting` are the correlations of its innovations from row to row.
fn trial(problem: &Problem, fit: &Fit, addition: Addition, lasting: &[f64; 4]) -> Fit {
    let mut active = fit.active.clone();
    let mut start = problem.unknowns(fit);
    match addition {
        Addition::Error(cause) => active.push(cause),
        Addition::Relaxation => {
            active.extend(Cause::TIRES);
            start.causes.relax();
        }
        Addition::Colour => {
            for (colour, correlation) in start.noise.colour.iter_mut().zip(lasting) {
                if *correlation > COLOURED {
                    *colour = COLOUR;
                }
            }
            (start.noise, _) = problem.noise.refine(&fit.likelihood, &start);
        }
    }
    problem.trial(active, start)
}

/// Takes out errors of sensors that later ones made idle.
fn drop_idle(problem: &Problem, fit: &mut Fit, gains: &mut Vec<(Addition, f64)>) {
    while gains.len() > 1 {
        let covariance = inverse(&fit.minimum.model.hessian);
        let height = |(addition, _): &(Addition, f64)| {
            let Addition::Error(cause) = *addition else { return None };
            let index = SIZE + fit.active.iter().position(|it| *it == cause)?;
            Some((cause, 0.5 * fit.minimum.x[index].powi(2) / covariance[(index, index)]))
        };
        let least = gains.iter().filter_map(height).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((cause, _)) = least.filter(|(_, height)| *height < ENOUGH) else { return };
        let active = fit.active.iter().copied().filter(|it| *it != cause).collect();
        let mut start = problem.unknowns(fit);
        start.causes[cause] = 0.0;
        *fit = problem.refit(active, start);
        gains.retain(|(it, _)| *it != Addition::Error(cause));
    }
}

/// What a fit leaves to hope for.
struct Outlook {
    /// What is worth a fit, that with the largest foretold gain first.
    promising: Vec<Addition>,
    /// Correlations of innovations from row to row.
    lasting: [f64; 4],
}

impl Outlook {
    fn new(problem: &Problem, fit: &Fit) -> Self {
        let sought = |cause: &Cause| problem.search.of(*cause) == Mode::Evidence;
        let candidates: Vec<Cause> = Cause::ALL
            .into_iter()
            .filter(|cause| sought(cause) && problem.std[*cause] > 0.0)
            // At no length the slip has no state to take a derivative by.
            .filter(|cause| !fit.active.contains(cause) && !Cause::TIRES.contains(cause))
            .collect();
        let joint = problem.joint(&fit.likelihood, fit.noise, &fit.active);
        let mut directions = joint.directions();
        let known = directions.len();
        directions.extend(candidates.iter().copied().map(Direction::Cause));
        let at = joint.unknowns(&fit.minimum.x);
        let mut rows = fit.likelihood.rows(&at, &directions);
        let lasting = std::array::from_fn(|channel| rows.autocorrelation(channel));
        let mut additions: Vec<(Addition, f64)> = candidates
            .iter()
            .map(|cause| (Addition::Error(*cause), joint.precision(*cause)))
            .collect();
        let rigid = Cause::TIRES.iter().all(|it| sought(it) && !fit.active.contains(it));
        if rigid && lasts(&lasting) {
            let mut relaxed = at;
            relaxed.causes.relax();
            rows.add_towards(&fit.likelihood.rows(&relaxed, &directions[..1]));
            additions.push((Addition::Relaxation, 0.0));
        }
        let score = Score::new(&rows, &joint, known);
        let gain = |(index, (addition, precision)): (usize, &(Addition, f64))| {
            score.gain(known + index, *precision).map(|gain| (*addition, gain))
        };
        let mut foretold: Vec<_> = additions.iter().enumerate().filter_map(gain).collect();
        foretold.sort_by(|a, b| b.1.total_cmp(&a.1));
        let enough = foretold.first().map_or(0.0, |(_, best)| SHARE * best);
        let worth = foretold.into_iter().filter(|(_, gain)| *gain >= enough).take(TRIALS);
        Self { promising: worth.map(|(addition, _)| addition).collect(), lasting }
    }

    /// Whether noise that lasts may be tried.
    fn coloured(&self, problem: &Problem, fit: &Fit) -> bool {
        let white = fit.noise.colour.iter().all(|[_, share]| *share == 0.0);
        problem.noise.estimated() && white && lasts(&self.lasting)
    }
}

/// Whether some channel's innovations do.
fn lasts(correlations: &[f64; 4]) -> bool {
    correlations.iter().any(|correlation| *correlation > COLOURED)
}

/// Scores of blocks, with what is known of everything that follows.
struct Score {
    blocks: Vec<DVector<f64>>,
    information: DMatrix<f64>,
    /// Covariance of the unknowns that are fitted.
    fitted: DMatrix<f64>,
    known: usize,
}

impl Score {
    fn new(rows: &Rows, joint: &Joint, known: usize) -> Self {
        let information = rows.whole().information;
        let mut fitted = information.view((0, 0), (known, known)).into_owned();
        for (i, cause) in joint.active.iter().enumerate() {
            let index = SIZE + i;
            fitted[(index, index)] += joint.precision(*cause);
        }
        Self { blocks: rows.scores(), fitted: inverse(&fitted), information, known }
    }

    /// Gain of the likelihood by an addition of some precision before any data, with everything else following [nat]; none where
    /// the scatter of blocks explains it, or where a length would be negative.
    fn gain(&self, index: usize, precision: f64) -> Option<f64> {
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
        (by(information.max(spread)) > ENOUGH && !backwards).then(|| by(information))
    }
}
