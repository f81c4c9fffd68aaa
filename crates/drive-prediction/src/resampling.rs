//! Resamples the log of a drive, whose channels have time stamps of their own, at the even instants of [`EvenDrive`]s.

use std::fmt;

use preparation::{Drive, DriveLog, Signal, local_mean_or_interpolation};

use crate::drive::{DriveSensors, EvenDrive};
use crate::zero_phase::{derivative, low_pass};

/// Channels of a log with their units. Without `a_y` it is that of the motion, v_y' + v_x r; without `v_y` drives have none. `course` and
/// `ground_speed`, as of GNSS, may be slower than the others and have gaps, and the course may leap by a turn. `lap` and `log` are numbers,
/// those of logs from 1.
pub const CHANNELS: [(&str, &str); 10] = [
    ("v_x", "m/s"),
    ("r", "rad/s"),
    ("delta", "rad"),
    ("v_y", "m/s"),
    ("a_y", "m/s2"),
    ("a_x", "m/s2"),
    ("course", "rad"),
    ("ground_speed", "m/s"),
    ("lap", "1"),
    ("log", "1"),
];
/// How many of [`CHANNELS`] are needed, and how many have a value at every instant of a drive.
const NEEDED: usize = 3;
const CONTINUOUS: usize = 6;

/// How channels become drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResamplingOptions {
    /// Rows per second [Hz]; that of the slowest needed channel, at most 100 Hz, if not given.
    pub rate: Option<f64>,
    /// Corner of the low pass of speeds, yaw rate and acceleration [Hz]; without it they stay as they are.
    pub smooth: Option<f64>,
    /// Rows that are not faster do not count [m/s].
    pub least_speed: f64,
}

/// Rows at the edges of a drive and of a gap do not count for this long [s]: a low pass has seen only one side of them.
const EDGE: f64 = 0.5;
/// More rows per second than this tell a car's motion no better [Hz].
const FASTEST: f64 = 100.0;
/// Steps of the slowest channel that are no gap yet.
const GAP_STEPS: f64 = 3.5;
/// The fewest rows of a drive: a second at 100 Hz.
const LEAST_ROWS: usize = 100;

/// Why a log is no drive.
#[derive(Clone, Debug, PartialEq)]
pub enum ResamplingError {
    /// A channel has fewer than two values.
    Empty(&'static str),
    /// No stretch has all channels for long enough.
    TooShort {
        /// Rows in the longest stretch.
        rows: usize,
    },
    /// No row is fast enough.
    TooSlow {
        /// The highest speed [m/s].
        fastest: f64,
        /// The least that counts [m/s].
        least: f64,
    },
}

impl fmt::Display for ResamplingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty(name) => write!(f, "`{name}`: expected two values or more"),
            Self::TooShort { rows } => write!(
                f,
                "expected a stretch of {LEAST_ROWS} rows in which all signals are there, found {rows} rows at most"
            ),
            Self::TooSlow { fastest, least } => {
                write!(
                    f,
                    "expected rows faster than `least_speed` = {least} m/s, found {fastest:.2} m/s at most"
                )
            }
        }
    }
}

impl std::error::Error for ResamplingError {}

/// The drives of a log with [`CHANNELS`]: one for each number of its channel `log`.
///
/// # Errors
/// If a channel is empty, no stretch has all of them, or no row is fast enough.
pub fn resample_log(log: &DriveLog, sampling: &ResamplingOptions) -> Result<Vec<EvenDrive>, ResamplingError> {
    let mut given = Vec::new();
    for (place, (name, _)) in CHANNELS.into_iter().take(CONTINUOUS).enumerate() {
        let channel = log.get(name).map(ValidSamples::from_signal);
        match channel {
            Some(channel) if channel.time.len() >= 2 => given.push((name, channel)),
            None if place >= NEEDED => {}
            _ => return Err(ResamplingError::Empty(name)),
        }
    }
    let slowest = given.iter().map(|(_, it)| it.usual_step).fold(0.0, f64::max);
    let step = sampling.rate.map_or(slowest.max(1.0 / FASTEST), f64::recip);
    let spans = common_time_ranges(log, &given);
    let mut drives = Vec::new();
    let mut longest = 0;
    for (number, [from, to]) in spans {
        let rows = if to > from { ((to - from) / step + 1e-6).floor() as usize + 1 } else { 0 };
        longest = longest.max(rows);
        if rows >= LEAST_ROWS {
            let time = (0..rows).map(|row| from + row as f64 * step).collect();
            let drive = resample_drive(log, &given, sampling, time, step);
            drives.push(EvenDrive { name: format!("log {number}"), log: number, ..drive });
        }
    }
    if drives.is_empty() {
        return Err(ResamplingError::TooShort { rows: longest });
    }
    if drives.iter().all(|drive| !drive.counts.contains(&true)) {
        let speeds = drives.iter().flat_map(|drive| drive.motion.v_x.iter().copied());
        let fastest = speeds.fold(f64::NEG_INFINITY, f64::max);
        if fastest <= sampling.least_speed {
            return Err(ResamplingError::TooSlow { fastest, least: sampling.least_speed });
        }
        return Err(ResamplingError::TooShort { rows: 0 });
    }
    Ok(drives)
}

/// The samples of a channel that are numbers, at rising time stamps.
struct ValidSamples {
    time: Vec<f64>,
    value: Vec<f64>,
    /// The step that nine in ten do not exceed [s].
    usual_step: f64,
}

impl ValidSamples {
    fn from_signal(channel: &Signal) -> Self {
        let mut time = Vec::new();
        let mut value = Vec::new();
        for (t, y) in channel.time.iter().zip(&*channel.value) {
            // Repeated stamps say nothing new of the time.
            if t.is_finite() && y.is_finite() && time.last().is_none_or(|last| last < t) {
                time.push(*t);
                value.push(*y);
            }
        }
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let usual = steps.get(steps.len() * 9 / 10).copied();
        Self { time, value, usual_step: usual.unwrap_or(0.0) }
    }

    /// Whether values are so near to a time [s] that nothing is made up.
    fn has_samples_near(&self, t: f64) -> bool {
        let behind = self.time.partition_point(|it| *it <= t);
        let Some(before) = behind.checked_sub(1).map(|i| self.time[i]) else { return false };
        match self.time.get(behind) {
            Some(after) => after - before <= GAP_STEPS * self.usual_step,
            None => t - before <= 1e-9,
        }
    }
}

/// The number of each log, and the times [s] from which to which all channels are there.
fn common_time_ranges(log: &DriveLog, given: &[(&str, ValidSamples)]) -> Vec<(usize, [f64; 2])> {
    let first = given.iter().map(|(_, it)| it.time[0]).fold(f64::NEG_INFINITY, f64::max);
    let last = given.iter().map(|(_, it)| it.time[it.time.len() - 1]).fold(f64::INFINITY, f64::min);
    let numbers = log.get("log").map(ValidSamples::from_signal).filter(|log| !log.time.is_empty());
    let Some(log) = numbers else {
        return vec![(1, [first, last])];
    };
    let rows: Vec<(f64, f64)> = log.time.iter().copied().zip(log.value.iter().copied()).collect();
    let of_one = |rows: &[(f64, f64)]| {
        let ends = [rows[0].0.max(first), rows[rows.len() - 1].0.min(last)];
        (rows[0].1.max(0.0) as usize, ends)
    };
    rows.chunk_by(|a, b| a.1 == b.1).map(of_one).collect()
}

/// One drive at these instants, `step` [s] apart.
fn resample_drive(
    log: &DriveLog,
    given: &[(&str, ValidSamples)],
    sampling: &ResamplingOptions,
    time: Vec<f64>,
    step: f64,
) -> EvenDrive {
    let rows = time.len();
    let raw = |name: &str| {
        let (_, channel) = given.iter().find(|(it, _)| *it == name)?;
        let at = |t: &f64| local_mean_or_interpolation(&channel.time, &channel.value, *t, step);
        Some(time.iter().map(at).collect::<Vec<f64>>())
    };
    let smooth = |values: &[f64]| match sampling.smooth {
        Some(cut) => low_pass(values, cut, step),
        None => values.to_vec(),
    };
    let sparse = |name: &str| log.get(name).map(|channel| at_new_values(channel, &time, step));
    let [v_x_raw, r_raw, delta] = ["v_x", "r", "delta"].map(|name| raw(name).unwrap_or_default());
    let (v_x, r) = (smooth(&v_x_raw), smooth(&r_raw));
    let v_y = raw("v_y").map(|values| smooth(&values));
    let a_y_raw = raw("a_y");
    let a_y = match &a_y_raw {
        Some(values) => smooth(values),
        None => {
            let rate = v_y.as_ref().map(|v_y| derivative(v_y, step));
            let rate = |row: usize| rate.as_ref().map_or(0.0, |rate| rate[row]);
            (0..rows).map(|row| rate(row) + v_x[row] * r[row]).collect()
        }
    };
    let wrong = near_gaps(given, &time, step);
    let counts = |row: usize| v_x[row] > sampling.least_speed && !wrong[row];
    EvenDrive {
        step,
        counts: (0..rows).map(counts).collect(),
        sensors: Some(DriveSensors {
            v: v_x_raw,
            r: r_raw,
            a_y: a_y_raw,
            a_x: raw("a_x"),
            course: sparse("course"),
            ground_speed: sparse("ground_speed"),
        }),
        r_dot: derivative(&r, step),
        lap: log.get("lap").and_then(|lap| held_channel_values(lap, &time)),
        motion: Drive {
            v_y: v_y.unwrap_or_else(|| vec![f64::NAN; rows]),
            v_x,
            r,
            a_y,
            delta,
            t: time,
            ..Drive::default()
        },
        ..EvenDrive::default()
    }
}

/// Which rows lie in a gap of a channel, or near one or an end.
fn near_gaps(given: &[(&str, ValidSamples)], time: &[f64], step: f64) -> Vec<bool> {
    let edge = (EDGE / step).round() as usize;
    let rows = time.len();
    let inner = edge..rows.saturating_sub(edge);
    let mut wrong: Vec<bool> = (0..rows).map(|row| !inner.contains(&row)).collect();
    let gap = |row: &usize| given.iter().any(|(_, channel)| !channel.has_samples_near(time[*row]));
    for row in (0..rows).filter(gap) {
        wrong[row.saturating_sub(edge)..(row + edge + 1).min(rows)].fill(true);
    }
    wrong
}

/// The values of a sensor in the rows next to its stamps, none elsewhere: a filter must not take what is held or drawn between for new.
fn at_new_values(channel: &Signal, time: &[f64], step: f64) -> Vec<f64> {
    let ValidSamples { time: stamps, value, .. } = ValidSamples::from_signal(channel);
    let mut rows = vec![f64::NAN; time.len()];
    let mut before = f64::NAN;
    for (stamp, value) in stamps.into_iter().zip(value) {
        let is_new = value != before;
        before = value;
        let row = ((stamp - time[0]) / step).round();
        if is_new && row >= 0.0 && (row as usize) < rows.len() {
            rows[row as usize] = value;
        }
    }
    rows
}

/// The values of a channel that holds, such as the number of a lap.
fn held_channel_values(channel: &Signal, time: &[f64]) -> Option<Vec<f64>> {
    let channel = ValidSamples::from_signal(channel);
    let last = |t: &f64| channel.time.partition_point(|it| it <= t).saturating_sub(1);
    (channel.time.len() > 1).then(|| time.iter().map(|t| channel.value[last(t)]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(n: usize, step: f64) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..n).map(|i| i as f64 * step).collect();
        let value = time.iter().map(|t| 5.0 + 0.1 * t).collect();
        (time, value)
    }

    const PLAIN: ResamplingOptions = ResamplingOptions { rate: None, smooth: None, least_speed: 1.0 };

    /// A log of channels with the same samples.
    fn log<'a>(names: &[&str], time: &'a [f64], value: &'a [f64]) -> DriveLog<'a> {
        let mut log = DriveLog::default();
        names.iter().for_each(|name| log.insert_borrowed(name, time, value));
        log
    }

    #[test]
    fn channels_of_different_rates_come_to_the_rows_of_the_slowest() {
        let (fast, slow) = (line(4000, 0.005), line(1000, 0.02));
        let mut channels = log(&["v_x", "delta", "v_y"], &fast.0, &fast.1);
        channels.insert_borrowed("r", &slow.0, &slow.1);
        let found = resample_log(&channels, &PLAIN).expect("it is a drive");
        assert_eq!(found.len(), 1);
        let (drive, Drive { v_x, r, a_y, .. }) = (&found[0], &found[0].motion);
        assert!((drive.step - 0.02).abs() < 1e-12);
        for row in 100..900 {
            assert!((v_x[row] - r[row]).abs() < 1e-3, "{row}");
        }
        // Without an accelerometer, v_y' + v_x r.
        assert!((a_y[500] - (0.1 + v_x[500] * r[500])).abs() < 1e-6);
    }

    #[test]
    fn gaps_edges_and_slow_rows_do_not_count() {
        let mut samples = line(1000, 0.01);
        for t in &mut samples.0[500..] {
            *t += 3.0;
        }
        let channels = log(&["v_x", "r", "delta"], &samples.0, &samples.1);
        let drive = &resample_log(&channels, &PLAIN).expect("it is a drive")[0];
        assert_eq!(drive.row_count(), 1300);
        let counts: Vec<usize> = (0..1300).filter(|row| drive.counts[*row]).collect();
        assert_eq!((counts[0], counts[counts.len() - 1]), (50, 1249));
        assert!(counts.iter().all(|row| *row < 450 || *row > 849), "{counts:?}");
        assert!(drive.motion.v_y[0].is_nan());
        let slow = resample_log(&channels, &ResamplingOptions { least_speed: 20.0, ..PLAIN });
        let message = slow.expect_err("nothing is fast enough").to_string();
        assert_eq!(message, "expected rows faster than `least_speed` = 20 m/s, found 6.00 m/s at most");
    }

    #[test]
    fn a_slow_sensor_that_is_held_has_a_value_where_it_had_a_new_one() {
        let samples = line(1000, 0.01);
        let held: Vec<f64> = (0..1000).map(|row| f64::from(row / 10 * 10) * 0.01).collect();
        let mut channels = log(&["v_x", "r", "delta"], &samples.0, &samples.1);
        channels.insert_borrowed("course", &samples.0, &held);
        let drive = &resample_log(&channels, &PLAIN).expect("it is a drive")[0];
        let course = drive.sensors.as_ref().and_then(|it| it.course.as_ref()).expect("a course");
        let rows: Vec<usize> = (0..1000).filter(|row| course[*row].is_finite()).collect();
        assert_eq!((rows.len(), rows[1], course[rows[1]]), (100, 10, 0.1));
    }

    #[test]
    fn each_log_is_a_drive_of_its_own() {
        let samples = line(1000, 0.01);
        let numbers: Vec<f64> = (0..1000).map(|i| if i < 400 { 1.0 } else { 2.0 }).collect();
        let mut channels = log(&["v_x", "r", "delta"], &samples.0, &samples.1);
        channels.insert_borrowed("log", &samples.0, &numbers);
        let found = resample_log(&channels, &PLAIN).expect("there are two");
        assert_eq!(found.iter().map(|it| (it.log, it.row_count())).collect::<Vec<_>>(), [(1, 400), (2, 600)]);
    }

    #[test]
    fn what_is_no_drive_is_told() {
        let error = resample_log(&log(&["v_x", "r", "delta"], &[0.0, 1.0], &[f64::NAN, 1.0]), &PLAIN)
            .expect_err("no drive");
        assert_eq!(error.to_string(), "`v_x`: expected two values or more");
        let (time, value) = line(50, 0.01);
        let error = resample_log(&log(&["v_x", "r", "delta"], &time, &value), &PLAIN).expect_err("too short");
        assert_eq!(error, ResamplingError::TooShort { rows: 50 });
    }
}
