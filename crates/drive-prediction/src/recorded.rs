//! Brings the channels of a log, each with its own time stamps, to the even instants of drives.

use std::fmt;

use crate::drive::{Drive, Sensors};
use crate::zero_phase::{derivative, low_pass};

/// Values over rising time stamps [s]; values that are no numbers are missing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Channel<'a> {
    /// Time stamps [s].
    pub time: &'a [f64],
    /// Values, one for each stamp.
    pub value: &'a [f64],
}

/// The channels of one log or of several, one after the other.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recorded<'a> {
    /// Forward velocity [m/s].
    pub v_x: Channel<'a>,
    /// Velocity to the left [m/s]; without it the drive has none.
    pub v_y: Option<Channel<'a>>,
    /// Yaw rate [rad/s].
    pub r: Channel<'a>,
    /// Lateral acceleration [m/s²]; without it that of the motion, v_y' + v_x r.
    pub a_y: Option<Channel<'a>>,
    /// Longitudinal acceleration [m/s²].
    pub a_x: Option<Channel<'a>>,
    /// Steering angle of the front wheels [rad].
    pub delta: Channel<'a>,
    /// Direction of travel over ground, positive to the left [rad], as of GNSS. It may leap by a turn, be slower than the others and have gaps.
    pub course: Option<Channel<'a>>,
    /// Speed over ground [m/s], as of GNSS, with the same freedom.
    pub ground_speed: Option<Channel<'a>>,
    /// Number of the lap.
    pub lap: Option<Channel<'a>>,
    /// Number of the log, from 1.
    pub log: Option<Channel<'a>>,
}

/// How channels become drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
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
pub enum Unusable {
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

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty(name) => write!(f, "`{name}`: expected two values or more"),
            Self::TooShort { rows } => write!(
                f,
                "expected a stretch of {LEAST_ROWS} rows in which all signals are there, found {rows} rows at most"
            ),
            Self::TooSlow { fastest, least } => write!(
                f,
                "expected rows faster than `least_speed` = {least} m/s, found {fastest:.2} m/s at most"
            ),
        }
    }
}

impl std::error::Error for Unusable {}

/// The drives: one for each log.
///
/// # Errors
/// If a channel is empty, no stretch has all of them, or no row is fast enough.
pub fn drives(recorded: &Recorded, sampling: &Sampling) -> Result<Vec<Drive>, Unusable> {
    let channels = [("v_x", Some(recorded.v_x)), ("r", Some(recorded.r))];
    let others = [
        ("delta", Some(recorded.delta)),
        ("v_y", recorded.v_y),
        ("a_y", recorded.a_y),
        ("a_x", recorded.a_x),
    ];
    let mut given = Vec::new();
    for (name, channel) in channels.into_iter().chain(others) {
        let Some(channel) = channel else { continue };
        let present = Present::of(channel);
        if present.time.len() < 2 {
            return Err(Unusable::Empty(name));
        }
        given.push((name, present));
    }
    let slowest = given.iter().map(|(_, it)| it.usual_step).fold(0.0, f64::max);
    let step = sampling.rate.map_or(slowest.max(1.0 / FASTEST), f64::recip);
    let spans = spans(recorded, &given);
    let mut drives = Vec::new();
    let mut longest = 0;
    for (log, [from, to]) in spans {
        let rows = if to > from { ((to - from) / step + 1e-6).floor() as usize + 1 } else { 0 };
        longest = longest.max(rows);
        if rows >= LEAST_ROWS {
            drives.push(drive(recorded, &given, sampling, (log, from, step, rows)));
        }
    }
    if drives.is_empty() {
        return Err(Unusable::TooShort { rows: longest });
    }
    if drives.iter().all(|drive| !drive.counts.contains(&true)) {
        let speeds = drives.iter().flat_map(|drive| drive.v_x.iter().copied());
        let fastest = speeds.fold(f64::NEG_INFINITY, f64::max);
        if fastest <= sampling.least_speed {
            return Err(Unusable::TooSlow { fastest, least: sampling.least_speed });
        }
        return Err(Unusable::TooShort { rows: 0 });
    }
    Ok(drives)
}

/// The values of a channel that are numbers.
struct Present {
    time: Vec<f64>,
    value: Vec<f64>,
    /// The step that nine in ten do not exceed [s].
    usual_step: f64,
}

impl Present {
    fn of(channel: Channel) -> Self {
        let mut time = Vec::new();
        let mut value = Vec::new();
        for (t, y) in channel.time.iter().zip(channel.value) {
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

    /// The value at a time [s]: the mean of the step around it where there are several values, else on the line between its neighbours.
    fn at(&self, t: f64, step: f64) -> f64 {
        let from = self.time.partition_point(|it| *it < t - 0.5 * step);
        let to = self.time.partition_point(|it| *it < t + 0.5 * step);
        if to > from + 2 {
            return self.value[from..to].iter().sum::<f64>() / (to - from) as f64;
        }
        let behind = self.time.partition_point(|it| *it <= t).clamp(1, self.time.len() - 1);
        let [t0, t1] = [self.time[behind - 1], self.time[behind]];
        let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        self.value[behind - 1] * (1.0 - share) + self.value[behind] * share
    }

    /// Whether values are so near to a time [s] that nothing is made up.
    fn covers(&self, t: f64) -> bool {
        let behind = self.time.partition_point(|it| *it <= t);
        let Some(before) = behind.checked_sub(1).map(|i| self.time[i]) else { return false };
        match self.time.get(behind) {
            Some(after) => after - before <= GAP_STEPS * self.usual_step,
            None => t - before <= 1e-9,
        }
    }
}

/// The number of each log, and the times [s] from which to which all channels are there.
fn spans(recorded: &Recorded, given: &[(&str, Present)]) -> Vec<(usize, [f64; 2])> {
    let first = given.iter().map(|(_, it)| it.time[0]).fold(f64::NEG_INFINITY, f64::max);
    let last = given.iter().map(|(_, it)| it.time[it.time.len() - 1]).fold(f64::INFINITY, f64::min);
    let Some(log) = recorded.log.map(Present::of).filter(|log| !log.time.is_empty()) else {
        return vec![(1, [first, last])];
    };
    let rows: Vec<(f64, f64)> = log.time.iter().copied().zip(log.value.iter().copied()).collect();
    let of_one = |rows: &[(f64, f64)]| {
        let ends = [rows[0].0.max(first), rows[rows.len() - 1].0.min(last)];
        (rows[0].1.max(0.0) as usize, ends)
    };
    rows.chunk_by(|a, b| a.1 == b.1).map(of_one).collect()
}

fn drive(
    recorded: &Recorded,
    given: &[(&str, Present)],
    sampling: &Sampling,
    (log, from, step, rows): (usize, f64, f64, usize),
) -> Drive {
    let time: Vec<f64> = (0..rows).map(|row| from + row as f64 * step).collect();
    let raw = |name: &str| {
        let (_, channel) = given.iter().find(|(it, _)| *it == name)?;
        Some(time.iter().map(|t| channel.at(*t, step)).collect::<Vec<f64>>())
    };
    let smooth = |values: &[f64]| match sampling.smooth {
        Some(cut) => low_pass(values, cut, step),
        None => values.to_vec(),
    };
    let [v_x_raw, r_raw, delta] = ["v_x", "r", "delta"].map(|name| raw(name).unwrap_or_default());
    let (v_x, r) = (smooth(&v_x_raw), smooth(&r_raw));
    let v_y = raw("v_y").map(|values| smooth(&values));
    let a_y_raw = raw("a_y");
    let a_y = match (&a_y_raw, &v_y) {
        (Some(values), _) => smooth(values),
        (None, v_y) => {
            let rate = v_y.as_ref().map(|v_y| derivative(v_y, step));
            let rate = |row: usize| rate.as_ref().map_or(0.0, |rate| rate[row]);
            (0..rows).map(|row| rate(row) + v_x[row] * r[row]).collect()
        }
    };
    let wrong = near_gaps(given, &time, step);
    let counts = |row: usize| v_x[row] > sampling.least_speed && !wrong[row];
    let lap = recorded.lap.and_then(|lap| held(lap, &time));
    Drive {
        name: format!("log {log}"),
        log,
        step,
        counts: (0..rows).map(counts).collect(),
        sensors: Some(Sensors {
            v: v_x_raw,
            r: r_raw,
            a_y: a_y_raw,
            a_x: raw("a_x"),
            course: recorded.course.map(|it| sampled(it, &time, step)),
            ground_speed: recorded.ground_speed.map(|it| sampled(it, &time, step)),
        }),
        r_dot: derivative(&r, step),
        v_y: v_y.unwrap_or_else(|| vec![f64::NAN; rows]),
        v_x,
        r,
        a_y,
        delta,
        lap,
        time,
    }
}

/// Which rows lie in a gap of a channel, or near one or an end.
fn near_gaps(given: &[(&str, Present)], time: &[f64], step: f64) -> Vec<bool> {
    let edge = (EDGE / step).round() as usize;
    let rows = time.len();
    let inner = edge..rows.saturating_sub(edge);
    let mut wrong: Vec<bool> = (0..rows).map(|row| !inner.contains(&row)).collect();
    let gap = |row: &usize| given.iter().any(|(_, channel)| !channel.covers(time[*row]));
    for row in (0..rows).filter(gap) {
        wrong[row.saturating_sub(edge)..(row + edge + 1).min(rows)].fill(true);
    }
    wrong
}

/// The values of a sensor in the rows next to its stamps, none elsewhere: a filter must not take what is held or drawn between for new.
fn sampled(channel: Channel, time: &[f64], step: f64) -> Vec<f64> {
    let Present { time: stamps, value, .. } = Present::of(channel);
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
fn held(channel: Channel, time: &[f64]) -> Option<Vec<f64>> {
    let channel = Present::of(channel);
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

    const PLAIN: Sampling = Sampling { rate: None, smooth: None, least_speed: 1.0 };

    #[test]
    fn channels_of_different_rates_come_to_the_rows_of_the_slowest() {
        let ((fast_t, fast), (slow_t, slow)) = (line(4000, 0.005), line(1000, 0.02));
        let fast = Channel { time: &fast_t, value: &fast };
        let slow = Channel { time: &slow_t, value: &slow };
        let recorded =
            Recorded { v_x: fast, r: slow, delta: fast, v_y: Some(fast), ..Recorded::default() };
        let found = drives(&recorded, &PLAIN).expect("it is a drive");
        assert_eq!(found.len(), 1);
        let drive = &found[0];
        assert!((drive.step - 0.02).abs() < 1e-12);
        for row in 100..900 {
            assert!((drive.v_x[row] - drive.r[row]).abs() < 1e-3, "{row}");
        }
        // Without an accelerometer, v_y' + v_x r.
        assert!((drive.a_y[500] - (0.1 + drive.v_x[500] * drive.r[500])).abs() < 1e-6);
    }

    #[test]
    fn gaps_edges_and_slow_rows_do_not_count() {
        let (mut time, value) = line(1000, 0.01);
        for t in &mut time[500..] {
            *t += 3.0;
        }
        let channel = Channel { time: &time, value: &value };
        let recorded = Recorded { v_x: channel, r: channel, delta: channel, ..Recorded::default() };
        let drive = &drives(&recorded, &PLAIN).expect("it is a drive")[0];
        assert_eq!(drive.rows(), 1300);
        let counts: Vec<usize> = (0..1300).filter(|row| drive.counts[*row]).collect();
        assert_eq!((counts[0], counts[counts.len() - 1]), (50, 1249));
        assert!(counts.iter().all(|row| *row < 450 || *row > 849), "{counts:?}");
        assert!(drive.v_y[0].is_nan());
        let slow = drives(&recorded, &Sampling { least_speed: 20.0, ..PLAIN });
        let message = slow.expect_err("nothing is fast enough").to_string();
        assert_eq!(
            message,
            "expected rows faster than `least_speed` = 20 m/s, found 6.00 m/s at most"
        );
    }

    #[test]
    fn a_slow_sensor_that_is_held_has_a_value_where_it_had_a_new_one() {
        let (time, value) = line(1000, 0.01);
        let channel = Channel { time: &time, value: &value };
        let held: Vec<f64> = (0..1000).map(|row| f64::from(row / 10 * 10) * 0.01).collect();
        let course = Some(Channel { time: &time, value: &held });
        let recorded =
            Recorded { v_x: channel, r: channel, delta: channel, course, ..Recorded::default() };
        let drive = &drives(&recorded, &PLAIN).expect("it is a drive")[0];
        let course = drive.sensors.as_ref().and_then(|it| it.course.as_ref()).expect("a course");
        let rows: Vec<usize> = (0..1000).filter(|row| course[*row].is_finite()).collect();
        assert_eq!((rows.len(), rows[1], course[rows[1]]), (100, 10, 0.1));
    }

    #[test]
    fn each_log_is_a_drive_of_its_own() {
        let (time, value) = line(1000, 0.01);
        let log: Vec<f64> = (0..1000).map(|i| if i < 400 { 1.0 } else { 2.0 }).collect();
        let channel = Channel { time: &time, value: &value };
        let log = Some(Channel { time: &time, value: &log });
        let recorded =
            Recorded { v_x: channel, r: channel, delta: channel, log, ..Recorded::default() };
        let found = drives(&recorded, &PLAIN).expect("there are two");
        assert_eq!(
            found.iter().map(|it| (it.log, it.rows())).collect::<Vec<_>>(),
            [(1, 400), (2, 600)]
        );
    }

    #[test]
    fn what_is_no_drive_is_told() {
        let channel = Channel { time: &[0.0, 1.0], value: &[f64::NAN, 1.0] };
        let recorded = Recorded { v_x: channel, r: channel, delta: channel, ..Recorded::default() };
        let error = drives(&recorded, &PLAIN).expect_err("it is no drive");
        assert_eq!(error.to_string(), "`v_x`: expected two values or more");
        let (time, value) = line(50, 0.01);
        let channel = Channel { time: &time, value: &value };
        let recorded = Recorded { v_x: channel, r: channel, delta: channel, ..Recorded::default() };
        let error = drives(&recorded, &PLAIN).expect_err("it is too short");
        assert_eq!(error, Unusable::TooShort { rows: 50 });
    }
}
