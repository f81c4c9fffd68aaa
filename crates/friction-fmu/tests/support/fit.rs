//! Fits curves of axles to slips and forces of logs by least squares.

use nalgebra::{DVector, Matrix4, U4, Vector4};
use numerics::levenberg_marquardt::{
    LevenbergMarquardtOptions, NormalEquations, SquaredCost, minimise_levenberg_marquardt,
};
use vehicle::{G, MagicFormula};

use super::log::Log;

/// Slip angles [rad] and forces over loads of the two axles, row by row.
pub fn axles(log: &Log) -> [Vec<[f64; 2]>; 2] {
    let body = &log.car.body;
    let base = body.l_f + body.l_r;
    let rows = (0..log.v_x.len()).filter(|k| log.ok[*k]);
    let of = |k: usize| {
        let (moment, force) = (body.I_zz * log.r_rate[k], body.m * log.a_y[k]);
        let [front, rear] = slips(log, k);
        let front_force = (body.l_r * force + moment) / base / log.delta[k].cos();
        let rear_force = (body.l_f * force - moment) / base;
        let [load_f, load_r] = [body.l_r, body.l_f].map(|arm| body.m * G * arm / base);
        [[front, front_force / load_f], [rear, rear_force / load_r]]
    };
    let both: Vec<_> = rows.map(of).collect();
    [0, 1].map(|axle| both.iter().map(|row| row[axle]).collect())
}

/// Slip angles [rad] of a row.
pub fn slips(log: &Log, k: usize) -> [f64; 2] {
    let (v, v_y, r, body) = (log.v_x[k], log.v_y[k], log.r[k], &log.car.body);
    [log.delta[k] - (v_y + body.l_f * r).atan2(v), -(v_y - body.l_r * r).atan2(v)]
}

/// The a_y [m/s²] of two curves at the slips of a row.
pub fn a_y(log: &Log, k: usize, curves: &[MagicFormula; 2]) -> f64 {
    let (loads, [front, rear]) = (log.car.body.static_loads(), slips(log, k));
    let front = curves[0].lateral_force(front, loads[0]) * log.delta[k].cos();
    (front + curves[1].lateral_force(rear, loads[1])) / log.car.body.m
}

/// The same tire with a friction and a stiffness over the ones that it has.
pub fn scaled(curve: &MagicFormula, friction: f64, stiffness: f64) -> MagicFormula {
    MagicFormula { B: curve.B * stiffness / friction, D: curve.D * friction, ..*curve }
}

/// Bounds of B, C, D and S_h.
const BOUNDS: [[f64; 2]; 4] = [[0.5, 60.0], [0.8, 2.0], [0.05, 3.0], [-0.1, 0.1]];

/// The curve nearest to points of slip angle and force over load, from the best of three starts.
pub fn curve(points: &[[f64; 2]]) -> MagicFormula {
    let options =
        LevenbergMarquardtOptions { iterations: 60, relative_tolerance: 1e-10, ..Default::default() };
    let starts = [[6.0, 1.3], [12.0, 1.3], [3.0, 1.8]].map(|[B, C]| Vector4::new(B, C, 0.9, 0.0));
    let fits = starts.map(|start| minimise_levenberg_marquardt(&CurveFit(points), start, &options));
    let best = fits.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).expect("three");
    formula(&best.x)
}

fn formula(at: &Vector4<f64>) -> MagicFormula {
    MagicFormula { B: at[0], C: at[1], D: at[2], E: 0.0, S_h: at[3], S_v: 0.0 }
}

struct CurveFit<'a>(&'a [[f64; 2]]);

impl CurveFit<'_> {
    fn residuals(&self, at: &Vector4<f64>) -> DVector<f64> {
        let curve = formula(at);
        let of = |[alpha, force]: &[f64; 2]| curve.friction_coefficient(*alpha) - force;
        DVector::from_iterator(self.0.len(), self.0.iter().map(of))
    }
}

impl SquaredCost<U4> for CurveFit<'_> {
    fn cost(&self, at: &Vector4<f64>) -> f64 {
        self.residuals(at).norm_squared()
    }

    /// By differences.
    fn normal_equations(&self, at: &Vector4<f64>) -> Option<NormalEquations<U4>> {
        let errors = self.residuals(at);
        let columns = [0, 1, 2, 3].map(|i| {
            let width = 1e-6 * (1.0 + at[i].abs());
            let mut near = *at;
            near[i] += width;
            (self.residuals(&near) - &errors) / width
        });
        let matrix = Matrix4::from_fn(|i, j| columns[i].dot(&columns[j]));
        Some(NormalEquations { matrix, gradient: Vector4::from_fn(|i, _| columns[i].dot(&errors)) })
    }

    fn point_after_step(&self, at: &Vector4<f64>, step: &Vector4<f64>) -> Vector4<f64> {
        Vector4::from_fn(|i, _| (at[i] + step[i]).clamp(BOUNDS[i][0], BOUNDS[i][1]))
    }
}
