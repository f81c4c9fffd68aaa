//! Looks at the values of each channel: spikes, values that are held for several rows, coarse steps.

use numerics::text::format_significant;
use preparation::ColumnKey;

use crate::case::ExaminedLog;
use crate::channel::channel_unit;
use crate::correction::{CorrectionKey, LogCorrection};
use crate::finding::{Certainty, LogFinding};
use crate::statistics::{median_step, quantile, value_range};

/// Checks all channels. Spikes and repeats are left out of all that follows.
pub(crate) fn check_channel_values(case: &mut ExaminedLog) {
    let names: Vec<_> = case.signals.keys().copied().collect();
    for name in names {
        if case.signals[name].value.len() >= 50 {
            report_spikes(case, name);
            if !report_coarse_steps(case, name) {
                report_held_values(case, name);
            }
        }
    }
}

/// Rows on either side that a spike is compared with.
const REACH: usize = 4;

fn report_spikes(case: &mut ExaminedLog, name: &'static str) {
    let Some(signal) = case.signals.get_mut(name) else { return };
    let range = quantile(signal.value.iter().copied(), 0.99) - quantile(signal.value.iter().copied(), 0.01);
    let rows = signal.value.len();
    let apart: Vec<f64> = signal.value.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let usual = quantile(apart, 0.5);
    let least = (0.5 * range).max(12.0 * usual);
    let off = |k: usize| {
        let near = k.saturating_sub(REACH)..(k + REACH + 1).min(rows);
        let [low, high] = value_range(&signal.value[near.clone()]);
        if high - low <= least {
            return false;
        }
        let middle = quantile(signal.value[near.clone()].iter().copied(), 0.5);
        let spread = quantile(signal.value[near].iter().map(|x| (x - middle).abs()), 0.5);
        (signal.value[k] - middle).abs() > least.max(10.0 * spread)
    };
    let spikes: Vec<usize> = (0..rows).filter(|&k| off(k)).collect();
    // Many are no spikes but the signal's own nature.
    if spikes.is_empty() || spikes.len() > rows / 100 || range == 0.0 {
        return;
    }
    let first = spikes[0];
    let (signal_value, middle) = (signal.value[first], quantile(signal.value.iter().copied(), 0.5));
    let [value, at] = [signal_value, signal.time[first]].map(|x| format_significant(x, 5));
    let mut next = spikes.iter().peekable();
    let kept: Vec<usize> = (0..rows).filter(|k| next.next_if_eq(&k).is_none()).collect();
    *signal = signal.select_rows(kept.into_iter());
    let count = spikes.len();
    let gross = (signal_value - middle).abs() > 3.0 * range;
    case.add_finding(LogFinding {
        check: format!("{name}_spikes"),
        channels: vec![name],
        sure: if gross { Certainty::Likely } else { Certainty::Possible },
        value: Some(count as f64),
        interval: None,
        unit: "1",
        sentence: format!(
            "`{name}` leaps in {count} row{}, such as to {value} at {at} s, and back at once.",
            if count == 1 { "" } else { "s" }
        ),
        consequence: "Least squares follow a leap with all parameters.".to_owned(),
        correction: LogCorrection::from_column_keys(&[CorrectionKey::Gaps("interpolate")])
            .with_note("once the leaps are empty cells in the file"),
        refuses: false,
    });
}

/// Steps of a value that are a hundredth of its range or more.
fn report_coarse_steps(case: &mut ExaminedLog, name: &'static str) -> bool {
    let signal = &case.signals[name];
    let mut levels = signal.value.to_vec();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let range = quantile(signal.value.iter().copied(), 0.99) - quantile(signal.value.iter().copied(), 0.01);
    let quantum = quantile(levels.windows(2).map(|pair| pair[1] - pair[0]), 0.1);
    let whole = |pair: &&[f64]| {
        let steps = (pair[1] - pair[0]) / quantum;
        (steps - steps.round()).abs() < 0.05
    };
    let even = levels.windows(2).filter(whole).count() as f64 > 0.95 * (levels.len() as f64 - 1.0);
    if !(even && levels.len() > 2 && quantum > 0.01 * range) {
        return false;
    }
    let text = format_significant(quantum, 3);
    case.add_finding(LogFinding {
        check: format!("{name}_coarse"),
        channels: vec![name],
        sure: Certainty::Possible,
        value: Some(quantum),
        interval: None,
        unit: channel_unit(name),
        sentence: format!("`{name}` moves in steps of {text}, {} levels in all.", levels.len()),
        consequence: "The rounding is an error that stays the same for many rows: intervals are too narrow."
            .to_owned(),
        correction: LogCorrection::from_advice("Record it with more digits."),
        refuses: false,
    });
    true
}

fn report_held_values(case: &mut ExaminedLog, name: &'static str) {
    let Some(signal) = case.signals.get_mut(name) else { return };
    let first: Vec<usize> =
        (0..signal.value.len()).filter(|&k| k == 0 || signal.value[k] != signal.value[k - 1]).collect();
    let rows = signal.value.len();
    let ends = value_range(&signal.value);
    let stops = signal.value.windows(2).filter(|pair| pair[0] == pair[1] && ends.contains(&pair[0])).count();
    let share = 1.0 - (first.len() + stops) as f64 / rows as f64;
    // A plateau at a stop is no held sample: usual runs decide.
    let length = quantile(first.windows(2).map(|pair| (pair[1] - pair[0]) as f64), 0.5);
    if share < 0.03 || first.len() < 20 {
        return;
    }
    let held = length >= 2.0;
    let period = length * median_step(&signal.time);
    // An actuator that gets a command holds it: there is nothing between two of them.
    let actuator = ["F_x", "delta"].contains(&name);
    if held && !actuator {
        *signal = signal.select_rows(first.iter().copied());
        case.held = case.held.max(period);
    }
    let percent = format_significant(100.0 * share, 2);
    let (sentence, correction) = match held {
        true => (
            format!(
                "`{name}` is a held signal: a new value every {} s ({length} rows).",
                format_significant(period, 3)
            ),
            LogCorrection::from_column_keys(&[ColumnKey::Delay(0.5 * (period - period / length)).into()])
                .into_compensation()
                .with_note("half of the time for which a value is held"),
        ),
        false => (
            format!("`{name}` repeats the value before it in {percent} % of the rows."),
            LogCorrection::from_column_keys(&[CorrectionKey::Gaps("interpolate")])
                .with_note("once repeated values are empty cells in the file"),
        ),
    };
    case.add_finding(LogFinding {
        check: format!("{name}_held"),
        channels: vec![name],
        sure: if held && !actuator { Certainty::Likely } else { Certainty::Possible },
        value: Some(share),
        interval: None,
        unit: "1",
        sentence,
        consequence:
            "A held value is late by half of the time for which it is held, and is counted several times."
                .to_owned(),
        correction,
        refuses: false,
    });
}
