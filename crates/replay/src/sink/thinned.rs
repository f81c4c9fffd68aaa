//! Keeps samples of a run of any length in bounded memory.

/// Samples that are kept; beyond that every second one is dropped.
const LIMIT: usize = 20_000;

/// Samples at even distances, from the first one on.
pub(super) struct Thinned<T> {
    kept: Vec<T>,
    /// One sample in so many is kept.
    stride: usize,
    /// Samples that were taken, kept or not.
    taken: usize,
}

impl<T> Default for Thinned<T> {
    fn default() -> Self {
        Self { kept: Vec::new(), stride: 1, taken: 0 }
    }
}

impl<T> Thinned<T> {
    pub fn push(&mut self, sample: T) {
        if self.taken.is_multiple_of(self.stride) {
            self.kept.push(sample);
        }
        self.taken += 1;
        if self.kept.len() == LIMIT {
            let mut place = 0;
            self.kept.retain(|_| {
                place += 1;
                place % 2 == 1
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
    use super::{LIMIT, Thinned};

    #[test]
    fn what_is_kept_is_bounded_and_even() {
        let mut thinned = Thinned::default();
        for sample in 0..10 * LIMIT {
            thinned.push(sample);
        }
        let kept = thinned.kept();
        assert!(kept.len() > LIMIT / 2 && kept.len() < LIMIT, "{}", kept.len());
        assert_eq!((kept[0], thinned.taken()), (0, 10 * LIMIT));
        assert!(kept.windows(2).all(|pair| pair[1] - pair[0] == kept[1]));
    }
}
