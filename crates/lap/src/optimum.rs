//! Solves for the fastest lap, and says what it is: times, positions, controls, and what each parameter is worth.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use track::TrackLine;

use crate::car::LapCar;
use crate::interior_point::{
    CENTRAL_BARRIER, InteriorPointLimits, InteriorPointSolution, InteriorPointStatus, minimise_stages,
    similar_points, stage_lagrangians, start_points,
};
use crate::node::{NodeVariables, PLANAR_STATES, PLANAR_VARIABLES, SWINGING_STATES, SWINGING_VARIABLES};
use crate::problem::LapProblem;
use crate::stages::{EQUATIONS, StageValues, StageVector, StagedProblem as _};
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
    /// What was minimised [s]: the time with what steering and pedals cost.
    pub cost: f64,
    /// How the search ended; only a lap that converged is the fastest.
    pub status: InteriorPointStatus,
    /// Steps of the search.
    pub iterations: usize,
    /// Largest error of the conditions of optimality, scaled.
    pub optimality_error: f64,
    /// The nodes.
    pub nodes: Vec<LapNode>,
    /// Unknowns and multipliers.
    solution: LapSolution,
}

/// Unknowns and multipliers of a lap, of a car whose body swings or does not.
#[derive(Clone, Debug)]
enum LapSolution {
    QuasiSteady(InteriorPointSolution<PLANAR_VARIABLES, PLANAR_STATES>),
    Swinging(InteriorPointSolution<SWINGING_VARIABLES, SWINGING_STATES>),
}

impl From<InteriorPointSolution<PLANAR_VARIABLES, PLANAR_STATES>> for LapSolution {
    fn from(solution: InteriorPointSolution<PLANAR_VARIABLES, PLANAR_STATES>) -> Self {
        LapSolution::QuasiSteady(solution)
    }
}

impl From<InteriorPointSolution<SWINGING_VARIABLES, SWINGING_STATES>> for LapSolution {
    fn from(solution: InteriorPointSolution<SWINGING_VARIABLES, SWINGING_STATES>) -> Self {
        LapSolution::Swinging(solution)
    }
}

/// Rows of the blocks of Newton's method for both kinds of cars.
const PLANAR_BLOCK: usize = PLANAR_VARIABLES + EQUATIONS + PLANAR_STATES;
const SWINGING_BLOCK: usize = SWINGING_VARIABLES + EQUATIONS + SWINGING_STATES;

/// How often a search that stalls begins anew where it is, with the multipliers of the barrier.
const RESTARTS: usize = 1;

impl LapOptimum {
    /// Whether the body of the car swings in this lap.
    pub fn has_transients(&self) -> bool {
        matches!(self.solution, LapSolution::Swinging(_))
    }

    /// Warns of an engine that turns faster in this lap of the car than its table tells.
    pub fn engine_warning(&self, car: &LapCar) -> Option<String> {
        let wheel_speed =
            |node: &LapNode| node.variables.v_x * (1.0 + car.driven_slip(&node.variables.kappas));
        let fastest = self.nodes.iter().map(wheel_speed).fold(0.0, f64::max);
        car.engine_power.as_ref()?.excess_message(fastest)
    }

    /// The fastest lap of a car on a line.
    ///
    /// # Errors
    /// When line, car and options do not make a problem. A search that does not converge is no error, but a status.
    pub fn find(car: &LapCar, line: &TrackLine, options: &LapOptions) -> Result<Self, Error> {
        let problem = LapProblem::new(car, line, options)?;
        let search = LapSearch { problem: &problem, line };
        if let Some(suspension) = &car.suspension {
            let steady = Self::find(&LapCar { suspension: None, ..car.clone() }, line, options)?;
            let node = |(stage, node): (usize, &LapNode)| {
                problem.with_steady_body(suspension, &node.variables, stage)
            };
            let start: Vec<_> = steady.nodes.iter().enumerate().map(node).collect();
            let lap =
                search.run::<SWINGING_VARIABLES, SWINGING_STATES, SWINGING_BLOCK>(&start, CENTRAL_BARRIER);
            return Ok(lap.after(steady.iterations));
        }
        let lap = search.run::<PLANAR_VARIABLES, PLANAR_STATES, PLANAR_BLOCK>(
            &problem.start(line)?,
            InteriorPointLimits::default().barrier,
        );
        if lap.has_converged() || car.track_widths == [0.0; 2] {
            return Ok(lap);
        }
        // The lap of the same car as a single track is easier to find, and near.
        let single = Self::find(&LapCar { track_widths: [0.0; 2], ..car.clone() }, line, options)?;
        let LapSolution::QuasiSteady(solution) = &single.solution else { return Ok(lap) };
        let near = search.run_from_similar::<_, _, PLANAR_BLOCK>(solution);
        let better = if near.has_converged() { near } else { lap.clone() };
        Ok(better.after(lap.iterations + single.iterations))
    }

    fn has_converged(&self) -> bool {
        self.status == InteriorPointStatus::Converged
    }

    /// The lap with the steps of searches before its own.
    fn after(self, iterations: usize) -> Self {
        LapOptimum { iterations: self.iterations + iterations, ..self }
    }

    /// The fastest lap of a similar car on the same line, from this one.
    ///
    /// # Errors
    /// As [`LapOptimum::find`], with the options of the first lap.
    pub fn find_similar(&self, car: &LapCar, line: &TrackLine, options: &LapOptions) -> Result<Self, Error> {
        let options = LapOptions { nodes: Some(self.nodes.len()), ..options.clone() };
        let problem = LapProblem::new(car, line, &options)?;
        let search = LapSearch { problem: &problem, line };
        let warm = match &self.solution {
            LapSolution::QuasiSteady(solution) => search.run_from_similar::<_, _, PLANAR_BLOCK>(solution),
            LapSolution::Swinging(solution) => search.run_from_similar::<_, _, SWINGING_BLOCK>(solution),
        };
        if warm.has_converged() { Ok(warm) } else { Self::find(car, line, &options) }
    }

    fn new<const V: usize, const S: usize>(
        LapSearch { problem, line }: LapSearch,
        solution: InteriorPointSolution<V, S>,
    ) -> Self
    where
        LapSolution: From<InteriorPointSolution<V, S>>,
    {
        let mut nodes = Vec::with_capacity(solution.points.len());
        let (mut t, mut lap_time, mut cost) = (0.0, 0.0, 0.0);
        let mut slowness_before = None;
        for (k, point) in solution.points.iter().enumerate() {
            let s = problem.node_distance() * k as f64;
            let variables = problem.unscaled(&point.x);
            let motion = problem.motion(&variables, k);
            lap_time += problem.way(k) * motion.slowness;
            let values: StageValues<S> = problem.values(&point.x, k);
            cost += values.cost;
            if let Some(before) = slowness_before.replace(motion.slowness) {
                t += 0.5 * problem.node_distance() * (before + motion.slowness);
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
            cost,
            status: solution.status,
            iterations: solution.iterations,
            optimality_error: solution.optimality_error,
            nodes,
            solution: solution.into(),
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
        Ok(match &self.solution {
            LapSolution::QuasiSteady(solution) => stage_lagrangians(&problem, &solution.points),
            LapSolution::Swinging(solution) => stage_lagrangians(&problem, &solution.points),
        })
    }
}

/// A search for the lap of a problem on a line.
#[derive(Clone, Copy)]
struct LapSearch<'a> {
    problem: &'a LapProblem<'a>,
    line: &'a TrackLine,
}

impl LapSearch<'_> {
    /// Searches from these nodes; where it stalls, anew from there.
    fn run<const V: usize, const S: usize, const B: usize>(
        self,
        start: &[NodeVariables],
        barrier: f64,
    ) -> LapOptimum
    where
        LapSolution: From<InteriorPointSolution<V, S>>,
    {
        let from = |unknowns: &[StageVector<V>], barrier: f64| {
            let start = start_points(self.problem, unknowns, barrier);
            let limits = InteriorPointLimits { barrier, ..InteriorPointLimits::default() };
            minimise_stages::<_, V, S, B>(self.problem, start, limits)
        };
        let start: Vec<StageVector<V>> = start.iter().map(|z| self.problem.scaled(z)).collect();
        let mut solution = from(&start, barrier);
        for _ in 0..RESTARTS {
            if solution.status == InteriorPointStatus::Converged {
                break;
            }
            let unknowns: Vec<_> = solution.points.iter().map(|point| point.x).collect();
            let next = from(&unknowns, InteriorPointLimits::default().barrier);
            solution = InteriorPointSolution { iterations: solution.iterations + next.iterations, ..next };
        }
        LapOptimum::new(self, solution)
    }

    /// Searches from the central points of the lap of a similar car.
    fn run_from_similar<const V: usize, const S: usize, const B: usize>(
        self,
        similar: &InteriorPointSolution<V, S>,
    ) -> LapOptimum
    where
        LapSolution: From<InteriorPointSolution<V, S>>,
    {
        let limits = InteriorPointLimits { barrier: CENTRAL_BARRIER, ..InteriorPointLimits::default() };
        let start = similar_points(self.problem, &similar.central_points);
        LapOptimum::new(self, minimise_stages::<_, V, S, B>(self.problem, start, limits))
    }
}
