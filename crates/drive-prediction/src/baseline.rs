//! Simple cars by least squares on the forces that accelerations tell: what a fit with more effort has to beat.
#![allow(non_snake_case, reason = "parameters of the Magic Formula are written as in its source")]

use nalgebra::{DMatrix, DVector};
use numerics::sqp::{self, Objective, QuadraticModel, SqpLimits};
use vehicle::VehicleBody;

use crate::curve::AxleCurve;
use crate::drive::EvenDrive;
use crate::lag::first_order_lag;
use crate::predictor::{KinematicModel, MotionPredictor, PersistenceModel};
use crate::single_track::SingleTrack;

/// Slip angles [rad] and forces over static load of one axle.
#[derive(Clone, Debug, Default)]
pub struct AxlePoints {
    /// Slip angles [rad].
    pub slip: Vec<f64>,
    /// Lateral forces over the static load.
    pub force: Vec<f64>,
}

/// The points of both axles in the rows that count:
/// F_yf = (l_r m a_y + I_zz r') / (L cos δ), F_yr = (l_f m a_y − I_zz r') / L.
#[must_use]
pub fn axle_points(drives: &[EvenDrive], body: &VehicleBody, steering_lag: f64) -> [AxlePoints; 2] {
    let mut points: [AxlePoints; 2] = Default::default();
    let VehicleBody { m, I_zz, l_f, l_r, .. } = *body;
    let loads = body.static_loads();
    for drive in drives {
        let steering = first_order_lag(&drive.motion.delta, steering_lag, drive.step);
        for row in (0..drive.row_count()).filter(|row| drive.counts[*row]) {
            let (a_y, r_dot, delta) = (drive.motion.a_y[row], drive.r_dot[row], steering[row]);
            let state = [drive.motion.v_y[row], drive.motion.r[row]];
            let slips = SingleTrack::slip_angles(body, drive.motion.v_x[row], state, delta);
            let front = (l_r * m * a_y + I_zz * r_dot) / (body.wheelbase() * delta.cos());
            let rear = (l_f * m * a_y - I_zz * r_dot) / body.wheelbase();
            for (axle, force) in [front, rear].into_iter().enumerate() {
                points[axle].slip.push(slips[axle]);
                points[axle].force.push(force / loads[axle]);
            }
        }
    }
    points
}

/// The four models that see the same inputs as any other: persistence, kinematic, linear, and the Magic Formula by least squares.
///
/// `steering_lag` [s] is that of the car, known beforehand; 0 where the angle was measured at the wheels.
#[must_use]
pub fn fit_baseline_models(
    drives: &[EvenDrive],
    body: &VehicleBody,
    steering_lag: f64,
) -> Vec<Box<dyn MotionPredictor>> {
    let kinematic = KinematicModel { wheelbase: body.wheelbase(), l_r: body.l_r, steering_lag };
    let points = axle_points(drives, body, steering_lag);
    let linear = points.each_ref().map(fit_linear_curve);
    let magic = points.each_ref().map(magic_formula);
    let car = |name, curves| SingleTrack { name, body: *body, curves, steering_lag };
    vec![
        Box::new(PersistenceModel),
        Box::new(kinematic),
        Box::new(BaselineWithBand::new(car("linear", linear), drives)),
        Box::new(BaselineWithBand::new(car("least squares", magic), drives)),
    ]
}

/// A car whose band has the scatter of the data that it was fitted to.
struct BaselineWithBand {
    car: SingleTrack,
    spread: f64,
}

impl BaselineWithBand {
    fn new(car: SingleTrack, drives: &[EvenDrive]) -> Self {
        let score = crate::score::score_lateral_acceleration(&car, drives);
        Self { car, spread: score.map_or(0.0, |score| score.rmse) }
    }
}

impl MotionPredictor for BaselineWithBand {
    fn name(&self) -> &str {
        self.car.name()
    }

    fn steering_lag(&self) -> f64 {
        self.car.steering_lag
    }

    fn simulate_states(
        &self,
        drive: &EvenDrive,
        steering: &[f64],
        start: usize,
        rows: usize,
    ) -> Vec<crate::predictor::LateralState> {
        self.car.simulate_states(drive, steering, start, rows)
    }

    fn a_y(&self, drive: &EvenDrive, steering: &[f64], row: usize) -> Option<f64> {
        self.car.a_y(drive, steering, row)
    }

    fn a_y_std(&self, _: &EvenDrive, _: usize) -> Option<f64> {
        Some(self.spread)
    }
}

/// The line through points.
fn fit_linear_curve(points: &AxlePoints) -> AxleCurve {
    let n = points.slip.len().max(1) as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
    let (x, y) = (mean(&points.slip), mean(&points.force));
    let (mut xx, mut xy) = (0.0, 0.0);
    for (slip, force) in points.slip.iter().zip(&points.force) {
        xx += (slip - x).powi(2);
        xy += (slip - x) * (force - y);
    }
    let K = if xx > 0.0 { xy / xx } else { 0.0 };
    AxleCurve::Linear { K, S_h: if K == 0.0 { 0.0 } else { y / K - x } }
}

/// Bounds of B, C, D, S_h.
const LOWER: [f64; 4] = [0.5, 0.8, 0.05, -0.1];
const UPPER: [f64; 4] = [60.0, 2.0, 3.0, 0.1];
/// Shapes from which the search starts: B and C.
const STARTS: [[f64; 2]; 3] = [[6.0, 1.3], [12.0, 1.3], [3.0, 1.8]];

/// The Magic Formula without curvature that is nearest to the points, of several starts.
#[must_use]
pub fn magic_formula(points: &AxlePoints) -> AxleCurve {
    let box_of = |bounds: [f64; 4]| DVector::from_row_slice(&bounds);
    let limits = SqpLimits { iterations: 60, target: 1e-8, ..SqpLimits::default() };
    let fit = |[B, C]: [f64; 2]| {
        let start = DVector::from_row_slice(&[B, C, 0.9, 0.0]);
        sqp::minimise_sqp(&MagicFormulaCost(points), &box_of(LOWER), &box_of(UPPER), &start, limits)
    };
    let found = STARTS.map(fit);
    let best = found.iter().min_by(|a, b| a.model.cost.total_cmp(&b.model.cost));
    let [B, C, D, S_h] = best.map_or([6.0, 1.3, 0.9, 0.0], |best| std::array::from_fn(|i| best.x[i]));
    AxleCurve::MagicFormula { B, C, D, S_h }
}

struct MagicFormulaCost<'a>(&'a AxlePoints);

impl Objective for MagicFormulaCost<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let [B, C, D, S_h] = std::array::from_fn(|i| x[i]);
        let mut cost = 0.0;
        let mut gradient = DVector::zeros(4);
        let mut hessian = DMatrix::zeros(4, 4);
        for (slip, force) in self.0.slip.iter().zip(&self.0.force) {
            let z = B * (slip + S_h);
            let (sin, cos) = (C * z.atan()).sin_cos();
            let error = D * sin - force;
            let by_z = D * cos * C / (1.0 + z * z);
            let slope = [by_z * (slip + S_h), D * cos * z.atan(), sin, by_z * B];
            cost += 0.5 * error * error;
            for i in 0..4 {
                gradient[i] += error * slope[i];
                for k in 0..4 {
                    hessian[(i, k)] += slope[i] * slope[k];
                }
            }
        }
        QuadraticModel { cost, gradient, hessian, scale: (2.0 * cost).sqrt() }
    }
}
