//! Lets a signal follow another one late, as a steering actuator does.

/// The signal after a lag of first order with a time constant [s]; settled at the start. Below a fifth of a step nothing changes.
#[must_use]
pub fn first_order_lag(signal: &[f64], time_constant: f64, step: f64) -> Vec<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_follows_the_exponential() {
        let mut step = vec![0.0; 3];
        step.extend([1.0; 200]);
        let late = first_order_lag(&step, 0.1, 0.01);
        assert_eq!(late[2], 0.0);
        assert!((late[12] - (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
        assert_eq!(first_order_lag(&step, 0.001, 0.01), step);
    }
}
