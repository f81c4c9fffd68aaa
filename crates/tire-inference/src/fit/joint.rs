//! Fits front and rear together: two curves whose parameters a ridge pulls to each other.

use nalgebra::DVector;
use numerics::sqp::{Inequality, Model, Objective};

use crate::fit::curve::CurveCost;
use crate::fit::solution::{Noise, Part};
use crate::fit::{FitError, Options, Problem, Solution, error, multistart};
use crate::parameters::Theta;

/// How strongly two axles should be alike: ½ weight Σ ((θ_front − θ_rear)/std)² is added to the cost, over the parameters that
/// are free on both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// λ_sim: 0 fits the axles apart.
    pub weight: f64,
    /// Unit of a difference, for each parameter; infinite where the axles may differ at will.
    pub std: Theta,
}

/// Fits two curves at once; the pull towards what is expected is that of each problem's prior. `cost` and `convergence` of both
/// solutions are those of the whole, and their covariances take the noise of their own axle.
///
/// # Errors
/// As for [`crate::fit::least_squares`], and if a problem has noise in the slip.
pub fn joint_least_squares(
    problems: [&Problem; 2],
    similarity: Similarity,
    options: &Options,
) -> Result<[Solution; 2], FitError> {
    for problem in problems {
        error::check(problem)?;
        if problem.slip_noise.is_some() {
            return Err(FitError::Setting {
                setting: "slip_noise",
                problem: "is not available in a joint fit; leave it out",
            });
        }
    }
    if !(similarity.weight >= 0.0 && similarity.weight.is_finite())
        || similarity.std.iter().any(|s| s.is_nan() || *s <= 0.0)
    {
        return Err(FitError::Setting {
            setting: "similarity",
            problem: "the weight must be 0 or above, every std above 0",
        });
    }
    let cost = JointCost { axles: problems.map(CurveCost::new), similarity };
    let [lower, upper] =
        [CurveCost::lower, CurveCost::upper].map(|side| join(cost.axles.each_ref().map(side)));
    let [front, rear] = problems.map(|p| multistart::starts(&p.bounds, &p.held, options));
    let start = |(f, r)| join([cost.axles[0].unknowns(f), cost.axles[1].unknowns(r)]);
    let starts: Vec<DVector<f64>> = front.iter().zip(&rear).map(start).collect();
    let search = multistart::search(&cost, None, &lower, &upper, &starts, options)?;
    let solution = |axle: usize| {
        let count = cost.axles[axle].unknowns.free.len();
        let from = if axle == 0 { 0 } else { lower.len() - count };
        let part = Part::of(&search.best, from, count);
        let theta = |x: &DVector<f64>| cost.axles[axle].theta(&x.rows(from, count).into_owned());
        let optima = search.optima.iter().map(|m| (theta(&m.x), m.model.cost)).collect();
        let noise = Noise::of(problems[axle], &theta(&search.best.x), part.fitted);
        part.solution(problems[axle], &noise, search.convergence(), optima)
    };
    Ok([solution(0), solution(1)])
}

struct JointCost<'a> {
    axles: [CurveCost<'a>; 2],
    similarity: Similarity,
}

/// One vector above the other.
fn join([front, rear]: [DVector<f64>; 2]) -> DVector<f64> {
    DVector::from_iterator(front.len() + rear.len(), front.iter().chain(rear.iter()).copied())
}

impl JointCost<'_> {
    fn split(&self, x: &DVector<f64>) -> [DVector<f64>; 2] {
        let front = self.axles[0].unknowns.free.len();
        [x.rows(0, front).into_owned(), x.rows(front, x.len() - front).into_owned()]
    }

    fn add_similarity(&self, model: &mut Model, parts: &[DVector<f64>; 2]) {
        let [front, rear] = &self.axles;
        let thetas = [front.theta(&parts[0]), rear.theta(&parts[1])];
        let slopes = [front.unknowns.slopes(&thetas[0]), rear.unknowns.slopes(&thetas[1])];
        let weight = self.similarity.weight;
        for (k, &parameter) in front.unknowns.free.iter().enumerate() {
            let Some(l) = rear.unknowns.free.iter().position(|&p| p == parameter) else { continue };
            let std = self.similarity.std[parameter];
            let difference = (thetas[0][parameter] - thetas[1][parameter]) / std;
            model.cost += 0.5 * weight * difference * difference;
            let by_x =
                [(k, slopes[0][k] / std), (front.unknowns.free.len() + l, -slopes[1][l] / std)];
            for (i, by_i) in by_x {
                model.gradient[i] += weight * difference * by_i;
                for (j, by_j) in by_x {
                    model.hessian[(i, j)] += weight * by_i * by_j;
                }
            }
        }
    }
}

impl Objective for JointCost<'_> {
    fn model(&self, x: &DVector<f64>) -> Model {
        let parts = self.split(x);
        let [front, rear] = [self.axles[0].model(&parts[0]), self.axles[1].model(&parts[1])];
        let (n, total) = (front.gradient.len(), x.len());
        let mut hessian = front.hessian.resize(total, total, 0.0);
        hessian.view_mut((n, n), rear.hessian.shape()).copy_from(&rear.hessian);
        let mut model = Model {
            cost: front.cost + rear.cost,
            gradient: join([front.gradient, rear.gradient]),
            hessian,
            scale: front.scale.hypot(rear.scale),
        };
        self.add_similarity(&mut model, &parts);
        model
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<Inequality> {
        let parts = self.split(x);
        let place = |axle: usize, row: Inequality| {
            let zeros = DVector::zeros(parts[1 - axle].len());
            let gradient =
                if axle == 0 { join([row.gradient, zeros]) } else { join([zeros, row.gradient]) };
            Inequality { gradient, ..row }
        };
        let of = |axle: usize| {
            self.axles[axle].inequalities(&parts[axle]).into_iter().map(move |row| place(axle, row))
        };
        of(0).chain(of(1)).collect()
    }
}
