//! Fits curves of axles to slips and forces of logs by least squares.

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
    let starts = [[6.0, 1.3], [12.0, 1.3], [3.0, 1.8]];
    let fits = starts.map(|[B, C]| least_squares([B, C, 0.9, 0.0], &BOUNDS, |p| residuals(p, points)));
    let best = fits.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("three");
    formula(&best.0)
}

fn formula(&[B, C, D, S_h]: &[f64; 4]) -> MagicFormula {
    MagicFormula { B, C, D, E: 0.0, S_h, S_v: 0.0 }
}

fn residuals(parameters: &[f64; 4], points: &[[f64; 2]]) -> Vec<f64> {
    let curve = formula(parameters);
    points.iter().map(|[alpha, force]| curve.friction_coefficient(*alpha) - force).collect()
}

/// Parameters within bounds with the least sum of squares, and that: Levenberg and Marquardt with differences.
pub fn least_squares<const N: usize>(
    start: [f64; N],
    bounds: &[[f64; 2]; N],
    residuals: impl Fn(&[f64; N]) -> Vec<f64>,
) -> ([f64; N], f64) {
    let cost = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
    let (mut at, mut damping) = (start, 1e-3);
    let mut errors = residuals(&at);
    let mut best = cost(&errors);
    for _ in 0..60 {
        let (mut normal, mut gradient) = ([[0.0; N]; N], [0.0; N]);
        let columns: [Vec<f64>; N] = std::array::from_fn(|i| {
            let width = 1e-6 * (1.0 + at[i].abs());
            let mut near = at;
            near[i] += width;
            residuals(&near).iter().zip(&errors).map(|(b, a)| (b - a) / width).collect()
        });
        for i in 0..N {
            gradient[i] = columns[i].iter().zip(&errors).map(|(a, b)| a * b).sum();
            for j in 0..N {
                normal[i][j] = columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum();
            }
        }
        let before = best;
        for _ in 0..8 {
            let mut system = normal;
            (0..N).for_each(|i| system[i][i] *= 1.0 + damping);
            let step = solve(system, gradient);
            let next = std::array::from_fn(|i| (at[i] - step[i]).clamp(bounds[i][0], bounds[i][1]));
            let tried = residuals(&next);
            if cost(&tried) < best {
                (at, best, errors) = (next, cost(&tried), tried);
                damping *= 0.3;
                break;
            }
            damping *= 5.0;
        }
        if before - best <= 1e-10 * before {
            break;
        }
    }
    (at, best)
}

/// Gauss's elimination of a positive definite system.
fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for i in 0..N {
        for k in i + 1..N {
            let factor = matrix[k][i] / matrix[i][i];
            let row = matrix[i];
            (i..N).for_each(|j| matrix[k][j] -= factor * row[j]);
            right[k] -= factor * right[i];
        }
    }
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|j| matrix[i][j] * right[j]).sum();
        right[i] = (right[i] - known) / matrix[i][i];
    }
    right
}
