//! Finds where a function with one peak is largest, without derivatives.

/// The argument of the largest value of a function with one peak in 0 .. `most`, by golden-section search.
pub fn argmax(function: impl Fn(f64) -> f64, most: f64) -> f64 {
    /// Leaves 1e-7 of the range: the value at the peak is right to the square of it.
    const PARTS: usize = 34;
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.0, most);
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_a, mut at_b) = (function(a), function(b));
    for _ in 0..PARTS {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = function(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = function(b);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::argmax;

    #[test]
    fn a_peak_is_found_within_and_at_the_end_of_the_range() {
        assert_relative_eq!(argmax(|x| -(x - 0.3_f64).powi(2), 0.5), 0.3, epsilon = 1e-7);
        assert_relative_eq!(argmax(|x| x, 0.5), 0.5, epsilon = 1e-7);
    }
}
