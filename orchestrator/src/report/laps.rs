//! Writes lap times as people read them, for the terminal and the page of a run.

use recording::overview::CompletedLap;

/// Laps with a line of their own at most.
const MOST_LINES: usize = 12;

/// A duration [s] as minutes, seconds and thousandths: `1:23.456`; `–` for what is none.
pub fn lap_time_text(duration: f64) -> String {
    if !(duration.is_finite() && duration >= 0.0) {
        return "–".to_owned();
    }
    // A rounded second may carry into a minute.
    let thousandths = (1e3 * duration).round() as u64;
    let (minutes, rest) = (thousandths / 60_000, thousandths % 60_000);
    format!("{minutes}:{:02}.{:03}", rest / 1_000, rest % 1_000)
}

/// Each lap with its time, the fastest of several marked; of many laps the first ones and the fastest.
pub fn lap_time_lines(laps: &[CompletedLap]) -> Vec<String> {
    let fastest = laps.iter().min_by(|a, b| a.duration.total_cmp(&b.duration));
    let fastest = fastest.filter(|_| laps.len() > 1);
    let line = |lap: &CompletedLap| {
        let mark = if fastest == Some(lap) { ", the fastest" } else { "" };
        format!("lap {}: {}{mark}", lap.number, lap_time_text(lap.duration))
    };
    let mut lines: Vec<_> = laps.iter().take(MOST_LINES).map(line).collect();
    if let Some(left) = laps.len().checked_sub(MOST_LINES).filter(|left| *left > 0) {
        lines.extend(fastest.filter(|lap| lap.number > MOST_LINES).map(line));
        lines.push(format!("{left} laps after the first {MOST_LINES} are in report.json"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lap_time_has_minutes_and_thousandths() {
        for (duration, text) in [
            (83.456, "1:23.456"),
            (37.0, "0:37.000"),
            (59.999_6, "1:00.000"),
            (605.25, "10:05.250"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(lap_time_text(duration), text);
        }
    }

    #[test]
    fn the_fastest_of_several_laps_is_marked() {
        let laps = |durations: &[f64]| {
            let numbered = durations.iter().enumerate();
            let laps =
                numbered.map(|(k, duration)| CompletedLap { number: k + 1, end: 0.0, duration: *duration });
            lap_time_lines(&laps.collect::<Vec<_>>())
        };
        assert_eq!(laps(&[83.456]), ["lap 1: 1:23.456"]);
        assert_eq!(laps(&[83.456, 80.0]), ["lap 1: 1:23.456", "lap 2: 1:20.000, the fastest"]);
        let mut many = vec![90.0; 30];
        many[20] = 89.0;
        let lines = laps(&many);
        assert_eq!(lines.len(), MOST_LINES + 2);
        assert_eq!(lines[MOST_LINES], "lap 21: 1:29.000, the fastest");
    }
}
