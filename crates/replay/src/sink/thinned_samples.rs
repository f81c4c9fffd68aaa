//! Samples of a run of any length in bounded memory: at a limit every second one is dropped.

/// Kept samples at most; then every second one is dropped.
const LIMIT: usize = 20_000;

/// Samples at even distances, from the first one on.
pub(super) struct ThinnedSamples<T> {
    samples: Vec<T>,
    /// Every so many-th sample is kept.
    stride: usize,
    /// All samples, kept or not.
    total: usize,
}

impl<T> Default for ThinnedSamples<T> {
    fn default() -> Self {
        Self { samples: Vec::new(), stride: 1, total: 0 }
    }
}

impl<T> ThinnedSamples<T> {
    pub fn push(&mut self, sample: T) {
        if self.total.is_multiple_of(self.stride) {
            self.samples.push(sample);
        }
        self.total += 1;
        if self.samples.len() == LIMIT {
            let mut count = 0;
            self.samples.retain(|_| {
                count += 1;
                count % 2 == 1
            });
            self.stride *= 2;
        }
    }

    /// The retained samples.
    pub fn samples(&self) -> &[T] {
        &self.samples
    }

    /// The number of all samples, retained or not.
    pub fn total_count(&self) -> usize {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::{LIMIT, ThinnedSamples};

    #[test]
    fn kept_samples_are_bounded_and_evenly_spaced() {
        let mut thinned = ThinnedSamples::default();
        for sample in 0..10 * LIMIT {
            thinned.push(sample);
        }
        let samples = thinned.samples();
        assert!(samples.len() > LIMIT / 2 && samples.len() < LIMIT, "{}", samples.len());
        assert_eq!((samples[0], thinned.total_count()), (0, 10 * LIMIT));
        assert!(samples.windows(2).all(|pair| pair[1] - pair[0] == samples[1]));
    }
}
