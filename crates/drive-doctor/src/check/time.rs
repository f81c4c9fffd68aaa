//! Looks at time stamps: their unit, their order, gaps, and how evenly they follow each other.

use numerics::text::significant;
use preparation::Signal;

use crate::case::Case;
use crate::finding::{Finding, Sure};
use crate::motion::{median_step, quantile};

/// Median steps between a gap's ends.
const GAP: f64 = 5.0;
/// Steps vary by this share of their median before it is worth a word.
const UNEVEN: f64 = 0.3;
/// No log of a drive has rows further apart [s].
const LONGEST_STEP: f64 = 1.5;

/// Checks the time stamps of all channels; those with the same stamps together.
pub(crate) fn check(case: &mut Case) {
    drop_rows_without_values(case);
    for names in groups(case) {
        let Some(time) = case.signals.get(names[0]).map(|signal| signal.time.clone()) else {
            continue;
        };
        if time.len() < 3 {
            continue;
        }
        order(case, &names, &time);
        unit(case, &names);
        let Some(time) = case.signals.get(names[0]).map(|signal| signal.time.clone()) else {
            continue;
        };
        gaps(case, &names, &time);
        jitter(case, &names, &time);
    }
}

/// Names of channels that have the same time stamps.
fn groups(case: &Case) -> Vec<Vec<&'static str>> {
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

fn drop_rows_without_values(case: &mut Case) {
    let names: Vec<_> = case.signals.keys().copied().collect();
    for name in names {
        let Some(signal) = case.signals.get_mut(name) else { continue };
        let rows = signal.time.len();
        let whole = |(t, x): &(&f64, &f64)| t.is_finite() && x.is_finite();
        let kept = signal.time.iter().zip(&signal.value).filter(whole).map(|(t, x)| (*t, *x));
        let (time, value): (Vec<f64>, Vec<f64>) = kept.unzip();
        let lost = rows - time.len();
        *signal = Signal { time, value };
        if lost > 0 {
            let share = significant(100.0 * lost as f64 / rows as f64, 2);
            case.report(Finding {
                check: "rows_without_values".to_owned(),
                channels: vec![name],
                sure: Sure::Likely,
                value: Some(lost as f64),
                interval: None,
                sentence: format!("`{name}` has no number in {lost} of {rows} rows ({share} %)."),
                consequence: "A value that is filled in is a motion that the car did not make."
                    .to_owned(),
                correction: "gaps = \"interpolate\"  # or \"hold\"".to_owned(),
                refuses: false,
            });
        }
    }
}

/// Reports stamps that do not rise and drops their rows.
fn order(case: &mut Case, names: &[&'static str], time: &[f64]) {
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
            let mut rows = rises.iter();
            signal.time.retain(|_| *rows.next().unwrap_or(&true));
            let mut rows = rises.iter();
            signal.value.retain(|_| *rows.next().unwrap_or(&true));
        }
    }
    case.report(Finding {
        check: "time_order".to_owned(),
        channels: names.to_vec(),
        sure: Sure::Certain,
        value: Some(count as f64),
        interval: None,
        sentence: format!(
            "The time does not rise in {count} rows; row {first} has {found} s after {before} s."
        ),
        consequence: "Rates of change have no meaning across such rows.".to_owned(),
        correction: "Remove these rows, or sort the rows by time.".to_owned(),
        refuses: true,
    });
}

/// Finds time stamps in ms, µs or ns by a step that no log has, and brings them to seconds.
fn unit(case: &mut Case, names: &[&'static str]) {
    let Some(signal) = case.signals.get(names[0]) else { return };
    let step = median_step(&signal.time);
    let (factor, word) = match step {
        step if step < LONGEST_STEP || step.is_nan() => return,
        step if step < 1e3 => (1e3, "ms"),
        step if step < 1e6 => (1e6, "us"),
        _ => (1e9, "ns"),
    };
    for name in names {
        if let Some(signal) = case.signals.get_mut(name) {
            signal.time.iter_mut().for_each(|time| *time /= factor);
        }
    }
    let step = significant(step, 4);
    case.report(Finding {
        check: "time_unit".to_owned(),
        channels: names.to_vec(),
        sure: Sure::Certain,
        value: Some(factor),
        interval: None,
        sentence: format!("The time is in {word}, not s: rows are {step} apart."),
        consequence: format!("All rates of change are {factor} times too small."),
        correction: format!("time_unit = \"{word}\""),
        refuses: true,
    });
}

fn gaps(case: &mut Case, names: &[&'static str], time: &[f64]) {
    let step = median_step(time);
    let gaps: Vec<_> = time.windows(2).filter(|pair| pair[1] - pair[0] > GAP * step).collect();
    let length = |pair: &[f64]| pair[1] - pair[0];
    let Some(longest) = gaps.iter().max_by(|a, b| length(a).total_cmp(&length(b))) else { return };
    let (count, seconds) = (gaps.len(), length(longest));
    let (at, seconds_text) = (significant(longest[0], 6), significant(seconds, 3));
    let lost: f64 = gaps.iter().map(|pair| length(pair) - step).sum();
    let serious = seconds > 0.2 || lost > 0.01 * (time[time.len() - 1] - time[0]);
    case.report(Finding {
        check: "gap".to_owned(),
        channels: names.to_vec(),
        sure: if serious { Sure::Certain } else { Sure::Possible },
        value: Some(seconds),
        interval: None,
        sentence: format!(
            "The time has {}; the longest lasts {seconds_text} s, after {at} s.",
            if count == 1 { "a gap".to_owned() } else { format!("{count} gaps") }
        ),
        consequence:
            "Whoever integrates over a gap takes the motion after it for that of wrong tires."
                .to_owned(),
        correction: "windows = [[FROM, UNTIL], ...]  # the stretches between the gaps [s]"
            .to_owned(),
        refuses: false,
    });
}

fn jitter(case: &mut Case, names: &[&'static str], time: &[f64]) {
    let step = median_step(time);
    let steps = || time.windows(2).map(|pair| pair[1] - pair[0]).filter(|it| *it <= GAP * step);
    let ends = [quantile(steps(), 0.025), quantile(steps(), 0.975)];
    let share = (ends[1] - ends[0]) / step;
    if share.is_nan() || share < UNEVEN {
        return;
    }
    let [step, low, high] = [step, ends[0], ends[1]].map(|value| significant(value, 3));
    case.report(Finding {
        check: "jitter".to_owned(),
        channels: names.to_vec(),
        sure: Sure::Possible,
        value: Some(share),
        interval: None,
        sentence: format!("Rows are {step} s apart, but 95 % of the steps go from {low} to {high} s."),
        consequence: "If the stamps are those of the arrival, not of the measurement, they add noise to fast changes.".to_owned(),
        correction: "Use the sensor's own clock or its counter of samples.".to_owned(),
        refuses: false,
    });
}
