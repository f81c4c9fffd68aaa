//! Holds the radius with which the wheels of an axle roll, as a log tells it.

use numerics::text::format_significant;
use serde::Serialize;

/// The radius of v_x = R ω without force, with 95 % intervals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RollingRadius {
    /// `front` or `rear`.
    pub axle: &'static str,
    /// R [m].
    pub radius: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// Slip by forward acceleration [s²/m]: positive at a driven axle.
    pub slip: f64,
    /// Its interval.
    pub slip_interval: [f64; 2],
    /// Whether both halves of the log agree.
    pub is_constant: bool,
    /// The whole in words.
    pub sentence: String,
}

impl RollingRadius {
    /// `None` of a radius that is no positive number.
    pub(crate) fn new(
        axle: &'static str,
        radius: f64,
        interval: [f64; 2],
        slip: f64,
        slip_interval: [f64; 2],
        is_constant: bool,
    ) -> Option<Self> {
        if !(radius.is_finite() && interval[0] > 0.0) {
            return None;
        }
        let [shown, low, high] = [radius, interval[0], interval[1]].map(|it| format_significant(it, 4));
        let mut sentence = format!(
            "The wheels of the {axle} axle roll with a radius of {shown} m [{low}, {high}] without force, if `v_x` was not made of their speeds."
        );
        if !is_constant {
            sentence += " The halves of the log disagree: it is no constant.";
        }
        let per_cent = |it: f64| format_significant(100.0 * it, 2);
        if slip_interval[0] > 0.0 || slip_interval[1] < 0.0 {
            sentence += &format!(
                " Each m/s2 of forward acceleration adds {} % [{}, {}] of slip.",
                per_cent(slip),
                per_cent(slip_interval[0]),
                per_cent(slip_interval[1])
            );
        }
        Some(Self { axle, radius, interval, slip, slip_interval, is_constant, sentence })
    }

    /// Whether both intervals share nothing.
    pub(crate) fn is_disjoint_from(&self, other: &Self) -> bool {
        self.interval[1] < other.interval[0] || other.interval[1] < self.interval[0]
    }
}
