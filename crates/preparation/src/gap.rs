//! Tells a gap in time from an uneven step.

use numerics::statistics::quantile;

/// A step of more than this many usual ones is a gap; half a step keeps rounding from deciding.
const STEPS: f64 = 3.5;
/// The step that this share of all steps does not exceed is the usual one: jitter and lost rows are no gaps.
const USUAL: f64 = 0.95;

/// Longest time between two rows that is no gap [s], from rising time stamps [s]: 3.5 times the step that 95 % of all steps do not
/// exceed; 0 for less than two rows.
pub fn longest_step(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return 0.0;
    }
    steps.sort_by(f64::total_cmp);
    STEPS * quantile(&steps, USUAL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sampling_decides_what_a_gap_is() {
        let log = |step: f64| -> Vec<f64> { (0..200).map(|k| step * f64::from(k)).collect() };
        for step in [0.001, 0.01, 0.1, 2.0] {
            assert!((longest_step(&log(step)) / step - 3.5).abs() < 1e-9, "{step}");
        }
        // Every 20th row lost.
        let lossy: Vec<f64> =
            log(0.01).into_iter().enumerate().filter(|(k, _)| k % 20 != 7).map(|(_, t)| t).collect();
        assert!(longest_step(&lossy) > 0.02);
        assert_eq!((longest_step(&[]), longest_step(&[1.0])), (0.0, 0.0));
    }
}
