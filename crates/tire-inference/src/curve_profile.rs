//! Profiles the likelihood of one curve.

use numerics::statistics::std;

use crate::compressed::CompressedSamples;
use crate::minimise::{Target, minimise};
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::prior::Prior;
use crate::profile::{Point, Profile, ProfileLikelihood, RULED_OUT, profile};
use crate::quantity::Quantity;

/// Points of the box from which optima are looked for.
const STARTS: usize = 16;

/// What the profiles of all quantities share.
pub struct Profiler<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
    posterior: &'a PosteriorSamples,
    /// Sum of squares of each draw.
    squares: Vec<f64>,
    best: Theta,
    least: f64,
    rivals: Vec<Theta>,
}

impl<'a> Profiler<'a> {
    /// Looks for optima from a given one, from the most likely draw, and from `STARTS` points that fill the box.
    pub fn new(
        data: &'a CompressedSamples,
        prior: &'a Prior,
        posterior: &'a PosteriorSamples,
        optimum: &Theta,
    ) -> Self {
        let squares: Vec<f64> = posterior.samples.iter().map(|theta| data.squares(theta)).collect();
        let draw = posterior
            .samples
            .iter()
            .zip(&squares)
            .min_by(|a, b| a.1.total_cmp(b.1))
            .map(|pair| *pair.0);
        let likely = prior.literature();
        let starts = std::iter::once(*optimum).chain(draw).chain(likely.fill(STARTS));
        let mut found: Vec<(Theta, f64)> =
            starts.map(|start| minimise(data, prior, &start, None)).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, least) = found.first().copied().unwrap_or((*optimum, f64::NAN));
        let mut this = Self { data, prior, posterior, squares, best, least, rivals: Vec::new() };
        for (theta, squares) in found.into_iter().skip(1) {
            let apart = |other: &Theta| {
                prior
                    .free()
                    .any(|p| (theta[p as usize] - other[p as usize]).abs() > 0.02 * prior.unit(p))
            };
            if this.rise(squares, least) < RULED_OUT
                && apart(&best)
                && this.rivals.iter().all(apart)
            {
                this.rivals.push(theta);
            }
        }
        this
    }

    /// Other optima that the data do not rule out.
    pub fn rivals(&self) -> &[Theta] {
        &self.rivals
    }

    /// The likeliest tire in the box.
    pub fn likeliest(&self) -> &Theta {
        &self.best
    }

    /// The profile of a quantity that has these values in the draws.
    pub fn profile(&self, quantity: Quantity, values: &[f64]) -> Profile {
        profile(&QuantityProfile { profiler: self, values }, quantity)
    }

    /// −2 ln of the likelihood over the highest one, the noise being what fits best at each.
    fn rise(&self, squares: f64, least: f64) -> f64 {
        self.data.count() as f64 * (squares / least).ln()
    }
}

/// The likelihood along one quantity.
struct QuantityProfile<'a> {
    profiler: &'a Profiler<'a>,
    /// The quantity in each draw: of peaks it takes a search.
    values: &'a [f64],
}

impl ProfileLikelihood for QuantityProfile<'_> {
    type X = Theta;
    type Quantity = Quantity;

    fn best(&self, quantity: Quantity) -> Point<Theta> {
        let value = quantity.value(&self.profiler.best);
        Point { value, x: self.profiler.best, cost: self.profiler.least, converged: true }
    }

    fn rivals(&self, quantity: Quantity) -> Vec<f64> {
        self.profiler.rivals.iter().map(|rival| quantity.value(rival)).collect()
    }

    fn range(&self, quantity: Quantity) -> [f64; 2] {
        quantity.range(self.profiler.prior)
    }

    fn spread(&self, _: Quantity) -> f64 {
        std(self.values)
    }

    fn rise(&self, squares: f64, least: f64) -> f64 {
        self.profiler.rise(squares, least)
    }

    /// Fifty times what the likelihood could set against a move by a stride.
    fn weight(&self, stride: f64) -> f64 {
        let Profiler { data, least, .. } = self.profiler;
        50.0 * RULED_OUT * least / data.count().max(1) as f64 / (stride * stride)
    }

    fn hold(&self, quantity: Quantity, target: f64, weight: f64, from: &Theta) -> Point<Theta> {
        let Profiler { data, prior, .. } = *self.profiler;
        let (theta, squares) = match quantity {
            Quantity::Parameter(parameter) => {
                let mut prior = *prior;
                prior.free[parameter as usize] = false;
                let mut start = *from;
                start[parameter as usize] = target;
                minimise(data, &prior, &start, None)
            }
            _ => {
                let drawn = Target { quantity, value: target, weight };
                minimise(data, prior, from, Some(&drawn))
            }
        };
        Point { value: quantity.value(&theta), x: theta, cost: squares, converged: true }
    }

    /// The optimum, and the most likely draw, those far from the target counting less.
    fn starts(&self, _: Quantity, target: f64, weight: f64) -> Vec<Theta> {
        let Profiler { posterior, squares, best, .. } = self.profiler;
        let cost = |(value, squares): (&f64, &f64)| squares + weight * (value - target).powi(2);
        let draws = posterior.samples.iter().zip(self.values.iter().zip(squares));
        let draw = draws.min_by(|a, b| cost(a.1).total_cmp(&cost(b.1))).map(|pair| *pair.0);
        std::iter::once(*best).chain(draw).collect()
    }

    fn looks_back(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::Bounds;
    use crate::parameters::Parameter;
    use crate::posterior::{SamplingOptions, draw};
    use crate::synthetic::{Excitation, samples};

    const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];

    fn profiles(level: f64) -> Vec<Profile> {
        let excitation = Excitation { samples: 1000, slip_std: 0.0, ..Excitation::default() };
        let data = CompressedSamples::new(&samples(&excitation, level));
        let prior = Prior::lateral().within(Bounds::GOBLIRSCH);
        let posterior =
            draw(&data, &prior, &[TRUTH], &SamplingOptions { draws: 1024, seed: 0 }).posterior;
        let profiler = Profiler::new(&data, &prior, &posterior, &TRUTH);
        let quantities = prior.free().map(Quantity::Parameter).chain(Quantity::DERIVED);
        quantities.map(|quantity| profiler.profile(quantity, &posterior.values(quantity))).collect()
    }

    #[test]
    fn enough_excitation_closes_all_profiles_about_the_truth() {
        for (index, profile) in profiles(0.75).into_iter().enumerate() {
            assert!(profile.lower.closed && profile.upper.closed, "{index}: {profile:?}");
            let truth = [15.0, 2.0, 1.5, 0.8, 45.0, 1.5, 0.087_733][index];
            // Wider than 95 %, so that no draw of the noise can fail it.
            let wide =
                [2.0 * profile.lower.at - profile.best, 2.0 * profile.upper.at - profile.best];
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
            assert!(
                !profiles[index].lower.closed || !profiles[index].upper.closed,
                "{index}: {profiles:#?}"
            );
        }
    }

    #[test]
    fn the_profile_of_a_linear_parameter_is_that_of_its_parabola() {
        // With B, C and E held the curve is linear in D, and 3.84 is crossed at √3.84 standard deviations.
        let excitation = Excitation { samples: 1000, slip_std: 0.0, ..Excitation::default() };
        let samples = samples(&excitation, 0.3);
        let data = CompressedSamples::new(&samples);
        let mut prior = Prior { centre: TRUTH, ..Prior::lateral() };
        prior.free = [false, false, true, false, false, false];
        let posterior =
            draw(&data, &prior, &[TRUTH], &SamplingOptions { draws: 1024, seed: 0 }).posterior;
        let quantity = Quantity::Parameter(Parameter::D);
        let profile = Profiler::new(&data, &prior, &posterior, &TRUTH)
            .profile(quantity, &posterior.values(quantity));
        let shapes =
            samples.slip.iter().map(|&x| crate::parameters::curve(&TRUTH).coefficient(x) / 1.5);
        let [information, weighted] = shapes
            .zip(&samples.force)
            .fold([0.0, 0.0], |[hh, hy], (h, y)| [hh + h * h, hy + h * y]);
        let best = weighted / information;
        let noise = data.squares(&[15.0, 2.0, best, 0.8, 0.0, 0.0]) / 1000.0;
        let half = (RULED_OUT * noise / information).sqrt();
        approx::assert_relative_eq!(profile.best, best, max_relative = 1e-6);
        approx::assert_relative_eq!(profile.upper.at - best, half, max_relative = 0.02);
        approx::assert_relative_eq!(best - profile.lower.at, half, max_relative = 0.02);
    }
}
