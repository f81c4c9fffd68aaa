//! Says what a new baseline changes, against the one that it replaces.

use std::path::PathBuf;

use assessment::BaselinePlan;
use assessment::baseline::{BaselineOutcome, SignalOutcome};
use diagnostics::rounded_time;
use serde::{Deserialize, Serialize};

/// Signals that are told; the others are counted.
const TOLD: usize = 10;

/// A baseline that a run writes, against the one that is there.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct BaselineChange {
    /// The name of the baseline.
    pub name: String,
    /// Its recording.
    pub recording: PathBuf,
    /// Why the old recording cannot be compared with; none when it was, or when there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unreadable: Option<String>,
    /// The comparison of the run with the old recording; none when there is no such recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comparison: Option<BaselineOutcome>,
}

impl BaselineChange {
    /// That of a baseline without an old recording that can be read.
    pub(crate) fn without_comparison(plan: &BaselinePlan, unreadable: Option<String>) -> Self {
        let (name, recording) = (plan.name.clone(), plan.path.clone());
        BaselineChange { name, recording, unreadable, comparison: None }
    }

    /// That of a run that was compared with the old recording.
    #[must_use]
    pub fn from_comparison(comparison: BaselineOutcome) -> Self {
        BaselineChange {
            name: comparison.name.clone(),
            recording: comparison.recording.clone(),
            unreadable: None,
            comparison: Some(comparison),
        }
    }

    /// The lines about it: first what happens to the baseline, then a line for each signal that leaves the old tube.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let BaselineChange { name, recording, unreadable, comparison } = self;
        let about = |what: &str| format!("baseline `{name}`, {}: {what}", recording.display());
        let Some(outcome) = comparison else {
            return vec![match unreadable {
                Some(reason) => about(&format!("the old one cannot be compared with: {reason}")),
                None => about("new"),
            }];
        };
        let mut left: Vec<_> = outcome.signals.iter().filter(|signal| !signal.passed).collect();
        left.sort_by(|a, b| leaving_time(a).total_cmp(&leaving_time(b)));
        let all = outcome.signals.len();
        let mut lines = match (left.len(), &outcome.reason) {
            (0, None) => return vec![about(&change_within_tubes(outcome))],
            (0, Some(reason)) => vec![about(reason)],
            (count, None) => vec![about(&format!("{count} of {all} signals leave the old one"))],
            (count, Some(reason)) => {
                vec![about(&format!("{reason}; {count} of {all} signals leave the old one"))]
            }
        };
        lines.extend(left.iter().take(TOLD).map(|signal| format!("  {}", describe_leaving_signal(signal))));
        if left.len() > TOLD {
            lines.push(format!("  and {} more", left.len() - TOLD));
        }
        lines
    }
}

fn leaving_time(signal: &SignalOutcome) -> f64 {
    signal.first.map_or(f64::NEG_INFINITY, |first| first.time)
}

/// The change of a run that stays in all of its tubes.
fn change_within_tubes(outcome: &BaselineOutcome) -> String {
    let differing: Vec<_> = outcome.signals.iter().filter_map(|it| Some((it, it.distance?))).collect();
    let share = |(_, distance): &(&SignalOutcome, assessment::baseline::CurveDistance)| {
        distance.largest.unwrap_or(f64::INFINITY) / distance.half_height
    };
    let Some((signal, distance)) = differing.iter().max_by(|a, b| share(a).total_cmp(&share(b))) else {
        return "nothing changes".to_owned();
    };
    format!(
        "all stay within the old tubes; {} of {} signals differ, most `{}` by {}{} at {} s, the tube is ±{}",
        differing.len(),
        outcome.signals.len(),
        signal.signal,
        number(distance.largest.unwrap_or(f64::NAN)),
        unit_suffix(signal),
        rounded_time(distance.at),
        number(distance.half_height),
    )
}

/// A signal that leaves its tube: from when on, and how far at most.
fn describe_leaving_signal(signal: &SignalOutcome) -> String {
    let name = &signal.signal;
    let (Some(first), Some(distance)) = (signal.first, signal.distance) else {
        return format!("`{name}`: {}", signal.reason.as_deref().unwrap_or("it differs"));
    };
    let begin = format!("`{name}` leaves its tube at {} s", rounded_time(first.time));
    let at = rounded_time(distance.at);
    match distance.largest {
        None => format!("{begin}; it is no number at {at} s"),
        Some(largest) => format!(
            "{begin}; largest deviation {}{unit} at {at} s, the old tube is ±{}{unit}",
            number(largest),
            number(distance.half_height),
            unit = unit_suffix(signal)
        ),
    }
}

fn unit_suffix(signal: &SignalOutcome) -> String {
    signal.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default()
}

/// A number with three digits.
fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e5).contains(&size) => {
            let digits = (2 - size.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use assessment::baseline::{CurveDistance, TubeDeviation};

    use super::*;

    fn signal(name: &str, first: Option<f64>, largest: Option<f64>) -> SignalOutcome {
        SignalOutcome {
            signal: name.to_owned(),
            unit: Some("m/s".to_owned()),
            passed: first.is_none(),
            reason: None,
            first: first.map(|time| TubeDeviation { time, value: 1.0, lower: 0.0, upper: 0.5 }),
            worst: None,
            distance: largest.map(|largest| CurveDistance {
                first: 0.1,
                largest: Some(largest).filter(|it| it.is_finite()),
                at: 0.7 + 0.1,
                half_height: 0.02,
            }),
            tube: None,
        }
    }

    fn lines(signals: Vec<SignalOutcome>) -> Vec<String> {
        let outcome = BaselineOutcome {
            name: "as before".to_owned(),
            recording: "golden.mcap".into(),
            reason: None,
            signals,
            picture: None,
            during: [0.0, 1.0],
            place: Default::default(),
            warnings: Vec::new(),
            has_tubes: false,
        };
        BaselineChange::from_comparison(outcome).lines()
    }

    #[test]
    fn each_signal_that_leaves_its_tube_has_a_line_with_time_amount_and_tube() {
        let many =
            (0..12).map(|k| signal(&format!("car.x{k}"), Some(2.0 - 0.1 * f64::from(k)), Some(0.1234)));
        let told = lines(many.collect());
        assert_eq!(told[0], "baseline `as before`, golden.mcap: 12 of 12 signals leave the old one");
        assert_eq!(
            told[1],
            "  `car.x11` leaves its tube at 0.9 s; largest deviation 0.123 m/s at 0.8 s, the old tube is ±0.0200 m/s"
        );
        assert_eq!((told.len(), told[11].as_str()), (12, "  and 2 more"));
        let nan = lines(vec![signal("car.v", Some(0.5), Some(f64::NAN))]);
        assert_eq!(nan[1], "  `car.v` leaves its tube at 0.5 s; it is no number at 0.8 s");
    }

    #[test]
    fn a_run_inside_of_its_tubes_says_whether_anything_changes() {
        let same = lines(vec![signal("car.v", None, None)]);
        assert_eq!(same, ["baseline `as before`, golden.mcap: nothing changes"]);
        let near = lines(vec![signal("car.v", None, Some(1e-5)), signal("car.r", None, Some(2e-5))]);
        assert!(
            near[0].ends_with(
                "2 of 2 signals differ, most `car.r` by 2.00e-5 m/s at 0.8 s, the tube is ±0.0200"
            ),
            "{near:?}"
        );
    }
}
