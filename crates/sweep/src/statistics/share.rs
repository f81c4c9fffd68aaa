//! The pass rate of variants with Wilson's confidence interval.

use numerics::statistics::NORMAL_95;
use serde::Serialize;

use super::Estimate;

/// How many of some variants pass.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq, Serialize)]
pub struct PassRate {
    /// Those that pass.
    pub passed: u64,
    /// All that were judged.
    pub of: u64,
}

impl PassRate {
    /// Of verdicts.
    #[must_use]
    pub fn from_verdicts(verdicts: impl IntoIterator<Item = bool>) -> Self {
        verdicts.into_iter().fold(Self::default(), |share, passed| Self {
            passed: share.passed + u64::from(passed),
            of: share.of + 1,
        })
    }

    /// The share with the interval of Wilson (1927), which is right at none and at all too; nothing of no variants. It takes variants for
    /// independent draws: for points that are spread evenly it is too wide.
    #[must_use]
    pub fn wilson_estimate(&self) -> Option<Estimate> {
        let (count, share) = (self.of as f64, self.passed as f64 / self.of as f64);
        let square = NORMAL_95 * NORMAL_95;
        let middle = (share + square / (2.0 * count)) / (1.0 + square / count);
        let inner = share * (1.0 - share) / count + square / (4.0 * count * count);
        let half = NORMAL_95 * inner.sqrt() / (1.0 + square / count);
        // Rounding must not leave the ends beside 0 and 1.
        let low = if self.passed == 0 { 0.0 } else { middle - half };
        let high = if self.passed == self.of { 1.0 } else { middle + half };
        (self.of > 0).then_some(Estimate { value: share, interval: [low, high] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_tables() {
        // Newcombe, "Two-sided confidence intervals for the single proportion", Statistics in Medicine 17 (1998), table I, method 3.
        for (passed, of, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let found = PassRate { passed, of }.wilson_estimate().expect("some").interval;
            assert!((found[0] - low).abs() < 5e-5 && (found[1] - high).abs() < 5e-5, "{found:?}");
        }
        let all = PassRate::from_verdicts([true; 20]).wilson_estimate().expect("some");
        assert_eq!((all.value, all.interval[1]), (1.0, 1.0));
        assert!((all.interval[0] - 0.8389).abs() < 5e-5);
        assert_eq!(PassRate::default().wilson_estimate(), None);
    }
}
