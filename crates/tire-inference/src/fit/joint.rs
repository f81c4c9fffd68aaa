//! Fits front and rear together: two curves whose parameters are coupled.

use nalgebra::DVector;
use numerics::sqp::{LinearisedInequality, Objective, QuadraticModel};

use crate::fit::curve::CurveCost;
use crate::fit::solution::{CurveMinimum, ResidualNoise};
use crate::fit::{CurveFitProblem, FitError, FitOptions, FitSolution, error, multistart};
use crate::parameters::Parameter;
use crate::regularisation::AxleCoupling;

/// Fits two curves at once; what is expected is reported by each problem. `cost` and `convergence` of both
/// solutions are those of the whole, and their covariances take the noise of their own axle.
///
/// # Errors
/// As for [`crate::fit::least_squares`], and if a problem has noise in the slip.
pub fn joint_least_squares(
    problems: [&CurveFitProblem; 2],
    coupling: AxleCoupling,
    options: &FitOptions,
) -> Result<[FitSolution; 2], FitError> {
    for problem in problems {
        error::check_problem(problem)?;
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
    let [lower, upper] = [CurveCost::lower_bounds, CurveCost::upper_bounds]
        .map(|side| concatenate(cost.axles.each_ref().map(side)));
    let [front, rear] = problems.map(|p| multistart::start_points(&p.bounds, &p.held, options));
    let start = |(f, r)| concatenate([cost.axles[0].x_from_theta(f), cost.axles[1].x_from_theta(r)]);
    let starts: Vec<DVector<f64>> = front.iter().zip(&rear).map(start).collect();
    let search = multistart::search_from_starts(&cost, None, &lower, &upper, &starts, options)?;
    let solution = |axle: usize| {
        let count = cost.axles[axle].unknowns.free.len();
        let from = if axle == 0 { 0 } else { lower.len() - count };
        let part = CurveMinimum::from_minimum(&search.best, from, count);
        let theta = |x: &DVector<f64>| cost.axles[axle].theta_from_x(&x.rows(from, count).into_owned());
        let optima = search.optima.iter().map(|m| (theta(&m.x), m.model.cost)).collect();
        let noise = ResidualNoise::estimate(problems[axle], &theta(&search.best.x), part.fitted);
        part.to_solution(problems[axle], &noise, search.convergence(), optima)
    };
    Ok([solution(0), solution(1)])
}

struct JointCost<'a> {
    axles: [CurveCost<'a>; 2],
    coupling: AxleCoupling,
}

/// One vector above the other.
fn concatenate([front, rear]: [DVector<f64>; 2]) -> DVector<f64> {
    DVector::from_iterator(front.len() + rear.len(), front.iter().chain(rear.iter()).copied())
}

impl JointCost<'_> {
    fn split_by_axle(&self, x: &DVector<f64>) -> [DVector<f64>; 2] {
        let front = self.axles[0].unknowns.free.len();
        [x.rows(0, front).into_owned(), x.rows(front, x.len() - front).into_owned()]
    }

    fn add_coupling(&self, model: &mut QuadraticModel, parts: &[DVector<f64>; 2]) {
        let [front, rear] = &self.axles;
        let thetas = [front.theta_from_x(&parts[0]), rear.theta_from_x(&parts[1])];
        let slopes =
            [front.unknowns.theta_derivatives(&thetas[0]), rear.unknowns.theta_derivatives(&thetas[1])];
        for (k, &i) in front.unknowns.free.iter().enumerate() {
            let Some(l) = rear.unknowns.free.iter().position(|&p| p == i) else { continue };
            let [cost, slope, bend] =
                self.coupling.cost_and_derivatives(Parameter::ALL[i], thetas[0][i], thetas[1][i]);
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
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let parts = self.split_by_axle(x);
        let [front, rear] = [self.axles[0].model(&parts[0]), self.axles[1].model(&parts[1])];
        let (n, total) = (front.gradient.len(), x.len());
        let mut hessian = front.hessian.resize(total, total, 0.0);
        hessian.view_mut((n, n), rear.hessian.shape()).copy_from(&rear.hessian);
        let mut model = QuadraticModel {
            cost: front.cost + rear.cost,
            gradient: concatenate([front.gradient, rear.gradient]),
            hessian,
            scale: front.scale.hypot(rear.scale),
        };
        self.add_coupling(&mut model, &parts);
        model
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<LinearisedInequality> {
        let parts = self.split_by_axle(x);
        let index = |axle: usize, row: LinearisedInequality| {
            let zeros = DVector::zeros(parts[1 - axle].len());
            let gradient = if axle == 0 {
                concatenate([row.gradient, zeros])
            } else {
                concatenate([zeros, row.gradient])
            };
            LinearisedInequality { gradient, ..row }
        };
        let of = |axle: usize| {
            self.axles[axle].inequalities(&parts[axle]).into_iter().map(move |row| index(axle, row))
        };
        of(0).chain(of(1)).collect()
    }
}
