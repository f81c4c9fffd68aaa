//! Moves those sides of a default box that samples push against.

use std::fmt;

use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::text::format_significant;
use preparation::samples::CurveSamples;
use serde::Serialize;

use crate::bounds::Bounds;
use crate::fit::{FitError, FitOptions, FitSolution};
use crate::parameters::{Parameter, Theta};
use crate::prior::Prior;
use crate::profile::RULED_OUT;
use crate::settings::{FitMethod, IdentificationSettings};

/// Parameters whose sides may move: those that scale a curve. What ends C and E is the shape of a tire, not its size.
const SCALES: [Parameter; 2] = [Parameter::B, Parameter::D];
/// By how much a side moves: B from karts to beyond model cars, D from slicks to beyond what any tire carries.
const FACTOR: f64 = 2.5;
/// A side this many standard deviations away cuts off what the data allow.
const CLOSE: f64 = 2.0;

/// A side of a box that was moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BoundExtension {
    /// Of which parameter.
    pub parameter: Parameter,
    /// Where it was.
    pub from: f64,
    /// Where it is.
    pub to: f64,
    /// −2 ln of the likelihood in the former box over that in the new one.
    pub gain: f64,
}

impl fmt::Display for BoundExtension {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = if self.to > self.from { "upper" } else { "lower" };
        let [before, after] = [self.from, self.to].map(|it| format_significant(it, 3));
        write!(to, "The {side} bound of {} was moved from {before} to {after}: ", self.parameter.symbol())?;
        if self.gain > RULED_OUT {
            let gain = format_significant(self.gain, 3);
            write!(to, "the data push against it (−2 ln L falls by {gain}).")
        } else {
            to.write_str("tires beyond it fit as well.")
        }
    }
}

impl IdentificationSettings {
    /// Moves the sides of the default box that the samples push against; ranges that were given stay.
    ///
    /// # Errors
    /// As for a fit.
    pub fn extend_bounds(mut self, samples: &CurveSamples) -> Result<(Self, Vec<BoundExtension>), FitError> {
        let movable = |p: &Parameter| {
            self.extensible
                && self.prior.free[*p as usize]
                && self.prior.bounds.range(*p) == Bounds::WIDE.range(*p)
        };
        let movable: Vec<Parameter> = SCALES.into_iter().filter(movable).collect();
        if movable.is_empty() {
            return Ok((self, Vec::new()));
        }
        self.check(samples)?;
        let mut bounds = self.prior.bounds;
        for &parameter in &movable {
            let [low, high] = bounds.range(parameter);
            bounds.set_range(parameter, [low / FACTOR, FACTOR * high]);
        }
        let inside = self.fit(samples, &self.prior, FitMethod::LeastSquares)?;
        let options =
            FitOptions { start: Some(inside.theta), starts: 2 * self.options.starts, ..self.options };
        let search = Self { options, ..self.clone() };
        let wider = Prior { bounds, ..self.prior };
        let outside = search.fit(samples, &wider, FitMethod::LeastSquares)?;
        let unit = match self.slip_noise {
            Some(_) => 1.0,
            None => self.loss.cost_divisor(outside.noise_std),
        };
        let gain = 2.0 * (inside.cost - outside.cost) / unit;
        let beyond = ExtendedBoundsFit { solution: outside, wider, gain, unit };
        let mut moved = Vec::new();
        for parameter in movable {
            let (old, new) = (self.prior.bounds.range(parameter), bounds.range(parameter));
            let mut range = old;
            for side in (0..2).filter(|&side| beyond.is_cut_off(&self.prior, parameter, side)) {
                range[side] = new[side];
                moved.push(BoundExtension { parameter, from: old[side], to: new[side], gain: gain.max(0.0) });
            }
            self.prior.bounds.set_range(parameter, range);
        }
        Ok((self, moved))
    }
}

/// The likeliest tire in a wider box.
struct ExtendedBoundsFit {
    solution: FitSolution,
    /// What is known before, with that box.
    wider: Prior,
    gain: f64,
    /// What costs are divided by to be −ln of a likelihood.
    unit: f64,
}

impl ExtendedBoundsFit {
    /// Whether a side of a box cuts off what the data allow: an optimum beyond it, or a parameter that is told so near to it.
    fn is_cut_off(&self, prior: &Prior, parameter: Parameter, side: usize) -> bool {
        let room = |theta: &Theta| {
            let (end, value) = (prior.bounds.range(parameter)[side], theta[parameter as usize]);
            if side == 0 { value - end } else { end - value }
        };
        let is_optimum = |theta: &Theta| self.gain > RULED_OUT || is_interior(&self.wider, theta, parameter);
        let std = self.solution.parameter_std(parameter).unwrap_or(f64::NAN);
        let is_told = std < MAX_WIDTH_IDENTIFIED * self.wider.parameter_std(parameter);
        self.allowed_optima().any(|theta| room(theta) < 0.0 && is_optimum(theta))
            || (room(&self.solution.theta) < CLOSE * std && is_told)
    }

    /// Those that the data do not rule out.
    fn allowed_optima(&self) -> impl Iterator<Item = &Theta> {
        let worst = self.solution.cost + 0.5 * RULED_OUT * self.unit;
        self.solution.optima.iter().filter(move |(_, cost)| *cost <= worst).map(|(theta, _)| theta)
    }
}

/// Whether an optimum is one in a parameter, not where the box ends.
fn is_interior(prior: &Prior, theta: &Theta, parameter: Parameter) -> bool {
    let ([low, high], value) = (prior.bounds.range(parameter), theta[parameter as usize]);
    low < value && value < high
}

#[cfg(test)]
mod tests {
    use preparation::direction::ForceDirection;

    use super::*;
    use crate::estimate::identify_tire;
    use crate::quantity::Quantity;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};
    use crate::verdict::Identifiability;

    fn samples(stiffness: f64) -> CurveSamples {
        let truth = [stiffness, 1.4, 1.3, -0.5, 0.0, 0.0];
        let force_std = 0.05;
        let excitation =
            SyntheticExcitation { truth, samples: 400, slip_std: 0.0, force_std, ..Default::default() };
        synthetic_samples(&excitation, 0.3)
    }

    #[test]
    fn a_default_side_moves_for_a_stiff_tire_and_a_given_one_leaves_nothing_identified_that_hangs_on_it() {
        let usual = IdentificationSettings::new(ForceDirection::Lateral);
        let (settings, moved) = usual.clone().extend_bounds(&samples(15.0)).expect("a fit");
        assert_eq!((settings.prior, moved), (usual.prior, Vec::new()));
        let stiff = samples(110.0);
        let (settings, moved) = usual.clone().extend_bounds(&stiff).expect("a fit");
        assert_eq!(settings.prior.bounds.range(Parameter::B), [1.0, 200.0]);
        assert!(moved[0].to_string().starts_with("The upper bound of B was moved from 80.0 to 200: "));
        let given = IdentificationSettings { extensible: false, ..usual };
        let (given, moved) = given.extend_bounds(&stiff).expect("a fit");
        assert!(moved.is_empty());
        let found = identify_tire(&stiff, &given, &[FitMethod::LeastSquares]).expect("a fit");
        let shape = found.judgements.iter().find(|it| it.quantity == Quantity::C).expect("judged");
        assert_ne!(shape.verdict, Identifiability::Identified, "{}", shape.reason);
    }
}
