//! Rates of the filter's state and their derivatives: a single track with load transfer, combined slip, slip errors, grade and bank.
#![allow(non_snake_case, reason = "symbols as in the literature")]

use nalgebra::{SMatrix, SVector};
use vehicle::{G, VehicleBody};

use super::parameters::{AxleTire, SideslipModelParameters};
use super::setup::EstimatorSetup;

/// Number of states.
pub(super) const STATES: usize = 10;
/// The states that do not merely wander: v_x [m/s], v_y [m/s], r [rad/s], heading [rad].
pub(super) const MOVING: usize = 4;
/// Places of the states that wander: grade and bank [m/s²], slip errors of the front, the rear and both axles [rad], trim [rad].
pub(super) const GRADE: usize = 4;
pub(super) const BANK: usize = 5;
pub(super) const SLIP: [usize; 2] = [6, 7];
pub(super) const COMMON: usize = 8;
pub(super) const TRIM: usize = 9;

pub(super) type FilterState = SVector<f64, STATES>;
pub(super) type StateJacobian = SMatrix<f64, MOVING, STATES>;

/// Least share of the static load that an axle keeps, and least share of its force that a longitudinal force leaves.
const LEAST_LOAD: f64 = 0.2;
const LEAST_SHARE: f64 = 0.1;
/// Cornering stiffness over load of a usual tire [1/rad].
const USUAL_STIFFNESS: f64 = 15.0;

/// What acts at an instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilterInput {
    /// Steering angle [rad].
    pub delta: f64,
    /// Its rate [rad/s].
    pub steering_rate: f64,
    /// Longitudinal specific force [m/s²], where it is known.
    pub a_x: Option<f64>,
    /// Lateral gravity by a map of the road [m/s²].
    pub bank: f64,
}

/// The rates of the moving states, the lateral specific force, and their derivatives by the state.
pub(super) struct LinearisedModel {
    pub rates: SVector<f64, MOVING>,
    pub A: StateJacobian,
    pub a_y: f64,
    pub C: FilterState,
}

/// The car with its tires.
pub(super) struct FilterCarModel<'a> {
    pub setup: &'a EstimatorSetup,
    pub parameters: &'a SideslipModelParameters,
    pub tires: [AxleTire; 2],
}

impl<'a> FilterCarModel<'a> {
    pub fn new(setup: &'a EstimatorSetup, parameters: &'a SideslipModelParameters) -> Self {
        Self { setup, parameters, tires: parameters.axle_tires() }
    }

    /// For each axle the force over the car's mass at slip zero and beyond: tires at their loads, with what longitudinal forces leave.
    fn loaded_axle_tires(&self, v_x: f64, a_x: f64) -> [(AxleTire, f64); 2] {
        let VehicleBody { l_f, l_r, .. } = self.setup.body;
        let L = l_f + l_r;
        let shift = a_x * self.parameters.centre_of_gravity_height() / L;
        let pull = a_x + self.setup.drag * v_x * v_x;
        let share = if pull > 0.0 { self.setup.front_drive_share } else { self.setup.front_brake_share };
        let pulls = [pull * share, pull * (1.0 - share)];
        let (rest, moved) = ([G * l_r / L, G * l_f / L], [-shift, shift]);
        std::array::from_fn(|i| {
            let load = (rest[i] + moved[i]).max(LEAST_LOAD * rest[i]);
            let lost = self.parameters.load_sensitivity() * (load / rest[i] - 1.0);
            let mut tire = self.tires[i];
            tire.D *= (1.0 - lost).max(LEAST_SHARE);
            let taken = (pulls[i] / (tire.D * load)).powi(2) * self.parameters.combined_slip();
            (tire, load * (1.0 - taken).max(LEAST_SHARE).sqrt())
        })
    }

    /// Rates and derivatives at a state.
    pub fn linearise(&self, x: &FilterState, input: &FilterInput) -> LinearisedModel {
        let VehicleBody { m, l_f, l_r, .. } = self.setup.body;
        let (v_y, r) = (x[1], x[2]);
        let v_x = x[0].max(self.setup.least_speed);
        let a_x = input.a_x.unwrap_or(0.0);
        let delta = input.delta + x[TRIM];
        let sideways = [v_y + l_f * r, v_y - l_r * r];
        let axles = self.loaded_axle_tires(v_x, a_x);
        let mut force = [0.0; 2];
        let mut by = [FilterState::zeros(); 2];
        for i in 0..2 {
            let (tire, load) = axles[i];
            let steer = if i == 0 { delta } else { 0.0 };
            let slip = steer - sideways[i].atan2(v_x) + x[SLIP[i]] + x[COMMON];
            let along = if i == 0 { delta.cos() } else { 1.0 };
            let [value, slope] = tire.force(slip).map(|it| it * load * along);
            let square = v_x * v_x + sideways[i] * sideways[i];
            force[i] = value;
            by[i][0] = slope * sideways[i] / square;
            by[i][1] = -slope * v_x / square;
            by[i][2] = by[i][1] * [l_f, -l_r][i];
            by[i][SLIP[i]] = slope;
            by[i][COMMON] = slope;
            by[i][TRIM] = if i == 0 { slope - value * delta.tan() } else { 0.0 };
        }
        let ease = m / self.parameters.yaw_inertia();
        let a_y = force[0] + force[1];
        let C = by[0] + by[1];
        let mut A = StateJacobian::zeros();
        for j in 0..STATES {
            A[(1, j)] = C[j];
            A[(2, j)] = ease * (l_f * by[0][j] - l_r * by[1][j]);
        }
        (A[(1, 0)], A[(1, 2)]) = (A[(1, 0)] - r, A[(1, 2)] - v_x);
        A[(1, BANK)] = -1.0;
        A[(3, 2)] = 1.0;
        let pushed = input.a_x.map_or(0.0, |a_x| {
            (A[(0, 1)], A[(0, 2)], A[(0, GRADE)]) = (r, v_y, -1.0);
            a_x * (1.0 - self.parameters.pitch_gain()) + r * v_y - x[GRADE]
        });
        let turning = ease * (l_f * force[0] - l_r * force[1]);
        let sliding = a_y - v_x * r - x[BANK] - input.bank;
        LinearisedModel { rates: SVector::from([pushed, sliding, turning, r]), A, a_y, C }
    }

    /// About the fastest rate at which v_y and r settle [1/s]: sets the step of integration. It knows nothing of the unknowns, by which a
    /// likelihood must be smooth.
    pub fn fastest_settling_rate(&self, v_x: f64) -> f64 {
        let VehicleBody { m, I_zz, l_f, l_r, .. } = self.setup.body;
        let slope = USUAL_STIFFNESS * G / v_x.max(self.setup.least_speed);
        // Loads of the axles are as l_r to l_f: l_f² l_r / L + l_r² l_f / L = l_f l_r.
        (m / I_zz * slope * l_f * l_r).max(slope)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::super::parameters::fit_unknowns;
    use super::*;

    #[test]
    fn derivatives_are_those_of_differences() {
        let setup =
            EstimatorSetup::road_car(VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.45 });
        let parameters = SideslipModelParameters(fit_unknowns(&setup, true).map(|it| it.start));
        let car = FilterCarModel::new(&setup, &parameters);
        let mut x = FilterState::zeros();
        x.copy_from_slice(&[30.0, -0.4, 0.3, 1.0, 0.1, 0.2, 0.003, -0.002, 0.001, 0.002]);
        for a_x in [None, Some(3.0), Some(-7.0)] {
            let input = FilterInput { delta: 0.06, steering_rate: 0.0, a_x, bank: 0.1 };
            let at = car.linearise(&x, &input);
            for j in 0..STATES {
                let moved = |step: f64| {
                    let mut x = x;
                    x[j] += step;
                    car.linearise(&x, &input)
                };
                let [low, high] = [moved(-1e-6), moved(1e-6)];
                for i in 0..MOVING {
                    let slope = (high.rates[i] - low.rates[i]) / 2e-6;
                    // Loads follow the speed through drag, which the derivative leaves out.
                    let near = if j == 0 { 2e-2 } else { 1e-5 };
                    assert_relative_eq!(at.A[(i, j)], slope, max_relative = near, epsilon = near);
                }
                if j > 0 {
                    let slope = (high.a_y - low.a_y) / 2e-6;
                    assert_relative_eq!(at.C[j], slope, max_relative = 1e-5, epsilon = 1e-5);
                }
            }
        }
    }
}
