//! Looks for channels that do not move: dead, frozen for a while, or at the end of their range.

use std::ops::Range;

use numerics::text::significant;
use preparation::Signal;

use crate::case::Case;
use crate::finding::{Finding, Sure};
use crate::motion::{Motion, median_step, quantile};

/// Channels that nothing limits but the range of a sensor. Steering and force have stops of their own.
const SENSORS: [&str; 5] = ["v_x", "v_y", "r", "a_x", "a_y"];

/// Checks all channels; dead ones are left out of all that follows.
pub(crate) fn check(case: &mut Case) {
    let names: Vec<_> = case.signals.keys().copied().collect();
    for name in names {
        let Some(signal) = case.signals.get(name) else { continue };
        if signal.value.len() < 5 {
            continue;
        }
        let constant = signal.value.iter().all(|value| *value == signal.value[0]);
        if constant {
            dead(case, name);
        } else {
            saturated(case, name);
            frozen(case, name);
        }
    }
}

fn dead(case: &mut Case, name: &'static str) {
    let value = significant(case.signals[name].value[0], 4);
    let (sure, why) = match name {
        "F_x" => match speed_changes(case) {
            Some(rate) => (
                Sure::Certain,
                format!(" although `v_x` changes by up to {} m/s2", significant(rate, 2)),
            ),
            None => (Sure::Possible, String::new()),
        },
        "delta" => match curvature_changes(case) {
            true => (Sure::Certain, " although the curvature of the path changes".to_owned()),
            false => (Sure::Possible, String::new()),
        },
        _ => (Sure::Certain, String::new()),
    };
    case.report(Finding {
        check: format!("{name}_dead"),
        channels: vec![name],
        sure,
        value: Some(case.signals[name].value[0]),
        interval: None,
        sentence: format!("`{name}` is {value} in all rows{why}."),
        consequence: match name {
            "F_x" => "What drives and brakes the car is taken for noise; peak and curvature of the tires make up for it.",
            "delta" => "A front axle that is not steered cannot be identified.",
            _ => "The fit bends the tires until the car moves as this channel says.",
        }
        .to_owned(),
        correction: format!("Record `{name}`, or leave it out."),
        refuses: true,
    });
    case.signals.remove(name);
}

/// The largest usual change of speed [m/s²], if the speed changes.
fn speed_changes(case: &Case) -> Option<f64> {
    let motion = Motion::of(case)?;
    let rate = motion.smooth(&motion.raw("v_x"), 0.3, 1);
    let usual = quantile(rate.iter().map(|rate| rate.abs()), 0.95);
    (usual > 0.3).then_some(usual)
}

fn curvature_changes(case: &Case) -> bool {
    let Some(motion) = Motion::of(case) else { return false };
    let moving = 0.5 * quantile(motion.raw("v_x"), 0.95);
    let curvature =
        motion.combine("r", "v_x", |r, v_x| if v_x > moving { r / v_x } else { f64::NAN });
    let curvature = motion.smooth(&curvature, 0.3, 0);
    let ends = [0.05, 0.95].map(|share| quantile(curvature.iter().copied(), share));
    ends[1] - ends[0] > 0.7 * ends[0].abs().max(ends[1].abs())
}

/// Ranges of rows with one value.
fn runs(signal: &Signal) -> Vec<Range<usize>> {
    let mut from = 0;
    let run = |run: &[f64]| {
        from += run.len();
        from - run.len()..from
    };
    signal.value.chunk_by(|a, b| a == b).map(run).collect()
}

fn frozen(case: &mut Case, name: &'static str) {
    if !SENSORS.contains(&name) {
        return;
    }
    let signal = &case.signals[name];
    let runs = runs(signal);
    let step = median_step(&signal.time);
    let usual = quantile(runs.iter().map(|run| run.len() as f64), 0.95);
    let top =
        case.signals.get("v_x").map_or(f64::NAN, |v_x| quantile(v_x.value.iter().copied(), 0.95));
    let moves = |run: &&Range<usize>| {
        let Some(v_x) = case.signals.get("v_x") else { return true };
        let middle = signal.time[(run.start + run.end) / 2];
        let row = v_x.time.partition_point(|t| *t < middle).min(v_x.value.len() - 1);
        v_x.value[row].abs() > 0.2 * top.abs()
    };
    let long =
        |run: &&Range<usize>| run.len() as f64 * step > 1.0 && run.len() as f64 > 10.0 * usual;
    let longest = runs.iter().filter(long).filter(moves).max_by_key(|run| run.len());
    let Some(run) = longest else { return };
    let [value, from, seconds] =
        [signal.value[run.start], signal.time[run.start], run.len() as f64 * step]
            .map(|x| significant(x, 4));
    let run = run.clone();
    let stuck = signal.value[run.start];
    if let Some(signal) = case.signals.get_mut(name) {
        leave_out(signal, |value| value == stuck);
    }
    case.report(Finding {
        check: format!("{name}_frozen"),
        channels: vec![name],
        sure: Sure::Certain,
        value: Some(run.len() as f64 * step),
        interval: None,
        sentence: format!(
            "`{name}` stays at {value} for {seconds} s from {from} s on, while the car drives."
        ),
        consequence: "The fit bends the tires until the car moves as this channel says.".to_owned(),
        correction: format!(
            "windows = [[FROM, UNTIL], ...]  # without the {seconds} s from {from} s on"
        ),
        refuses: true,
    });
}

/// Runs at one end of the range that are longer than those elsewhere.
fn plateaus(signal: &Signal, end: f64) -> Vec<Range<usize>> {
    let (at, others): (Vec<_>, Vec<_>) =
        runs(signal).into_iter().partition(|run| signal.value[run.start] == end);
    let usual = quantile(others.iter().map(|run| run.len() as f64), 0.99).max(1.0);
    let long: Vec<_> =
        at.into_iter().filter(|run| run.len() as f64 >= (3.0 * usual).max(3.0)).collect();
    let rows: usize = long.iter().map(|run| run.len()).sum();
    // A single plateau can be a standstill.
    let none = long.len() < 2 || end == 0.0 || (rows as f64) < 0.0005 * signal.value.len() as f64;
    if none { Vec::new() } else { long }
}

fn saturated(case: &mut Case, name: &'static str) {
    let Some(signal) = case.signals.get_mut(name) else { return };
    let ends = [f64::min, f64::max].map(|f| signal.value.iter().copied().fold(signal.value[0], f));
    let plateaus = ends.map(|end| plateaus(signal, end));
    let count = plateaus[0].len() + plateaus[1].len();
    if count == 0 {
        return;
    }
    let sensor = SENSORS.contains(&name);
    let rows: usize = plateaus.iter().flatten().map(|run| run.len()).sum();
    let share = significant(100.0 * rows as f64 / signal.value.len() as f64, 2);
    let at = ends.iter().zip(&plateaus).filter(|(_, plateaus)| !plateaus.is_empty());
    let at: Vec<String> = at.map(|(end, _)| significant(*end, 4)).collect();
    if sensor {
        // The car was somewhere beyond.
        leave_out(signal, |value| ends.contains(&value));
    }
    case.report(Finding {
        check: format!("{name}_saturated"),
        channels: vec![name],
        sure: if sensor { Sure::Certain } else { Sure::Possible },
        value: None,
        interval: None,
        sentence: format!(
            "`{name}` ends at {}: it stays there {count} times, in {share} % of the rows.",
            at.join(" and ")
        ),
        consequence: match sensor {
            true => "The peak of the tires is that of the sensor's range.",
            false => {
                "If this is the sensor's end and not the actuator's, the tires get what is missing."
            }
        }
        .to_owned(),
        correction: "Widen the range of the sensor, or use windows in which it is not reached."
            .to_owned(),
        refuses: sensor,
    });
}

/// Leaves values out; their rows stay, or someone would draw a line from before to after.
fn leave_out(signal: &mut Signal, wrong: impl Fn(f64) -> bool) {
    signal.value.iter_mut().filter(|value| wrong(**value)).for_each(|value| *value = f64::NAN);
}
