//! Adaptive importance sampling, for posteriors that take milliseconds to evaluate.
//!
//! Each round draws from a mixture of t distributions, one for each mode, and counts all draws so far as those of the mixture of all
//! rounds (Cornuet, Marin, Mira and Robert, "Adaptive multiple importance sampling", Scand. J. Stat. 39 (2012)). The next round's
//! distributions have masses, means and covariances of the weighted draws. Once they fit, what is reported comes from their own draws
//! alone, which they were not fitted to: those of earlier rounds would make them look better than they are.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use crate::psis::{self, WeightDiagnosis};

/// Draws of a round.
const ROUND: usize = 192;
/// Most rounds.
const ROUNDS: usize = 8;
/// Share of a round's draws that count, from which on its distributions fit.
const FITS: f64 = 0.3;
/// Effective draws per dimension that a covariance is taken from; weights are flattened until there are so many.
const FOR_COVARIANCE: f64 = 8.0;
/// Power of the weights that flattens them once, and how often that is done at most.
const FLATTER: f64 = 0.7;
const MOST_FLATTENED: usize = 20;
/// Effective draws below which they are no posterior.
const FEWEST: f64 = 300.0;
/// Least share of a round's draws that a mode gets.
const LEAST_SHARE: f64 = 0.1;
/// Degrees of freedom of the t distributions.
const FREEDOM: usize = 6;
/// Factor of the covariance: weights cannot give mass to where there are no draws.
const WIDER: f64 = 1.4;
/// Part of the variances that is added to them, so that they never collapse.
const RIDGE: f64 = 1e-6;

/// A multivariate t distribution and its weight in a mixture.
#[derive(Clone)]
struct StudentTComponent {
    mean: DVector<f64>,
    cholesky_factor: DMatrix<f64>,
    /// Half the logarithm of the determinant of the scale matrix.
    half_log_determinant: f64,
    weight: f64,
}

impl StudentTComponent {
    /// `None` if the covariance is not positive definite.
    fn new(mean: DVector<f64>, covariance: DMatrix<f64>, weight: f64) -> Option<Self> {
        let cholesky_factor = covariance.cholesky()?.l();
        let half_log_determinant = cholesky_factor.diagonal().iter().map(|width| width.ln()).sum();
        Some(Self { mean, cholesky_factor, half_log_determinant, weight })
    }

    fn draw(&self, random: &mut Pcg64) -> DVector<f64> {
        let mut normal = || -> f64 { random.sample(StandardNormal) };
        let e = DVector::from_fn(self.mean.len(), |_, _| normal());
        let chi_squared: f64 = (0..FREEDOM).map(|_| normal().powi(2)).sum();
        &self.mean + &self.cholesky_factor * e * (FREEDOM as f64 / chi_squared).sqrt()
    }

    /// But for a constant that all have in common.
    fn log_density(&self, z: &DVector<f64>) -> f64 {
        let (freedom, dimension) = (FREEDOM as f64, z.len() as f64);
        let Some(e) = self.cholesky_factor.solve_lower_triangular(&(z - &self.mean)) else {
            return f64::NEG_INFINITY;
        };
        -0.5 * (freedom + dimension) * (e.norm_squared() / freedom).ln_1p() - self.half_log_determinant
    }
}

/// Draws with the logarithms of the density that is sought, and what they were drawn from.
struct DrawPool<'a, F> {
    log_density: &'a F,
    points: Vec<DVector<f64>>,
    logs: Vec<f64>,
    mixtures: Vec<(Vec<StudentTComponent>, f64)>,
}

impl<'a, F: Fn(&[DVector<f64>]) -> Vec<f64>> DrawPool<'a, F> {
    fn new(log_density: &'a F) -> Self {
        Self { log_density, points: Vec::new(), logs: Vec::new(), mixtures: Vec::new() }
    }

    fn draw_from_mixture(&mut self, mixture: &[StudentTComponent], count: usize, random: &mut Pcg64) {
        let from = self.points.len();
        for component in mixture {
            let own = (component.weight * count as f64).round() as usize;
            self.points.extend((0..own).map(|_| component.draw(random)));
        }
        let new = (self.log_density)(&self.points[from..]);
        let known = |log: f64| if log.is_nan() { f64::NEG_INFINITY } else { log };
        self.logs.extend(new.into_iter().map(known));
        self.mixtures.push((mixture.to_vec(), (self.points.len() - from) as f64));
    }

    /// Weights of all draws, as those of the mixture of all that they came from.
    fn importance_weights(&self) -> (WeightDiagnosis, Vec<f64>) {
        let log_weight = |(z, log): (&DVector<f64>, &f64)| {
            let parts = self.mixtures.iter().flat_map(|(mixture, count)| {
                mixture.iter().map(move |it| (it.weight * count).ln() + it.log_density(z))
            });
            let parts: Vec<f64> = parts.collect();
            let most = parts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            log - most - parts.iter().map(|part| (part - most).exp()).sum::<f64>().ln()
        };
        let log_weights: Vec<f64> = self.points.iter().zip(&self.logs).map(log_weight).collect();
        psis::pareto_smooth(&log_weights)
    }

    fn append(&mut self, other: Self) {
        self.points.extend(other.points);
        self.logs.extend(other.logs);
        self.mixtures.extend(other.mixtures);
    }
}

/// Weighted draws.
pub struct WeightedDraws {
    /// The draws.
    pub points: Vec<DVector<f64>>,
    /// Their weights, of sum 1, the largest ones smoothed.
    pub weights: Vec<f64>,
    /// What the weights say.
    pub diagnosis: WeightDiagnosis,
    /// How many rounds it took.
    pub rounds: usize,
    /// Evaluations of the density in all of them.
    pub evaluations: usize,
}

impl WeightedDraws {
    /// Whether the draws can stand for the density, but for modes that no start was near.
    pub fn is_exact(&self) -> bool {
        self.diagnosis.is_close() && self.effective_sample_size() >= FEWEST
    }

    /// How many independent draws say as much.
    pub fn effective_sample_size(&self) -> f64 {
        self.diagnosis.effective_share * self.points.len() as f64
    }
}

/// Draws from the density of this logarithm, which is asked for many points at once; NaN and −∞ are no density. Starts are means and covariances, one for each mode that is
/// known; `enough` is the number of effective draws that are wanted in the end. `go_on` is asked before each round. `None` if no start is usable or nobody wants to go on.
pub fn sample_by_importance(
    log_density: &impl Fn(&[DVector<f64>]) -> Vec<f64>,
    starts: &[(DVector<f64>, DMatrix<f64>)],
    enough: f64,
    seed: u64,
    go_on: impl Fn() -> bool,
) -> Option<WeightedDraws> {
    let mut random = Pcg64::seed_from_u64(seed);
    let share = 1.0 / starts.len() as f64;
    let start = |(mean, covariance): &(DVector<f64>, DMatrix<f64>)| {
        StudentTComponent::new(mean.clone(), covariance.clone(), share)
    };
    let mut mixture: Vec<StudentTComponent> = starts.iter().filter_map(start).collect();
    let mut all = DrawPool::new(log_density);
    for round in 1..=ROUNDS {
        if mixture.is_empty() || !go_on() {
            return None;
        }
        let mut own = DrawPool::new(log_density);
        own.draw_from_mixture(&mixture, ROUND, &mut random);
        let (mut diagnosis, mut weights) = own.importance_weights();
        if diagnosis.effective_share >= FITS && diagnosis.is_close() {
            // The first share was that of few draws.
            for _ in 0..2 {
                let missing = enough - diagnosis.effective_share * own.points.len() as f64;
                let more = (missing.max(0.0) / diagnosis.effective_share.max(FITS)).ceil() as usize;
                own.draw_from_mixture(&mixture, more, &mut random);
                (diagnosis, weights) = own.importance_weights();
            }
            if diagnosis.is_close() {
                let evaluations = all.points.len() + own.points.len();
                return Some(WeightedDraws {
                    points: own.points,
                    weights,
                    diagnosis,
                    rounds: round,
                    evaluations,
                });
            }
        }
        all.append(own);
        if round == ROUNDS {
            break;
        }
        let better = refit_mixture(&all, &mixture);
        if !better.is_empty() {
            mixture = better;
        }
    }
    let (diagnosis, weights) = all.importance_weights();
    let evaluations = all.points.len();
    Some(WeightedDraws { points: all.points, weights, diagnosis, rounds: ROUNDS, evaluations })
}

/// Masses, means and covariances of the weighted draws, each counted with the component that is densest there.
fn refit_mixture<F: Fn(&[DVector<f64>]) -> Vec<f64>>(
    pool: &DrawPool<F>,
    mixture: &[StudentTComponent],
) -> Vec<StudentTComponent> {
    let (_, weights) = pool.importance_weights();
    let nearest = |z: &DVector<f64>| {
        let height = |component: &StudentTComponent| component.weight.ln() + component.log_density(z);
        let heights: Vec<f64> = mixture.iter().map(height).collect();
        (0..heights.len()).max_by(|&a, &b| heights[a].total_cmp(&heights[b]))
    };
    let places: Vec<Option<usize>> = pool.points.iter().map(nearest).collect();
    let component = |index: usize| {
        let own = |&i: &usize| places[i] == Some(index);
        let own: Vec<usize> = (0..weights.len()).filter(own).collect();
        let weights: Vec<f64> = own.iter().map(|&i| weights[i]).collect();
        let points: Vec<_> = own.iter().map(|&i| &pool.points[i]).collect();
        let mass = weights.iter().sum::<f64>().max(LEAST_SHARE);
        fit_component(&points, weights, mass)
    };
    let mut better: Vec<StudentTComponent> = (0..mixture.len()).filter_map(component).collect();
    let whole: f64 = better.iter().map(|component| component.weight).sum();
    better.iter_mut().for_each(|component| component.weight /= whole);
    better
}

/// With mean and covariance of weighted draws.
fn fit_component(points: &[&DVector<f64>], mut weights: Vec<f64>, share: f64) -> Option<StudentTComponent> {
    let dimension = points.first()?.len();
    // With more than that all that have a weight have the same.
    for _ in 0..MOST_FLATTENED {
        let whole: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        if whole * whole >= FOR_COVARIANCE * dimension as f64 * squares {
            break;
        }
        weights.iter_mut().for_each(|weight| *weight = weight.powf(FLATTER));
    }
    let whole: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= whole);
    let mut mean = DVector::zeros(dimension);
    for (z, weight) in points.iter().zip(&weights) {
        mean.axpy(*weight, z, 1.0);
    }
    let mut covariance = DMatrix::zeros(dimension, dimension);
    for (z, weight) in points.iter().zip(&weights) {
        let off = *z - &mean;
        covariance.ger(*weight, &off, &off, 1.0);
    }
    for i in 0..dimension {
        covariance[(i, i)] *= 1.0 + RIDGE;
    }
    StudentTComponent::new(mean, covariance * WIDER, share)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const ENOUGH: f64 = 500.0;

    fn all(of: impl Fn(&DVector<f64>) -> f64) -> impl Fn(&[DVector<f64>]) -> Vec<f64> {
        move |points| points.iter().map(&of).collect()
    }

    fn moments(sampled: &WeightedDraws, quantity: impl Fn(&DVector<f64>) -> f64) -> [f64; 2] {
        let weighted = |f: &dyn Fn(f64) -> f64| -> f64 {
            sampled.points.iter().zip(&sampled.weights).map(|(z, w)| w * f(quantity(z))).sum()
        };
        let mean = weighted(&|x| x);
        [mean, weighted(&|x| (x - mean).powi(2)).sqrt()]
    }

    /// A bent ridge, and the logit of what is anywhere between two bounds.
    fn banana(z: &DVector<f64>) -> f64 {
        let bent = z[1] - 0.15 * (z[0] * z[0] - 1.0);
        let bounded = -z[2] - 2.0 * (-z[2]).exp().ln_1p();
        -0.5 * z[0] * z[0] - 2.0 * bent * bent + bounded - 0.5 * z.rows(3, 5).norm_squared()
    }

    #[test]
    fn a_bent_valley_and_what_is_not_known_are_drawn_from_as_they_are() {
        // The start is off by several standard deviations, and too narrow.
        let start = (DVector::from_element(8, 1.5), 0.3 * DMatrix::<f64>::identity(8, 8));
        let mut off = [[0.0; 2]; 3];
        let seeds = 12;
        for seed in 0..seeds {
            let found =
                sample_by_importance(&all(banana), std::slice::from_ref(&start), ENOUGH, seed, || true)
                    .expect("draws");
            assert!(
                found.effective_sample_size() > 0.6 * ENOUGH && found.diagnosis.is_close(),
                "{seed} {} {:?} {}",
                found.effective_sample_size(),
                found.diagnosis,
                found.rounds
            );
            // Means and standard deviations of x, of 0.15 (x² − 1) with noise, and of a uniform distribution.
            let exact = [[0.0, 1.0], [0.0, (0.0225_f64 * 2.0 + 0.25).sqrt()], [0.5, 12_f64.sqrt().recip()]];
            for (i, exact) in exact.into_iter().enumerate() {
                let share = |z: f64| 1.0 / (1.0 + (-z).exp());
                let [mean, std] = moments(&found, |z| if i == 2 { share(z[2]) } else { z[i] });
                off[i][0] += (mean - exact[0]) / exact[1] / seeds as f64;
                off[i][1] += (std / exact[1] - 1.0) / seeds as f64;
            }
        }
        // Of twelve times 300 draws: three standard errors.
        assert!(off.iter().flatten().all(|off| off.abs() < 0.05), "{off:?}");
    }

    #[test]
    fn modes_have_their_shares() {
        let apart = 12.0;
        let bimodal = |z: &DVector<f64>| {
            let rest = -0.5 * z.rows(1, 7).norm_squared();
            let near = -0.5 * z[0] * z[0];
            let far = 0.25_f64.ln() - 0.5 * ((z[0] - apart) / 0.5).powi(2);
            rest + near.max(far) + (-(near - far).abs()).exp().ln_1p()
        };
        let at = |x: f64| {
            let mut mean = DVector::zeros(8);
            mean[0] = x;
            (mean, DMatrix::identity(8, 8))
        };
        let found =
            sample_by_importance(&all(bimodal), &[at(0.0), at(apart)], ENOUGH, 3, || true).expect("draws");
        let there = found.points.iter().zip(&found.weights).filter(|(z, _)| z[0] > 6.0);
        // A quarter as high and half as wide.
        assert_relative_eq!(there.map(|(_, w)| w).sum::<f64>(), 1.0 / 9.0, max_relative = 0.15);
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let start = [(DVector::zeros(8), DMatrix::<f64>::identity(8, 8))];
        assert!(sample_by_importance(&all(banana), &[], ENOUGH, 0, || true).is_none());
        assert!(sample_by_importance(&all(banana), &start, ENOUGH, 0, || false).is_none());
        let found = sample_by_importance(&all(|_| f64::NAN), &start, ENOUGH, 0, || true);
        assert!(found.is_none_or(|found| !found.diagnosis.is_close()));
    }
}
