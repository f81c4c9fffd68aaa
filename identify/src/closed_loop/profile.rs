//! Follows the likelihood away from its maximum, with all other parameters adapting: how far it is before the data object.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::sqp::{self, Limits, Model, Objective};

/// Rise of the negative log-likelihood at the ends of a 95 % interval: half of χ²(0.95, 1).
const RISE: f64 = 1.920_729;
/// How close to it an end is found [nat].
const ENOUGH: f64 = 0.1;
/// Most points on the way to an end.
const POINTS: usize = 5;

/// What is profiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A parameter, by its place.
    Parameter(usize),
    /// Stiffness per load B C D of the axle whose parameters begin at this place.
    Stiffness(usize),
}

/// An interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Lower and upper end, the border of the box where it is open.
    pub ends: [f64; 2],
    /// Whether the data object before the border of the box.
    pub closed: [bool; 2],
    /// By how much the cost fell below the maximum's on the way [nat]: above 0 there is a better optimum.
    pub improvement: f64,
}

/// A cost with B of one axle replaced by K = B C D.
struct WithStiffness<'a> {
    objective: &'a dyn Objective,
    axle: usize,
}

impl WithStiffness<'_> {
    fn original(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut theta = x.clone();
        theta[self.axle] = x[self.axle] / (x[self.axle + 1] * x[self.axle + 2]);
        theta
    }
}

impl Objective for WithStiffness<'_> {
    fn model(&self, x: &DVector<f64>) -> Model {
        let theta = self.original(x);
        let mut model = self.objective.model(&theta);
        let (n, o, B) = (x.len(), self.axle, theta[self.axle]);
        let mut J = DMatrix::identity(n, n);
        J[(o, o)] = 1.0 / (x[o + 1] * x[o + 2]);
        J[(o, o + 1)] = -B / x[o + 1];
        J[(o, o + 2)] = -B / x[o + 2];
        model.gradient = J.tr_mul(&model.gradient);
        model.hessian = J.tr_mul(&model.hessian) * &J;
        model
    }
}

/// A maximum whose surroundings are explored.
pub struct Explored<'a> {
    /// The cost.
    pub objective: &'a dyn Objective,
    /// Where it is least.
    pub x: DVector<f64>,
    /// The least cost.
    pub cost: f64,
    /// Inverse second derivatives there.
    pub covariance: DMatrix<f64>,
    /// The box.
    pub corners: [DVector<f64>; 2],
}

impl Explored<'_> {
    /// Profiles quantities, several at once.
    pub fn profiles(&self, quantities: &[Quantity]) -> Vec<Profile> {
        quantities.par_iter().map(|quantity| self.profile(*quantity)).collect()
    }

    fn profile(&self, quantity: Quantity) -> Profile {
        let Quantity::Stiffness(o) = quantity else {
            let Quantity::Parameter(place) = quantity else { unreachable!("two kinds") };
            return self.profile_of(place);
        };
        let objective = WithStiffness { objective: self.objective, axle: o };
        let product = |x: &DVector<f64>| x[o] * x[o + 1] * x[o + 2];
        let with = |x: &DVector<f64>| {
            let mut x = x.clone();
            x[o] = product(&x);
            x
        };
        let n = self.x.len();
        let mut J = DMatrix::identity(n, n);
        J[(o, o)] = self.x[o + 1] * self.x[o + 2];
        J[(o, o + 1)] = self.x[o] * self.x[o + 2];
        J[(o, o + 2)] = self.x[o] * self.x[o + 1];
        let explored = Explored {
            objective: &objective,
            x: with(&self.x),
            cost: self.cost,
            covariance: &J * &self.covariance * J.transpose(),
            corners: [with(&self.corners[0]), with(&self.corners[1])],
        };
        explored.profile_of(o)
    }

    fn profile_of(&self, place: usize) -> Profile {
        let mut profile =
            Profile { ends: [self.x[place]; 2], closed: [false; 2], improvement: 0.0 };
        for side in 0..2 {
            let (end, closed, lowest) = self.end(place, side);
            profile.ends[side] = end;
            profile.closed[side] = closed;
            profile.improvement = profile.improvement.max(self.cost - lowest);
        }
        profile
    }

    /// Where the cost has risen enough on one side, whether it has, and the lowest cost on the way.
    fn end(&self, place: usize, side: usize) -> (f64, bool, f64) {
        let (best, border) = (self.x[place], self.corners[side][place]);
        let reach = (border - best).abs();
        let sign = (side as f64) * 2.0 - 1.0;
        let std = self.covariance[(place, place)].max(0.0).sqrt();
        let mut off = if std.is_finite() { (1.96 * std).min(reach) } else { reach };
        let mut lowest = self.cost;
        let mut from = self.x.clone();
        let mut at = best;
        for point in 1..=POINTS {
            let value = if off >= reach { border } else { best + sign * off };
            let (x, cost) = self.best_with(place, value, &from, at);
            lowest = lowest.min(cost);
            let rise = (cost - self.cost).max(1e-6);
            let short = rise < RISE - ENOUGH;
            if short && off >= reach {
                return (border, false, lowest);
            }
            let next = (off * (RISE / rise).sqrt()).clamp(0.2 * off, 5.0 * off).min(reach);
            if (rise - RISE).abs() <= ENOUGH || point == POINTS {
                return (
                    best + sign * next.min(reach),
                    rise >= RISE - ENOUGH || next < reach,
                    lowest,
                );
            }
            (from, at, off) = (x, value, next);
        }
        (border, false, lowest)
    }

    /// The best point with one variable held, from a neighbour moved along the valley.
    fn best_with(
        &self,
        place: usize,
        value: f64,
        from: &DVector<f64>,
        at: f64,
    ) -> (DVector<f64>, f64) {
        let [mut lower, mut upper] = self.corners.clone();
        (lower[place], upper[place]) = (value, value);
        let along = self.covariance.column(place) / self.covariance[(place, place)].max(1e-300);
        let mut start = from + along * (value - at);
        for i in 0..start.len() {
            if !start[i].is_finite() {
                start[i] = from[i];
            }
            start[i] = start[i].clamp(lower[i], upper[i]);
        }
        let limits = Limits { iterations: 12, target: 1e-4, tolerance: 1e-3 };
        let minimum = sqp::minimise(self.objective, &lower, &upper, &start, limits);
        (minimum.x, minimum.model.cost)
    }
}
