//! The track of a test on the ground of a run: cones, those that the car hit, and the line to follow.

use crate::channel::Channel;
use crate::frame::rotate_into_frame;
use crate::log::ManoeuvreLog;
use crate::manoeuvre::Manoeuvre;

/// Cones and the line to follow, east and north [m].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TestTrack {
    /// Where cones stand.
    pub cones: Vec<[f64; 2]>,
    /// When the outline of the car first touched each of them [s]; empty while nothing is known of it.
    pub hits: Vec<Option<f64>>,
    /// The line to follow.
    pub path: Vec<[f64; 2]>,
}

impl Manoeuvre {
    /// The track where the test began; `phase` and `inputs` are those of [`Manoeuvre::test_log`]. None for a test without a track, and
    /// for one that did not begin.
    #[must_use]
    pub fn test_track(&self, phase: &[f64], inputs: &[Vec<f64>]) -> Option<TestTrack> {
        let channels = self.kind.required_channels();
        let begin = phase.iter().position(|phase| *phase != 0.0)?;
        let value = |channel| {
            let place = channels.iter().position(|it| *it == channel)?;
            inputs.get(place)?.get(begin).copied()
        };
        let [east, north, heading] =
            [value(Channel::East)?, value(Channel::North)?, value(Channel::Heading)?];
        let sign = self.common.direction.left_positive_sign();
        let on_ground = |[x, y]: [f64; 2]| {
            let [along, across] = rotate_into_frame([x, sign * y], -heading);
            [east + along, north + across]
        };
        let path = self.kind.reference_path().map(|path| path.sampled_points()).unwrap_or_default();
        let track = TestTrack {
            cones: self.kind.cones().into_iter().map(on_ground).collect(),
            hits: Vec::new(),
            path: path.into_iter().map(on_ground).collect(),
        };
        (track != TestTrack::default()).then_some(track)
    }
}

impl TestTrack {
    /// Takes from the log of the test which cones the car hit; the test began at `begin` [s].
    pub fn set_hits(&mut self, manoeuvre: &Manoeuvre, log: &ManoeuvreLog, begin: f64) {
        let times = manoeuvre.kind.cone_hit_times(log).into_iter();
        self.hits = times.map(|time| time.map(|time| begin + time)).collect();
    }

    /// Where cones stand that the car hit, and where the others do [m].
    #[must_use]
    pub fn hit_and_standing_cones(&self) -> [Vec<[f64; 2]>; 2] {
        let is_hit = |place: usize| self.hits.get(place).is_some_and(Option::is_some);
        [true, false].map(|hit| {
            let cones = self.cones.iter().enumerate();
            cones.filter(|(place, _)| is_hit(*place) == hit).map(|(_, cone)| *cone).collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;
    use std::sync::Arc;

    use crate::common::{CommonParameters, Direction};
    use crate::kind::{LaneChange, StepSteer};
    use crate::log::ManoeuvreLog;
    use crate::{Manoeuvre, PathFollower, SpeedController};

    fn manoeuvre(direction: Direction, kind: Arc<dyn crate::kind::ManoeuvreKind>) -> Manoeuvre {
        let common = CommonParameters {
            entry_speed: 20.0,
            speed_tolerance: 0.1,
            settle: 0.5,
            direction,
            wheelbase: Some(2.5),
            speed_controller: SpeedController::default(),
            path_follower: PathFollower::default(),
            step: 0.01,
            seed: 0,
        };
        Manoeuvre { common, kind }
    }

    #[test]
    fn cones_stand_where_the_test_began_and_on_the_side_of_its_direction() {
        // v_x, v_y, r, a_y, X, Y, psi: the test begins at the second row, at (5, 7) and to the north.
        let inputs: Vec<Vec<f64>> =
            [20.0, 0.0, 0.0, 0.0, 5.0, 7.0, FRAC_PI_2].map(|it| vec![0.0, it]).to_vec();
        let phase = [0.0, 1.0];
        for (direction, left) in [(Direction::Left, 1.0), (Direction::Right, -1.0)] {
            let track = manoeuvre(direction, Arc::new(LaneChange::default()));
            let track = track.test_track(&phase, &inputs).expect("a track");
            assert_eq!(track.cones.len(), 30);
            // The lead is 20 m; the first lane is 1.1 * 1.8 m + 0.25 m wide.
            let [east, north] = track.cones[0];
            assert!(
                (north - 27.0).abs() < 1e-9 && (east - 5.0 - left * 1.115).abs() < 1e-9,
                "{east} {north}"
            );
            let last = track.path.last().expect("a path");
            assert!((last[1] - 27.0).abs() > 100.0, "{last:?}");
        }
        let lane_change = manoeuvre(Direction::Left, Arc::new(LaneChange::default()));
        // 1.8 m wide, straight ahead: it takes the cones on the right edge of the second lane, which begins 45 m behind the first.
        let log = ManoeuvreLog {
            t: (0..20).map(|k| 0.5 * f64::from(k)).collect(),
            x: (0..20).map(|k| 10.0 * f64::from(k)).collect(),
            y: vec![2.6; 20],
            psi: vec![0.0; 20],
            ..ManoeuvreLog::default()
        };
        let mut track = lane_change.test_track(&phase, &inputs).expect("a track");
        track.set_hits(&lane_change, &log, 3.0);
        let [hit, standing] = track.hit_and_standing_cones();
        assert!(!hit.is_empty() && hit.len() + standing.len() == 30, "{hit:?}");
        assert!(track.hits.iter().flatten().all(|time| *time >= 3.0), "{:?}", track.hits);
        assert_eq!(lane_change.test_track(&[0.0, 0.0], &inputs), None);
        let step = manoeuvre(Direction::Left, Arc::new(StepSteer::default()));
        assert_eq!(step.test_track(&phase, &inputs), None);
    }
}
