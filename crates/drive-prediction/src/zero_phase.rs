//! Takes fast parts out of a signal without moving the rest in time.

/// The signal without what is faster than `cut` [Hz], where it is 3 dB weaker: a Butterworth filter of second order, forwards and
/// backwards. The ends go on as their mirror images through the end points. A signal that is shorter than the filter's settling stays as it is.
#[must_use]
pub fn low_pass(signal: &[f64], cut: f64, step: f64) -> Vec<f64> {
    // Both passes together are 3 dB down where each is 1.5 dB down: (√2 − 1)^¼ of the corner of one.
    let filter = Butterworth::new(cut / (2.0_f64.sqrt() - 1.0).powf(0.25), step);
    let edge = 9;
    if signal.len() <= edge {
        return signal.to_vec();
    }
    let last = signal.len() - 1;
    let before = (1..=edge).rev().map(|i| 2.0 * signal[0] - signal[i]);
    let behind = (1..=edge).map(|i| 2.0 * signal[last] - signal[last - i]);
    let longer: Vec<f64> = before.chain(signal.iter().copied()).chain(behind).collect();
    let mut passed = filter.filter_once(&longer);
    passed.reverse();
    passed = filter.filter_once(&passed);
    passed.reverse();
    passed[edge..edge + signal.len()].to_vec()
}

/// The derivative by central differences, one-sided at the ends [1/s].
#[must_use]
pub fn derivative(signal: &[f64], step: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let slope = |i: usize| {
        let (before, behind) = (i.saturating_sub(1), (i + 1).min(last));
        (signal[behind] - signal[before]) / (step * (behind - before).max(1) as f64)
    };
    (0..signal.len()).map(slope).collect()
}

/// A low pass of second order, by the bilinear transform.
struct Butterworth {
    b: [f64; 3],
    a: [f64; 2],
}

impl Butterworth {
    fn new(corner: f64, step: f64) -> Self {
        // Corners beyond the Nyquist frequency let everything pass.
        let c = 1.0 / (std::f64::consts::PI * (corner * step).min(0.499)).tan();
        let a0 = 1.0 + 2.0_f64.sqrt() * c + c * c;
        let a = [2.0 * (1.0 - c * c) / a0, (1.0 - 2.0_f64.sqrt() * c + c * c) / a0];
        Self { b: [1.0 / a0, 2.0 / a0, 1.0 / a0], a }
    }

    /// One pass, which begins as if the first value had been there for ever.
    fn filter_once(&self, signal: &[f64]) -> Vec<f64> {
        let Self { b, a } = self;
        let first = signal[0];
        let mut w = [first * (1.0 - b[0]), first * (b[2] - a[1])];
        let mut next = |x: &f64| {
            let y = b[0] * x + w[0];
            w = [b[1] * x - a[0] * y + w[1], b[2] * x - a[1] * y];
            y
        };
        signal.iter().map(&mut next).collect()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn sine(f: f64, n: usize, step: f64) -> Vec<f64> {
        (0..n).map(|i| (std::f64::consts::TAU * f * i as f64 * step).sin()).collect()
    }

    fn amplitude(signal: &[f64]) -> f64 {
        let inner = &signal[signal.len() / 4..3 * signal.len() / 4];
        (2.0 * inner.iter().map(|y| y * y).sum::<f64>() / inner.len() as f64).sqrt()
    }

    #[test]
    fn a_line_passes_as_it_is() {
        let line: Vec<f64> = (0..300).map(|i| 2.0 - 0.3 * i as f64).collect();
        let passed = low_pass(&line, 5.0, 0.01);
        for (a, b) in passed[50..250].iter().zip(&line[50..250]) {
            assert_relative_eq!(a, b, max_relative = 1e-4);
        }
    }

    #[test]
    fn the_corner_is_three_decibels_down_and_not_late() {
        let at_corner = low_pass(&sine(5.0, 4000, 0.01), 5.0, 0.01);
        assert_relative_eq!(amplitude(&at_corner), 0.5_f64.sqrt(), max_relative = 1e-2);
        let slow = sine(0.5, 4000, 0.01);
        let passed = low_pass(&slow, 5.0, 0.01);
        for (a, b) in passed[1000..3000].iter().zip(&slow[1000..3000]) {
            assert!((a - b).abs() < 1e-3);
        }
        assert!(amplitude(&low_pass(&sine(20.0, 4000, 0.01), 5.0, 0.01)) < 0.01);
    }

    #[test]
    fn short_signals_stay() {
        assert_eq!(low_pass(&[1.0, 2.0], 5.0, 0.01), [1.0, 2.0]);
        assert!(low_pass(&[], 5.0, 0.01).is_empty());
        assert_eq!(derivative(&[1.0], 0.1), [0.0]);
        assert_eq!(derivative(&[1.0, 2.0, 4.0], 1.0), [1.0, 1.5, 2.0]);
    }
}
