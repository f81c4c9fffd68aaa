//! Lists the reductions over the window of a check. A new reduction is a line in [`REDUCERS`] and its accumulator.

mod series;

use std::fmt::Debug;

use crate::dimension::UnitRule;
use series::{Series, banded, rated};

/// A reduction of one or more quantities over the window.
#[derive(Debug)]
pub(crate) struct Reducer {
    pub name: &'static str,
    /// Arguments that have a value at each sample.
    pub quantities: usize,
    /// The form of the call, when it has other arguments than one quantity.
    pub form: Option<Form>,
    pub units: UnitRule,
    /// The accumulator before the first sample; its argument is the parameter.
    pub start: fn(f64) -> Box<dyn Accumulator>,
}

/// The form of a call.
#[derive(Debug)]
pub(crate) struct Form {
    /// What the last argument may be, if it is a constant.
    pub parameter: Option<fn(f64) -> bool>,
    /// The expected form of the call.
    pub expected: &'static str,
    /// An example with its meaning.
    pub example: &'static str,
}

/// A reduction with the same name is the same one.
impl PartialEq for Reducer {
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
    fn at(&self) -> Option<f64> {
        None
    }

    /// What it remembers of the samples so far.
    fn memory(&self) -> Vec<f64>;

    /// Goes on with what one of its kind remembered; whether these numbers are such a memory. If not, it is as it was.
    fn recall(&mut self, memory: &[f64]) -> bool;

    /// A copy with the same state.
    fn boxed(&self) -> Box<dyn Accumulator>;
}

impl Clone for Box<dyn Accumulator> {
    fn clone(&self) -> Self {
        self.as_ref().boxed()
    }
}

pub(crate) static REDUCERS: &[Reducer] = &[
    of("max", UnitRule::Kept, |_| picks(|x, value| x > value)),
    of("min", UnitRule::Kept, |_| picks(|x, value| x < value)),
    of("first", UnitRule::Kept, |_| picks(|_, _| false)),
    of("last", UnitRule::Kept, |_| picks(|_, _| true)),
    of("sum", UnitRule::Sum, |_| adds(|x| x, |sum, _| sum)),
    of("mean", UnitRule::Kept, |_| adds(|x| x, |sum, count| sum / count)),
    of("rms", UnitRule::Sum, |_| adds(|x| x * x, |sum, count| (sum / count).sqrt())),
    of("count", UnitRule::Plain, |_| adds(|x| f64::from(u8::from(x != 0.0)), |sum, _| sum)),
    of("std", UnitRule::Spread, |_| Box::new(Spread::default())),
    Reducer {
        name: "quantile",
        quantities: 1,
        form: Some(Form {
            parameter: Some(|p| (0.0..=1.0).contains(&p)),
            expected: "`quantile(x, p)` with a number p from 0 to 1",
            example: "`quantile(x, 0.95)` is the value that 95 % of the samples do not exceed",
        }),
        units: UnitRule::Kept,
        start: |share| Box::new(Quantile { share, samples: Vec::new() }),
    },
    rating("rating", |_| Series::of(2, |it| rated(it, |rating| rating.overall))),
    rating("rating_corridor", |_| Series::of(2, |it| rated(it, |rating| rating.corridor))),
    rating("rating_phase", |_| Series::of(2, |it| rated(it, |rating| rating.phase))),
    rating("rating_magnitude", |_| Series::of(2, |it| rated(it, |rating| rating.magnitude))),
    rating("rating_slope", |_| Series::of(2, |it| rated(it, |rating| rating.slope))),
    corridor("corridor", |_| {
        Series::of(6, |it| banded(it, |inside| (inside.deviation, Some(inside.worst))))
    }),
    corridor("corridor_share", |_| {
        Series::of(6, |it| banded(it, |inside| (inside.share, inside.first_outside)))
    }),
];

/// A part of the rating by ISO/TS 18571.
const fn rating(name: &'static str, start: fn(f64) -> Box<dyn Accumulator>) -> Reducer {
    let form = Form {
        parameter: None,
        expected: "a signal and its reference, as in `rating(x, reference)`",
        example: "it says by ISO/TS 18571 how well the signal agrees with the reference: 1 is the best",
    };
    Reducer { name, quantities: 2, form: Some(form), units: UnitRule::OneUnit, start }
}

/// A statement about the band of ISO 19364.
const fn corridor(name: &'static str, start: fn(f64) -> Box<dyn Accumulator>) -> Reducer {
    let form = Form {
        parameter: None,
        expected: "`(x, y, x_ref, y_ref, dx, dy)`: a curve, its reference, and the tolerances of that",
        example: "tolerances are as `0.1 m/s2 + 0.06 * abs(x_ref)`",
    };
    Reducer { name, quantities: 6, form: Some(form), units: UnitRule::Curves, start }
}

const fn of(
    name: &'static str,
    units: UnitRule,
    start: fn(f64) -> Box<dyn Accumulator>,
) -> Reducer {
    Reducer { name, quantities: 1, form: None, units, start }
}

/// The reduction of this name.
pub(crate) fn find(name: &str) -> Option<&'static Reducer> {
    REDUCERS.iter().find(|reducer| reducer.name == name)
}

fn picks(replaces: fn(f64, f64) -> bool) -> Box<dyn Accumulator> {
    Box::new(Pick { replaces, picked: None })
}

fn adds(term: fn(f64) -> f64, result: fn(f64, f64) -> f64) -> Box<dyn Accumulator> {
    Box::new(Sum { term, result, sum: 0.0, count: 0.0 })
}

/// The only quantity of a reduction.
fn first(values: &[f64]) -> f64 {
    values.first().copied().unwrap_or(f64::NAN)
}

/// Keeps the value of one sample.
#[derive(Debug, Clone)]
struct Pick {
    /// Whether a new value replaces the kept one.
    replaces: fn(f64, f64) -> bool,
    /// Time [s] and value.
    picked: Option<(f64, f64)>,
}

impl Accumulator for Pick {
    fn push(&mut self, time: f64, values: &[f64]) {
        let value = first(values);
        if self.picked.is_none_or(|(_, kept)| (self.replaces)(value, kept)) {
            self.picked = Some((time, value));
        }
    }

    fn result(&self) -> f64 {
        self.picked.map_or(f64::NAN, |(_, value)| value)
    }

    fn at(&self) -> Option<f64> {
        self.picked.map(|(time, _)| time)
    }

    fn memory(&self) -> Vec<f64> {
        self.picked.iter().flat_map(|(time, value)| [*time, *value]).collect()
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        self.picked = match *memory {
            [] => None,
            [time, value] => Some((time, value)),
            _ => return false,
        };
        true
    }

    fn boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// Adds up a term of each sample.
#[derive(Debug, Clone)]
struct Sum {
    term: fn(f64) -> f64,
    /// The result of the sum and the number of samples.
    result: fn(f64, f64) -> f64,
    sum: f64,
    count: f64,
}

impl Accumulator for Sum {
    fn push(&mut self, _: f64, values: &[f64]) {
        self.count += 1.0;
        self.sum += (self.term)(first(values));
    }

    fn result(&self) -> f64 {
        (self.result)(self.sum, self.count)
    }

    fn memory(&self) -> Vec<f64> {
        vec![self.sum, self.count]
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        let [sum, count] = *memory else { return false };
        (self.sum, self.count) = (sum, count);
        true
    }

    fn boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// Standard deviation by Welford's recursion.
#[derive(Debug, Clone, Default)]
struct Spread {
    count: f64,
    mean: f64,
    /// Sum of squared distances to the mean.
    squares: f64,
}

impl Accumulator for Spread {
    fn push(&mut self, _: f64, values: &[f64]) {
        let value = first(values);
        self.count += 1.0;
        let distance = value - self.mean;
        self.mean += distance / self.count;
        self.squares += distance * (value - self.mean);
    }

    fn result(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }

    fn memory(&self) -> Vec<f64> {
        vec![self.count, self.mean, self.squares]
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        let [count, mean, squares] = *memory else { return false };
        *self = Spread { count, mean, squares };
        true
    }

    fn boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}

/// Interpolates linearly between the two samples around the quantile (type 7 of Hyndman and Fan, Sample Quantiles in
/// Statistical Packages, 1996).
#[derive(Debug, Clone)]
struct Quantile {
    share: f64,
    samples: Vec<f64>,
}

impl Accumulator for Quantile {
    fn push(&mut self, _: f64, values: &[f64]) {
        self.samples.push(first(values));
    }

    fn result(&self) -> f64 {
        let mut sorted = self.samples.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let place = self.share * (sorted.len() - 1) as f64;
        let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
        // Without the comparison two equal infinities would become NaN.
        if below == above { below } else { below + (above - below) * place.fract() }
    }

    fn memory(&self) -> Vec<f64> {
        self.samples.clone()
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        memory.clone_into(&mut self.samples);
        true
    }

    fn boxed(&self) -> Box<dyn Accumulator> {
        Box::new(self.clone())
    }
}
