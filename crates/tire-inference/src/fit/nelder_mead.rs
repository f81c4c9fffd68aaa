//! Fits a curve without derivatives, by the simplex of Nelder and Mead: the yardstick of the literature.

use nalgebra::DMatrix;
use numerics::convergence::ConvergenceReport;
use numerics::simplex;

use crate::fit::curve::CurveCost;
use crate::fit::solution::ResidualNoise;
use crate::fit::{CurveConstraints, CurveFitProblem, FitError, FitOptions, FitSolution, error, multistart};

/// Fits the free parameters from the first start of the options. There are no variances of parameters in the solution: the
/// method has no derivatives.
///
/// # Errors
/// As for [`crate::fit::least_squares`], and for constraints or noise in the slip, which this method cannot take.
pub fn fit_nelder_mead(problem: &CurveFitProblem, options: &FitOptions) -> Result<FitSolution, FitError> {
    error::check_problem(problem)?;
    if problem.constraints != CurveConstraints::default() || problem.slip_noise.is_some() {
        let problem = "has bounds only; leave out constraints and slip noise, or use least squares";
        return Err(FitError::Setting { setting: "nelder_mead", problem });
    }
    let curve = CurveCost::new(problem);
    let free = &curve.unknowns.free;
    let pick = |theta: &crate::parameters::Theta| free.iter().map(|&i| theta[i]).collect::<Vec<f64>>();
    let theta = |x: &[f64]| {
        let mut theta = problem.held;
        for (&i, &x) in free.iter().zip(x) {
            theta[i] = x;
        }
        theta
    };
    let start = pick(&multistart::start_points(&problem.bounds, &problem.held, options)[0]);
    let (lower, upper) = (pick(&problem.bounds.lower), pick(&problem.bounds.upper));
    let minimum = simplex::minimise_nelder_mead(
        &|x| curve.cost_of_theta(&theta(x)),
        &lower,
        &upper,
        &start,
        simplex::SimplexLimits::default(),
    );
    let values = theta(&minimum.x);
    let at_bound: Vec<_> = problem
        .free_parameters()
        .into_iter()
        .filter(|&p| {
            values[p as usize] <= problem.bounds.lower[p as usize]
                || values[p as usize] >= problem.bounds.upper[p as usize]
        })
        .collect();
    let n = free.len();
    Ok(FitSolution {
        theta: values,
        cost: minimum.cost,
        noise_std: ResidualNoise::estimate(problem, &values, n - at_bound.len()).std,
        free: problem.free_parameters(),
        covariance: DMatrix::from_element(n, n, f64::NAN),
        at_bound,
        convergence: ConvergenceReport {
            status: minimum.status,
            iterations: minimum.restarts,
            evaluations: minimum.evaluations,
            kkt_residual: None,
            starts: 1,
            optima: 1,
            cost: minimum.cost,
            trace: minimum.trace,
        },
        optima: vec![(values, minimum.cost)],
    })
}
