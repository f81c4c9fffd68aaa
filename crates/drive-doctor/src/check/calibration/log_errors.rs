//! The systematic errors that show in a log: what each adds to the relations of the motion, to first order, and how it is reported.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;
use preparation::{ErrorDescription, ErrorKind, SystematicError};

use super::terms::{MotionRelation, SmoothedSignals};
use crate::correction::LogCorrection;

/// The largest error of a kind that is one to first order.
pub(super) fn largest_first_order_error(kind: ErrorKind) -> f64 {
    match kind {
        ErrorKind::Delay => 0.2,
        ErrorKind::Gain => 0.3,
        ErrorKind::MountingAngle => 0.1,
        ErrorKind::Offset
        | ErrorKind::Lever
        | ErrorKind::RelaxationLength
        | ErrorKind::CarParameter
        | ErrorKind::RoadOrTire
        | ErrorKind::ClockDrift
        | ErrorKind::LowPass
        | ErrorKind::Roll => 5.0,
    }
}

/// The smallest error that matters.
pub(super) fn smallest_relevant_error(error: SystematicError) -> f64 {
    error.describe().least.unwrap_or(f64::INFINITY)
}

/// The scale of the steering.
pub(super) const STEERING_GAIN: usize = 1;

/// The error that is a constant in the slips of both axles.
pub(super) const CONSTANT: usize = 6;

/// The delay of the lateral acceleration.
pub(super) const A_Y_DELAY: usize = 10;

/// The delays of `v_y`, `r` and `a_y`.
pub(super) const DELAYS: [usize; 3] = [4, 7, A_Y_DELAY];

/// The relaxation length of the tires.
pub(super) const RELAXATION: usize = 14;

/// All errors that are looked for; the relaxation length is that of both axles.
pub(super) const LOG_ERRORS: [SystematicError; 15] = [
    SystematicError::SteeringOffset,
    SystematicError::SteeringGain,
    SystematicError::SteeringDelay,
    SystematicError::SideslipLever,
    SystematicError::SideslipDelay,
    SystematicError::SideslipGain,
    SystematicError::SideslipOffset,
    SystematicError::YawRateDelay,
    SystematicError::YawRateOffset,
    SystematicError::YawRateGain,
    SystematicError::AccelerationDelay,
    SystematicError::AccelerationOffset,
    SystematicError::AccelerationGain,
    SystematicError::AccelerationLever,
    SystematicError::RelaxationFront,
];

/// What one unit of the error adds to a relation; `None` where it adds nothing. `compliance` is the slip of the axle by its
/// force in each row [rad/(m/s²)], `arm` the distance to it [m].
pub(super) fn effect_column(
    error: SystematicError,
    relation: MotionRelation,
    terms: &SmoothedSignals,
    compliance: &[f64],
    arm: Option<f64>,
) -> Option<Vec<f64>> {
    use ErrorKind::{Delay, Gain, Lever, MountingAngle, Offset, RelaxationLength};
    use MotionRelation::{Front, Rear, RigidBody};
    let rows = terms.v_x[0].len();
    let map = |f: &dyn Fn(usize) -> f64| Some((0..rows).map(f).collect::<Vec<f64>>());
    let times = |column: &[f64], factor: f64| Some(column.iter().map(|x| factor * x).collect::<Vec<f64>>());
    // The front's slip goes against v_y, the rear's with it.
    let side = if relation == Front { -1.0 } else { 1.0 };
    let ErrorDescription { channel, kind, .. } = *error.describe();
    match (channel, kind, relation) {
        ("delta", Offset, Front) => Some(vec![1.0; rows]),
        // Without the distance to the axle a scale is told from that distance by the bend of the tires' curve alone.
        ("delta", Gain, Front) => arm.map(|_| terms.delta[0].clone()),
        ("delta", Delay, Front) => times(&terms.delta[1], -1.0),
        ("v_y", Lever, RigidBody) => times(&terms.r[1], -1.0),
        ("v_y", Lever, _) => times(&terms.curvature[0], side),
        ("v_y", Delay, RigidBody) => Some(terms.v_y[1].clone()),
        ("v_y", Delay, _) => times(&terms.sideslip[1], -side),
        // In the axles' slips the noise of v_y would look like a scale.
        ("v_y", Gain, RigidBody) => times(&terms.v_y[0], -1.0),
        ("v_y", MountingAngle, RigidBody) => times(&terms.v_x[1], -1.0),
        ("v_y", MountingAngle, _) => Some(vec![side; rows]),
        ("r", Delay, RigidBody) => map(&|k| terms.v_x[0][k] * terms.r[1][k]),
        ("r", Delay, _) => times(&terms.curvature[1], arm?),
        ("r", Offset, RigidBody) => times(&terms.v_x[0], -1.0),
        ("r", Offset, _) => map(&|k| -arm.unwrap_or(0.0) / terms.v_x[0][k]),
        ("r", Gain, RigidBody) => times(&terms.turn[0], -1.0),
        ("r", Gain, _) => times(&terms.curvature[0], -arm?),
        ("a_y", Delay, RigidBody) => map(&|k| -terms.turn[1][k] - terms.v_y[1][k]),
        ("a_y", Delay, _) => map(&|k| -side * compliance[k] * terms.a_y[1][k]),
        ("a_y", Offset, RigidBody) => Some(vec![1.0; rows]),
        ("a_y", Offset, _) => map(&|k| side * compliance[k]),
        ("a_y", Gain, RigidBody) => map(&|k| terms.turn[0][k] + terms.v_y[0][k]),
        ("a_y", Lever, RigidBody) => Some(terms.r[1].clone()),
        // v_y − l r = −v_x k (F + (length/v_x) F'): the force follows the slip.
        ("tires", RelaxationLength, Rear | Front) => {
            let rate = |k: usize| terms.a_y[1][k] - side * arm.unwrap_or(0.0) * terms.r[2][k];
            map(&|k| -side * compliance[k] * rate(k) / terms.v_x[0][k])
        }
        _ => None,
    }
}

/// Name of the check.
pub(super) fn check_name(error: SystematicError) -> String {
    let kind = match error.describe().kind {
        ErrorKind::Delay => "delay",
        ErrorKind::Gain => "scale",
        ErrorKind::Offset => "offset",
        ErrorKind::Lever => "arm",
        ErrorKind::MountingAngle => "angle",
        ErrorKind::RelaxationLength => "relaxation",
        ErrorKind::CarParameter
        | ErrorKind::RoadOrTire
        | ErrorKind::ClockDrift
        | ErrorKind::LowPass
        | ErrorKind::Roll => "parameter",
    };
    format!("{}_{kind}", error.describe().channel)
}

/// The error in a sentence.
pub(super) fn describe_size(error: SystematicError, value: f64, [low, high]: [f64; 2]) -> String {
    let ErrorDescription { channel, kind, title, unit, .. } = *error.describe();
    let sign = value.signum();
    let (low, high) = if sign < 0.0 { (-high, -low) } else { (low, high) };
    let text = |factor: f64| {
        let [value, low, high] = [value.abs(), low, high].map(|x| format_significant(factor * x, 2));
        (value, format!("[{low}, {high}]"))
    };
    let more = if value > 0.0 { "more" } else { "less" };
    match kind {
        ErrorKind::Delay => {
            let (value, interval) = text(1e3);
            let late = if sign > 0.0 { "late" } else { "early" };
            format!("`{channel}` is {value} ms {interval} {late}.")
        }
        ErrorKind::Gain => {
            let (value, interval) = text(100.0);
            let of = if channel == "a_y" { "; roll of the body adds some per cent too" } else { "" };
            format!("`{channel}` reads {value} % {interval} {more} than the other channels say{of}.")
        }
        ErrorKind::Offset if channel == "a_y" => {
            let (value, interval) = text(1.0);
            format!(
                "`a_y` reads {value} m/s2 {interval} {more} than v_x r + v_y' on average: an offset, or a road that falls to one side."
            )
        }
        ErrorKind::Offset => {
            let (value, interval) = text(180.0 / std::f64::consts::PI);
            let unit = if channel == "r" { "deg/s" } else { "deg" };
            let much = if value.is_empty() || sign > 0.0 { "much" } else { "little" };
            format!("`{channel}` reads {value} {unit} {interval} too {much}.")
        }
        ErrorKind::Lever => {
            let (value, interval) = text(1.0);
            let place = if sign > 0.0 { "ahead of" } else { "behind" };
            format!("`{channel}` is measured {value} m {interval} {place} the centre of gravity.")
        }
        ErrorKind::MountingAngle => {
            let (value, interval) = text(180.0 / std::f64::consts::PI);
            let side = if sign > 0.0 { "right" } else { "left" };
            format!("The sensor of `{channel}` is turned by {value} deg {interval} to the {side}.")
        }
        ErrorKind::RelaxationLength => {
            let (value, interval) = text(1.0);
            format!("The forces follow the slips after {value} m {interval} of rolling.")
        }
        ErrorKind::CarParameter
        | ErrorKind::RoadOrTire
        | ErrorKind::ClockDrift
        | ErrorKind::LowPass
        | ErrorKind::Roll => {
            let (value, interval) = text(1.0);
            format!("The {title} is {value} {unit} {interval}.")
        }
    }
}

/// What the error does to the tires.
pub(super) fn error_consequence(error: SystematicError) -> &'static str {
    match (error.describe().channel, error.describe().kind) {
        ("delta", ErrorKind::Offset) | ("v_y", ErrorKind::MountingAngle) => {
            "The curve is shifted along the slip: stiffness and curvature E make up for it."
        }
        ("delta", ErrorKind::Gain) => {
            "The front slip is wrong by this share, the front stiffness against it."
        }
        ("v_y", ErrorKind::Gain) => "Both slips are wrong by this share.",
        ("v_y", ErrorKind::Lever) => "Both slips get a part of the yaw rate: C and E are far off.",
        ("a_y", ErrorKind::Offset | ErrorKind::Gain) => "D and K are wrong by what the forces are.",
        ("a_y", ErrorKind::Lever) => "Forces get a part of the yaw acceleration.",
        ("r", ErrorKind::Offset | ErrorKind::Gain) => "Both slips and the equilibrium of forces are wrong.",
        (_, ErrorKind::RelaxationLength) => "In fast manoeuvres the stiffness comes out too small.",
        _ => "Slip and force are those of different moments: C and E follow the hysteresis that this makes.",
    }
}

/// Unit of the figure; `1` of a share.
pub(super) fn error_unit(error: SystematicError) -> &'static str {
    match error.describe().unit {
        "-" => "1",
        unit => unit,
    }
}

/// What corrects it.
pub(super) fn error_correction(error: SystematicError, value: f64) -> LogCorrection {
    let ErrorDescription { channel, kind, .. } = *error.describe();
    if let Some(key) = error.correction_key(value, 0.0) {
        let correction = LogCorrection::from_column_keys(&[key.into()]);
        return match kind {
            ErrorKind::Offset => correction
                .with_note(format!("in {}: convert it where the column has another unit", error_unit(error))),
            _ => correction,
        };
    }
    let number = format_significant(value.abs(), 3);
    // Less what is too much.
    let sign = if value > 0.0 { "less" } else { "plus" };
    match kind {
        ErrorKind::Lever => {
            let with = if channel == "v_y" { "r" } else { "the derivative of r" };
            LogCorrection::from_advice(format!("Give `{channel}` {sign} {number} m times {with}."))
        }
        ErrorKind::MountingAngle => {
            LogCorrection::from_advice(format!("Give `v_y` {sign} {number} times v_x."))
        }
        _ => LogCorrection::from_advice("It is no error of the log: let the fit estimate it."),
    }
}
