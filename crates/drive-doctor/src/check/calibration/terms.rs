//! The smoothed signals of a log that the relations of its motion are made of.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use crate::motion::Motion;

/// Narrowest filter [s].
const FILTER: f64 = 0.06;

/// Smoothed signals: the number is the order of the derivative.
pub(super) struct Terms {
    pub v_x: [Vec<f64>; 2],
    /// v_y' and v_y''.
    pub v_y: [Vec<f64>; 2],
    /// v_x r and its derivative.
    pub turn: [Vec<f64>; 2],
    pub r: [Vec<f64>; 2],
    pub a_y: [Vec<f64>; 2],
    /// v_y/v_x and its derivative.
    pub sideslip: [Vec<f64>; 2],
    /// r/v_x and its derivative.
    pub curvature: [Vec<f64>; 2],
    pub delta: [Vec<f64>; 2],
}

/// The relations, each of which is 0 for true signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    /// a_y − v_x r − v_y'.
    RigidBody,
    /// (v_y − l_r r)/v_x less what the rear slip is by its force.
    Rear,
    /// delta − (v_y + l_f r)/v_x less what the front slip is by its force.
    Front,
}

impl Relation {
    /// Whether slip goes with force as that of a tire does, by the t-value of its coefficient.
    pub fn is_of_a_tire(self, t: f64) -> bool {
        match self {
            Relation::RigidBody => true,
            Relation::Rear => t < -4.0,
            Relation::Front => t > 4.0,
        }
    }
}

impl Terms {
    /// The name of a channel that is mostly noise, if there is one.
    pub fn new(motion: &Motion) -> Result<Self, &'static str> {
        let filter = |name| motion.filter(name, FILTER).ok_or(name);
        let filter = filter("r")?.max(filter("v_y")?);
        let both = |column: &[f64]| [0, 1].map(|order| motion.smooth(column, filter, order));
        let v_y = motion.raw("v_y");
        let ratio = |name| motion.combine(name, "v_x", |a, v_x| a / v_x);
        Ok(Self {
            v_x: both(&motion.raw("v_x")),
            v_y: [1, 2].map(|order| motion.smooth(&v_y, filter, order)),
            turn: both(&motion.combine("v_x", "r", |v_x, r| v_x * r)),
            r: both(&motion.raw("r")),
            a_y: both(&motion.raw("a_y")),
            sideslip: both(&ratio("v_y")),
            curvature: both(&ratio("r")),
            delta: both(&motion.raw("delta")),
        })
    }
}
