//! Draws from the posterior in the box by tempering: a population walks from the prior to the posterior as the data are
//! given more and more weight (sequential Monte Carlo, Del Moral, Doucet and Jasra 2006).
//!
//! The noise is integrated out under a flat prior. Moves along differences of two other members follow curved and
//! bounded ridges, where a normal distribution at the best fit has a third of the true width. A second mode of
//! a ten-thousandth of the volume can be missed: its mass is not to be relied on.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::compressed::CompressedSamples;
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::prior::Prior;

/// How much work to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperingOptions {
    /// Members of the population.
    pub members: usize,
    /// Rounds of moves after each rise of the weight of the data.
    pub rounds: usize,
    /// Rounds at the end; four of them, evenly spaced, leave their draws.
    pub last_rounds: usize,
    /// Of the generator, PCG64.
    pub seed: u64,
}

impl Default for TemperingOptions {
    fn default() -> Self {
        Self { members: 2048, rounds: 5, last_rounds: 20, seed: 0 }
    }
}

/// Four times as many draws as members.
pub fn draw_tempered(
    data: &CompressedSamples,
    prior: &Prior,
    options: &TemperingOptions,
) -> PosteriorSamples {
    let mut walk = TemperedPopulation::new(data, prior, options);
    let mut beta = 0.0;
    while beta < 1.0 {
        let next = walk.next_inverse_temperature(beta);
        walk.resample(next - beta);
        beta = next;
        for _ in 0..options.rounds {
            walk.metropolis_step(beta);
        }
    }
    let mut draws = Vec::with_capacity(4 * options.members);
    for round in 1..=options.last_rounds.max(4) {
        walk.metropolis_step(1.0);
        if round * 4 % options.last_rounds.max(4) < 4 {
            draws.extend(walk.members.iter().map(|member| member.theta));
        }
    }
    PosteriorSamples { samples: draws }
}

#[derive(Clone, Copy)]
struct PopulationMember {
    theta: Theta,
    /// Logarithm of the likelihood.
    likelihood: f64,
}

struct TemperedPopulation<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
    free: Vec<usize>,
    members: Vec<PopulationMember>,
    random: Pcg64,
}

impl<'a> TemperedPopulation<'a> {
    fn new(data: &'a CompressedSamples, prior: &'a Prior, options: &TemperingOptions) -> Self {
        let random = Pcg64::seed_from_u64(options.seed);
        let free = prior.free_parameters().map(|parameter| parameter as usize).collect();
        let mut this = Self { data, prior, free, members: Vec::new(), random };
        for _ in 0..options.members {
            let theta = prior.interpolate(&std::array::from_fn(|_| this.random.random()));
            let likelihood = this.log_likelihood(&theta);
            this.members.push(PopulationMember { theta, likelihood });
        }
        this
    }

    /// ∫ σ^−N exp(−S / 2σ²) dσ is S^−(N−1)/2 but for a factor.
    fn log_likelihood(&self, theta: &Theta) -> f64 {
        -0.5 * (self.data.effective_count() as f64 - 1.0) * self.data.residual_squares(theta).ln()
    }

    /// The weight of the data at which half of the population still counts.
    fn next_inverse_temperature(&self, beta: f64) -> f64 {
        let best = self.members.iter().map(|member| member.likelihood).fold(f64::NEG_INFINITY, f64::max);
        let effective = |rise: f64| {
            let weights = self.members.iter().map(|member| (rise * (member.likelihood - best)).exp());
            let (sum, square) = weights.fold((0.0, 0.0), |(sum, square), w| (sum + w, square + w * w));
            sum * sum / square
        };
        let half = 0.5 * self.members.len() as f64;
        let (mut low, mut high) = (0.0, 1.0 - beta);
        if effective(high) >= half {
            return 1.0;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if effective(middle) >= half { low = middle } else { high = middle }
        }
        beta + high
    }

    /// Systematic resampling with weights exp(rise · likelihood).
    fn resample(&mut self, rise: f64) {
        let best = self.members.iter().map(|member| member.likelihood).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = self.members.iter().map(|m| (rise * (m.likelihood - best)).exp()).collect();
        let step = weights.iter().sum::<f64>() / weights.len() as f64;
        let mut threshold = step * self.random.random::<f64>();
        let mut reached = 0.0;
        let mut chosen = Vec::with_capacity(weights.len());
        for (member, weight) in self.members.iter().zip(&weights) {
            reached += weight;
            while threshold < reached && chosen.len() < weights.len() {
                chosen.push(*member);
                threshold += step;
            }
        }
        // The sum may have lost the last bit.
        while let (true, Some(last)) = (chosen.len() < weights.len(), chosen.last().copied()) {
            chosen.push(last);
        }
        self.members = chosen;
    }

    /// One Metropolis step of each member, along the difference of two others (ter Braak 2006).
    fn metropolis_step(&mut self, beta: f64) {
        let before: Vec<Theta> =
            self.members.iter().map(|member| to_walk_coordinates(&member.theta)).collect();
        let usual = 2.38 / (2.0 * self.free.len() as f64).sqrt();
        for (index, start) in before.iter().enumerate() {
            let (a, b) =
                (self.random.random_range(0..before.len()), self.random.random_range(0..before.len()));
            // Whole differences jump from mode to mode.
            let length = if self.random.random::<f64>() < 0.1 {
                1.0
            } else {
                usual * (0.5 + self.random.random::<f64>())
            };
            let mut moved = *start;
            for &i in &self.free {
                moved[i] += length
                    * (before[a][i] - before[b][i])
                    * (1.0 + 0.1 * (self.random.random::<f64>() - 0.5));
            }
            let threshold = self.random.random::<f64>().ln();
            let theta = self.leave_walk_coordinates(&moved);
            if !self.prior.contains(&theta) {
                continue;
            }
            let likelihood = self.log_likelihood(&theta);
            let old = &mut self.members[index];
            let gain = beta * (likelihood - old.likelihood) + log_jacobian(&theta) - log_jacobian(&old.theta);
            if threshold < gain {
                *old = PopulationMember { theta, likelihood };
            }
        }
    }

    /// Back from the coordinates of the walk. Parameters that are held stay.
    fn leave_walk_coordinates(&self, walked: &Theta) -> Theta {
        let [K, C, D, E, S_h, S_v] = *walked;
        let theta = [K.exp() / (C * D.exp()), C, D.exp(), E, S_h, S_v];
        std::array::from_fn(|i| if self.prior.free[i] { theta[i] } else { self.prior.centre[i] })
    }
}

/// Coordinates in which the posterior is closest to a normal distribution: ln K, C, ln D, E.
fn to_walk_coordinates(theta: &Theta) -> Theta {
    let [B, C, D, E, S_h, S_v] = *theta;
    [(B * C * D).ln(), C, D.ln(), E, S_h, S_v]
}

/// Logarithm of the volume dB dD per d(ln K) d(ln D).
fn log_jacobian(theta: &Theta) -> f64 {
    (theta[0] * theta[2]).ln()
}

#[cfg(test)]
mod tests {
    use numerics::statistics::{mean, std};

    use super::*;
    use crate::bounds::Bounds;
    use crate::quantity::Quantity;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    /// Means and standard deviations of B, C, D, E on a grid in the whole box, by brute force.
    fn brute_force(data: &CompressedSamples, prior: &Prior) -> [[f64; 2]; 4] {
        let nodes = [200, 32, 300, 32];
        let Bounds { lower, upper } = prior.bounds;
        let at = |axis: usize, k: usize| {
            lower[axis] + (upper[axis] - lower[axis]) * (k as f64 + 0.5) / nodes[axis] as f64
        };
        let mut moments = [[0.0; 2]; 4];
        let mut whole = 0.0;
        let best = data.residual_squares(&[15.0, 2.0, 1.5, 0.8, 0.0, 0.0]);
        for place in 0..nodes[0] * nodes[1] * nodes[3] {
            let (B, C, E) = (
                at(0, place / nodes[1] / nodes[3]),
                at(1, place / nodes[3] % nodes[1]),
                at(3, place % nodes[3]),
            );
            // The sum of squares is a parabola in D.
            let [zero, one, two] = [0.0, 1.0, 2.0].map(|D| data.residual_squares(&[B, C, D, E, 0.0, 0.0]));
            let bend = (two - 2.0 * one + zero) / 2.0;
            let slope = one - zero - bend;
            if data.effective_count() as f64 * (zero - 0.25 * slope * slope / bend).max(best).ln()
                > data.effective_count() as f64 * best.ln() + 50.0
            {
                continue;
            }
            for D in (0..nodes[2]).map(|l| at(2, l)) {
                let squares = zero + D * (slope + D * bend);
                let weight = (-0.5 * (data.effective_count() as f64 - 1.0) * (squares / best).ln()).exp();
                for (moment, value) in moments.iter_mut().zip([B, C, D, E]) {
                    moment[0] += weight * value;
                    moment[1] += weight * value * value;
                }
                whole += weight;
            }
        }
        moments.map(|[first, second]| {
            let mean = first / whole;
            [mean, (second / whole - mean * mean).sqrt()]
        })
    }

    #[test]
    fn the_draws_have_the_moments_of_a_dense_grid() {
        let prior = Prior::lateral().with_bounds(Bounds::GOBLIRSCH);
        for level in [0.03, 0.08] {
            let excitation =
                SyntheticExcitation { samples: 300, slip_std: 0.0, ..SyntheticExcitation::default() };
            let data = CompressedSamples::new(&synthetic_samples(&excitation, level));
            let posterior = draw_tempered(&data, &prior, &TemperingOptions::default());
            for (parameter, [expected, spread]) in prior.free_parameters().zip(brute_force(&data, &prior)) {
                let values = posterior.quantity_values(Quantity::Parameter(parameter));
                let (error, ratio) = ((mean(&values) - expected) / spread, std(&values) / spread);
                assert!(
                    error.abs() < 0.15,
                    "{parameter:?} at {level}: mean off by {error} standard deviations"
                );
                assert!(
                    (ratio - 1.0).abs() < 0.1,
                    "{parameter:?} at {level}: {ratio} times the standard deviation"
                );
            }
        }
    }

    #[test]
    fn a_seed_gives_the_same_draws() {
        let data = CompressedSamples::new(&synthetic_samples(
            &SyntheticExcitation { samples: 200, ..SyntheticExcitation::default() },
            0.2,
        ));
        let options = TemperingOptions { members: 64, ..TemperingOptions::default() };
        let first = draw_tempered(&data, &Prior::lateral(), &options);
        assert_eq!(first.samples.len(), 256);
        assert_eq!(first, draw_tempered(&data, &Prior::lateral(), &options));
        assert!(first.samples.iter().all(|theta| Prior::lateral().contains(theta)));
    }
}
