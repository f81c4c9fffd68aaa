//! Counts durations in a fixed memory, so finely that a quantile is right to two percent.

use std::time::Duration;

/// Steps between two powers of two, as a power of two: a quantile is off by half of one at most.
const FINE: u32 = 5;
/// Durations of 2^40 ns, a quarter of an hour, and longer ones are counted as one.
const OCTAVES: u32 = 40;
const PLACES: usize = ((OCTAVES - FINE + 1) << FINE) as usize;

/// How many durations there were of each length. It allocates at the first of them only.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct DurationHistogram {
    counts: Vec<u32>,
    total: u64,
}

/// The place of a duration [ns]. Those below 2^FINE have their own.
fn bin_index(time: u64) -> usize {
    let octave = (time | 1).ilog2().max(FINE) - FINE;
    let place = (u64::from(octave) << FINE) + (time >> octave);
    // In an octave the leading one is counted with its number.
    usize::try_from(place).unwrap_or(PLACES).min(PLACES - 1)
}

/// The middle of the durations of a place [ns].
fn bin_center(place: usize) -> f64 {
    let fine = 1_usize << FINE;
    let octave = (place >> FINE).saturating_sub(1);
    let first = place - (octave << FINE);
    match place < fine {
        true => place as f64,
        false => (first as f64 + 0.5) * 2.0_f64.powi(octave as i32),
    }
}

impl DurationHistogram {
    /// Counts a duration so often.
    pub fn add_duration(&mut self, time: Duration, times: u32) {
        if self.counts.is_empty() {
            self.counts = vec![0; PLACES];
        }
        let place = bin_index(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
        self.counts[place] = self.counts[place].saturating_add(times);
        self.total += u64::from(times);
    }

    /// The duration [s] that this share [-] of all does not exceed; nothing when there is none.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let wanted = (share * self.total as f64).ceil().max(1.0);
        let mut so_far = 0.0;
        let place = self.counts.iter().position(|count| {
            so_far += f64::from(*count);
            so_far >= wanted
        });
        place.map(|place| bin_center(place) * 1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_duration_is_near_the_middle_of_its_place() {
        let mut before = 0;
        for exponent in 0..390 {
            let time = 2.0_f64.powf(f64::from(exponent) * 0.1) as u64;
            let now = bin_index(time);
            assert!(now >= before && now < PLACES, "{time}");
            before = now;
            let off = (bin_center(now) - time as f64).abs();
            assert!(off <= time as f64 / 64.0 + 0.5, "{time} ns is taken for {}", bin_center(now));
        }
        assert_eq!(bin_index(u64::MAX), PLACES - 1);
        assert_eq!([0, 31, 32, 33, 63, 64, 65, 66].map(bin_index), [0, 31, 32, 33, 63, 64, 64, 65]);
    }

    #[test]
    fn a_quantile_is_that_of_the_counted_durations() {
        let mut histogram = DurationHistogram::default();
        assert_eq!(histogram.quantile(0.99), None);
        for micros in 1..=1000 {
            histogram.add_duration(Duration::from_micros(micros), 3);
        }
        for share in [0.01, 0.5, 0.99, 1.0] {
            let found = histogram.quantile(share).expect("there are some") * 1e6;
            assert!((found / (share * 1000.0) - 1.0).abs() < 0.02, "{share}: {found} us");
        }
        let total = histogram.total;
        histogram.add_duration(Duration::MAX, 1);
        assert_eq!(histogram.total, total + 1);
        assert!(histogram.quantile(1.0).expect("there are some") > 1000.0);
    }
}
