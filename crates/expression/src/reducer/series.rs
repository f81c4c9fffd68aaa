//! Keeps all samples of some quantities, for what can be said about whole signals only: how they agree.

use rating::{BandCoverage, SignalRating, ToleranceBand};

use super::Accumulator;

/// All samples of some quantities.
#[derive(Debug, Clone)]
pub(super) struct WholeSignalAccumulator {
    metric: fn(&SeriesColumns) -> SeriesResult,
    /// Numbers of a sample: the time [s], then the quantities.
    width: usize,
    samples: Vec<f64>,
}

/// The time [s] and the quantities.
type SeriesColumns = [Vec<f64>];

/// The result, and the index of the sample that decided it.
type SeriesResult = (f64, Option<usize>);

impl WholeSignalAccumulator {
    /// None so far, of so many quantities, which `metric` gets behind the time.
    pub(super) fn new_boxed(
        quantities: usize,
        metric: fn(&SeriesColumns) -> SeriesResult,
    ) -> Box<dyn Accumulator> {
        Box::new(Self { metric, width: 1 + quantities, samples: Vec::new() })
    }

    fn apply_metric(&self) -> SeriesResult {
        let column = |place| self.samples.iter().skip(place).step_by(self.width).copied().collect();
        (self.metric)(&(0..self.width).map(column).collect::<Vec<_>>())
    }
}

impl Accumulator for WholeSignalAccumulator {
    fn push(&mut self, time: f64, values: &[f64]) {
        self.samples.push(time);
        self.samples.extend_from_slice(values);
    }

    fn result(&self) -> f64 {
        self.apply_metric().0
    }

    fn sample_time(&self) -> Option<f64> {
        self.samples.get(self.apply_metric().1? * self.width).copied()
    }

    fn save_state(&self) -> Vec<f64> {
        self.samples.clone()
    }

    fn restore_state(&mut self, memory: &[f64]) -> bool {
        let fits = memory.len().is_multiple_of(self.width);
        if fits {
            memory.clone_into(&mut self.samples);
        }
        fits
    }

    fn clone_boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// A score of a signal against its reference; not a number where no rating is possible.
pub(super) fn evaluate_rating(columns: &SeriesColumns, score: fn(&SignalRating) -> f64) -> SeriesResult {
    let [time, candidate, reference] = columns else { return (f64::NAN, None) };
    let step = time.windows(2).next().map_or(f64::NAN, |pair| pair[1] - pair[0]);
    (rating::rate_signal(reference, candidate, step).map_or(f64::NAN, |it| score(&it)), None)
}

/// What is said of the points of a curve in the band around its reference; not a number where there is no band.
pub(super) fn evaluate_band_coverage(
    columns: &SeriesColumns,
    judged: fn(&BandCoverage) -> SeriesResult,
) -> SeriesResult {
    let [_, x, y, reference_x, reference_y, dx, dy] = columns else { return (f64::NAN, None) };
    let inside =
        ToleranceBand::new(reference_x, reference_y, dx, dy).and_then(|band| band.judge_points(x, y));
    inside.map_or((f64::NAN, None), |inside| judged(&inside))
}
