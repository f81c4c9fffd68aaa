//! Follows the profile of the likelihood of a quantity to both sides, up to where the data rule it out or the box ends.

use numerics::statistics::std;
use serde::Serialize;

use crate::compressed::Compressed;
use crate::parameters::Theta;
use crate::posterior::Posterior;
use crate::prior::Prior;
use crate::quantity::Quantity;
use crate::verdict::minimise::{Pull, minimise};

/// Twice the fall of the log-likelihood that a value must cause to be ruled out: 95 % of χ² with one degree of freedom.
pub const RULED_OUT: f64 = 3.84;
/// Points on one side at most.
const POINTS: usize = 24;
/// Points of the box from which optima are looked for.
const STARTS: usize = 16;

/// One side of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Side {
    /// Whether the profile rises above [`RULED_OUT`] inside the box.
    pub closed: bool,
    /// Where it does; the end of the box, or the last value that any tire in the box has, if it does not.
    pub at: f64,
    /// Largest rise of −2 ln(likelihood) on this side.
    pub rise: f64,
}

/// The profile of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Profile {
    /// The value of highest likelihood.
    pub best: f64,
    /// Towards lower values.
    pub lower: Side,
    /// Towards higher values.
    pub upper: Side,
}

/// What the profiles of all quantities share.
pub struct Profiler<'a> {
    data: &'a Compressed,
    prior: &'a Prior,
    posterior: &'a Posterior,
    /// Sum of squares of each draw.
    squares: Vec<f64>,
    best: Theta,
    least: f64,
    rivals: Vec<Theta>,
}

/// A point of a profile: value, the tire that has it with the least squares, and these.
#[derive(Clone, Copy)]
struct Point {
    value: f64,
    theta: Theta,
    squares: f64,
}

impl<'a> Profiler<'a> {
    /// Looks for optima from a given one, from the most likely draw, and from `STARTS` points that fill the box.
    pub fn new(
        data: &'a Compressed,
        prior: &'a Prior,
        posterior: &'a Posterior,
        optimum: &Theta,
    ) -> Self {
        let squares: Vec<f64> = posterior.draws.iter().map(|theta| data.squares(theta)).collect();
        let draw = posterior
            .draws
            .iter()
            .zip(&squares)
            .min_by(|a, b| a.1.total_cmp(b.1))
            .map(|pair| *pair.0);
        let starts = std::iter::once(*optimum).chain(draw).chain(prior.fill(STARTS));
        let mut found: Vec<(Theta, f64)> =
            starts.map(|start| minimise(data, prior, &start, None)).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, least) = found.first().copied().unwrap_or((*optimum, f64::NAN));
        let mut this = Self { data, prior, posterior, squares, best, least, rivals: Vec::new() };
        for (theta, squares) in found.into_iter().skip(1) {
            let apart = |other: &Theta| {
                prior
                    .free()
                    .any(|p| (theta[p as usize] - other[p as usize]).abs() > 0.02 * prior.std(p))
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

    /// The profile of a quantity.
    pub fn profile(&self, quantity: Quantity) -> Profile {
        let [low, high] = quantity.range(self.prior);
        let best = quantity.value(&self.best);
        let spread = std(&self.posterior.values(quantity)).clamp(1e-6 * (high - low), high - low);
        let mut below = self.walk(quantity, low, spread);
        let mut above = self.walk(quantity, high, spread);
        // Neighbours may lead to a better optimum than the one that all started from.
        let least =
            below.iter().chain(&above).map(|point| point.squares).fold(self.least, f64::min);
        let side = |points: &mut Vec<Point>, end: f64| self.side(points, least, best, end);
        Profile { best, lower: side(&mut below, low), upper: side(&mut above, high) }
    }

    /// Points from the optimum towards an end, and back again: each is the best of what its two neighbours, the optima
    /// and the most likely draw near it lead to.
    fn walk(&self, quantity: Quantity, end: f64, spread: f64) -> Vec<Point> {
        let origin =
            Point { value: quantity.value(&self.best), theta: self.best, squares: self.least };
        let mut points = vec![origin];
        let mut stride = 0.7 * spread;
        let mut target = origin.value;
        while points.len() <= POINTS && target != end {
            let last = points[points.len() - 1];
            let reach = if points.len() == POINTS { f64::INFINITY } else { stride };
            target =
                if end > target { (target + reach).min(end) } else { (target - reach).max(end) };
            let weight = self.pull_weight(stride);
            let draw = self.draw_near(quantity, target, weight);
            let starts = [Some(&last.theta), Some(&self.best), draw];
            let found = starts
                .into_iter()
                .flatten()
                .map(|start| self.reach(quantity, target, weight, start));
            let Some(point) = found.min_by(|a, b| self.order(a, b, target, weight)) else { break };
            points.push(point);
            let rival_ahead = |rival| (quantity.value(rival) - target) * (end - target) > 0.0;
            if self.rise(point.squares, self.least) > 1.5 * RULED_OUT
                && !self.rivals.iter().any(rival_ahead)
            {
                break;
            }
            stride *= 1.4;
        }
        for index in (1..points.len().saturating_sub(1)).rev() {
            let target = points[index].value;
            let weight = self.pull_weight(0.7 * spread);
            let back = self.reach(quantity, target, weight, &points[index + 1].theta);
            if self.order(&back, &points[index], target, weight).is_lt() {
                points[index] = back;
            }
        }
        points
    }

    /// Fifty times what the likelihood could set against a move by a stride.
    fn pull_weight(&self, stride: f64) -> f64 {
        50.0 * RULED_OUT * self.least / self.data.count().max(1) as f64 / (stride * stride)
    }

    fn order(&self, a: &Point, b: &Point, target: f64, weight: f64) -> std::cmp::Ordering {
        let cost = |point: &Point| point.squares + weight * (point.value - target).powi(2);
        cost(a).total_cmp(&cost(b))
    }

    /// The most likely draw, those far from the target counting less.
    fn draw_near(&self, quantity: Quantity, target: f64, weight: f64) -> Option<&Theta> {
        let cost = |(theta, squares): (&Theta, &f64)| {
            squares + weight * (quantity.value(theta) - target).powi(2)
        };
        let draws = self.posterior.draws.iter().zip(&self.squares);
        draws.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).map(|pair| pair.0)
    }

    fn reach(&self, quantity: Quantity, target: f64, weight: f64, start: &Theta) -> Point {
        let (theta, squares) = match quantity {
            Quantity::Parameter(parameter) => {
                let mut prior = *self.prior;
                prior.free[parameter as usize] = false;
                let mut start = *start;
                start[parameter as usize] = target;
                minimise(self.data, &prior, &start, None)
            }
            _ => minimise(self.data, self.prior, start, Some(&Pull { quantity, target, weight })),
        };
        Point { value: quantity.value(&theta), theta, squares }
    }

    /// −2 ln of the likelihood over the highest one, the noise being what fits best at each.
    fn rise(&self, squares: f64, least: f64) -> f64 {
        self.data.count() as f64 * (squares / least).ln()
    }

    fn side(&self, points: &mut [Point], least: f64, best: f64, end: f64) -> Side {
        let ascending = end >= best;
        points.sort_by(|a, b| {
            if ascending { a.value.total_cmp(&b.value) } else { b.value.total_cmp(&a.value) }
        });
        let rises: Vec<f64> = points.iter().map(|point| self.rise(point.squares, least)).collect();
        let rise = rises.iter().copied().fold(0.0, f64::max);
        // The last point below the threshold decides: beyond it everything is ruled out.
        let inside = rises.iter().rposition(|&rise| rise <= RULED_OUT).unwrap_or(0);
        match points.get(inside + 1) {
            Some(outside) => {
                // The profile is close to a parabola: its root is close to a line.
                let (low, high) = (rises[inside].max(0.0).sqrt(), rises[inside + 1].sqrt());
                let share = if high > low { (RULED_OUT.sqrt() - low) / (high - low) } else { 1.0 };
                let at = points[inside].value
                    + share.clamp(0.0, 1.0) * (outside.value - points[inside].value);
                Side { closed: true, at, rise }
            }
            None => {
                Side { closed: false, at: points.last().map_or(end, |point| point.value), rise }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Parameter;
    use crate::posterior::{Options, draw};
    use crate::synthetic::{Excitation, samples};

    const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];

    fn profiles(level: f64) -> Vec<Profile> {
        let excitation = Excitation { samples: 1000, slip_std: 0.0, ..Excitation::default() };
        let data = Compressed::new(&samples(&excitation, level));
        let prior = Prior::lateral();
        let posterior = draw(&data, &prior, &[TRUTH], &Options { draws: 1024, seed: 0 }).posterior;
        let profiler = Profiler::new(&data, &prior, &posterior, &TRUTH);
        let quantities = prior.free().map(Quantity::Parameter).chain(Quantity::DERIVED);
        quantities.map(|quantity| profiler.profile(quantity)).collect()
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
        let data = Compressed::new(&samples);
        let mut prior = Prior { centre: TRUTH, ..Prior::lateral() };
        prior.free = [false, false, true, false, false, false];
        let posterior = draw(&data, &prior, &[TRUTH], &Options { draws: 1024, seed: 0 }).posterior;
        let profile = Profiler::new(&data, &prior, &posterior, &TRUTH)
            .profile(Quantity::Parameter(Parameter::D));
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
