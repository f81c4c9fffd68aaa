//! The lowest and the highest value of curves in buckets of equal duration, which grow with the run: no peak is lost, and memory is bounded.

/// The extreme values of a bucket in the order of their time; not numbers in a bucket without a number.
type Extremes = [f64; 2];

/// Envelopes of curves that are sampled together.
#[derive(Debug, Clone)]
pub struct Envelopes {
    /// The buckets of each curve.
    curves: Vec<Vec<Extremes>>,
    /// The bucket that is being filled, for each curve.
    filling: Vec<Extremes>,
    /// Samples in it.
    filled: usize,
    /// Samples of a bucket.
    stride: usize,
    /// Buckets of a curve at most.
    limit: usize,
}

/// Two extremes, and what one more sample makes of them.
#[inline]
fn extend_extremes([first, second]: Extremes, sample: f64) -> Extremes {
    // These leave out what is no number.
    let (low, high) = (first.min(second), first.max(second));
    if sample < low {
        [high, sample]
    } else if sample > high {
        [low, sample]
    } else if low.is_nan() {
        [sample; 2]
    } else {
        [first, second]
    }
}

impl Envelopes {
    /// Envelopes of so many curves, with `limit` buckets each at most.
    #[must_use]
    pub fn new(curves: usize, limit: usize) -> Self {
        let limit = limit.max(2) & !1;
        Envelopes {
            curves: (0..curves).map(|_| Vec::with_capacity(limit)).collect(),
            filling: vec![[f64::NAN; 2]; curves],
            filled: 0,
            stride: 1,
            limit,
        }
    }

    /// Takes a sample of each curve.
    #[inline]
    pub fn push(&mut self, samples: impl Iterator<Item = f64>) {
        for (extremes, sample) in self.filling.iter_mut().zip(samples) {
            *extremes = extend_extremes(*extremes, sample);
        }
        self.filled += 1;
        if self.filled == self.stride {
            self.close_bucket();
        }
    }

    fn close_bucket(&mut self) {
        for (buckets, extremes) in self.curves.iter_mut().zip(&mut self.filling) {
            buckets.push(std::mem::replace(extremes, [f64::NAN; 2]));
        }
        self.filled = 0;
        if self.curves.first().is_some_and(|buckets| buckets.len() == self.limit) {
            self.curves.iter_mut().for_each(merge_pairs);
            self.stride *= 2;
        }
    }

    /// Samples of a bucket.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// The extremes of the buckets of a curve, each in the order of their time; the last bucket may hold fewer samples.
    pub fn extremes(&self, curve: usize) -> impl Iterator<Item = [f64; 2]> + Clone {
        let last = self.filling.get(curve).filter(|_| self.filled > 0);
        self.curves.get(curve).into_iter().flatten().chain(last).copied()
    }
}

/// Halves the buckets.
fn merge_pairs(buckets: &mut Vec<Extremes>) {
    let half = buckets.len() / 2;
    for place in 0..half {
        let (earlier, later) = (buckets[2 * place], buckets[2 * place + 1]);
        buckets[place] = later.into_iter().fold(earlier, extend_extremes);
    }
    buckets.truncate(half);
}

#[cfg(test)]
mod tests {
    use super::Envelopes;

    #[test]
    fn no_peak_is_lost_and_extremes_stand_in_their_order() {
        let mut envelopes = Envelopes::new(2, 8);
        let curve = |k: usize| match k {
            37 => 9.0,
            41 => -7.0,
            _ => 0.1 * (k % 3) as f64,
        };
        for k in 0..100 {
            envelopes.push([curve(k), -curve(k)].into_iter());
        }
        // 8 buckets are filled at 8, 16, 32 and 64 samples.
        assert_eq!(envelopes.stride(), 16);
        let all: Vec<_> = envelopes.extremes(0).collect();
        assert_eq!((all.len(), all[2]), (7, [9.0, -7.0]));
        assert_eq!(envelopes.extremes(1).nth(2), Some([-9.0, 7.0]));
        assert!(
            all.iter().enumerate().all(|(bucket, it)| bucket == 2 || *it == [0.0, 0.2] || *it == [0.2, 0.0])
        );
    }

    #[test]
    fn what_is_no_number_leaves_a_gap_only_where_there_is_nothing_else() {
        let mut envelopes = Envelopes::new(1, 4);
        for sample in [f64::NAN, f64::NAN, f64::NAN, 3.0, 5.0, f64::NAN, 1.0] {
            envelopes.push([sample].into_iter());
        }
        let all: Vec<_> = envelopes.extremes(0).collect();
        assert!(all[0][0].is_nan());
        assert_eq!(all[1..], [[3.0; 2], [5.0; 2], [1.0; 2]]);
    }
}
