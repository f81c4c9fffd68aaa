//! Writes intervals and differences of time for people.

use lap::LapTimeInterval;
use numerics::text::{format_lap_time, format_significant};

/// Least difference of time that is written [s].
const LEAST_DIFFERENCE: f64 = 1e-6;

/// An interval of times [s], with as many decimals as tell its ends apart.
pub(crate) fn format_time_interval(ends: [f64; 2]) -> [String; 2] {
    let width = ends[1] - ends[0];
    let decimals = if width > 0.0 { (-width.log10()).ceil().clamp(1.0, 3.0) as usize } else { 3 };
    ends.map(|end| format_lap_time(end, decimals))
}

/// An interval of the lap time in words: `95 % of 200 draws: 0:30.641 to 0:30.987; 2 more were not solved, the first because …`.
pub fn interval_text(interval: &LapTimeInterval) -> String {
    let [low, high] = [0.025, 0.975].map(|share| format_lap_time(interval.quantile(share), 3));
    let unsolved = match &interval.first_failure {
        None => String::new(),
        Some(why) if interval.unsolved == 1 => format!("; one more was not solved, because {why}"),
        Some(why) => format!("; {} more were not solved, the first because {why}", interval.unsolved),
    };
    match interval.lap_times.as_slice() {
        [_] => format!("one draw: {low}, no interval{unsolved}"),
        lap_times => format!("95 % of {} draws: {low} to {high}{unsolved}", lap_times.len()),
    }
}

/// A difference of time [s] with its sign and three significant digits.
pub(crate) fn format_time_difference(seconds: f64) -> String {
    with_sign(seconds, LEAST_DIFFERENCE, |size| format_significant(size, 3))
}

/// A difference of time [s] with its sign and four decimals.
pub(crate) fn format_small_difference(seconds: f64) -> String {
    with_sign(seconds, 0.5e-4, |size| format!("{size:.4}"))
}

/// What is smaller than `least` is 0.
fn with_sign(value: f64, least: f64, size: impl Fn(f64) -> String) -> String {
    match value {
        _ if !value.is_finite() => "–".to_owned(),
        _ if value.abs() < least => "0".to_owned(),
        _ if value < 0.0 => format!("−{}", size(-value)),
        _ => format!("+{}", size(value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_an_interval_have_the_decimals_of_its_width() {
        assert_eq!(format_time_interval([46.81, 47.29]), ["0:46.8", "0:47.3"]);
        assert_eq!(format_time_interval([46.812, 46.831]), ["0:46.81", "0:46.83"]);
        assert_eq!(format_time_interval([59.4, 59.97]), ["0:59.4", "1:00.0"]);
        assert_eq!(format_time_interval([46.8, 46.8]), ["0:46.800", "0:46.800"]);
    }

    #[test]
    fn differences_have_signs() {
        assert_eq!(format_time_difference(0.123_45), "+0.123");
        assert_eq!(format_time_difference(-0.012_345), "−0.0123");
        assert_eq!(format_time_difference(1e-9), "0");
        assert_eq!(format_time_difference(f64::INFINITY), "–");
        assert_eq!(format_small_difference(-0.012_345), "−0.0123");
        assert_eq!(format_small_difference(4e-5), "0");
    }
}
