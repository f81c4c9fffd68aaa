//! Tabulates what of a tire depends on the load almost alone: its radii and relaxation lengths.
//!
//! They are small corrections that the formulas give at the price of half a force; a table keeps them out of every step.
#![allow(non_snake_case, reason = "radii are written as in the equations")]

use tire::{Number, RelaxationLengths, Tire, TireForces, TireOperatingPoint};

use super::rims::RimParameters;

/// Intervals of the table.
const INTERVALS: usize = 96;

/// Highest load of the table, in units of the wheel's load at rest. Above it values stay.
const HIGHEST: f64 = 6.0;

/// Speeds [m/s] at which the radii are found: how much they grow follows from both.
const SPEEDS: [f64; 2] = [20.0, 60.0];

/// Effective and loaded radius and both relaxation lengths [m] over the load, between even points by cubics that join
/// smoothly (Catmull and Rom). Camber and pressure are those of a wheel that stands upright on its own pressure.
#[derive(Clone, Debug)]
pub(crate) struct RadiusAndRelaxationTable {
    per_newton: f64,
    /// R_e, R_l, σ_κ, σ_α at each point, and one point more on either side.
    points: Vec<[f64; 4]>,
    /// Growth of the radii with the square of the wheel speed [m s²].
    growth: f64,
}

impl RadiusAndRelaxationTable {
    /// The table of a tire around a load at rest [N].
    pub fn new<W: Tire<f64>>(tire: &W, rims: &RimParameters, load: f64) -> Self {
        let step = HIGHEST * load / INTERVALS as f64;
        let radii = |F_z: f64, v_x: f64| {
            let slip = TireOperatingPoint { F_z, v_x, ..TireOperatingPoint::default() };
            let known = |radius: Option<f64>| radius.filter(|radius| radius.is_finite() && *radius > 0.0);
            let R_e = known(tire.effective_radius(&slip)).unwrap_or(rims.radius);
            let R_l = known(tire.loaded_radius(&slip, &TireForces::default())).unwrap_or(R_e);
            [R_e, R_l]
        };
        let [slow, fast] = SPEEDS.map(|v| (radii(load, v)[0], v));
        let omega = |(R_e, v): (f64, f64)| v / R_e;
        let growth = (fast.0 - slow.0) / (omega(fast).powi(2) - omega(slow).powi(2));
        let point = |i: usize| {
            let F_z = step * (i.clamp(1, INTERVALS + 1) - 1) as f64;
            let slip = TireOperatingPoint { F_z, v_x: SPEEDS[0], ..TireOperatingPoint::default() };
            let [R_e, R_l] = radii(F_z, SPEEDS[0]).map(|R| R - growth * omega(slow).powi(2));
            let [sigma_x, sigma_y] = bounded_relaxation_lengths(tire.relaxation(&slip), rims.relaxation_min);
            [R_e, R_l, sigma_x, sigma_y]
        };
        let points = (0..INTERVALS + 3).map(point).collect();
        Self { per_newton: 1.0 / step, points, growth }
    }

    /// Effective radius, loaded radius and both relaxation lengths [m] at a load [N] and a wheel speed [rad/s].
    #[inline]
    pub fn radii_and_relaxation_lengths<T: Number>(&self, F_z: T, omega: T) -> [T; 4] {
        let x = F_z * self.per_newton;
        // A load that is no number ends in the first interval, and stays no number.
        let i = (x.re() as usize).min(INTERVALS - 1);
        let s = if x > INTERVALS as f64 { T::one() } else { x - i as f64 };
        let [p, q, r, t] = [0, 1, 2, 3].map(|k| &self.points[i + k]);
        let growth = omega * omega * self.growth;
        std::array::from_fn(|k| {
            let (a, b) = (0.5 * (r[k] - p[k]), 0.5 * (t[k] - q[k]));
            let rise = r[k] - q[k];
            let value = ((s * (a + b - 2.0 * rise) + (3.0 * rise - 2.0 * a - b)) * s + a) * s + q[k];
            if k < 2 { value + growth } else { value }
        })
    }
}

/// Relaxation lengths [m] that a car can be integrated with: finite, and not below the shortest.
fn bounded_relaxation_lengths(relaxation: RelaxationLengths, least: f64) -> [f64; 2] {
    [relaxation.x, relaxation.y].map(|length| if length.is_finite() { length.max(least) } else { least })
}
