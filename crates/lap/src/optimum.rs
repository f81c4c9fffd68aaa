//! Solves for the fastest lap, and says what it is: times, positions, controls, and what each parameter is worth.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use track::TrackLine;

use crate::car::LapCar;
use crate::interior_point::{
    CENTRAL_BARRIER, InteriorPointLimits, InteriorPointStatus, StageIterate, minimise_stages, similar_points,
    start_points,
};
use crate::node::NodeVariables;
use crate::problem::LapProblem;
use crate::stages::StagedProblem;
use crate::{Error, LapOptions};

/// The car at a node of its lap.
#[derive(Clone, Copy, Debug)]
pub struct LapNode {
    /// Station of the line [m].
    pub s: f64,
    /// Time since the first node [s].
    pub t: f64,
    /// Position of the centre of gravity [m].
    pub position: [f64; 2],
    /// Yaw angle of the car from the X axis [rad], not wrapped within a lap.
    pub psi: f64,
    /// Curvature of the line [1/m].
    pub kappa: f64,
    /// Ways from the centre of gravity to the left and the right edge [m]; none for a track without widths.
    pub edges: Option<[f64; 2]>,
    /// Bounds of the lateral deviation [m]: to the right (negative), to the left.
    pub deviation_bounds: [f64; 2],
    /// States and controls.
    pub variables: NodeVariables,
    /// Acceleration by tires and air along the car [m/s²].
    pub a_x: f64,
    /// Slip angles of the axles [rad], in ISO-W.
    pub alphas: [f64; 2],
}

/// The fastest lap, as far as it was found.
#[derive(Clone, Debug)]
pub struct LapOptimum {
    /// Time of the lap [s].
    pub lap_time: f64,
    /// How the search ended; only a lap that converged is the fastest.
    pub status: InteriorPointStatus,
    /// Steps of the search.
    pub iterations: usize,
    /// Largest error of the conditions of optimality, scaled.
    pub optimality_error: f64,
    /// The nodes.
    pub nodes: Vec<LapNode>,
    /// Unknowns and multipliers.
    points: Vec<StageIterate>,
    /// Those from which the search for a similar car starts.
    central_points: Vec<StageIterate>,
}

/// How often a search that stalls begins anew where it is, with the multipliers of the barrier.
const RESTARTS: usize = 3;

impl LapOptimum {
    /// Warns of an engine that turns faster in this lap of the car than its table tells.
    pub fn engine_warning(&self, car: &LapCar) -> Option<String> {
        let fastest = self.nodes.iter().map(|node| node.variables.v_x).fold(0.0, f64::max);
        car.engine_power.as_ref()?.excess_message(fastest)
    }

    /// The fastest lap of a car on a line.
    ///
    /// # Errors
    /// When line, car and options do not make a problem. A search that does not converge is no error, but a status.
    pub fn find(car: &LapCar, line: &TrackLine, options: &LapOptions) -> Result<Self, Error> {
        let problem = LapProblem::new(car, line, options)?;
        let limits = InteriorPointLimits::default();
        let start = start_points(&problem, &problem.start(line)?, limits.barrier);
        let mut lap = Self::solve(&problem, line, start, limits);
        for _ in 0..RESTARTS {
            if lap.status == InteriorPointStatus::Converged {
                break;
            }
            let unknowns: Vec<_> = lap.points.iter().map(|point| point.x).collect();
            let start = start_points(&problem, &unknowns, limits.barrier);
            let next = Self::solve(&problem, line, start, limits);
            lap = LapOptimum { iterations: lap.iterations + next.iterations, ..next };
        }
        Ok(lap)
    }

    /// The fastest lap of a similar car on the same line, from this one.
    ///
    /// # Errors
    /// As [`LapOptimum::find`], with the options of the first lap.
    pub fn find_similar(&self, car: &LapCar, line: &TrackLine, options: &LapOptions) -> Result<Self, Error> {
        let options = LapOptions { nodes: Some(self.nodes.len()), ..options.clone() };
        let problem = LapProblem::new(car, line, &options)?;
        let limits = InteriorPointLimits { barrier: CENTRAL_BARRIER, ..InteriorPointLimits::default() };
        let start = similar_points(&problem, &self.central_points);
        let warm = Self::solve(&problem, line, start, limits);
        match warm.status {
            InteriorPointStatus::Converged => Ok(warm),
            _ => Self::find(car, line, &options),
        }
    }

    fn solve(
        problem: &LapProblem,
        line: &TrackLine,
        start: Vec<StageIterate>,
        limits: InteriorPointLimits,
    ) -> Self {
        let solution = minimise_stages(problem, start, limits);
        let mut nodes = Vec::with_capacity(solution.points.len());
        let (mut t, mut lap_time) = (0.0, 0.0);
        let mut slowness_before = None;
        for (k, point) in solution.points.iter().enumerate() {
            let s = problem.step() * k as f64;
            let variables = problem.unscaled(&point.x);
            let motion = problem.motion(&variables, k);
            lap_time += problem.way(k) * motion.slowness;
            if let Some(before) = slowness_before.replace(motion.slowness) {
                t += 0.5 * problem.step() * (before + motion.slowness);
            }
            let on_line = line.point_at(s);
            let (sin, cos) = on_line.psi.sin_cos();
            let n = variables.n;
            nodes.push(LapNode {
                s,
                t,
                position: [on_line.point[0] - n * sin, on_line.point[1] + n * cos],
                psi: on_line.psi + variables.xi,
                kappa: on_line.kappa,
                edges: line.widths_at(s).map(|[left, right]| [left - n, right + n]),
                deviation_bounds: problem.deviation_bounds(k),
                variables,
                a_x: motion.a_x,
                alphas: motion.alphas,
            });
        }
        LapOptimum {
            lap_time,
            status: solution.status,
            iterations: solution.iterations,
            optimality_error: solution.optimality_error,
            nodes,
            points: solution.points,
            central_points: solution.central_points,
        }
    }

    /// What each node adds to the Lagrangian with another car, with unknowns and multipliers held [s].
    ///
    /// By the envelope theorem the least time changes as its sum does, to first order of the change of the car.
    ///
    /// # Errors
    /// As [`LapOptimum::find`], with the options of this lap.
    pub fn lagrangian_by_node(
        &self,
        car: &LapCar,
        line: &TrackLine,
        options: &LapOptions,
    ) -> Result<Vec<f64>, Error> {
        let options = LapOptions { nodes: Some(self.nodes.len()), ..options.clone() };
        let problem = LapProblem::new(car, line, &options)?;
        Ok((0..self.points.len()).map(|k| problem.lagrangian(&self.points, k)).collect())
    }
}
