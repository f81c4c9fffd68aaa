//! Writes lap times as people read them, for the terminal and the page of a run.

use numerics::text::format_lap_time;
use recording::overview::CompletedLap;

/// Decimals of a lap time.
pub const DECIMALS: usize = 3;
/// Laps with a line of their own at most.
const MOST_LINES: usize = 12;

/// Each lap with its time, the fastest of several marked; of many laps the first ones and the fastest.
pub fn lap_time_lines(laps: &[CompletedLap]) -> Vec<String> {
    let fastest = laps.iter().min_by(|a, b| a.duration.total_cmp(&b.duration));
    let fastest = fastest.filter(|_| laps.len() > 1);
    let line = |lap: &CompletedLap| {
        let mark = if fastest == Some(lap) { ", the fastest" } else { "" };
        format!("lap {}: {}{mark}", lap.number, format_lap_time(lap.duration, DECIMALS))
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
