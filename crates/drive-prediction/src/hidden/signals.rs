//! Holds what sensors gave of one drive: a value where a sensor gave a new one, NaN elsewhere, so that rates may differ and gaps need no rule.

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorChannel {
    /// Forward speed of the centre of gravity [m/s].
    Speed,
    /// Yaw rate [rad/s].
    YawRate,
    /// Lateral specific force at the centre of gravity [m/s²].
    LateralAcceleration,
    /// Velocity to the left [m/s].
    LateralSpeed,
    /// Course over ground, to the left of a fixed direction [rad], as of GNSS.
    Course,
    /// Speed over ground [m/s], as of GNSS.
    GroundSpeed,
}

/// Number of channels.
pub(super) const CHANNELS: usize = 6;
/// Rows per second that a likelihood is made of where sensors are faster [Hz]: vibration above its half would rule the fit.
const LIKELIHOOD_RATE: f64 = 20.0;

/// The signals of one drive at even instants.
#[derive(Clone, Debug, Default)]
pub struct SensorSignals {
    /// Time between two rows [s].
    pub(super) step: f64,
    /// Steering angle of the road wheels [rad].
    pub(super) delta: Vec<f64>,
    /// Longitudinal specific force [m/s²].
    pub(super) a_x: Option<Vec<f64>>,
    pub(super) measured: Vec<[f64; CHANNELS]>,
}

impl SensorSignals {
    /// A drive with steering angles [rad] every `step` [s] and no sensor yet. Angles that are no numbers stay as they were.
    #[must_use]
    pub fn new(step: f64, delta: &[f64]) -> Self {
        let measured = vec![[f64::NAN; CHANNELS]; delta.len()];
        Self { step, delta: hold_last_value(delta), a_x: None, measured }
    }

    /// With the values of a channel, one for each row; NaN where there is no new one. Values that are missing at the end are none.
    #[must_use]
    pub fn with_channel(mut self, channel: SensorChannel, values: &[f64]) -> Self {
        for (row, value) in self.measured.iter_mut().zip(values) {
            row[channel as usize] = if value.is_finite() { *value } else { f64::NAN };
        }
        self
    }

    /// With the longitudinal specific force [m/s²], which drives the filter; values that are no numbers stay as they were.
    #[must_use]
    pub fn with_a_x(mut self, a_x: &[f64]) -> Self {
        let mut a_x = hold_last_value(a_x);
        a_x.resize(self.row_count(), a_x.last().copied().unwrap_or(0.0));
        self.a_x = Some(a_x);
        self
    }

    /// Without the rows of yaw rate and lateral acceleration that repeat both of the row before: a logger that is faster than its sensor.
    #[must_use]
    pub fn without_repeats(mut self) -> Self {
        let pair = [SensorChannel::YawRate as usize, SensorChannel::LateralAcceleration as usize];
        let mut before = [f64::NAN; 2];
        for row in &mut self.measured {
            let now = pair.map(|channel| row[channel]);
            if now == before {
                pair.iter().for_each(|channel| row[*channel] = f64::NAN);
            }
            before = now;
        }
        self
    }

    /// Number of rows.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.delta.len()
    }

    /// How many values a channel has.
    #[must_use]
    pub fn value_count(&self, channel: SensorChannel) -> usize {
        self.measured.iter().filter(|row| row[channel as usize].is_finite()).count()
    }

    /// The first `rows` rows.
    #[must_use]
    pub fn first_rows(&self, rows: usize) -> Self {
        let mut part = self.clone();
        part.delta.truncate(rows);
        part.measured.truncate(rows);
        if let Some(a_x) = &mut part.a_x {
            a_x.truncate(rows);
        }
        part
    }

    /// Without measured v_y.
    pub(super) fn without_v_y(&self) -> Self {
        let mut hidden = self.clone();
        for row in &mut hidden.measured {
            row[SensorChannel::LateralSpeed as usize] = f64::NAN;
        }
        hidden
    }

    /// Means of blocks of rows, for the likelihood. Sensors that are slower than the rows stay as they are.
    pub(super) fn averaged_over_blocks(&self) -> Self {
        let block = (1.0 / (self.step * LIKELIHOOD_RATE) + 1e-6).floor() as usize;
        if block < 2 || 2 * self.value_count(SensorChannel::YawRate) < self.row_count() {
            return self.clone();
        }
        let means = |values: &[f64]| values.chunks_exact(block).map(mean_of_finite).collect::<Vec<_>>();
        let of_rows = |rows: &[[f64; CHANNELS]]| {
            std::array::from_fn(|channel| {
                if channel == SensorChannel::Course as usize {
                    // Angles have no mean; the middle of the block is where the means of the others belong.
                    return rows[block / 2][channel];
                }
                let values: Vec<f64> = rows.iter().map(|row| row[channel]).collect();
                mean_of_finite(&values)
            })
        };
        Self {
            step: self.step * block as f64,
            delta: means(&self.delta),
            a_x: self.a_x.as_deref().map(means),
            measured: self.measured.chunks_exact(block).map(of_rows).collect(),
        }
    }
}

/// The mean of what is a number; NaN if nothing is.
fn mean_of_finite(values: &[f64]) -> f64 {
    let numbers = || values.iter().filter(|value| value.is_finite());
    numbers().sum::<f64>() / numbers().count() as f64
}

/// Values that are no numbers stay as they were; at the start the first number stands for them.
fn hold_last_value(values: &[f64]) -> Vec<f64> {
    let mut last = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    let hold = |value: &f64| {
        if value.is_finite() {
            last = *value;
        }
        last
    };
    values.iter().map(hold).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_repeats_are_no_measurements() {
        let signals = SensorSignals::new(0.01, &[f64::NAN, 0.1, f64::NAN, 0.3])
            .with_channel(SensorChannel::YawRate, &[1.0, 1.0, 2.0])
            .with_channel(SensorChannel::LateralAcceleration, &[5.0, 5.0, f64::INFINITY, 4.0])
            .without_repeats();
        assert_eq!(signals.delta, [0.1, 0.1, 0.1, 0.3]);
        assert_eq!(signals.value_count(SensorChannel::YawRate), 2);
        assert_eq!(signals.value_count(SensorChannel::LateralAcceleration), 2);
        assert_eq!(signals.value_count(SensorChannel::Course), 0);
    }

    #[test]
    fn blocks_are_means_and_slow_sensors_stay() {
        let ramp: Vec<f64> = (0..103).map(f64::from).collect();
        let fast =
            SensorSignals::new(0.01, &ramp).with_channel(SensorChannel::YawRate, &ramp).with_a_x(&ramp[..50]);
        let thin = fast.averaged_over_blocks();
        assert_eq!((thin.row_count(), thin.step), (20, 0.05));
        assert_eq!(thin.delta[1], 7.0);
        assert_eq!(thin.measured[1][SensorChannel::YawRate as usize], 7.0);
        assert!(thin.measured[1][SensorChannel::Speed as usize].is_nan());
        let mut slow = vec![f64::NAN; 103];
        slow[50] = 1.0;
        assert_eq!(
            SensorSignals::new(0.01, &ramp)
                .with_channel(SensorChannel::YawRate, &slow)
                .averaged_over_blocks()
                .row_count(),
            103
        );
    }
}
