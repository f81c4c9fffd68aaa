//! Turns spring rates, motion ratios and anti-roll bars of a data sheet into the stiffness of an axle in heave and in roll.

use serde::{Deserialize, Serialize};

/// Springs and bar of an axle, as a data sheet has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxleSprings {
    /// Rate of each spring [N/m]; 0 when heave and roll stiffness are given themselves.
    pub rate: f64,
    /// Way of the spring over that of its wheel [-].
    pub motion_ratio: f64,
    /// What the anti-roll bar adds to the roll stiffness of the axle, at the wheels [N m/rad].
    pub bar_stiffness: f64,
}

impl Default for AxleSprings {
    fn default() -> Self {
        AxleSprings { rate: 0.0, motion_ratio: 1.0, bar_stiffness: 0.0 }
    }
}

/// Stiffness of an axle with its tires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleStiffness {
    /// In heave, at each wheel [N/m].
    pub ride: f64,
    /// In roll [N m/rad].
    pub roll: f64,
}

impl AxleSprings {
    /// The stiffness with tires of this vertical stiffness [N/m] behind the springs, infinite for rigid ones; none when no rate is given.
    ///
    /// By the travel of the wheel a spring has the rate k_s i² (Milliken and Milliken, Race Car Vehicle Dynamics, section 16.2). In roll
    /// two of them have k t²/2 at the track width t, and the bar is beside them; the tires are in series with both.
    pub fn axle_stiffness(&self, track: f64, tire_stiffness: f64) -> Option<AxleStiffness> {
        let wheel_rate = self.rate * self.motion_ratio.powi(2);
        let in_roll = 0.5 * track.powi(2);
        let ride = in_series(wheel_rate, tire_stiffness);
        let roll = in_series(wheel_rate * in_roll + self.bar_stiffness, tire_stiffness * in_roll);
        (self.rate > 0.0).then_some(AxleStiffness { ride, roll })
    }
}

/// The stiffness of two springs one behind the other.
fn in_series(a: f64, b: f64) -> f64 {
    if a == 0.0 || b.is_infinite() { a } else { a * b / (a + b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_of_a_data_sheet_have_the_stiffness_that_the_formulas_say() {
        let springs = AxleSprings { rate: 40e3, motion_ratio: 0.8, bar_stiffness: 15e3 };
        let AxleStiffness { ride, roll } = springs.axle_stiffness(1.5, 250e3).expect("a rate");
        // 25.6 N/mm at the wheel; 28.8 kN m/rad by the springs, 43.8 with the bar, 281.25 by the tires.
        assert!((ride - 25.6e3 * 250.0 / 275.6).abs() < 1e-6, "{ride}");
        assert!((roll - 43.8e3 * 281.25 / 325.05).abs() < 1e-6, "{roll}");
        let rigid = springs.axle_stiffness(1.5, f64::INFINITY).expect("a rate");
        assert!((rigid.ride - 25.6e3).abs() < 1e-6 && (rigid.roll - 43.8e3).abs() < 1e-6, "{rigid:?}");
        assert_eq!(AxleSprings::default().axle_stiffness(1.5, 250e3), None);
    }
}
