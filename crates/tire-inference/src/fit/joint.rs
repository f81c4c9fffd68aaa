//! Fits front and rear together: two curves whose parameters are coupled.

use nalgebra::DVector;
use numerics::sqp::{Inequality, Model, Objective};

use crate::fit::curve::CurveCost;
use crate::fit::solution::{Part, ResidualNoise};
use crate::fit::{FitError, FitOptions, Problem, Solution, error, multistart};
use crate::parameters::Parameter;
use crate::regularisation::AxleCoupling;

/// Fits two curves at once; what is expected is reported by each problem. `cost` and `convergence` of both
/// solutions are those of the whole, and their covariances take the noise of their own axle.
///
/// # Errors
/// As for [`crate::fit::least_squares`], and if a problem has noise in the slip.
pub fn joint_least_squares(
    problems: [&Problem; 2],
    coupling: AxleCoupling,
    options: &FitOptions,
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
    if !coupling.is_valid() {
        return Err(FitError::Setting {
            setting: "axle_coupling",
            problem: "the weight must be 0 or above, every unit above 0",
        });
    }
    let cost = JointCost { axles: problems.map(CurveCost::new), coupling };
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
        let noise = ResidualNoise::of(problems[axle], &theta(&search.best.x), part.fitted);
        part.solution(problems[axle], &noise, search.convergence(), optima)
    };
    Ok([solution(0), solution(1)])
}

struct JointCost<'a> {
    axles: [CurveCost<'a>; 2],
    coupling: AxleCoupling,
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

    fn couple(&self, model: &mut Model, parts: &[DVector<f64>; 2]) {
        let [front, rear] = &self.axles;
        let thetas = [front.theta(&parts[0]), rear.theta(&parts[1])];
        let slopes = [front.unknowns.slopes(&thetas[0]), rear.unknowns.slopes(&thetas[1])];
        for (k, &i) in front.unknowns.free.iter().enumerate() {
            let Some(l) = rear.unknowns.free.iter().position(|&p| p == i) else { continue };
            let [cost, slope, bend] =
                self.coupling.at(Parameter::ALL[i], thetas[0][i], thetas[1][i]);
            model.cost += cost;
            let by_x = [(k, slopes[0][k]), (front.unknowns.free.len() + l, -slopes[1][l])];
            for (i, by_i) in by_x {
                model.gradient[i] += slope * by_i;
                for (j, by_j) in by_x {
                    model.hessian[(i, j)] += bend * by_i * by_j;
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
        self.couple(&mut model, &parts);
        model
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<Inequality> {
        let parts = self.split(x);
        let index = |axle: usize, row: Inequality| {
            let zeros = DVector::zeros(parts[1 - axle].len());
            let gradient =
                if axle == 0 { join([row.gradient, zeros]) } else { join([zeros, row.gradient]) };
            Inequality { gradient, ..row }
        };
        let of = |axle: usize| {
            self.axles[axle].inequalities(&parts[axle]).into_iter().map(move |row| index(axle, row))
        };
        of(0).chain(of(1)).collect()
    }
}
