//! Looks at time stamps: their unit, their order, gaps, and how evenly they follow each other.

use numerics::text::format_significant;

use crate::case::ExaminedLog;
use crate::correction::{CorrectionKey, LogCorrection};
use crate::finding::{Certainty, LogFinding};
use crate::statistics::{median, median_step, quantile, value_range};

/// Median steps between a gap's ends.
const GAP: f64 = 5.0;
/// Steps vary by this share of their median before it is worth a word.
const UNEVEN: f64 = 0.3;
/// No log of a drive has rows further apart [s].
const LONGEST_STEP: f64 = 1.5;
/// Rows as far apart [s] can be those of a slow log, or stamps in ms of one at 1 kHz.
const DOUBTFUL_STEP: f64 = 0.9;
/// Rows further apart [s] miss the answer of a car to its steering; those as far apart miss the turns, too.
const SLOW_STEP: f64 = 0.15;
const BLIND_STEP: f64 = 0.5;
/// Share of rows that are missing from which on it is likely to matter.
const MANY: f64 = 0.01;

/// Checks the time stamps of all channels; those with the same stamps together.
pub(crate) fn check_time_stamps(case: &mut ExaminedLog) {
    drop_rows_without_values(case);
    for names in group_by_time_stamps(case) {
        drop_unordered_rows(case, &names);
        correct_time_unit(case, &names);
        let Some(signal) = case.signals.get(names[0]) else { continue };
        let time = signal.time.clone();
        if time.len() < 3 {
            continue;
        }
        report_low_sampling_rate(case, &names, &time);
        report_gaps(case, &names, &time);
        report_missing_rows(case, &names, &time);
        report_jitter(case, &names, &time);
    }
}

/// Names of channels that have the same time stamps.
fn group_by_time_stamps(case: &ExaminedLog) -> Vec<Vec<&'static str>> {
    let mut groups: Vec<Vec<&'static str>> = Vec::new();
    for (&name, signal) in &case.signals {
        let same = |group: &&mut Vec<&'static str>| case.signals[group[0]].time == signal.time;
        match groups.iter_mut().find(same) {
            Some(group) => group.push(name),
            None => groups.push(vec![name]),
        }
    }
    groups
}

/// Leaves out rows without a number: what is missing shows in the time stamps of the channel.
fn drop_rows_without_values(case: &mut ExaminedLog) {
    for signal in case.signals.values_mut() {
        let whole = |row: &usize| signal.time[*row].is_finite() && signal.value[*row].is_finite();
        if !(0..signal.time.len()).all(|row| whole(&row)) {
            *signal = signal.select_rows((0..signal.time.len()).filter(whole));
        }
    }
    let empty: Vec<_> =
        case.signals.iter().filter(|(_, it)| it.time.is_empty()).map(|(name, _)| *name).collect();
    for name in empty {
        case.signals.remove(name);
        case.add_open_question(
            "a channel without values",
            format!("`{name}` has no number in any row"),
            "Record it, or leave it out.",
        );
    }
}

/// Rows that are missing here and there, where neighbours are steps apart. Those in gaps are told as gaps.
fn report_missing_rows(case: &mut ExaminedLog, names: &[&'static str], time: &[f64]) {
    let step = median_step(time);
    let steps = || time.windows(2).map(|pair| (pair[1] - pair[0]) / step);
    let lost: f64 = steps().filter(|it| (1.5..=GAP).contains(it)).map(|it| it.round() - 1.0).sum();
    // A stamp that came late makes a long step and a short one.
    let short = steps().filter(|it| *it < 0.5).count() as f64;
    let count = lost - short;
    let share = count / (time.len() as f64 + count);
    if count < 1.0 || share < 0.1 * MANY {
        return;
    }
    let all = names.join("`, `");
    let percent = format_significant(100.0 * share, 2);
    case.add_finding(LogFinding {
        check: "missing_rows".to_owned(),
        channels: names.to_vec(),
        sure: if share > MANY { Certainty::Likely } else { Certainty::Possible },
        value: Some(count),
        interval: None,
        unit: "1",
        sentence: format!("{count} rows without a value ({percent} %) are scattered over `{all}`."),
        consequence: "A value that is filled in is a motion that the car did not make.".to_owned(),
        correction: LogCorrection::from_column_keys(&[CorrectionKey::Gaps("interpolate")])
            .with_note("for a row or two at a time; longer gaps end a recording"),
        refuses: false,
    });
}

/// Says that rows are too far apart for the motion of a car.
fn report_low_sampling_rate(case: &mut ExaminedLog, names: &[&'static str], time: &[f64]) {
    let step = median_step(time);
    if step.is_nan() || step < SLOW_STEP {
        return;
    }
    let text = format_significant(step, 3);
    case.add_finding(LogFinding {
        check: "slow_sampling".to_owned(),
        channels: names.to_vec(),
        sure: if step < BLIND_STEP { Certainty::Likely } else { Certainty::Certain },
        value: Some(step),
        interval: None,
        unit: "s",
        sentence: format!(
            "Rows are {text} s apart, in which a car answers its steering: 0.05 s or less are needed."
        ),
        consequence: "Rates of change are too small: what lies between the rows is taken for slip."
            .to_owned(),
        correction: LogCorrection::from_advice("Record at 20 Hz or more."),
        refuses: step >= BLIND_STEP,
    });
}

/// Reports stamps that do not rise and drops their rows.
fn drop_unordered_rows(case: &mut ExaminedLog, names: &[&'static str]) {
    let Some(signal) = case.signals.get(names[0]) else { return };
    let time = signal.time.clone();
    let mut latest = f64::NEG_INFINITY;
    let rises: Vec<bool> = time
        .iter()
        .map(|&t| {
            let rises = t > latest;
            latest = latest.max(t);
            rises
        })
        .collect();
    let Some(first) = rises.iter().position(|rises| !rises) else { return };
    let count = rises.iter().filter(|rises| !**rises).count();
    let (before, found) = (time[first - 1], time[first]);
    for name in names {
        if let Some(signal) = case.signals.get_mut(name) {
            *signal = signal.select_rows((0..rises.len()).filter(|row| rises[*row]));
        }
    }
    case.add_finding(LogFinding {
        check: "time_order".to_owned(),
        channels: names.to_vec(),
        sure: Certainty::Certain,
        value: Some(count as f64),
        interval: None,
        unit: "1",
        sentence: format!(
            "The time does not rise in {count} rows; row {first} has {found} s after {before} s."
        ),
        consequence: "Rates of change have no meaning across such rows.".to_owned(),
        correction: LogCorrection::from_advice("Remove these rows, or sort the rows by time."),
        refuses: true,
    });
}

/// Finds time stamps in ms, µs or ns by a step that no log has, and brings them to seconds.
fn correct_time_unit(case: &mut ExaminedLog, names: &[&'static str]) {
    let Some(signal) = case.signals.get(names[0]) else { return };
    let step = median_step(&signal.time);
    let (factor, word) = match step {
        step if step < DOUBTFUL_STEP || step.is_nan() => return,
        step if step < LONGEST_STEP && !has_slow_channel(case, names) => return,
        step if step < 1e3 => (1e3, "ms"),
        step if step < 1e6 => (1e6, "us"),
        _ => (1e9, "ns"),
    };
    for name in names {
        if let Some(signal) = case.signals.get_mut(name) {
            signal.time.to_mut().iter_mut().for_each(|time| *time /= factor);
        }
    }
    let step = format_significant(step, 4);
    case.add_finding(LogFinding {
        check: "time_unit".to_owned(),
        channels: names.to_vec(),
        sure: Certainty::Certain,
        value: Some(factor),
        interval: None,
        unit: "1",
        sentence: format!("The time is in {word}, not s: rows are {step} apart."),
        consequence: format!("All rates of change are {factor} times too small."),
        correction: LogCorrection::time_unit(word),
        refuses: true,
    });
}

/// Whether a channel changes far less from row to row than within 300 of them: a car that is logged once a second does not.
fn has_slow_channel(case: &ExaminedLog, names: &[&'static str]) -> bool {
    const APART: usize = 300;
    let rate = |name: &&'static str| {
        let value = &case.signals[*name].value;
        let change =
            |rows: usize| median(value.iter().zip(value.iter().skip(rows)).map(|(a, b)| (b - a).abs()));
        change(1) / change(APART)
    };
    names.iter().map(rate).any(|rate| rate < 0.05)
}

fn report_gaps(case: &mut ExaminedLog, names: &[&'static str], time: &[f64]) {
    let step = median_step(time);
    let gaps: Vec<_> = time.windows(2).filter(|pair| pair[1] - pair[0] > GAP * step).collect();
    let length = |pair: &[f64]| pair[1] - pair[0];
    let Some(longest) = gaps.iter().max_by(|a, b| length(a).total_cmp(&length(b))) else { return };
    let (count, seconds) = (gaps.len(), length(longest));
    let (at, seconds_text) = (format_significant(longest[0], 6), format_significant(seconds, 3));
    let lost: f64 = gaps.iter().map(|pair| length(pair) - step).sum();
    let wrong: Vec<[f64; 2]> = gaps.iter().map(|pair| [pair[0], pair[1]]).collect();
    let serious = seconds > 0.2 || lost > 0.01 * (time[time.len() - 1] - time[0]);
    case.add_finding(LogFinding {
        check: "gap".to_owned(),
        channels: names.to_vec(),
        sure: if serious { Certainty::Certain } else { Certainty::Possible },
        value: Some(seconds),
        interval: None,
        unit: "s",
        sentence: format!(
            "The time has {}; the longest lasts {seconds_text} s, after {at} s.",
            if count == 1 { "a gap".to_owned() } else { format!("{count} gaps") }
        ),
        consequence: "Whoever integrates over a gap takes the motion after it for that of wrong tires."
            .to_owned(),
        correction: LogCorrection::for_excluded_stretches(&wrong, value_range(time))
            .with_note("both tasks end a recording at a gap by themselves"),
        refuses: false,
    });
}

fn report_jitter(case: &mut ExaminedLog, names: &[&'static str], time: &[f64]) {
    let step = median_step(time);
    let steps = || time.windows(2).map(|pair| pair[1] - pair[0]).filter(|it| *it <= GAP * step);
    let [low, high] = [quantile(steps(), 0.025), quantile(steps(), 0.975)];
    let share = (high - low) / step;
    if share.is_nan() || share < UNEVEN {
        return;
    }
    let [step, low, high] = [step, low, high].map(|value| format_significant(value, 3));
    case.add_finding(LogFinding {
        check: "jitter".to_owned(),
        channels: names.to_vec(),
        sure: Certainty::Possible,
        value: Some(share),
        interval: None,
        unit: "1",
        sentence: format!("Rows are {step} s apart, but 95 % of the steps go from {low} to {high} s."),
        consequence:
            "If the stamps are those of the arrival, not of the measurement, they add noise to fast changes."
                .to_owned(),
        correction: LogCorrection::from_advice("Use the sensor's own clock or its counter of samples."),
        refuses: false,
    });
}
