//! Lists errors of sensors with what each adds to the relations of the motion, to first order.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::significant;

use super::terms::{Relation, Terms};
use crate::correction::{Correction, Key};

/// What is wrong with a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Time by which it is late [s].
    Delay,
    /// Share by which it reads too much.
    Scale,
    /// What it reads at zero, in its unit.
    Offset,
    /// Distance of the sensor ahead of the centre of gravity [m].
    Arm,
    /// Angle by which the sensor is turned about the vertical axis [rad].
    Angle,
    /// Distance that the tires roll until their force follows the slip [m]: no error of the log, but it looks like one.
    Relaxation,
}

/// An error of a channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cause {
    pub channel: &'static str,
    pub kind: Kind,
    /// The smallest that matters.
    pub least: f64,
}

impl Kind {
    /// Beyond this it is another error than the one to first order.
    pub fn most(self) -> f64 {
        match self {
            Kind::Delay => 0.2,
            Kind::Scale => 0.3,
            Kind::Offset | Kind::Arm | Kind::Relaxation => 5.0,
            Kind::Angle => 0.1,
        }
    }
}

const fn cause(channel: &'static str, kind: Kind, least: f64) -> Cause {
    Cause { channel, kind, least }
}

/// The error that is a constant in the slips of both axles.
pub(super) const CONSTANT: usize = 6;

/// The delay of the lateral acceleration.
pub(super) const A_Y_DELAY: usize = 10;

/// All errors that are looked for.
pub(super) const CAUSES: [Cause; 15] = [
    cause("delta", Kind::Offset, 0.0015),
    cause("delta", Kind::Scale, 0.03),
    cause("delta", Kind::Delay, 0.008),
    cause("v_y", Kind::Arm, 0.1),
    cause("v_y", Kind::Delay, 0.008),
    cause("v_y", Kind::Scale, 0.05),
    cause("v_y", Kind::Angle, 0.003),
    cause("r", Kind::Delay, 0.008),
    cause("r", Kind::Offset, 0.004),
    cause("r", Kind::Scale, 0.02),
    cause("a_y", Kind::Delay, 0.008),
    cause("a_y", Kind::Offset, 0.15),
    cause("a_y", Kind::Scale, 0.03),
    cause("a_y", Kind::Arm, 0.1),
    cause("tires", Kind::Relaxation, 0.1),
];

impl Cause {
    /// What one unit of the error adds to a relation; `None` where it adds nothing. `compliance` is the slip of the axle by its
    /// force [rad/(m/s²)], `arm` the distance to it [m].
    pub fn column(
        &self,
        relation: Relation,
        terms: &Terms,
        compliance: f64,
        arm: Option<f64>,
    ) -> Option<Vec<f64>> {
        use Kind::{Angle, Arm, Delay, Offset, Relaxation, Scale};
        use Relation::{Front, Rear, RigidBody};
        let rows = terms.v_x[0].len();
        let map = |f: &dyn Fn(usize) -> f64| Some((0..rows).map(f).collect::<Vec<f64>>());
        let times = |column: &[f64], factor: f64| {
            Some(column.iter().map(|x| factor * x).collect::<Vec<f64>>())
        };
        // The front's slip goes against v_y, the rear's with it.
        let side = if relation == Front { -1.0 } else { 1.0 };
        match (self.channel, self.kind, relation) {
            ("delta", Offset, Front) => Some(vec![1.0; rows]),
            // Without the distance to the axle a scale is told from that distance by the bend of the tires' curve alone.
            ("delta", Scale, Front) => arm.map(|_| terms.delta[0].clone()),
            ("delta", Delay, Front) => times(&terms.delta[1], -1.0),
            ("v_y", Arm, RigidBody) => times(&terms.r[1], -1.0),
            ("v_y", Arm, _) => times(&terms.curvature[0], side),
            ("v_y", Delay, RigidBody) => Some(terms.v_y[1].clone()),
            ("v_y", Delay, _) => times(&terms.sideslip[1], -side),
            // In the axles' slips the noise of v_y would look like a scale.
            ("v_y", Scale, RigidBody) => times(&terms.v_y[0], -1.0),
            ("v_y", Angle, RigidBody) => times(&terms.v_x[1], -1.0),
            ("v_y", Angle, _) => Some(vec![side; rows]),
            ("r", Delay, RigidBody) => map(&|k| terms.v_x[0][k] * terms.r[1][k]),
            ("r", Delay, _) => times(&terms.curvature[1], arm?),
            ("r", Offset, RigidBody) => times(&terms.v_x[0], -1.0),
            ("r", Offset, _) => map(&|k| -arm.unwrap_or(0.0) / terms.v_x[0][k]),
            ("r", Scale, RigidBody) => times(&terms.turn[0], -1.0),
            ("r", Scale, _) => times(&terms.curvature[0], -arm?),
            ("a_y", Delay, RigidBody) => map(&|k| -terms.turn[1][k] - terms.v_y[1][k]),
            ("a_y", Delay, _) => times(&terms.a_y[1], -side * compliance),
            ("a_y", Offset, RigidBody) => Some(vec![1.0; rows]),
            ("a_y", Offset, _) => Some(vec![side * compliance; rows]),
            ("a_y", Scale, RigidBody) => map(&|k| terms.turn[0][k] + terms.v_y[0][k]),
            ("a_y", Arm, RigidBody) => Some(terms.r[1].clone()),
            // v_y − l r = −v_x k (a_y + (length/v_x) a_y'): the force follows the slip.
            ("tires", Relaxation, Rear | Front) => {
                map(&|k| -side * compliance * terms.a_y[1][k] / terms.v_x[0][k])
            }
            _ => None,
        }
    }

    /// Name of the check.
    pub fn check(&self) -> String {
        let kind = match self.kind {
            Kind::Delay => "delay",
            Kind::Scale => "scale",
            Kind::Offset => "offset",
            Kind::Arm => "arm",
            Kind::Angle => "angle",
            Kind::Relaxation => "relaxation",
        };
        format!("{}_{kind}", self.channel)
    }

    /// The error in a sentence.
    pub fn sentence(&self, value: f64, [low, high]: [f64; 2]) -> String {
        let channel = self.channel;
        let sign = value.signum();
        let (low, high) = if sign < 0.0 { (-high, -low) } else { (low, high) };
        let text = |factor: f64| {
            let [value, low, high] = [value.abs(), low, high].map(|x| significant(factor * x, 2));
            (value, format!("[{low}, {high}]"))
        };
        let more = if value > 0.0 { "more" } else { "less" };
        match self.kind {
            Kind::Delay => {
                let (value, interval) = text(1e3);
                let late = if sign > 0.0 { "late" } else { "early" };
                format!("`{channel}` is {value} ms {interval} {late}.")
            }
            Kind::Scale => {
                let (value, interval) = text(100.0);
                let of =
                    if channel == "a_y" { "; roll of the body adds some per cent too" } else { "" };
                format!(
                    "`{channel}` reads {value} % {interval} {more} than the other channels say{of}."
                )
            }
            Kind::Offset if channel == "a_y" => {
                let (value, interval) = text(1.0);
                format!(
                    "`a_y` reads {value} m/s2 {interval} {more} than v_x r + v_y' on average: an offset, or a road that falls to one side."
                )
            }
            Kind::Offset => {
                let (value, interval) = text(180.0 / std::f64::consts::PI);
                let unit = if channel == "r" { "deg/s" } else { "deg" };
                let much = if value.is_empty() || sign > 0.0 { "much" } else { "little" };
                format!("`{channel}` reads {value} {unit} {interval} too {much}.")
            }
            Kind::Arm => {
                let (value, interval) = text(1.0);
                let place = if sign > 0.0 { "ahead of" } else { "behind" };
                format!(
                    "`{channel}` is measured {value} m {interval} {place} the centre of gravity."
                )
            }
            Kind::Angle => {
                let (value, interval) = text(180.0 / std::f64::consts::PI);
                let side = if sign > 0.0 { "right" } else { "left" };
                format!(
                    "The sensor of `{channel}` is turned by {value} deg {interval} to the {side}."
                )
            }
            Kind::Relaxation => {
                let (value, interval) = text(1.0);
                format!("The forces follow the slips after {value} m {interval} of rolling.")
            }
        }
    }

    /// What the error does to the tires.
    pub fn consequence(&self) -> &'static str {
        match (self.channel, self.kind) {
            ("delta", Kind::Offset) | ("v_y", Kind::Angle) => {
                "The curve is shifted along the slip: stiffness and curvature E make up for it."
            }
            ("delta", Kind::Scale) => {
                "The front slip is wrong by this share, the front stiffness against it."
            }
            ("v_y", Kind::Scale) => "Both slips are wrong by this share.",
            ("v_y", Kind::Arm) => "Both slips get a part of the yaw rate: C and E are far off.",
            ("a_y", Kind::Offset | Kind::Scale) => "D and K are wrong by what the forces are.",
            ("a_y", Kind::Arm) => "Forces get a part of the yaw acceleration.",
            ("r", Kind::Offset | Kind::Scale) => {
                "Both slips and the equilibrium of forces are wrong."
            }
            (_, Kind::Relaxation) => "In fast manoeuvres the stiffness comes out too small.",
            _ => {
                "Slip and force are those of different moments: C and E follow the hysteresis that this makes."
            }
        }
    }

    /// Unit of the figure.
    pub fn unit(&self) -> &'static str {
        match (self.kind, self.channel) {
            (Kind::Delay, _) => "s",
            (Kind::Scale, _) => "1",
            (Kind::Offset, "a_y") => "m/s2",
            (Kind::Offset, "r") => "rad/s",
            (Kind::Offset | Kind::Angle, _) => "rad",
            (Kind::Arm | Kind::Relaxation, _) => "m",
        }
    }

    /// What corrects it.
    pub fn correction(&self, value: f64) -> Correction {
        let number = significant(value.abs(), 3);
        // Less what is too much.
        let sign = if value > 0.0 { "less" } else { "plus" };
        match self.kind {
            Kind::Delay => Correction::column(&[Key::Delay(value)]),
            Kind::Scale => Correction::column(&[Key::Gain(1.0 / (1.0 + value))]),
            Kind::Offset => Correction::column(&[Key::Offset(-value)]).noting(format!(
                "in {}: convert it where the column has another unit",
                self.unit()
            )),
            Kind::Arm => {
                let with = if self.channel == "v_y" { "r" } else { "the derivative of r" };
                Correction::advice(format!(
                    "Give `{}` {sign} {number} m times {with}.",
                    self.channel
                ))
            }
            Kind::Angle => Correction::advice(format!("Give `v_y` {sign} {number} times v_x.")),
            Kind::Relaxation => {
                Correction::advice("It is no error of the log: let the fit estimate it.")
            }
        }
    }
}
