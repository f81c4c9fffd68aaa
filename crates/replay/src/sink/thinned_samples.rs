//! Samples of a run of any length in bounded memory: at a limit every second one is dropped.

/// Kept samples at most; then every second one is dropped.
const LIMIT: usize = 20_000;

/// Samples at even distances, from the first one on.
pub(super) struct ThinnedSamples<T> {
    kept: Vec<T>,
    /// Every so many-th sample is kept.
    stride: usize,
    /// All samples, kept or not.
    taken: usize,
}

impl<T> Default for ThinnedSamples<T> {
    fn default() -> Self {
        Self { kept: Vec::new(), stride: 1, taken: 0 }
    }
}

impl<T> ThinnedSamples<T> {
    pub fn push(&mut self, sample: T) {
        if self.taken.is_multiple_of(self.stride) {
            self.kept.push(sample);
        }
        self.taken += 1;
        if self.kept.len() == LIMIT {
            let mut count = 0;
            self.kept.retain(|_| {
                count += 1;
                count % 2 == 1
            });
            self.stride *= 2;
        }
    }

    pub fn kept(&self) -> &[T] {
        &self.kept
    }

    pub fn taken(&self) -> usize {
        self.taken
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
        let kept = thinned.kept();
        assert!(kept.len() > LIMIT / 2 && kept.len() < LIMIT, "{}", kept.len());
        assert_eq!((kept[0], thinned.taken()), (0, 10 * LIMIT));
        assert!(kept.windows(2).all(|pair| pair[1] - pair[0] == kept[1]));
    }
}
