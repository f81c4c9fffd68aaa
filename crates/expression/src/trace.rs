//! Keeps what a check compares over time in bounded memory, for a picture.

/// Points at most; beyond that, neighbours are merged.
const MOST: usize = 600;
const _: () = assert!(MOST.is_multiple_of(2), "two become one");

/// What is compared during some samples in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TracePoint {
    /// Time of the first of them [s].
    pub time: f64,
    /// The lowest and the highest value.
    pub value: [f64; 2],
    /// The lowest and the highest limit; not a number without one.
    pub limit: [f64; 2],
}

impl TracePoint {
    fn merged_with(self, later: Self) -> Self {
        // These leave out what is no number.
        let both = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let (value, limit) = (both(self.value, later.value), both(self.limit, later.limit));
        Self { time: self.time, value, limit }
    }
}

/// What a trace is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TraceContent {
    /// The sides of the only comparison.
    #[default]
    Sides,
    /// The quantity that the only reduction reduces; the limit of its samples, if it picks one.
    Reduced,
    /// Distances to failing, whose limit is 0: sides of several comparisons do not compare.
    Margins,
}

/// What is compared over time, merged as it grows.
#[derive(Debug, Clone)]
pub struct ComparisonTrace {
    of: TraceContent,
    points: Vec<TracePoint>,
    /// Samples of a point, and how many the last one has.
    samples: [u32; 2],
}

impl Default for ComparisonTrace {
    fn default() -> Self {
        Self::new(TraceContent::default())
    }
}

impl ComparisonTrace {
    /// An empty trace.
    #[must_use]
    pub fn new(of: TraceContent) -> Self {
        Self { of, points: Vec::new(), samples: [1, 1] }
    }

    /// What it is of.
    #[must_use]
    pub fn content(&self) -> TraceContent {
        self.of
    }

    /// The points, at rising times.
    #[must_use]
    pub fn points(&self) -> &[TracePoint] {
        &self.points
    }

    /// What it remembers.
    pub(crate) fn save_state(&self) -> Vec<f64> {
        let [of_each, of_last] = self.samples.map(f64::from);
        let points =
            self.points.iter().flat_map(|it| [it.time, it.value[0], it.value[1], it.limit[0], it.limit[1]]);
        [of_each, of_last].into_iter().chain(points).collect()
    }

    /// Goes on with what one of its kind remembered; whether these numbers are such a memory. If not, it is as it was.
    pub(crate) fn restore_state(&mut self, memory: &[f64]) -> bool {
        let [of_each, of_last, points @ ..] = memory else { return false };
        let counts = [*of_each, *of_last];
        let is_count = |it: f64| it >= 1.0 && it <= f64::from(u32::MAX / 2) && it.fract() == 0.0;
        let fits = points.len().is_multiple_of(5) && points.len() / 5 <= MOST;
        if !fits || !counts.into_iter().all(is_count) {
            return false;
        }
        self.samples = counts.map(|count| count as u32);
        let point = |it: &[f64]| TracePoint { time: it[0], value: [it[1], it[2]], limit: [it[3], it[4]] };
        self.points = points.chunks_exact(5).map(point).collect();
        true
    }

    pub(crate) fn push_sample(&mut self, time: f64, value: f64, limit: f64) {
        let point = TracePoint { time, value: [value; 2], limit: [limit; 2] };
        let [of_each, of_last] = &mut self.samples;
        match self.points.last_mut() {
            Some(last) if of_last < of_each => {
                *last = last.merged_with(point);
                *of_last += 1;
            }
            _ => {
                if self.points.len() == MOST {
                    for pair in 0..MOST / 2 {
                        self.points[pair] = self.points[2 * pair].merged_with(self.points[2 * pair + 1]);
                    }
                    self.points.truncate(MOST / 2);
                    *of_each *= 2;
                }
                self.points.push(point);
                *of_last = 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_is_bounded_and_loses_no_peak() {
        let mut trace = ComparisonTrace::default();
        for sample in 0..100_000_u32 {
            let peak = if sample == 77_777 { 50.0 } else { 0.0 };
            trace.push_sample(f64::from(sample), peak - f64::from(sample % 2), 3.0);
        }
        let points = trace.points();
        assert!((MOST / 2..=MOST).contains(&points.len()), "{} points", points.len());
        assert!(points.windows(2).all(|pair| pair[0].time < pair[1].time));
        let high = points.iter().find(|it| it.value[1] > 1.0).expect("the peak");
        assert!((high.time - 77_777.0).abs() <= 256.0 && high.value[1] >= 49.0, "{high:?}");
        assert!(points.iter().all(|it| it.value[0] == -1.0 && it.limit == [3.0; 2]));
    }
}
