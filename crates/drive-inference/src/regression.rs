//! Fits both tires to points by least squares: residuals that are linear in the friction coefficients, given slip and load.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use numerics::sqp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tire_inference::axles::{Axle, Axles};
use tire_inference::kernel::friction_and_gradient;
use tire_inference::parameters::{COUNT, Theta};
use vehicle::VehicleBody;

use crate::points::{InputResponse, RegressionPoint};
use crate::regularisation::TireRegularisation;
use crate::tires::{SIZE, from_vector, parameter_block};

/// Parameters of both tires and three odd residual terms of the lateral acceleration.
pub const COLUMNS: usize = SIZE + 3;
type GradientRow = [f64; COLUMNS];

/// What the tires have to explain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RegressionTarget {
    /// The lateral acceleration of smoothed states: lumped disturbances as a virtual force sensor.
    SmoothedAcceleration,
    /// The measured lateral acceleration.
    Acceleration,
    /// The lateral forces of the axles, of smoothed states.
    AxleForces,
    /// The measured lateral acceleration, and the change of the measured yaw rate over a window as the integral of the yaw
    /// moment.
    AccelerationAndYaw,
}

/// Weights of residuals in fits to smoothed states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ResidualWeights {
    /// The same weight for all residuals of a kind.
    Plain,
    /// Inverse to the variance of the smoothed state.
    Variance {
        /// Lower limit of the variance over the mean variance [-].
        clamp: f64,
    },
}

/// Samples over which the yaw moment is integrated.
const WINDOW: usize = 20;

/// Residuals over stretches of points.
pub struct TireRegression<'a> {
    /// Masses and lengths.
    pub body: VehicleBody,
    /// Points of each recording.
    pub points: &'a [Vec<RegressionPoint>],
    /// Stretches that are used: recording and samples.
    pub blocks: Vec<(usize, Range<usize>)>,
    /// What is fitted.
    pub target: RegressionTarget,
    /// How residuals are weighed.
    pub weights: ResidualWeights,
    /// Standard deviations of the residuals: accelerations [m/s²], yaw-rate changes [rad/s], front and rear forces [N].
    pub std: [f64; 4],
    /// Whether the odd terms are free.
    pub odd_terms: bool,
    /// What is expected of the tires.
    pub expected: TireRegularisation,
}

/// Sums of squares while they grow.
struct RegressionSums {
    cost: f64,
    gradient: GradientRow,
    hessian: [GradientRow; COLUMNS],
    squares: [f64; 4],
    counts: [usize; 4],
}

impl RegressionSums {
    #[inline(always)]
    fn add_residual(&mut self, kind: usize, residual: f64, by: &GradientRow, weight: f64) {
        self.cost += 0.5 * weight * residual * residual;
        self.squares[kind] += residual * residual;
        self.counts[kind] += 1;
        for (i, by_i) in by.iter().enumerate() {
            let weighted = weight * by_i;
            self.gradient[i] += weighted * residual;
            for (sum, by_j) in self.hessian[i].iter_mut().zip(by) {
                *sum += weighted * by_j;
            }
        }
    }
}

/// A value with its derivatives.
#[derive(Clone, Copy)]
struct WithGradient<const N: usize> {
    value: f64,
    gradient: [f64; N],
}

impl<const N: usize> WithGradient<N> {
    const ZERO: Self = Self { value: 0.0, gradient: [0.0; N] };
}

/// Friction coefficient at a slip, with derivatives by the parameters of the tire.
#[inline(always)]
fn friction_coefficient(tire: &Theta, slip: f64) -> WithGradient<COUNT> {
    let (value, gradient) = friction_and_gradient(tire, slip);
    WithGradient { value, gradient }
}

/// A sum of axle forces, with derivatives by the parameters of both tires.
#[inline(always)]
fn combined_axle_force(
    share_f: f64,
    share_r: f64,
    f: &WithGradient<COUNT>,
    r: &WithGradient<COUNT>,
) -> WithGradient<COLUMNS> {
    let mut by = [0.0; COLUMNS];
    let [front, rear] = [parameter_block(Axle::Front).start, parameter_block(Axle::Rear).start];
    for i in 0..4 {
        by[front + i] = share_f * f.gradient[i];
        by[rear + i] = share_r * r.gradient[i];
    }
    WithGradient { value: share_f * f.value + share_r * r.value, gradient: by }
}

impl TireRegression<'_> {
    /// Root mean squares of the residuals of each kind at these parameters; those that do not occur stay as they are.
    pub fn rms_residuals(&self, x: &DVector<f64>) -> [f64; 4] {
        let sums = self.accumulate_sums(x);
        std::array::from_fn(|i| match sums.counts[i] {
            0 => self.std[i],
            count => (sums.squares[i] / count as f64).sqrt(),
        })
    }

    fn accumulate_sums(&self, x: &DVector<f64>) -> RegressionSums {
        let mut sums = RegressionSums {
            cost: 0.0,
            gradient: [0.0; COLUMNS],
            hessian: [[0.0; COLUMNS]; COLUMNS],
            squares: [0.0; 4],
            counts: [0; 4],
        };
        let tires = from_vector(x).map(|tire| tire.to_theta());
        let odd: [f64; 3] = std::array::from_fn(|i| if self.odd_terms { x[SIZE + i] } else { 0.0 });
        for (recording, range) in &self.blocks {
            let points = &self.points[*recording][range.clone()];
            pulp::Arch::new().dispatch(StretchAccumulator { of: self, points, tires, odd, sums: &mut sums });
        }
        sums
    }

    /// Weight of a residual of a kind, given the variance of what is fitted.
    #[inline(always)]
    fn residual_weight(&self, kind: usize, variance: f64) -> f64 {
        let plain = self.std[kind] * self.std[kind];
        match self.weights {
            ResidualWeights::Plain => 1.0 / plain,
            ResidualWeights::Variance { clamp } => 1.0 / variance.max(clamp * plain),
        }
    }
}

/// One stretch; a type of its own as [`crate::likelihood`] explains.
struct StretchAccumulator<'a> {
    of: &'a TireRegression<'a>,
    points: &'a [RegressionPoint],
    tires: Axles<Theta>,
    odd: [f64; 3],
    sums: &'a mut RegressionSums,
}

impl pulp::WithSimd for StretchAccumulator<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { of, points, tires, odd, sums } = self;
        let yaw = of.target == RegressionTarget::AccelerationAndYaw;
        // Integral of the yaw moment over I_zz since the start of the stretch, with derivatives, at the last samples.
        let mut integrals = [WithGradient::<COLUMNS>::ZERO; WINDOW];
        let mut integral = WithGradient::<COLUMNS>::ZERO;
        let mut rate_after = WithGradient::<COLUMNS>::ZERO;
        for (k, point) in points.iter().enumerate() {
            let rear = friction_coefficient(&tires.rear, point.alpha_r);
            let front = friction_coefficient(&tires.front, point.before.alpha_f);
            if of.target == RegressionTarget::AxleForces {
                add_force_residuals(of, point, &front, &rear, sums);
                continue;
            }
            add_acceleration_residuals(of, point, &front, &rear, &odd, sums);
            if !yaw {
                continue;
            }
            if k > 0 {
                let rate_before = yaw_acceleration(&of.body, &point.before, &front, &rear);
                let half = 0.5 * points[k - 1].h;
                integral.value += half * (rate_after.value + rate_before.value);
                for i in 0..SIZE {
                    integral.gradient[i] += half * (rate_after.gradient[i] + rate_before.gradient[i]);
                }
            }
            if k >= WINDOW {
                let from = &integrals[k % WINDOW];
                let change = point.measured[1] - points[k - WINDOW].measured[1];
                let mut by = integral.gradient;
                for (by, from) in by.iter_mut().zip(&from.gradient) {
                    *by -= from;
                }
                sums.add_residual(1, integral.value - from.value - change, &by, of.std[1].powi(-2));
            }
            integrals[k % WINDOW] = integral;
            let front = friction_coefficient(&tires.front, point.after.alpha_f);
            rate_after = yaw_acceleration(&of.body, &point.after, &front, &rear);
        }
    }
}

/// Yaw acceleration [rad/s²], with derivatives.
#[inline(always)]
fn yaw_acceleration(
    body: &VehicleBody,
    side: &InputResponse,
    f: &WithGradient<COUNT>,
    r: &WithGradient<COUNT>,
) -> WithGradient<COLUMNS> {
    let share_f = body.l_f * side.F_z[0] * side.cos / body.I_zz;
    let mut rate = combined_axle_force(share_f, -body.l_r * side.F_z[1] / body.I_zz, f, r);
    rate.value += body.l_f * side.braking / body.I_zz;
    rate
}

#[inline(always)]
fn add_acceleration_residuals(
    of: &TireRegression,
    point: &RegressionPoint,
    f: &WithGradient<COUNT>,
    r: &WithGradient<COUNT>,
    odd: &[f64; 3],
    sums: &mut RegressionSums,
) {
    let (side, m) = (&point.before, of.body.m);
    let WithGradient { value: force, gradient: mut by } =
        combined_axle_force(side.F_z[0] * side.cos / m, side.F_z[1] / m, f, r);
    let mut residual = force + side.braking / m;
    for i in 0..3 {
        residual += odd[i] * point.odd[i];
        by[SIZE + i] = if of.odd_terms { point.odd[i] } else { 0.0 };
    }
    let smoothed = of.target == RegressionTarget::SmoothedAcceleration;
    residual -= if smoothed { point.a_y[0] } else { point.measured[0] };
    // What was measured has its own noise as well.
    let own = if smoothed { 0.0 } else { of.std[0] * of.std[0] };
    sums.add_residual(0, residual, &by, of.residual_weight(0, own + point.a_y[1]));
}

#[inline(always)]
fn add_force_residuals(
    of: &TireRegression,
    point: &RegressionPoint,
    f: &WithGradient<COUNT>,
    r: &WithGradient<COUNT>,
    sums: &mut RegressionSums,
) {
    let side = &point.before;
    let shares = [[side.F_z[0] * side.cos, 0.0], [0.0, side.F_z[1]]];
    for (axle, [share_f, share_r]) in shares.into_iter().enumerate() {
        let [target, variance] = point.forces[axle];
        let known = if axle == 0 { side.braking } else { 0.0 };
        let WithGradient { value: force, gradient: by } = combined_axle_force(share_f, share_r, f, r);
        sums.add_residual(2 + axle, force + known - target, &by, of.residual_weight(2 + axle, variance));
    }
}

impl sqp::Objective for TireRegression<'_> {
    fn model(&self, x: &DVector<f64>) -> sqp::QuadraticModel {
        let sums = self.accumulate_sums(x);
        let n = x.len();
        let rows: usize = sums.counts.iter().sum();
        let mut model = sqp::QuadraticModel {
            cost: sums.cost,
            gradient: DVector::from_fn(n, |i, _| sums.gradient[i]),
            hessian: DMatrix::from_fn(n, n, |i, j| sums.hessian[i][j]),
            scale: (rows as f64).sqrt().max((2.0 * sums.cost).sqrt()),
        };
        self.expected.add_to_model(x, &mut model);
        model
    }
}
