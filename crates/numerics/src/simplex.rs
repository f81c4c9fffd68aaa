//! Minimises a cost in a box without derivatives, by the simplex of Nelder and Mead.
//!
//! Bounds clip the points. A start on a bound is moved inside, where the simplex has extent in every direction, and the search
//! begins anew from its end until that no longer helps.

use crate::convergence::OptimisationStatus;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimplexLimits {
    /// Most evaluations of the cost, in all restarts.
    pub evaluations: usize,
    /// Size of the simplex, as a share of the box, at which it has contracted.
    pub size: f64,
    /// Spread of the cost over the simplex, as a share of the cost, at which it has contracted.
    pub spread: f64,
    /// Most restarts.
    pub restarts: usize,
}

impl Default for SimplexLimits {
    fn default() -> Self {
        Self { evaluations: 20_000, size: 1e-9, spread: 1e-12, restarts: 30 }
    }
}

/// Where a search ended.
#[derive(Clone, Debug, PartialEq)]
pub struct SimplexMinimum {
    /// The best point.
    pub x: Vec<f64>,
    /// Its cost.
    pub cost: f64,
    /// Converged when restarts in all directions did not improve it.
    pub status: OptimisationStatus,
    /// Restarts that were made.
    pub restarts: usize,
    /// Evaluations of the cost.
    pub evaluations: usize,
    /// The cost at the start and after each restart.
    pub trace: Vec<f64>,
}

/// Edges of the first simplex of each start, as shares of the box, in turn.
const EDGES: [f64; 4] = [0.1, -0.1, 0.01, -0.01];
/// Least distance of a start from a bound, as a share of the box.
const MARGIN: f64 = 0.05;

/// Minimises a cost in a box with finite bounds.
pub fn minimise_nelder_mead(
    cost: &dyn Fn(&[f64]) -> f64,
    lower: &[f64],
    upper: &[f64],
    start: &[f64],
    limits: SimplexLimits,
) -> SimplexMinimum {
    let mut search = SimplexSearch { cost, lower, upper, limits, evaluations: 0 };
    let share = |i: usize| {
        let width = upper[i] - lower[i];
        if width > 0.0 { ((start[i] - lower[i]) / width).clamp(MARGIN, 1.0 - MARGIN) } else { 0.0 }
    };
    let first: Vec<f64> = (0..start.len()).map(share).collect();
    let mut best = search.evaluate_vertex(first);
    let mut trace = vec![best.1];
    let (mut status, mut restarts, mut in_vain) = (OptimisationStatus::IterationLimit, 0, 0);
    for restart in 0..=limits.restarts {
        restarts = restart;
        let end = search.run_simplex(best.clone(), EDGES[restart % EDGES.len()]);
        let gained = best.1 - end.1;
        if end.1 <= best.1 {
            best = end;
        }
        trace.push(best.1);
        if search.evaluations >= limits.evaluations {
            break;
        }
        in_vain = if gained <= limits.spread * best.1.abs() { in_vain + 1 } else { 0 };
        if in_vain == EDGES.len() {
            status = OptimisationStatus::Converged;
            break;
        }
    }
    SimplexMinimum {
        x: search.point_from_shares(&best.0),
        cost: best.1,
        status,
        restarts,
        evaluations: search.evaluations,
        trace,
    }
}

/// A point, as shares of the box, with its cost.
type Vertex = (Vec<f64>, f64);

struct SimplexSearch<'a> {
    cost: &'a dyn Fn(&[f64]) -> f64,
    lower: &'a [f64],
    upper: &'a [f64],
    limits: SimplexLimits,
    evaluations: usize,
}

impl SimplexSearch<'_> {
    fn point_from_shares(&self, shares: &[f64]) -> Vec<f64> {
        let value = |(i, &t): (usize, &f64)| {
            if t >= 1.0 { self.upper[i] } else { self.lower[i] + t * (self.upper[i] - self.lower[i]) }
        };
        shares.iter().enumerate().map(value).collect()
    }

    fn evaluate_vertex(&mut self, mut shares: Vec<f64>) -> Vertex {
        shares.iter_mut().for_each(|t| *t = t.clamp(0.0, 1.0));
        self.evaluations += 1;
        let cost = (self.cost)(&self.point_from_shares(&shares));
        (shares, if cost.is_nan() { f64::INFINITY } else { cost })
    }

    /// The simplex of Nelder and Mead (A Simplex Method for Function Minimization, 1965) from one of its corners to its end.
    fn run_simplex(&mut self, corner: Vertex, edge: f64) -> Vertex {
        let n = corner.0.len();
        let mut simplex = vec![corner];
        for i in 0..n {
            let mut shares = simplex[0].0.clone();
            // Towards the inside where the edge would leave the box.
            shares[i] += if (0.0..=1.0).contains(&(shares[i] + edge)) { edge } else { -edge };
            let vertex = self.evaluate_vertex(shares);
            simplex.push(vertex);
        }
        loop {
            simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
            let size =
                simplex[1..].iter().flat_map(|v| v.0.iter().zip(&simplex[0].0).map(|(a, b)| (a - b).abs()));
            let contracted = size.fold(0.0, f64::max) <= self.limits.size;
            let level = simplex[n].1 - simplex[0].1 <= self.limits.spread * simplex[0].1.abs();
            if contracted && level || self.evaluations >= self.limits.evaluations {
                return simplex.swap_remove(0);
            }
            self.advance_simplex(&mut simplex);
        }
    }

    /// Replaces the worst corner, or shrinks the simplex towards its best.
    fn advance_simplex(&mut self, simplex: &mut [Vertex]) {
        let n = simplex.len() - 1;
        let centre: Vec<f64> =
            (0..n).map(|i| simplex[..n].iter().map(|v| v.0[i]).sum::<f64>() / n as f64).collect();
        let worst = simplex[n].clone();
        let beyond = |factor: f64| {
            centre.iter().zip(&worst.0).map(|(c, w)| c + factor * (c - w)).collect::<Vec<f64>>()
        };
        let reflected = self.evaluate_vertex(beyond(1.0));
        if reflected.1 < simplex[0].1 {
            let expanded = self.evaluate_vertex(beyond(2.0));
            simplex[n] = if expanded.1 < reflected.1 { expanded } else { reflected };
        } else if reflected.1 < simplex[n - 1].1 {
            simplex[n] = reflected;
        } else {
            let (contracted, limit) = if reflected.1 < worst.1 {
                (self.evaluate_vertex(beyond(0.5)), reflected.1)
            } else {
                (self.evaluate_vertex(beyond(-0.5)), worst.1)
            };
            if contracted.1 <= limit && contracted.1 < worst.1 {
                simplex[n] = contracted;
            } else {
                for k in 1..=n {
                    let middle = simplex[k].0.iter().zip(&simplex[0].0).map(|(a, b)| 0.5 * (a + b)).collect();
                    simplex[k] = self.evaluate_vertex(middle);
                }
            }
        }
    }
}
