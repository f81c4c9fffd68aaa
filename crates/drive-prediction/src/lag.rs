//! Lets a signal follow another one late, as a steering actuator does.

/// The signal after a lag of first order with a time constant [s]; settled at the start. Below a fifth of a step nothing changes.
#[must_use]
pub fn lag(signal: &[f64], time_constant: f64, step: f64) -> Vec<f64> {
    let Some(&first) = signal.first() else { return Vec::new() };
    if time_constant < step / 5.0 {
        return signal.to_vec();
    }
    let keep = (-step / time_constant).exp();
    let mut y = first;
    let next = |x: &f64| {
        y = keep * y + (1.0 - keep) * x;
        y
    };
    signal.iter().map(next).collect()
}

/// The signal `delay` [s] later, on the straight line between rows; the ends are held. A negative delay is an advance.
#[must_use]
pub fn delayed(signal: &[f64], delay: f64, step: f64) -> Vec<f64> {
    let Some(last) = signal.len().checked_sub(1) else { return Vec::new() };
    let value = |i: usize| {
        let place = (i as f64 - delay / step).clamp(0.0, last as f64);
        let (below, share) = (place.floor() as usize, place.fract());
        signal[below] * (1.0 - share) + signal[(below + 1).min(last)] * share
    };
    (0..signal.len()).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_follows_the_exponential() {
        let mut step = vec![0.0; 3];
        step.extend([1.0; 200]);
        let late = lag(&step, 0.1, 0.01);
        assert_eq!(late[2], 0.0);
        assert!((late[12] - (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
        assert_eq!(lag(&step, 0.001, 0.01), step);
    }

    #[test]
    fn a_delay_moves_a_line() {
        let line: Vec<f64> = (0..20).map(f64::from).collect();
        assert_eq!(delayed(&line, 0.025, 0.01)[10], 7.5);
        assert_eq!(delayed(&line, -0.02, 0.01)[10], 12.0);
        assert_eq!(delayed(&line, 1.0, 0.01)[10], 0.0);
    }
}
