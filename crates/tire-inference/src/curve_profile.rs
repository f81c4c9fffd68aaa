//! Profiles the likelihood of one curve.

use numerics::statistics::std;

use crate::compressed::CompressedSamples;
use crate::minimise::{QuantityTarget, minimise_squares};
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::prior::Prior;
use crate::profile::{LikelihoodProfile, ProfileLikelihood, ProfilePoint, RULED_OUT, profile_likelihood};
use crate::quantity::Quantity;

/// Points of the box from which optima are looked for.
const STARTS: usize = 16;

/// What the profiles of all quantities share.
pub struct CurveProfiler<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
    posterior: &'a PosteriorSamples,
    /// Sum of squares of each draw.
    squares: Vec<f64>,
    best: Theta,
    least: f64,
    rivals: Vec<Theta>,
}

impl<'a> CurveProfiler<'a> {
    /// Looks for optima from a given one, from the most likely draw, and from `STARTS` points that fill the box.
    pub fn new(
        data: &'a CompressedSamples,
        prior: &'a Prior,
        posterior: &'a PosteriorSamples,
        optimum: &Theta,
    ) -> Self {
        let squares: Vec<f64> = posterior.samples.iter().map(|theta| data.residual_squares(theta)).collect();
        let draw =
            posterior.samples.iter().zip(&squares).min_by(|a, b| a.1.total_cmp(b.1)).map(|pair| *pair.0);
        let likely = prior.restricted_to_literature();
        let starts = std::iter::once(*optimum).chain(draw).chain(likely.space_filling_points(STARTS));
        let mut found: Vec<(Theta, f64)> =
            starts.map(|start| minimise_squares(data, prior, &start, None)).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, least) = found.first().copied().unwrap_or((*optimum, f64::NAN));
        let mut this = Self { data, prior, posterior, squares, best, least, rivals: Vec::new() };
        for (theta, squares) in found.into_iter().skip(1) {
            let apart = |other: &Theta| {
                prior
                    .free_parameters()
                    .any(|p| (theta[p as usize] - other[p as usize]).abs() > 0.02 * prior.difference_unit(p))
            };
            if this.likelihood_ratio_statistic(squares, least) < RULED_OUT
                && apart(&best)
                && this.rivals.iter().all(apart)
            {
                this.rivals.push(theta);
            }
        }
        this
    }

    /// Other optima that the data do not rule out.
    pub fn rival_optima(&self) -> &[Theta] {
        &self.rivals
    }

    /// The likeliest tire in the box.
    pub fn likeliest_tire(&self) -> &Theta {
        &self.best
    }

    /// The profile of a quantity that has these values in the draws.
    pub fn profile_quantity(&self, quantity: Quantity, values: &[f64]) -> LikelihoodProfile {
        profile_likelihood(&QuantityLikelihood { profiler: self, values }, quantity)
    }

    /// −2 ln of the likelihood over the highest one, the noise being what fits best at each.
    fn likelihood_ratio_statistic(&self, squares: f64, least: f64) -> f64 {
        self.data.effective_count() as f64 * (squares / least).ln()
    }
}

/// The likelihood along one quantity.
struct QuantityLikelihood<'a> {
    profiler: &'a CurveProfiler<'a>,
    /// The quantity in each draw: of peaks it takes a search.
    values: &'a [f64],
}

impl ProfileLikelihood for QuantityLikelihood<'_> {
    type ProfileParameters = Theta;
    type Quantity = Quantity;

    fn optimum(&self, quantity: Quantity) -> ProfilePoint<Theta> {
        let value = quantity.value(&self.profiler.best);
        ProfilePoint { value, x: self.profiler.best, cost: self.profiler.least, converged: true }
    }

    fn rival_values(&self, quantity: Quantity) -> Vec<f64> {
        self.profiler.rivals.iter().map(|rival| quantity.value(rival)).collect()
    }

    fn quantity_range(&self, quantity: Quantity) -> [f64; 2] {
        quantity.range_in_prior(self.profiler.prior)
    }

    fn approximate_std(&self, _: Quantity) -> f64 {
        std(self.values)
    }

    fn likelihood_ratio_statistic(&self, squares: f64, least: f64) -> f64 {
        self.profiler.likelihood_ratio_statistic(squares, least)
    }

    /// Fifty times what the likelihood could set against a move by a stride.
    fn target_weight(&self, stride: f64) -> f64 {
        let CurveProfiler { data, least, .. } = self.profiler;
        50.0 * RULED_OUT * least / data.effective_count().max(1) as f64 / (stride * stride)
    }

    fn maximise_at(&self, quantity: Quantity, target: f64, weight: f64, from: &Theta) -> ProfilePoint<Theta> {
        let CurveProfiler { data, prior, .. } = *self.profiler;
        let (theta, squares) = match quantity {
            Quantity::Parameter(parameter) => {
                let mut prior = *prior;
                prior.free[parameter as usize] = false;
                let mut start = *from;
                start[parameter as usize] = target;
                minimise_squares(data, &prior, &start, None)
            }
            _ => {
                let drawn = QuantityTarget { quantity, value: target, weight };
                minimise_squares(data, prior, from, Some(&drawn))
            }
        };
        ProfilePoint { value: quantity.value(&theta), x: theta, cost: squares, converged: true }
    }

    /// The optimum, and the most likely draw, those far from the target counting less.
    fn extra_starts(&self, _: Quantity, target: f64, weight: f64) -> Vec<Theta> {
        let CurveProfiler { posterior, squares, best, .. } = self.profiler;
        let cost = |(value, squares): (&f64, &f64)| squares + weight * (value - target).powi(2);
        let draws = posterior.samples.iter().zip(self.values.iter().zip(squares));
        let draw = draws.min_by(|a, b| cost(a.1).total_cmp(&cost(b.1))).map(|pair| *pair.0);
        std::iter::once(*best).chain(draw).collect()
    }

    fn has_backward_pass(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::Bounds;
    use crate::parameters::Parameter;
    use crate::posterior::{SamplingOptions, draw_posterior};
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];

    fn profiles(level: f64) -> Vec<LikelihoodProfile> {
        let excitation =
            SyntheticExcitation { samples: 1000, slip_std: 0.0, ..SyntheticExcitation::default() };
        let data = CompressedSamples::new(&synthetic_samples(&excitation, level));
        let prior = Prior::lateral().with_bounds(Bounds::GOBLIRSCH);
        let posterior =
            draw_posterior(&data, &prior, &[TRUTH], &SamplingOptions { draws: 1024, seed: 0 }).posterior;
        let profiler = CurveProfiler::new(&data, &prior, &posterior, &TRUTH);
        let quantities = prior.free_parameters().map(Quantity::Parameter).chain(Quantity::DERIVED);
        quantities
            .map(|quantity| profiler.profile_quantity(quantity, &posterior.quantity_values(quantity)))
            .collect()
    }

    #[test]
    fn enough_excitation_closes_all_profiles_about_the_truth() {
        for (index, profile) in profiles(0.75).into_iter().enumerate() {
            assert!(profile.lower.closed && profile.upper.closed, "{index}: {profile:?}");
            let truth = [15.0, 2.0, 1.5, 0.8, 45.0, 1.5, 0.087_733][index];
            // Wider than 95 %, so that no draw of the noise can fail it.
            let wide = [2.0 * profile.lower.at - profile.best, 2.0 * profile.upper.at - profile.best];
            assert!(wide[0] < truth && truth < wide[1], "{index}: {profile:?}");
        }
    }

    #[test]
    fn data_to_the_peak_leave_the_curvature_open_and_close_peak_and_stiffness() {
        let profiles = profiles(0.08);
        let closed: Vec<_> =
            profiles.iter().map(|profile| (profile.lower.closed, profile.upper.closed)).collect();
        let at = |parameter: Parameter| closed[parameter as usize];
        assert!(!(at(Parameter::E).0 && at(Parameter::E).1), "{profiles:#?}");
        assert_eq!([closed[2], closed[4], closed[5]], [(true, true); 3], "{profiles:#?}");
    }

    #[test]
    fn data_of_the_linear_range_tell_the_stiffness_alone() {
        let profiles = profiles(0.02);
        assert!(profiles[4].lower.closed && profiles[4].upper.closed, "{profiles:#?}");
        for index in [1, 2, 3] {
            assert!(!profiles[index].lower.closed || !profiles[index].upper.closed, "{index}: {profiles:#?}");
        }
    }

    #[test]
    fn the_profile_of_a_linear_parameter_is_that_of_its_parabola() {
        // With B, C and E held the curve is linear in D, and 3.84 is crossed at √3.84 standard deviations.
        let excitation =
            SyntheticExcitation { samples: 1000, slip_std: 0.0, ..SyntheticExcitation::default() };
        let samples = synthetic_samples(&excitation, 0.3);
        let data = CompressedSamples::new(&samples);
        let mut prior = Prior { centre: TRUTH, ..Prior::lateral() };
        prior.free = [false, false, true, false, false, false];
        let posterior =
            draw_posterior(&data, &prior, &[TRUTH], &SamplingOptions { draws: 1024, seed: 0 }).posterior;
        let quantity = Quantity::Parameter(Parameter::D);
        let profile = CurveProfiler::new(&data, &prior, &posterior, &TRUTH)
            .profile_quantity(quantity, &posterior.quantity_values(quantity));
        let shapes = samples
            .slip
            .iter()
            .map(|&x| crate::parameters::magic_formula_from_theta(&TRUTH).friction_coefficient(x) / 1.5);
        let [information, weighted] =
            shapes.zip(&samples.force).fold([0.0, 0.0], |[hh, hy], (h, y)| [hh + h * h, hy + h * y]);
        let best = weighted / information;
        let noise = data.residual_squares(&[15.0, 2.0, best, 0.8, 0.0, 0.0]) / 1000.0;
        let half = (RULED_OUT * noise / information).sqrt();
        approx::assert_relative_eq!(profile.best, best, max_relative = 1e-6);
        approx::assert_relative_eq!(profile.upper.at - best, half, max_relative = 0.02);
        approx::assert_relative_eq!(best - profile.lower.at, half, max_relative = 0.02);
    }
}
