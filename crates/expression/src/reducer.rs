//! Lists the reductions over the window of a check. A new reduction is a line in [`REDUCERS`] and its accumulator.

mod series;

use std::fmt::Debug;

use crate::dimension::UnitRule;
use series::{WholeSignalAccumulator, evaluate_band_coverage, evaluate_rating};

/// A reduction of one or more quantities over the window.
#[derive(Debug)]
pub(crate) struct WindowReducer {
    pub name: &'static str,
    /// Arguments that have a value at each sample.
    pub quantities: usize,
    /// The form of the call, when it has other arguments than one quantity.
    pub form: Option<ReducerCallForm>,
    pub units: UnitRule,
    /// The accumulator before the first sample; its argument is the parameter.
    pub start: fn(f64) -> Box<dyn Accumulator>,
}

/// The form of a call.
#[derive(Debug)]
pub(crate) struct ReducerCallForm {
    /// What the last argument may be, if it is a constant.
    pub parameter: Option<fn(f64) -> bool>,
    /// The expected form of the call.
    pub expected: &'static str,
    /// An example with its meaning.
    pub example: &'static str,
}

/// A reduction with the same name is the same one.
impl PartialEq for WindowReducer {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// The state of a reduction.
pub(crate) trait Accumulator: Debug + Send + Sync {
    /// Takes the values of the quantities of one sample at a time [s].
    fn push(&mut self, time: f64, values: &[f64]);

    /// The result after at least one sample.
    fn result(&self) -> f64;

    /// The time of the sample that is the result, when it is one sample's value [s].
    fn sample_time(&self) -> Option<f64> {
        None
    }

    /// What it remembers of the samples so far.
    fn save_state(&self) -> Vec<f64>;

    /// Goes on with what one of its kind remembered; whether these numbers are such a memory. If not, it is as it was.
    fn restore_state(&mut self, memory: &[f64]) -> bool;

    /// A copy with the same state.
    fn clone_boxed(&self) -> Box<dyn Accumulator>;
}

impl Clone for Box<dyn Accumulator> {
    fn clone(&self) -> Self {
        self.as_ref().clone_boxed()
    }
}

pub(crate) static REDUCERS: &[WindowReducer] = &[
    single_quantity_reducer("max", UnitRule::Kept, |_| pick_accumulator(|x, value| x > value)),
    single_quantity_reducer("min", UnitRule::Kept, |_| pick_accumulator(|x, value| x < value)),
    single_quantity_reducer("first", UnitRule::Kept, |_| pick_accumulator(|_, _| false)),
    single_quantity_reducer("last", UnitRule::Kept, |_| pick_accumulator(|_, _| true)),
    single_quantity_reducer("sum", UnitRule::Sum, |_| sum_accumulator(|x| x, |sum, _| sum)),
    single_quantity_reducer("mean", UnitRule::Kept, |_| sum_accumulator(|x| x, |sum, count| sum / count)),
    single_quantity_reducer("rms", UnitRule::Sum, |_| {
        sum_accumulator(|x| x * x, |sum, count| (sum / count).sqrt())
    }),
    single_quantity_reducer("count", UnitRule::Plain, |_| {
        sum_accumulator(|x| f64::from(u8::from(x != 0.0)), |sum, _| sum)
    }),
    single_quantity_reducer("std", UnitRule::Spread, |_| Box::new(WelfordAccumulator::default())),
    WindowReducer {
        name: "quantile",
        quantities: 1,
        form: Some(ReducerCallForm {
            parameter: Some(|p| (0.0..=1.0).contains(&p)),
            expected: "`quantile(x, p)` with a number p from 0 to 1",
            example: "`quantile(x, 0.95)` is the value that 95 % of the samples do not exceed",
        }),
        units: UnitRule::Kept,
        start: |share| Box::new(QuantileAccumulator { share, samples: Vec::new() }),
    },
    rating_reducer("rating", |_| {
        WholeSignalAccumulator::new_boxed(2, |it| evaluate_rating(it, |rating| rating.overall))
    }),
    rating_reducer("rating_corridor", |_| {
        WholeSignalAccumulator::new_boxed(2, |it| evaluate_rating(it, |rating| rating.corridor))
    }),
    rating_reducer("rating_phase", |_| {
        WholeSignalAccumulator::new_boxed(2, |it| evaluate_rating(it, |rating| rating.phase))
    }),
    rating_reducer("rating_magnitude", |_| {
        WholeSignalAccumulator::new_boxed(2, |it| evaluate_rating(it, |rating| rating.magnitude))
    }),
    rating_reducer("rating_slope", |_| {
        WholeSignalAccumulator::new_boxed(2, |it| evaluate_rating(it, |rating| rating.slope))
    }),
    corridor_reducer("corridor", |_| {
        WholeSignalAccumulator::new_boxed(6, |it| {
            evaluate_band_coverage(it, |inside| (inside.deviation, Some(inside.worst)))
        })
    }),
    corridor_reducer("corridor_share", |_| {
        WholeSignalAccumulator::new_boxed(6, |it| {
            evaluate_band_coverage(it, |inside| (inside.share, inside.first_outside))
        })
    }),
];

/// A part of the rating by ISO/TS 18571.
const fn rating_reducer(name: &'static str, start: fn(f64) -> Box<dyn Accumulator>) -> WindowReducer {
    let form = ReducerCallForm {
        parameter: None,
        expected: "a signal and its reference, as in `rating(x, reference)`",
        example: "it says by ISO/TS 18571 how well the signal agrees with the reference: 1 is the best",
    };
    WindowReducer { name, quantities: 2, form: Some(form), units: UnitRule::OneUnit, start }
}

/// A statement about the band of ISO 19364.
const fn corridor_reducer(name: &'static str, start: fn(f64) -> Box<dyn Accumulator>) -> WindowReducer {
    let form = ReducerCallForm {
        parameter: None,
        expected: "`(x, y, x_ref, y_ref, dx, dy)`: a curve, its reference, and the tolerances of that",
        example: "tolerances are as `0.1 m/s2 + 0.06 * abs(x_ref)`",
    };
    WindowReducer { name, quantities: 6, form: Some(form), units: UnitRule::Curves, start }
}

const fn single_quantity_reducer(
    name: &'static str,
    units: UnitRule,
    start: fn(f64) -> Box<dyn Accumulator>,
) -> WindowReducer {
    WindowReducer { name, quantities: 1, form: None, units, start }
}

/// The reduction of this name.
pub(crate) fn find_reducer(name: &str) -> Option<&'static WindowReducer> {
    REDUCERS.iter().find(|reducer| reducer.name == name)
}

fn pick_accumulator(replaces: fn(f64, f64) -> bool) -> Box<dyn Accumulator> {
    Box::new(PickAccumulator { replaces, picked: None })
}

fn sum_accumulator(term: fn(f64) -> f64, result: fn(f64, f64) -> f64) -> Box<dyn Accumulator> {
    Box::new(SumAccumulator { term, result, sum: 0.0, count: 0.0 })
}

/// The only quantity of a reduction.
fn single_quantity(values: &[f64]) -> f64 {
    values.first().copied().unwrap_or(f64::NAN)
}

/// Keeps the value of one sample.
#[derive(Debug, Clone)]
struct PickAccumulator {
    /// Whether a new value replaces the kept one.
    replaces: fn(f64, f64) -> bool,
    /// Time [s] and value.
    picked: Option<(f64, f64)>,
}

impl Accumulator for PickAccumulator {
    fn push(&mut self, time: f64, values: &[f64]) {
        let value = single_quantity(values);
        if self.picked.is_none_or(|(_, kept)| (self.replaces)(value, kept)) {
            self.picked = Some((time, value));
        }
    }

    fn result(&self) -> f64 {
        self.picked.map_or(f64::NAN, |(_, value)| value)
    }

    fn sample_time(&self) -> Option<f64> {
        self.picked.map(|(time, _)| time)
    }

    fn save_state(&self) -> Vec<f64> {
        self.picked.iter().flat_map(|(time, value)| [*time, *value]).collect()
    }

    fn restore_state(&mut self, memory: &[f64]) -> bool {
        self.picked = match *memory {
            [] => None,
            [time, value] => Some((time, value)),
            _ => return false,
        };
        true
    }

    fn clone_boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// Adds up a term of each sample.
#[derive(Debug, Clone)]
struct SumAccumulator {
    term: fn(f64) -> f64,
    /// The result of the sum and the number of samples.
    result: fn(f64, f64) -> f64,
    sum: f64,
    count: f64,
}

impl Accumulator for SumAccumulator {
    fn push(&mut self, _: f64, values: &[f64]) {
        self.count += 1.0;
        self.sum += (self.term)(single_quantity(values));
    }

    fn result(&self) -> f64 {
        (self.result)(self.sum, self.count)
    }

    fn save_state(&self) -> Vec<f64> {
        vec![self.sum, self.count]
    }

    fn restore_state(&mut self, memory: &[f64]) -> bool {
        let [sum, count] = *memory else { return false };
        (self.sum, self.count) = (sum, count);
        true
    }

    fn clone_boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// Standard deviation by Welford's recursion.
#[derive(Debug, Clone, Default)]
struct WelfordAccumulator {
    count: f64,
    mean: f64,
    /// Sum of squared distances to the mean.
    squares: f64,
}

impl Accumulator for WelfordAccumulator {
    fn push(&mut self, _: f64, values: &[f64]) {
        let value = single_quantity(values);
        self.count += 1.0;
        let distance = value - self.mean;
        self.mean += distance / self.count;
        self.squares += distance * (value - self.mean);
    }

    fn result(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }

    fn save_state(&self) -> Vec<f64> {
        vec![self.count, self.mean, self.squares]
    }

    fn restore_state(&mut self, memory: &[f64]) -> bool {
        let [count, mean, squares] = *memory else { return false };
        *self = WelfordAccumulator { count, mean, squares };
        true
    }

    fn clone_boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// Interpolates linearly between the two samples around the quantile (type 7 of Hyndman and Fan, Sample Quantiles in
/// Statistical Packages, 1996).
#[derive(Debug, Clone)]
struct QuantileAccumulator {
    share: f64,
    samples: Vec<f64>,
}

impl Accumulator for QuantileAccumulator {
    fn push(&mut self, _: f64, values: &[f64]) {
        self.samples.push(single_quantity(values));
    }

    fn result(&self) -> f64 {
        let mut sorted = self.samples.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let place = self.share * (sorted.len() - 1) as f64;
        let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
        // Without the comparison two equal infinities would become NaN.
        if below == above { below } else { below + (above - below) * place.fract() }
    }

    fn save_state(&self) -> Vec<f64> {
        self.samples.clone()
    }

    fn restore_state(&mut self, memory: &[f64]) -> bool {
        memory.clone_into(&mut self.samples);
        true
    }

    fn clone_boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}
