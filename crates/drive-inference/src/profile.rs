//! Follows the likelihood away from its maximum, with all other parameters adapting: how far it is before the data object.

use nalgebra::{Cholesky, DMatrix, DVector};
use numerics::convergence::Status;
use numerics::sqp::{self, Limits, Model, Objective};
use rayon::prelude::*;

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
    /// Whether both ends were found and the minimisations over all other parameters converged; if not, the interval may be too
    /// narrow.
    pub found: bool,
    /// By how much the cost fell below the maximum's on the way [nat]: above 0 there is a better optimum.
    pub improvement: f64,
}

/// The best point with one quantity held.
struct Neighbour {
    x: DVector<f64>,
    cost: f64,
    found: bool,
}

/// One end of an interval.
struct End {
    value: f64,
    closed: bool,
    found: bool,
    lowest: f64,
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
        let J = by_stiffness(&theta, self.axle);
        model.gradient = J.tr_mul(&model.gradient);
        model.hessian = J.tr_mul(&model.hessian) * &J;
        model
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.objective.cost(&self.original(x))
    }
}

fn std(covariance: &DMatrix<f64>, i: usize) -> f64 {
    covariance[(i, i)].max(0.0).sqrt()
}

/// A maximum whose surroundings are explored.
pub struct Explored<'a> {
    /// The cost.
    pub objective: &'a dyn Objective,
    /// Where it is least.
    pub x: DVector<f64>,
    /// The least cost.
    pub cost: f64,
    /// Second derivatives there.
    pub information: DMatrix<f64>,
    /// The box.
    pub corners: [DVector<f64>; 2],
}

/// Inverse of second derivatives, scaled so that parameters that the data hardly move keep their digits; where there is no
/// inverse, nothing is known and the entries are infinite.
pub fn inverse(H: &DMatrix<f64>) -> DMatrix<f64> {
    let n = H.nrows();
    let width = H.diagonal().map(|h| if h > 0.0 { h.sqrt() } else { 1.0 });
    let scaled = DMatrix::from_fn(n, n, |i, j| H[(i, j)] / (width[i] * width[j]));
    match Cholesky::new(scaled) {
        Some(factor) => {
            let inverse = factor.inverse();
            DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (width[i] * width[j]))
        }
        None => DMatrix::from_element(n, n, f64::INFINITY),
    }
}

/// Derivatives of the parameters with respect to those with K in place of B, at parameters with B.
fn by_stiffness(theta: &DVector<f64>, o: usize) -> DMatrix<f64> {
    let mut J = DMatrix::identity(theta.len(), theta.len());
    J[(o, o)] = 1.0 / (theta[o + 1] * theta[o + 2]);
    J[(o, o + 1)] = -theta[o] / theta[o + 1];
    J[(o, o + 2)] = -theta[o] / theta[o + 2];
    J
}

impl Explored<'_> {
    /// Profiles quantities, several at once.
    pub fn profiles(&self, quantities: &[Quantity]) -> Vec<Profile> {
        quantities.par_iter().map(|quantity| self.profile(*quantity)).collect()
    }

    fn profile(&self, quantity: Quantity) -> Profile {
        match quantity {
            Quantity::Parameter(place) => self.profile_of(place),
            Quantity::Stiffness(o) => {
                let objective = WithStiffness { objective: self.objective, axle: o };
                self.with_stiffness(&objective, o).profile_of(o)
            }
        }
    }

    /// Standard deviation of a quantity, all others being somewhere in the box.
    pub fn std(&self, quantity: Quantity) -> f64 {
        let (explored, place) = match quantity {
            Quantity::Parameter(place) => return std(&self.in_box(), place),
            // Its digits would drown in the variance of B and C, which has no limit.
            Quantity::Stiffness(o) => (self.with_stiffness(self.objective, o), o),
        };
        std(&explored.in_box(), place)
    }

    /// The same maximum with K in place of B.
    fn with_stiffness<'b>(&self, objective: &'b dyn Objective, o: usize) -> Explored<'b> {
        let with = |x: &DVector<f64>| {
            let mut x = x.clone();
            x[o] *= x[o + 1] * x[o + 2];
            x
        };
        let J = by_stiffness(&self.x, o);
        Explored {
            objective,
            x: with(&self.x),
            cost: self.cost,
            information: J.tr_mul(&self.information) * &J,
            corners: [with(&self.corners[0]), with(&self.corners[1])],
        }
    }

    /// Covariance with the variance of a uniform distribution over the box as prior: finite where the data tell nothing.
    pub fn in_box(&self) -> DMatrix<f64> {
        let mut information = self.information.clone();
        for i in 0..information.nrows() {
            information[(i, i)] += 12.0 / (self.corners[1][i] - self.corners[0][i]).powi(2);
        }
        inverse(&information)
    }

    fn profile_of(&self, place: usize) -> Profile {
        let covariance = self.in_box();
        let ends = [0, 1].map(|side| self.end(place, side, &covariance));
        let lowest = ends[0].lowest.min(ends[1].lowest);
        Profile {
            ends: [ends[0].value, ends[1].value],
            closed: [ends[0].closed, ends[1].closed],
            found: ends[0].found && ends[1].found,
            improvement: self.cost - lowest,
        }
    }

    /// Where the cost has risen enough on one side.
    fn end(&self, place: usize, side: usize, covariance: &DMatrix<f64>) -> End {
        let (best, border) = (self.x[place], self.corners[side][place]);
        let reach = (border - best).abs();
        let sign = if side == 0 { -1.0 } else { 1.0 };
        let std = std(covariance, place);
        let along = covariance.column(place) / covariance[(place, place)].max(1e-300);
        let mut off = if std.is_finite() { (1.96 * std).min(reach) } else { reach };
        let mut from = self.x.clone();
        let mut at = best;
        let mut end = End { value: border, closed: false, found: true, lowest: self.cost };
        for _ in 0..POINTS {
            let value = if off >= reach { border } else { best + sign * off };
            let neighbour = self.best_with(place, value, &from, &along * (value - at));
            end.lowest = end.lowest.min(neighbour.cost);
            end.found &= neighbour.found;
            let rise = (neighbour.cost - end.lowest).max(1e-6);
            if rise < RISE - ENOUGH && off >= reach {
                return End { value: border, closed: false, ..end };
            }
            let next = (off * (RISE / rise).sqrt()).clamp(0.2 * off, 5.0 * off).min(reach);
            end = End { value: best + sign * next, closed: true, ..end };
            if (rise - RISE).abs() <= ENOUGH {
                return end;
            }
            (from, at, off) = (neighbour.x, value, next);
        }
        End { found: false, ..end }
    }

    /// The best point with one variable held, from a neighbour moved along the valley.
    fn best_with(
        &self,
        place: usize,
        value: f64,
        from: &DVector<f64>,
        ahead: DVector<f64>,
    ) -> Neighbour {
        let [mut lower, mut upper] = self.corners.clone();
        (lower[place], upper[place]) = (value, value);
        let within = |mut x: DVector<f64>| {
            for i in 0..x.len() {
                x[i] = x[i].clamp(lower[i], upper[i]);
            }
            x
        };
        // In a flat valley the straight way along it may lead out of it, and staying is the better start.
        let (moved, stayed) = (within(from + ahead), within(from.clone()));
        let better = self.objective.cost(&moved) <= self.objective.cost(&stayed);
        let start = if better { moved } else { stayed };
        let limits = Limits { iterations: 20, target: 1e-4, tolerance: 1e-3, damping: 1e-5 };
        let minimum = sqp::minimise(self.objective, &lower, &upper, &start, limits);
        Neighbour {
            cost: minimum.model.cost,
            found: minimum.status == Status::Converged,
            x: minimum.x,
        }
    }
}
