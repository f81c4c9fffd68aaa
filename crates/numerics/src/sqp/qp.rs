//! Solves one small quadratic subproblem: a step in a box, with linear rows that may be violated at a price.
#![allow(non_snake_case, reason = "matrices as in the documentation of clarabel")]

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT};
use nalgebra::{Cholesky, DMatrix, DVector};

/// min ½ d'Hd + g'd + price · Σ max(0, −(row·d + value)) over lower ≤ d ≤ upper. The diagonal of H should be near 1.
pub struct QuadraticSubproblem {
    /// Positive definite, n × n.
    pub hessian: DMatrix<f64>,
    /// Length n.
    pub gradient: DVector<f64>,
    /// At most 0 everywhere.
    pub lower: DVector<f64>,
    /// At least 0 everywhere.
    pub upper: DVector<f64>,
    /// Gradients of the rows, one per row.
    pub rows: DMatrix<f64>,
    /// Values of the rows at d = 0.
    pub values: DVector<f64>,
    /// What a unit of violation costs.
    pub price: f64,
}

/// Where a variable or a row ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintState {
    /// Strictly inside.
    Free,
    /// On the lower bound; for a row, exactly met.
    Lower,
    /// On the upper bound.
    Upper,
    /// For a row: violated.
    Violated,
}

/// A solution of a subproblem.
pub struct SubproblemSolution {
    /// The step, exactly on the bounds where `places` says so.
    pub d: DVector<f64>,
    /// Where each variable ended.
    pub places: Vec<ConstraintState>,
    /// Multipliers of the rows, from 0 to the price.
    pub multipliers: DVector<f64>,
    /// Where each row ended.
    pub rows: Vec<ConstraintState>,
}

/// Solves it; `None` if H is not positive definite or the interior-point method gave up.
pub fn solve_subproblem(problem: &QuadraticSubproblem) -> Option<SubproblemSolution> {
    if problem.rows.nrows() == 0 { solve_with_bounds(problem) } else { solve_with_constraints(problem) }
}

impl QuadraticSubproblem {
    /// The gradient of the objective at d, without the rows.
    fn objective_gradient(&self, d: &DVector<f64>) -> DVector<f64> {
        &self.hessian * d + &self.gradient
    }

    /// Minimises with variables fixed on their bounds, rows met exactly, and violated rows pulling with the full price.
    /// Gives the step and the multipliers of the rows.
    fn equality_step(
        &self,
        places: &[ConstraintState],
        rows: &[ConstraintState],
    ) -> Option<(DVector<f64>, DVector<f64>)> {
        let n = places.len();
        let mut d = DVector::from_fn(n, |i, _| match places[i] {
            ConstraintState::Lower => self.lower[i],
            ConstraintState::Upper => self.upper[i],
            _ => 0.0,
        });
        let mut multipliers =
            DVector::from_fn(
                rows.len(),
                |r, _| if rows[r] == ConstraintState::Violated { self.price } else { 0.0 },
            );
        let free: Vec<usize> = (0..n).filter(|&i| places[i] == ConstraintState::Free).collect();
        let met: Vec<usize> = (0..rows.len()).filter(|&r| rows[r] == ConstraintState::Lower).collect();
        let pull = self.objective_gradient(&d) - self.rows.transpose() * &multipliers;
        let size = free.len() + met.len();
        if free.is_empty() {
            return met.is_empty().then_some((d, multipliers));
        }
        let level = &self.rows * &d + &self.values;
        let right =
            DVector::from_fn(
                size,
                |i, _| if i < free.len() { -pull[free[i]] } else { -level[met[i - free.len()]] },
            );
        let entry = |i: usize, j: usize| match (i < free.len(), j < free.len()) {
            (true, true) => self.hessian[(free[i], free[j])],
            (true, false) => self.rows[(met[j - free.len()], free[i])],
            (false, true) => self.rows[(met[i - free.len()], free[j])],
            (false, false) => 0.0,
        };
        let matrix = DMatrix::from_fn(size, size, entry);
        let solution = if met.is_empty() {
            Cholesky::new(matrix)?.solve(&right)
        } else {
            matrix.full_piv_lu().solve(&right)?
        };
        if solution.iter().any(|x| !x.is_finite()) {
            return None;
        }
        for (k, &i) in free.iter().enumerate() {
            d[i] = solution[k];
        }
        for (k, &r) in met.iter().enumerate() {
            multipliers[r] = -solution[free.len() + k];
        }
        Some((d, multipliers))
    }
}

/// Active sets: walk to the minimum of the free variables, stop at the first bound, release what pulls inwards.
fn solve_with_bounds(problem: &QuadraticSubproblem) -> Option<SubproblemSolution> {
    let n = problem.gradient.len();
    let index = |i: usize| match problem.gradient[i] {
        g if problem.lower[i] >= 0.0 && g >= 0.0 => ConstraintState::Lower,
        g if problem.upper[i] <= 0.0 && g <= 0.0 => ConstraintState::Upper,
        _ => ConstraintState::Free,
    };
    let mut places: Vec<ConstraintState> = (0..n).map(index).collect();
    let mut d: DVector<f64> = DVector::zeros(n);
    for _ in 0..10 * n + 10 {
        let (target, _) = problem.equality_step(&places, &[])?;
        let (mut fraction, mut blocking) = (1.0, None);
        for i in (0..n).filter(|&i| places[i] == ConstraintState::Free) {
            let (bound, side) = if target[i] > problem.upper[i] {
                (problem.upper[i], ConstraintState::Upper)
            } else if target[i] < problem.lower[i] {
                (problem.lower[i], ConstraintState::Lower)
            } else {
                continue;
            };
            let share = (bound - d[i]) / (target[i] - d[i]);
            if share < fraction || blocking.is_none() {
                (fraction, blocking) = (share.clamp(0.0, 1.0), Some((i, side)));
            }
        }
        d += (target - &d) * fraction;
        if let Some((i, side)) = blocking {
            places[i] = side;
            d[i] = if side == ConstraintState::Upper { problem.upper[i] } else { problem.lower[i] };
            continue;
        }
        let gradient = problem.objective_gradient(&d);
        let pull = |i: usize| match places[i] {
            ConstraintState::Lower => -gradient[i],
            ConstraintState::Upper => gradient[i],
            _ => 0.0,
        };
        let worst = (0..n).max_by(|&i, &j| pull(i).total_cmp(&pull(j)))?;
        if pull(worst) <= 1e-14 * problem.gradient.amax() {
            return Some(SubproblemSolution { d, places, multipliers: DVector::zeros(0), rows: Vec::new() });
        }
        places[worst] = ConstraintState::Free;
    }
    None
}

/// Interior points find which bounds and rows hold; the reduced system then hits them exactly.
fn solve_with_constraints(problem: &QuadraticSubproblem) -> Option<SubproblemSolution> {
    let (n, m) = (problem.gradient.len(), problem.rows.nrows());
    let (d, duals, slacks, bounds) = interior_points(problem)?;
    let mut places = vec![ConstraintState::Free; n];
    for (k, &(i, side)) in bounds.iter().enumerate() {
        if duals[k] > slacks[k] {
            places[i] = side;
        }
    }
    let first = bounds.len();
    let holds = |k: usize| duals[k] > slacks[k];
    let rows: Vec<ConstraintState> = (0..m)
        .map(|r| match (holds(first + r), holds(first + m + r)) {
            (false, _) => ConstraintState::Free,
            (true, true) => ConstraintState::Lower,
            (true, false) => ConstraintState::Violated,
        })
        .collect();
    if let Some((exact, multipliers)) = problem.equality_step(&places, &rows) {
        let near = (&exact - &d).amax() <= 1e-4 * (1.0 + d.amax());
        let inside =
            (0..n).all(|i| exact[i] >= problem.lower[i] - 1e-12 && exact[i] <= problem.upper[i] + 1e-12);
        if near && inside {
            return Some(SubproblemSolution { d: exact, places, multipliers, rows });
        }
    }
    let d = DVector::from_fn(n, |i, _| match places[i] {
        ConstraintState::Lower => problem.lower[i],
        ConstraintState::Upper => problem.upper[i],
        _ => d[i].clamp(problem.lower[i], problem.upper[i]),
    });
    let multipliers = DVector::from_fn(m, |r, _| duals[first + r]);
    Some(SubproblemSolution { d, places, multipliers, rows })
}

type InteriorPointSolution = (DVector<f64>, Vec<f64>, Vec<f64>, Vec<(usize, ConstraintState)>);

/// The subproblem with a slack variable for each row, by clarabel: step, duals, slacks, and whose bounds the first
/// inequalities are. Then come the rows, then the slack variables.
fn interior_points(problem: &QuadraticSubproblem) -> Option<InteriorPointSolution> {
    let (n, m) = (problem.gradient.len(), problem.rows.nrows());
    let mut P = DMatrix::zeros(n + m, n + m);
    for j in 0..n {
        for i in 0..=j {
            P[(i, j)] = problem.hessian[(i, j)];
        }
    }
    let mut q = problem.gradient.as_slice().to_vec();
    q.extend(std::iter::repeat_n(problem.price, m));
    let mut bounds = Vec::new();
    for i in 0..n {
        if problem.lower[i].is_finite() {
            bounds.push((i, ConstraintState::Lower));
        }
        if problem.upper[i].is_finite() {
            bounds.push((i, ConstraintState::Upper));
        }
    }
    let first = bounds.len();
    let mut A = DMatrix::zeros(first + 2 * m, n + m);
    let mut b = vec![0.0; first + 2 * m];
    for (k, &(i, side)) in bounds.iter().enumerate() {
        let sign = if side == ConstraintState::Upper { 1.0 } else { -1.0 };
        A[(k, i)] = sign;
        b[k] = sign * if side == ConstraintState::Upper { problem.upper[i] } else { problem.lower[i] };
    }
    for r in 0..m {
        for i in 0..n {
            A[(first + r, i)] = -problem.rows[(r, i)];
        }
        A[(first + r, n + r)] = -1.0;
        b[first + r] = problem.values[r];
        A[(first + m + r, n + r)] = -1.0;
    }
    let settings = DefaultSettings {
        verbose: false,
        presolve_enable: false,
        tol_gap_abs: 1e-12,
        tol_gap_rel: 1e-12,
        tol_feas: 1e-12,
        max_iter: 60,
        ..DefaultSettings::default()
    };
    let cones = [NonnegativeConeT(first + 2 * m)];
    let mut solver =
        DefaultSolver::new(&to_sparse_columns(&P), &q, &to_sparse_columns(&A), &b, &cones, settings).ok()?;
    solver.solve();
    let solution = solver.solution;
    let usable = solution.x.iter().chain(&solution.z).all(|x| x.is_finite());
    usable.then(|| (DVector::from_column_slice(&solution.x[..n]), solution.z, solution.s, bounds))
}

/// Compressed columns without the zeros.
fn to_sparse_columns(matrix: &DMatrix<f64>) -> CscMatrix<f64> {
    let (mut starts, mut places, mut values) = (vec![0], Vec::new(), Vec::new());
    for column in matrix.column_iter() {
        for (i, &x) in column.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            places.push(i);
            values.push(x);
        }
        starts.push(places.len());
    }
    CscMatrix::new(matrix.nrows(), matrix.ncols(), starts, places, values)
}
