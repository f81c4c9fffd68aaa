//! A drive at even instants: the motion that models are judged by, which rows of it count, and what sensors say of it.

use preparation::Drive;

/// A drive at even instants. All channels have one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EvenDrive {
    /// Where it comes from, for people.
    pub name: String,
    /// The number of its log, from 1; 0 where nobody counts.
    pub log: usize,
    /// Time between two rows [s].
    pub step: f64,
    /// Motion of the centre of gravity and angle of the road wheels, over the time of the log; without a longitudinal force.
    pub motion: Drive,
    /// Yaw acceleration [rad/s²].
    pub r_dot: Vec<f64>,
    /// Which rows count: fast enough, without a gap, not at an edge.
    pub counts: Vec<bool>,
    /// Number of the lap, where it is known.
    pub lap: Option<Vec<f64>>,
    /// What an estimator sees that does not know v_y.
    pub sensors: Option<DriveSensors>,
}

/// Sensors of a drive, held between their samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriveSensors {
    /// Forward speed, as of wheels or GNSS [m/s].
    pub v: Vec<f64>,
    /// Yaw rate [rad/s].
    pub r: Vec<f64>,
    /// Lateral specific force [m/s²].
    pub a_y: Option<Vec<f64>>,
    /// Longitudinal specific force [m/s²].
    pub a_x: Option<Vec<f64>>,
    /// Direction of travel over ground, positive to the left [rad]; NaN where there was no new value.
    pub course: Option<Vec<f64>>,
    /// Speed over ground [m/s]; NaN where there was no new value.
    pub ground_speed: Option<Vec<f64>>,
}

impl EvenDrive {
    /// Number of rows.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.motion.len()
    }

    /// The same drive, of which only the rows from `from` [s] to before `to` [s] count.
    #[must_use]
    pub fn restricted_to_interval(&self, from: f64, to: f64) -> Self {
        let mut part = self.clone();
        for (counts, time) in part.counts.iter_mut().zip(&self.motion.t) {
            *counts &= (from..to).contains(time);
        }
        part
    }

    /// The values of a channel in the rows that count.
    pub fn counted_values<'a>(&'a self, channel: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        channel.iter().zip(&self.counts).filter_map(|(value, counts)| counts.then_some(*value))
    }
}
