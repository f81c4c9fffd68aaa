//! States the fastest lap as a problem of stages: scaled unknowns at equidistant nodes of a line, and a start for the search.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use std::ops::RangeInclusive;

use nalgebra::SMatrix;
use track::{AccelerationLimits, GgvDiagram, RoadGeometry, SpeedBounds, SpeedProfile, TrackLine};
use vehicle::G;
use vehicle::dual_track::{HeaveRollPitch, STOP, Suspension};

use crate::car::LapCar;
use crate::node::{BodyMotion, NodeMotion, NodeVariables};
use crate::stages::{
    EQUATIONS, INEQUALITIES, StageBounds, StageModel, StageValues, StageVector, StageWeights, StagedProblem,
};
use crate::tires::{StageDual, StageNumber, TirePeaks, unknown};
use crate::{Error, LapOptions};

/// The functions of a stage with S states, whose unknowns are numbers T.
struct StageFunctions<T, const S: usize> {
    cost: T,
    slopes: [T; S],
    equations: [T; EQUATIONS],
    inequalities: [T; INEQUALITIES],
}

/// What steering and pedals at their fastest cost, as a share of the time: so little that the lap time does not feel it, and enough that
/// only one solution is the best.
const SMOOTHNESS: f64 = 3e-2;
/// Sizes of the unknowns [m, rad, m/s, N, N/s, -, m/s²]. They are the same for all cars, so that the laps of two can be compared.
const SCALE: NodeVariables = NodeVariables {
    n: 5.0,
    xi: 0.3,
    v_x: 30.0,
    v_y: 2.0,
    r: 1.0,
    delta: 0.1,
    F_x: 1e4,
    body: Some(BodyMotion {
        attitude: HeaveRollPitch { z: 0.02, phi: 0.05, theta: 0.02 },
        rates: HeaveRollPitch { z: 0.2, phi: 0.3, theta: 0.2 },
    }),
    delta_rate: 1.0,
    F_x_rate: 5e4,
    kappas: [0.1; 4],
    a_y: 10.0,
};
/// How far a body heaves [m] at most, and how fast it moves on its springs [m/s, rad/s].
const MOST_HEAVE: f64 = 0.5;
const FASTEST_BODY: f64 = 10.0;
/// Numbers of nodes that make sense: of more each is a few kilobytes.
const NODES: RangeInclusive<usize> = 10..=50_000;
/// Slowest speed of a lap [m/s].
const SLOWEST: f64 = 2.0;
/// Least friction of a tire [-]: below that of wet ice.
const LEAST_FRICTION: f64 = 0.02;
/// Slowest speed at the start of an open line [m/s]: above the slowest one at all, as a search needs room between bounds.
const SLOWEST_START: f64 = 1.5 * SLOWEST;
/// Share of the grip of the tires that the start of the search uses.
const START_GRIP: f64 = 0.75;
/// How far an open lap may begin from straight ahead [rad, m/s, rad/s].
const START_TOLERANCE: f64 = 1e-3;
/// Lateral acceleration that no car reaches [m/s²].
const MOST_ACCELERATION: f64 = 100.0;
/// What has to be left of the radius of a bend at the inner edge [-]: 1 − n κ.
const LEAST_RADIUS_SHARE: f64 = 0.1;

/// The fastest lap of a car on a line with widths.
pub struct LapProblem<'a> {
    car: &'a LapCar,
    closed: bool,
    step: f64,
    roads: Vec<RoadGeometry>,
    /// Bounds of the lateral deviation at each node [m].
    deviations: Vec<[f64; 2]>,
    top_speed: f64,
    start_speed: Option<f64>,
    peaks: [TirePeaks; 2],
}

impl<'a> LapProblem<'a> {
    /// The lap of a car on this line.
    ///
    /// # Errors
    /// When the line has no widths and none are told, when it is too narrow, or when its bends are tighter than it is wide.
    pub fn new(car: &'a LapCar, line: &TrackLine, options: &LapOptions) -> Result<Self, Error> {
        let nodes = options.nodes.unwrap_or_else(|| default_nodes(line.length()));
        if !NODES.contains(&nodes) {
            let (least, most) = (NODES.start(), NODES.end());
            return Err(Error::Options(format!("expected {least} to {most} nodes, found {nodes}")));
        }
        check_start_speed(options.start_speed, line)?;
        let intervals = if line.is_closed() { nodes } else { nodes - 1 };
        let step = line.length() / intervals as f64;
        let stations: Vec<f64> = (0..nodes).map(|k| step * k as f64).collect();
        let roads: Vec<RoadGeometry> = stations.iter().map(|s| line.road_at(*s)).collect();
        let mut deviations = Vec::with_capacity(nodes);
        for (s, road) in stations.iter().zip(&roads) {
            deviations.push(deviation_bounds(line, *s, road, options)?);
        }
        let peaks = car.tire_peaks();
        check_friction(&peaks)?;
        let limits = &car.limits;
        let aero = car.aero.at_rest();
        let drag = 0.5 * aero.rho * aero.area * aero.C_d;
        let top_speed = if drag > 0.0 { (limits.power / drag).cbrt() } else { f64::INFINITY };
        let top_speed = (1.2 * top_speed).clamp(10.0 * SLOWEST, 150.0);
        Ok(LapProblem {
            car,
            closed: line.is_closed(),
            step,
            roads,
            deviations,
            top_speed,
            start_speed: options.start_speed,
            peaks,
        })
    }

    /// Unknowns of a stage in their units.
    pub fn unscaled<const V: usize>(&self, x: &StageVector<V>) -> NodeVariables {
        NodeVariables::from_unknowns(unscaled(x))
    }

    /// Unknowns of a stage without their units.
    pub fn scaled<const V: usize>(&self, z: &NodeVariables) -> StageVector<V> {
        let (z, scale): ([f64; V], [f64; V]) = (z.into_unknowns(), SCALE.into_unknowns());
        StageVector::from_fn(|i, _| z[i] / scale[i])
    }

    /// Where the search for the lap of a car that swings starts: how its body stands at the nodes of a lap without that.
    pub fn with_steady_body(
        &self,
        suspension: &Suspension,
        z: &NodeVariables,
        stage: usize,
    ) -> NodeVariables {
        let attitude = self.car.steady_attitude(suspension, z, &self.roads[stage]);
        NodeVariables { body: Some(BodyMotion { attitude, rates: HeaveRollPitch::default() }), ..*z }
    }

    /// The motion of the car at a node.
    pub fn motion(&self, z: &NodeVariables, stage: usize) -> NodeMotion {
        self.car.motion(z, &self.roads[stage])
    }

    /// Distance of two nodes [m].
    pub fn node_distance(&self) -> f64 {
        self.step
    }

    /// The way along the line that a node stands for [m]: half a step at an end.
    pub fn way(&self, stage: usize) -> f64 {
        let is_end = !self.closed && (stage == 0 || stage + 1 == self.roads.len());
        if is_end { 0.5 * self.step } else { self.step }
    }

    /// Bounds of the lateral deviation at a node [m].
    pub fn deviation_bounds(&self, stage: usize) -> [f64; 2] {
        self.deviations[stage]
    }

    fn functions<T: StageNumber, const V: usize, const S: usize>(
        &self,
        unknowns: [T; V],
        stage: usize,
    ) -> StageFunctions<T, S> {
        let z = NodeVariables::from_unknowns(unknowns);
        let motion = self.car.motion(&z, &self.roads[stage]);
        let [cost] = T::compose([&motion.slowness, &z.delta_rate, &z.F_x_rate], |[slowness, delta, F_x]| {
            let [steering, pedals] = [delta / self.car.limits.delta_rate, F_x / self.car.limits.F_x_rate];
            [slowness * ((steering * steering + pedals * pedals) * SMOOTHNESS + 1.0) * self.way(stage)]
        });
        let body_slopes = motion.body_slopes.map(<[T; 6]>::from);
        let scale: [f64; V] = SCALE.into_unknowns();
        let mut slopes = motion.slopes.into_iter().chain(body_slopes.into_iter().flatten()).zip(scale);
        let beyond_peak = |axle: usize| {
            T::compose([&motion.alphas[axle]], |[alpha]| {
                let share = alpha / self.peaks[axle].alpha;
                [share * share - 1.0]
            })[0]
        };
        StageFunctions {
            cost,
            slopes: std::array::from_fn(|_| slopes.next().map_or(T::zero(), |(slope, scale)| slope / scale)),
            equations: motion.force_residuals,
            inequalities: [
                self.car.excess_power(&motion.power, &motion.wheel_speed),
                beyond_peak(0),
                beyond_peak(1),
            ],
        }
    }

    /// Where the search starts: on the line, by a speed profile that leaves the tires a reserve, with the steady-state angles for it.
    ///
    /// # Errors
    /// Where the car cannot drive the line at all.
    pub fn start(&self, line: &TrackLine) -> Result<Vec<NodeVariables>, Error> {
        let ggv = self.start_diagram()?;
        let bounds = SpeedBounds { start: self.start_speed, ..SpeedBounds::default() };
        let profile = SpeedProfile::fastest_on_line(line, &ggv, &bounds)?;
        let body = self.car.body;
        let weight = body.m * G;
        let aero = self.car.aero.at_rest();
        let stiffness = [0, 1].map(|axle| self.peaks[axle].mu_y * 2.0 / self.peaks[axle].alpha);
        let stage = |k: usize| {
            let s = self.step * k as f64;
            let (v_x, road) = (profile.speed_at(s).max(2.0 * SLOWEST), &self.roads[k]);
            let F_x = body.m * profile.acceleration_at(s) + aero.drag(v_x) + weight * road.grade.sin();
            let alphas = stiffness.map(|it| road.lateral_acceleration(v_x) / G / it);
            let r = v_x * road.kappa;
            let asked = self.car.split_force(F_x);
            let kappa = |axle: usize| {
                let peaks = &self.peaks[axle];
                (asked[axle] / (0.5 * weight * peaks.mu_x * 2.0) * peaks.kappa)
                    .clamp(-peaks.kappa, peaks.kappa)
            };
            let v_y = body.l_r * r - alphas[1] * v_x;
            NodeVariables {
                n: 0.0,
                xi: -v_y / v_x,
                v_x,
                v_y,
                r,
                delta: body.wheelbase() * road.kappa + alphas[0] - alphas[1],
                F_x,
                body: None,
                delta_rate: 0.0,
                F_x_rate: 0.0,
                kappas: [kappa(0), kappa(0), kappa(1), kappa(1)],
                a_y: road.lateral_acceleration(v_x),
            }
        };
        Ok((0..self.roads.len()).map(stage).collect())
    }

    /// What the car reaches for certain, over its speed.
    fn start_diagram(&self) -> Result<GgvDiagram, Error> {
        /// Speeds of the diagram.
        const ROWS: usize = 40;
        let [front, rear] = &self.peaks;
        let (body, limits) = (&self.car.body, &self.car.limits);
        let aero = self.car.aero.at_rest();
        let across = START_GRIP * front.mu_y.min(rear.mu_y);
        let along = START_GRIP * front.mu_x.min(rear.mu_x);
        let drive_share = self.car.drive_front_share.max(1.0 - self.car.drive_front_share);
        let row = |i: usize| {
            let v = self.top_speed * i as f64 / ROWS as f64;
            let downforce = aero.downforce(v).iter().sum::<f64>() / body.m;
            AccelerationLimits {
                lateral: across * (G + downforce).max(0.0),
                drive: (along * 0.5 / drive_share * (G + downforce)).max(0.0),
                brake: (0.8 * along * (G + downforce)).clamp(0.0, limits.brake_force / body.m),
                engine: (self.car.available_power(v) / v.max(1.0)).min(limits.drive_force) / body.m,
                drag: aero.drag(v) / body.m,
                downforce,
                ..AccelerationLimits::at_speed(v)
            }
        };
        Ok(GgvDiagram::new((0..=ROWS).map(row).collect(), 2.0)?)
    }
}

/// Tires without friction under the load of the car leave nothing to search for.
fn check_friction(peaks: &[TirePeaks; 2]) -> Result<(), Error> {
    for (peak, axle) in peaks.iter().zip(["front", "rear"]) {
        let friction = peak.mu_x.min(peak.mu_y);
        if !(friction.is_finite() && friction >= LEAST_FRICTION) {
            return Err(Error::Options(format!(
                "expected tires with a friction of at least {LEAST_FRICTION} under the car, found {friction:.3} at the {axle} axle"
            )));
        }
    }
    Ok(())
}

/// A speed that is too low would be raised, and one of a closed line would do nothing.
fn check_start_speed(speed: Option<f64>, line: &TrackLine) -> Result<(), Error> {
    let Some(speed) = speed else { return Ok(()) };
    if line.is_closed() {
        return Err(Error::Options("a closed line has no start, so there is no start speed".to_owned()));
    }
    if !(speed.is_finite() && speed >= SLOWEST_START) {
        return Err(Error::Options(format!(
            "expected a start speed of at least {SLOWEST_START} m/s, found {speed} m/s"
        )));
    }
    Ok(())
}

/// Nodes every 4 m, as far as that is possible with at least 200 and at most 2000.
fn default_nodes(length: f64) -> usize {
    (length / 4.0).ceil().clamp(200.0, 2000.0) as usize
}

fn deviation_bounds(
    line: &TrackLine,
    s: f64,
    road: &RoadGeometry,
    options: &LapOptions,
) -> Result<[f64; 2], Error> {
    /// Way to both sides of a line that has to be kept [m].
    const LINE_WIDTH: f64 = 0.01;
    let [left, right] = if options.keeps_line {
        [LINE_WIDTH; 2]
    } else {
        let widths = line.widths_at(s).or(options.half_width.map(|half| [half; 2]));
        let Some(widths) = widths else { return Err(Error::NoWidths) };
        widths.map(|width| width - options.margin)
    };
    if left + right < 2.0 * LINE_WIDTH {
        let width = left + right + 2.0 * options.margin;
        return Err(Error::Narrow { s, width, margin: options.margin });
    }
    // The line's own normals must not cross on the road.
    let most = (1.0 - LEAST_RADIUS_SHARE) / road.kappa.abs().max(1e-9);
    let bounds = if road.kappa > 0.0 { [-right, left.min(most)] } else { [-right.min(most), left] };
    if bounds[1] - bounds[0] < 2.0 * LINE_WIDTH {
        return Err(Error::Tight { s, radius: 1.0 / road.kappa.abs() });
    }
    Ok(bounds)
}

impl<const V: usize, const S: usize> StagedProblem<V, S> for LapProblem<'_> {
    fn stages(&self) -> usize {
        self.roads.len()
    }

    fn is_closed(&self) -> bool {
        self.closed
    }

    fn step(&self) -> f64 {
        self.step
    }

    fn bounds(&self, stage: usize) -> StageBounds<V> {
        let limits = &self.car.limits;
        let around = |most: f64| [-most, most];
        let mut v_x = [SLOWEST, self.top_speed];
        if let Some(start) = self.start_speed.filter(|_| !self.closed && stage == 0) {
            v_x[1] = start.min(self.top_speed);
        }
        let body_rate = around(FASTEST_BODY);
        let mut bounds = NodeVariables {
            n: self.deviations[stage],
            xi: around(1.2),
            v_x,
            v_y: around(30.0),
            r: around(6.0),
            delta: around(limits.delta),
            F_x: [-limits.brake_force, limits.drive_force],
            body: Some(BodyMotion {
                attitude: HeaveRollPitch { z: around(MOST_HEAVE), phi: around(STOP), theta: around(STOP) },
                rates: HeaveRollPitch { z: body_rate, phi: body_rate, theta: body_rate },
            }),
            delta_rate: around(limits.delta_rate),
            F_x_rate: around(limits.F_x_rate),
            kappas: [0, 0, 1, 1].map(|axle: usize| around(self.peaks[axle].kappa)),
            a_y: around(MOST_ACCELERATION),
        };
        if !self.closed && stage == 0 {
            // Sideways motion would be speed on top of the one that the start has.
            [bounds.xi, bounds.v_y, bounds.r] = [around(START_TOLERANCE); 3];
        }
        let (bounds, scale): ([[f64; 2]; V], [f64; V]) = (bounds.into_unknowns(), SCALE.into_unknowns());
        let [lower, upper] = [0, 1].map(|side| StageVector::from_fn(|i, _| bounds[i][side] / scale[i]));
        StageBounds { lower, upper }
    }

    fn values(&self, x: &StageVector<V>, stage: usize) -> StageValues<S> {
        let StageFunctions { cost, slopes, equations, inequalities } = self.functions(unscaled(x), stage);
        StageValues {
            cost,
            slopes: slopes.into(),
            equations: equations.into(),
            inequalities: inequalities.into(),
        }
    }

    fn model(&self, x: &StageVector<V>, stage: usize, weights: &StageWeights<S>) -> StageModel<V, S> {
        let (z, scale): ([f64; V], [f64; V]) = (unscaled(x), SCALE.into_unknowns());
        let duals: [StageDual<V>; V] = std::array::from_fn(|i| unknown(z[i], i, scale[i]));
        let StageFunctions { cost, slopes, equations, inequalities } = self.functions(duals, stage);
        let mut hessian = cost.v2.0.unwrap_or_else(SMatrix::zeros);
        let weighted = slopes.iter().zip(&weights.slopes);
        let weighted = weighted.chain(equations.iter().zip(&weights.equations));
        for (function, weight) in weighted.chain(inequalities.iter().zip(&weights.inequalities)) {
            if let Some(curvature) = &function.v2.0 {
                hessian += curvature * *weight;
            }
        }
        StageModel {
            values: StageValues {
                cost: cost.re,
                slopes: slopes.each_ref().map(|it| it.re).into(),
                equations: equations.each_ref().map(|it| it.re).into(),
                inequalities: inequalities.each_ref().map(|it| it.re).into(),
            },
            gradient: gradients(&[cost]).transpose(),
            slopes: gradients(&slopes),
            equations: gradients(&equations),
            inequalities: gradients(&inequalities),
            hessian,
        }
    }
}

/// Unknowns of a stage in their units.
fn unscaled<const V: usize>(x: &StageVector<V>) -> [f64; V] {
    let scale: [f64; V] = SCALE.into_unknowns();
    std::array::from_fn(|i| x[i] * scale[i])
}

/// First derivatives, one function in each row.
fn gradients<const V: usize, const N: usize>(functions: &[StageDual<V>; N]) -> SMatrix<f64, N, V> {
    SMatrix::from_fn(|i, by| functions[i].v1.0.map_or(0.0, |gradient| gradient[by]))
}
