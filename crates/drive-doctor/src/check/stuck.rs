//! Looks for channels that do not move: dead, frozen for a while, or at the end of their range.

use std::ops::Range;

use numerics::text::format_significant;
use preparation::Signal;

use crate::case::ExaminedLog;
use crate::channel::channel_unit;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::ResampledChannels;
use crate::statistics::{median_step, quantile, value_range};

/// Channels that nothing limits but the range of a sensor. Steering and force have stops of their own.
const SENSORS: [&str; 5] = ["v_x", "v_y", "r", "a_x", "a_y"];
/// Channels that are 0 for long when a wheel is locked, but keep no other value.
const WHEELS: [&str; 4] = ["omega_fl", "omega_fr", "omega_rl", "omega_rr"];
/// A channel that keeps its value for as long [s] is frozen.
const FROZEN: f64 = 1.0;

/// Checks all channels; dead ones are left out of all that follows.
pub(crate) fn check_stuck_channels(case: &mut ExaminedLog) {
    let names: Vec<_> = case.signals.keys().copied().collect();
    for name in names {
        let Some(signal) = case.signals.get(name) else { continue };
        if signal.value.len() < 5 {
            continue;
        }
        let constant = signal.value.iter().all(|value| *value == signal.value[0]);
        if constant {
            report_dead_channel(case, name);
        } else {
            report_saturation(case, name);
            report_frozen_runs(case, name);
        }
    }
}

fn report_dead_channel(case: &mut ExaminedLog, name: &'static str) {
    if name == "v_x" && speed_is_constant(case) {
        return constant_speed(case);
    }
    let value = format_significant(case.signals[name].value[0], 4);
    let (sure, why) = match name {
        "F_x" => match usual_speed_rate(case) {
            Some(rate) => (
                Certainty::Certain,
                format!(" although `v_x` changes by up to {} m/s2", format_significant(rate, 2)),
            ),
            None => (Certainty::Possible, String::new()),
        },
        "delta" => match curvature_changes(case) {
            true => (Certainty::Certain, " although the curvature of the path changes".to_owned()),
            false => (Certainty::Possible, String::new()),
        },
        _ => (Certainty::Certain, String::new()),
    };
    case.add_finding(LogFinding {
        check: format!("{name}_dead"),
        channels: vec![name],
        sure,
        value: Some(case.signals[name].value[0]),
        interval: None,
        unit: channel_unit(name),
        sentence: format!("`{name}` is {value} in all rows{why}."),
        consequence: match name {
            "F_x" => {
                "What drives and brakes the car is taken for noise; peak and curvature of the tires make up for it."
            }
            "delta" => "A front axle that is not steered cannot be identified.",
            _ => "The fit bends the tires until the car moves as this channel says.",
        }
        .to_owned(),
        correction: LogCorrection::from_advice(format!("Record `{name}`, or leave it out.")),
        refuses: true,
    });
    case.signals.remove(name);
}

/// Reports a speed that the car keeps: logs of simulators have one, and the usual exercise does.
fn constant_speed(case: &mut ExaminedLog) {
    let speed = case.signals["v_x"].value[0];
    case.add_finding(LogFinding {
        check: "v_x_constant".to_owned(),
        channels: vec!["v_x"],
        sure: Certainty::Possible,
        value: Some(speed),
        interval: None,
        unit: channel_unit("v_x"),
        sentence: format!(
            "`v_x` is {} in all rows, and the other channels agree with it.",
            format_significant(speed, 4)
        ),
        consequence: "If it is a set speed and not a measured one, the tires get what is missing.".to_owned(),
        correction: LogCorrection::from_advice("Nothing, where the speed was held or simulated."),
        refuses: false,
    });
}

/// Whether the other channels say that a constant `v_x` is true: the accelerations are those of a turn at this speed, and wheels keep
/// theirs. Without `r` and `a_y` nothing says so.
fn speed_is_constant(case: &ExaminedLog) -> bool {
    /// Largest share that a_y may be off, and that wheels may vary [-].
    const SHARE: f64 = 0.1;
    /// Largest acceleration along the path, root mean square [m/s²].
    const ALONG: f64 = 0.3;
    /// Width of the filter [s].
    const SIGMA: f64 = 0.1;
    let Some(motion) = ResampledChannels::from_log(case).filter(|_| case.has_channels(&["r", "a_y"])) else {
        return false;
    };
    let smooth = |column: &[f64], order| motion.gaussian_filter(column, SIGMA, order);
    let mean_square = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values
            .filter(|it| it.is_finite())
            .fold((0.0, 0.0), |(sum, count), it| (sum + it * it, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let or_zero = |name: &str, column: Vec<f64>| match case.has_channels(&[name]) {
        true => column,
        false => vec![0.0; column.len()],
    };
    let v_y_rate = or_zero("v_y", smooth(&motion.channel_values("v_y"), 1));
    let turning = smooth(&motion.combine_channels("r", "v_x", |r, v_x| r * v_x), 0);
    let a_y = smooth(&motion.channel_values("a_y"), 0);
    let across = || a_y.iter().zip(&v_y_rate).zip(&turning);
    let miss = mean_square(&mut across().map(|((a_y, rate), turning)| a_y - rate - turning));
    let turns = mean_square(&mut turning.iter().copied());
    let along = or_zero("v_y", motion.combine_channels("v_y", "r", |v_y, r| v_y * r));
    let a_x = or_zero("a_x", motion.channel_values("a_x"));
    let driven: Vec<f64> = a_x.iter().zip(&along).map(|(a_x, along)| a_x + along).collect();
    let driven = match case.has_channels(&["a_x"]) {
        true => mean_square(&mut smooth(&driven, 0).into_iter()),
        false => 0.0,
    };
    let wheel_keeps_speed = |name: &&&str| {
        let values = || case.signals[**name].value.iter().copied();
        let [low, high] = [0.05, 0.95].map(|share| quantile(values(), share));
        // The wheels of a car that turns run at different speeds.
        high - low <= 2.0 * SHARE * high.abs().max(low.abs())
    };
    turns > 0.0
        && miss < SHARE * SHARE * turns
        && driven < ALONG * ALONG
        && WHEELS.iter().filter(|name| case.has_channels(&[name])).all(|name| wheel_keeps_speed(&name))
}

/// The largest usual change of speed [m/s²], if the speed changes.
fn usual_speed_rate(case: &ExaminedLog) -> Option<f64> {
    let motion = ResampledChannels::from_log(case)?;
    let rate = motion.gaussian_filter(&motion.channel_values("v_x"), 0.3, 1);
    let usual = quantile(rate.iter().map(|rate| rate.abs()), 0.95);
    (usual > 0.3).then_some(usual)
}

fn curvature_changes(case: &ExaminedLog) -> bool {
    let Some(motion) = ResampledChannels::from_log(case) else { return false };
    let moving = 0.5 * quantile(motion.channel_values("v_x"), 0.95);
    let curvature =
        motion.combine_channels("r", "v_x", |r, v_x| if v_x > moving { r / v_x } else { f64::NAN });
    let curvature = motion.gaussian_filter(&curvature, 0.3, 0);
    let ends = [0.05, 0.95].map(|share| quantile(curvature.iter().copied(), share));
    ends[1] - ends[0] > 0.7 * ends[0].abs().max(ends[1].abs())
}

/// Ranges of rows with one value.
fn equal_value_runs(signal: &Signal) -> Vec<Range<usize>> {
    let mut from = 0;
    let run = |run: &[f64]| {
        from += run.len();
        from - run.len()..from
    };
    signal.value.chunk_by(|a, b| a == b).map(run).collect()
}

/// Reports runs of one value while the car drives, and leaves all of them out.
fn report_frozen_runs(case: &mut ExaminedLog, name: &'static str) {
    if !SENSORS.contains(&name) && !WHEELS.contains(&name) {
        return;
    }
    let signal = &case.signals[name];
    let runs = equal_value_runs(signal);
    let step = median_step(&signal.time);
    let usual = quantile(runs.iter().map(|run| run.len() as f64), 0.5);
    let seconds = |run: &Range<usize>| signal.time[run.end - 1] - signal.time[run.start] + step;
    let long = |run: &Range<usize>| {
        let locked = WHEELS.contains(&name) && signal.value[run.start] == 0.0;
        !locked && seconds(run) > FROZEN && run.len() as f64 > 10.0 * usual
    };
    let frozen: Vec<Range<usize>> =
        runs.into_iter().filter(|run| long(run) && is_car_driving(case, signal, run)).collect();
    let Some(longest) = frozen.iter().max_by(|a, b| seconds(a).total_cmp(&seconds(b))) else {
        return;
    };
    let (longest_seconds, stamps) = (seconds(longest), value_range(&signal.time));
    let [value, from, text] = [signal.value[longest.start], signal.time[longest.start], longest_seconds]
        .map(|x| format_significant(x, 4));
    let times = match frozen.len() {
        1 => String::new(),
        count => format!(", the longest of {count} times"),
    };
    let wrong: Vec<[f64; 2]> =
        frozen.iter().map(|run| [signal.time[run.start], signal.time[run.end - 1] + step]).collect();
    if let Some(signal) = case.signals.get_mut(name) {
        frozen.iter().for_each(|run| signal.value.to_mut()[run.clone()].fill(f64::NAN));
    }
    case.add_finding(LogFinding {
        check: format!("{name}_frozen"),
        channels: vec![name],
        sure: Certainty::Certain,
        value: Some(longest_seconds),
        interval: None,
        unit: "s",
        sentence: format!(
            "`{name}` stays at {value} for {text} s from {from} s on while the car drives{times}."
        ),
        consequence: "The fit bends the tires until the car moves as this channel says.".to_owned(),
        correction: LogCorrection::for_excluded_stretches(&wrong, stamps),
        refuses: true,
    });
}

/// Whether the car drives in the middle of a run, as far as `v_x` says.
fn is_car_driving(case: &ExaminedLog, signal: &Signal, run: &Range<usize>) -> bool {
    let Some(v_x) = case.signals.get("v_x").filter(|v_x| !v_x.value.is_empty()) else {
        return true;
    };
    let top = quantile(v_x.value.iter().map(|v_x| v_x.abs()), 0.95);
    let middle = signal.time[(run.start + run.end) / 2];
    let row = v_x.time.partition_point(|t| *t < middle).min(v_x.value.len() - 1);
    v_x.value[row].abs() > 0.2 * top
}

/// Runs at one end of the range that are longer than those elsewhere.
fn saturation_plateaus(signal: &Signal, end: f64) -> Vec<Range<usize>> {
    let (at, others): (Vec<_>, Vec<_>) =
        equal_value_runs(signal).into_iter().partition(|run| signal.value[run.start] == end);
    let usual = quantile(others.iter().map(|run| run.len() as f64), 0.99).max(1.0);
    let long: Vec<_> = at.into_iter().filter(|run| run.len() as f64 >= (3.0 * usual).max(3.0)).collect();
    let rows: usize = long.iter().map(|run| run.len()).sum();
    // A single plateau can be a standstill.
    let none = long.len() < 2 || end == 0.0 || (rows as f64) < 0.0005 * signal.value.len() as f64;
    if none { Vec::new() } else { long }
}

fn report_saturation(case: &mut ExaminedLog, name: &'static str) {
    let Some(signal) = case.signals.get_mut(name) else { return };
    let ends = value_range(&signal.value);
    let plateaus = ends.map(|end| saturation_plateaus(signal, end));
    let count = plateaus[0].len() + plateaus[1].len();
    if count == 0 {
        return;
    }
    let sensor = SENSORS.contains(&name);
    let rows: usize = plateaus.iter().flatten().map(|run| run.len()).sum();
    let all = signal.value.len();
    let share = format_significant(100.0 * rows as f64 / all as f64, 2);
    let at = ends.iter().zip(&plateaus).filter(|(_, plateaus)| !plateaus.is_empty());
    let at: Vec<String> = at.map(|(end, _)| format_significant(*end, 4)).collect();
    if sensor {
        // The car was somewhere beyond.
        replace_by_nan(signal, |value| ends.contains(&value));
        case.cut_off.push(name);
    }
    case.add_finding(LogFinding {
        check: format!("{name}_saturated"),
        channels: vec![name],
        sure: if sensor { Certainty::Certain } else { Certainty::Possible },
        value: Some(rows as f64 / all as f64),
        interval: None,
        unit: "1",
        sentence: format!(
            "`{name}` ends at {}: it stays there {count} times, in {share} % of the rows.",
            at.join(" and ")
        ),
        consequence: match sensor {
            true => "The peak of the tires is that of the sensor's range.",
            false => "If this is the sensor's end and not the actuator's, the tires get what is missing.",
        }
        .to_owned(),
        correction: LogCorrection::from_advice(
            "Widen the range of the sensor, or use stretches (`during`) in which it is not reached.",
        ),
        refuses: sensor,
    });
}

/// Leaves values out; their rows stay, or someone would draw a line from before to after.
fn replace_by_nan(signal: &mut Signal, wrong: impl Fn(f64) -> bool) {
    let values = signal.value.to_mut().iter_mut();
    values.filter(|value| wrong(**value)).for_each(|value| *value = f64::NAN);
}
