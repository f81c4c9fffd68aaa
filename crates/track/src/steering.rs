//! Steers along a line: feed-forward of curvature and of steady slip angles, feedback of the deviation at a point ahead.

use serde::{Deserialize, Serialize};

use crate::angle::wrap_angle;
use crate::{Error, LineStation, TrackLine};

/// What a steady turn of a car needs: geometry, and the slip angles of its axles over lateral acceleration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SteadyStateHandling {
    /// Distance between the axles [m].
    wheelbase: f64,
    /// Distance from the centre of gravity to the rear axle [m].
    l_r: f64,
    /// Lateral acceleration [m/s²], positive and rising, with the slip angles of front and rear axle [rad].
    slips: Vec<[f64; 3]>,
}

impl SteadyStateHandling {
    /// A car whose slip angles are proportional to the lateral acceleration: front and rear angle for each unit of it
    /// [rad s²/m]. Their difference is the understeer gradient. Zeros make a car that rolls without slip.
    #[must_use]
    pub fn with_linear_slip_angles(wheelbase: f64, l_r: f64, [front, rear]: [f64; 2]) -> Self {
        let far = 1e3;
        SteadyStateHandling { wheelbase, l_r, slips: vec![[0.0; 3], [far, far * front, far * rear]] }
    }

    /// A car with a table of its steady slip angles: lateral acceleration [m/s²] from 0 on, slip angles of front and rear axle
    /// [rad], positive in left turns. Beyond its end it is constant: there a tire has no more to give.
    ///
    /// # Errors
    /// When the table has fewer than two rows, or accelerations do not rise from 0.
    pub fn with_slip_angle_table(wheelbase: f64, l_r: f64, slips: Vec<[f64; 3]>) -> Result<Self, Error> {
        let rises = slips.windows(2).all(|it| it[0][0] < it[1][0]);
        let finite = slips.as_flattened().iter().all(|it| it.is_finite());
        if slips.len() < 2 || slips[0][0] != 0.0 || !rises || !finite {
            let message = "expected slip angles at lateral accelerations that rise from 0";
            return Err(Error::Limits(message.to_owned()));
        }
        Ok(SteadyStateHandling { wheelbase, l_r, slips })
    }

    /// Distance between the axles [m].
    #[must_use]
    pub fn wheelbase(&self) -> f64 {
        self.wheelbase
    }

    /// Slip angles of front and rear axle in a steady turn with a lateral acceleration [m/s²] [rad].
    #[must_use]
    pub fn steady_slip_angles(&self, a_y: f64) -> [f64; 2] {
        let size = a_y.abs();
        let above = self.slips.partition_point(|row| row[0] <= size).clamp(1, self.slips.len() - 1);
        let [[a, front_a, rear_a], [b, front_b, rear_b]] = [self.slips[above - 1], self.slips[above]];
        let t = ((size - a) / (b - a)).min(1.0);
        let sign = if a_y < 0.0 { -1.0 } else { 1.0 };
        [sign * (front_a + t * (front_b - front_a)), sign * (rear_a + t * (rear_b - rear_a))]
    }
}

/// The steering law with its gains. Its default has those of the source, and no preview.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PathSteeringLaw {
    /// Deviation ahead to steering angle, k_p [rad/m].
    pub gain: f64,
    /// Distance of the point ahead, x_LA [m].
    pub lookahead: f64,
    /// How far ahead in time the curvature of the feed-forward is read, for actuators that lag [s].
    pub preview: f64,
}

/// Motion of the car that follows a line.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct HeadingAndSpeed {
    /// Heading [rad].
    pub psi: f64,
    /// Forward speed of the centre of gravity [m/s].
    pub v_x: f64,
}

/// What a banked road and the air add to the load of the tires in a turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TireLoadCondition {
    /// Lateral acceleration that the tires give besides that of the turn [m/s²]: g sin φ on a bank.
    pub bank_acceleration: f64,
    /// Load of the tires over that on a level road at rest [-]; the slip angles of a turn are those of one with a lateral
    /// acceleration smaller by this.
    pub load_factor: f64,
}

impl Default for TireLoadCondition {
    fn default() -> Self {
        TireLoadCondition { bank_acceleration: 0.0, load_factor: 1.0 }
    }
}

impl Default for PathSteeringLaw {
    fn default() -> Self {
        PathSteeringLaw { gain: 0.053, lookahead: 14.2, preview: 0.0 }
    }
}

impl PathSteeringLaw {
    /// Road-wheel angle [rad] for a car at this station of a line, after N. Kapania, J. Gerdes, "Design of a
    /// feedback-feedforward steering controller for accurate path tracking and stability at the limits of handling", Vehicle
    /// System Dynamics 53 (2015): δ = L κ + α_f − α_r − k_p (e + x_LA sin(Δψ + β_ss)), with the slip angles and
    /// the sideslip angle β_ss = l_r κ − α_r of a steady turn with a_y = κ v². Slip angles here are positive in left turns,
    /// which turns their signs round. With the steady sideslip in the feedback the car settles with its centre of gravity on the line.
    #[must_use]
    pub fn steering_angle(
        &self,
        handling: &SteadyStateHandling,
        line: &TrackLine,
        station: &LineStation,
        motion: &HeadingAndSpeed,
        tire_load: &TireLoadCondition,
    ) -> f64 {
        let HeadingAndSpeed { psi, v_x } = *motion;
        let TireLoadCondition { bank_acceleration, load_factor } = *tire_load;
        let slips =
            |kappa: f64| handling.steady_slip_angles((kappa * v_x * v_x + bank_acceleration) / load_factor);
        let ahead = station.s + v_x * self.preview;
        let kappa = if self.preview == 0.0 { station.kappa } else { line.curvature_at(ahead) };
        let [front, rear] = slips(kappa);
        let forward = handling.wheelbase * kappa + front - rear;
        let [_, rear] = slips(station.kappa);
        let sideslip = handling.l_r * station.kappa - rear;
        let error = station.lateral + self.lookahead * (wrap_angle(psi - station.psi) + sideslip).sin();
        forward - self.gain * error
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use approx::assert_relative_eq;

    use super::*;
    use crate::TrackSurvey;

    /// A car of linear tires: mass 1500 kg, 2500 kg m², l_f 1.2 m, l_r 1.5 m, 90 and 110 kN/rad.
    struct Car {
        point: [f64; 2],
        psi: f64,
        v_y: f64,
        r: f64,
    }

    const V: f64 = 20.0;

    impl Car {
        fn step(&mut self, delta: f64, h: f64) {
            let (m, i_zz, l_f, l_r, c_f, c_r) = (1500.0, 2500.0, 1.2, 1.5, 90e3, 110e3);
            let front = c_f * (delta - (self.v_y + l_f * self.r) / V);
            let rear = -c_r * (self.v_y - l_r * self.r) / V;
            self.v_y += h * ((front + rear) / m - V * self.r);
            self.r += h * (l_f * front - l_r * rear) / i_zz;
            let (sin, cos) = self.psi.sin_cos();
            self.point[0] += h * (V * cos - self.v_y * sin);
            self.point[1] += h * (V * sin + self.v_y * cos);
            self.psi += h * self.r;
        }
    }

    fn car() -> SteadyStateHandling {
        let (m, l_f, l_r, c_f, c_r) = (1500.0, 1.2, 1.5, 90e3, 110e3);
        let per_a = m / (l_f + l_r);
        SteadyStateHandling::with_linear_slip_angles(l_f + l_r, l_r, [per_a * l_r / c_f, per_a * l_f / c_r])
    }

    fn steered(law: &PathSteeringLaw, line: &TrackLine, station: &LineStation, psi: f64) -> f64 {
        law.steering_angle(
            &car(),
            line,
            station,
            &HeadingAndSpeed { psi, v_x: V },
            &TireLoadCondition::default(),
        )
    }

    #[test]
    fn a_car_that_the_law_knows_keeps_its_centre_of_gravity_on_a_circle() {
        let point = |i: i32| {
            let angle = TAU * f64::from(i) / 300.0;
            [60.0 * angle.cos(), 60.0 * angle.sin()]
        };
        let points = (0..300).map(point).collect();
        let line = TrackLine::from_survey(&TrackSurvey { points, closed: true, ..TrackSurvey::default() })
            .expect("one");
        let settled = |known: &SteadyStateHandling| {
            let mut car = Car { point: [61.0, 0.0], psi: PI / 2.0 + 0.1, v_y: 0.0, r: 0.0 };
            let mut station = line.locate_point(car.point, Some(car.psi));
            for _ in 0..20_000 {
                station = line.follow_point(station.s, car.point);
                let motion = HeadingAndSpeed { psi: car.psi, v_x: V };
                let law = PathSteeringLaw::default();
                car.step(
                    law.steering_angle(known, &line, &station, &motion, &TireLoadCondition::default()),
                    1e-3,
                );
            }
            station.lateral
        };
        assert_relative_eq!(settled(&car()), 0.0, epsilon = 0.01);
        let rolling = SteadyStateHandling::with_linear_slip_angles(2.7, 1.5, [0.0; 2]);
        assert!(settled(&rolling).abs() > 0.1, "{}", settled(&rolling));
    }

    #[test]
    fn a_step_beside_a_straight_line_decays_without_swinging() {
        let line = TrackLine::from_table_text("x,y\n0,0\n100,0\n200,0\n300,0\n").expect("a line");
        let mut car = Car { point: [0.0, 2.0], psi: 0.0, v_y: 0.0, r: 0.0 };
        let (mut s, mut lowest) = (0.0, f64::INFINITY);
        for _ in 0..10_000 {
            let station = line.follow_point(s, car.point);
            s = station.s;
            lowest = station.lateral.min(lowest);
            car.step(steered(&PathSteeringLaw::default(), &line, &station, car.psi), 1e-3);
        }
        assert!(car.point[1].abs() < 0.01 && lowest > -0.2, "{:?} {lowest}", car.point);
    }

    #[test]
    fn slip_angles_are_odd_and_end_with_the_table() {
        let table = vec![[0.0, 0.0, 0.0], [5.0, 0.02, 0.01], [10.0, 0.08, 0.05]];
        let handling = SteadyStateHandling::with_slip_angle_table(3.0, 1.5, table).expect("a table");
        assert_relative_eq!(handling.steady_slip_angles(7.5)[0], 0.05, max_relative = 1e-12);
        assert_relative_eq!(handling.steady_slip_angles(-7.5)[1], -0.03, max_relative = 1e-12);
        assert_relative_eq!(handling.steady_slip_angles(15.0)[0], 0.08, max_relative = 1e-12);
        assert!(SteadyStateHandling::with_slip_angle_table(3.0, 1.5, vec![[0.0; 3]; 2]).is_err());
        assert!((wrap_angle(7.0) - (7.0 - TAU)).abs() < 1e-12 && (wrap_angle(-PI) + PI).abs() < 1e-12);
    }

    #[test]
    fn preview_reads_the_curvature_ahead() {
        let line =
            TrackLine::from_table_text("x,y\n0,0\n20,0\n40,0\n60,5\n75,20\n80,40\n80,60\n").expect("a line");
        let station = line.follow_point(20.0, [20.0, 0.0]);
        let here = steered(&PathSteeringLaw::default(), &line, &station, station.psi);
        let early = PathSteeringLaw { preview: 1.5, ..PathSteeringLaw::default() };
        let ahead = steered(&early, &line, &station, station.psi);
        assert!(ahead > here + 0.05, "{here} {ahead}");
    }
}
