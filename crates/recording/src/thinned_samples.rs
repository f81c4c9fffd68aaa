//! Samples of a run of any length in bounded memory: at a limit every second one is dropped.

/// Kept samples at most, unless there is another limit; then every second one is dropped.
const LIMIT: usize = 20_000;

/// Samples at even distances, from the first one on.
#[derive(Debug, Clone)]
pub struct ThinnedSamples<T> {
    samples: Vec<T>,
    /// Kept samples at most.
    limit: usize,
    /// Every so many-th sample is kept.
    stride: usize,
    /// All samples, kept or not.
    total: usize,
}

impl<T> Default for ThinnedSamples<T> {
    fn default() -> Self {
        Self { samples: Vec::new(), limit: LIMIT, stride: 1, total: 0 }
    }
}

impl<T> ThinnedSamples<T> {
    /// At most `limit` samples, whose memory is there from the start.
    #[must_use]
    pub fn with_limit(limit: usize) -> Self {
        Self { samples: Vec::with_capacity(limit), limit, stride: 1, total: 0 }
    }

    /// Takes a sample.
    pub fn push(&mut self, sample: T) {
        self.push_with(|| sample);
    }

    /// Takes a sample, which is evaluated if it is kept.
    #[inline]
    pub fn push_with(&mut self, sample: impl FnOnce() -> T) {
        if self.total.is_multiple_of(self.stride) {
            self.samples.push(sample());
        }
        self.total += 1;
        if self.samples.len() == self.limit {
            let mut count = 0;
            self.samples.retain(|_| {
                count += 1;
                count % 2 == 1
            });
            self.stride *= 2;
        }
    }

    /// The retained samples.
    #[must_use]
    pub fn samples(&self) -> &[T] {
        &self.samples
    }

    /// Every so many-th sample is retained.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The number of all samples, retained or not.
    #[must_use]
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
        assert!(samples.windows(2).all(|pair| pair[1] - pair[0] == thinned.stride()));
    }
}
