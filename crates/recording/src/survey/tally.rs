//! Accumulates range, rate and gaps of a channel in constant memory.

use std::collections::BTreeMap;

/// So many different texts are kept as examples.
const EXAMPLES: usize = 3;
/// A text is shown up to so many letters.
const LETTERS: usize = 40;
/// A step is a gap when it is longer than so many median steps.
const GAP: f64 = 1.5;
/// Different steps that are counted, to four digits each; of more, the last ones are not.
const STEPS: usize = 50_000;

/// What was seen of a channel.
#[derive(Debug, Clone, Default)]
pub struct ChannelStatistics {
    /// All rows, also those without a value.
    pub rows: u64,
    /// Rows with a value.
    pub values: u64,
    /// The least and the largest number.
    pub range: Option<(f64, f64)>,
    /// The first different texts.
    pub texts: Vec<String>,
    /// The times of the first and the last value [s].
    pub times: Option<(f64, f64)>,
    /// Values whose time is not behind that of the value before.
    pub not_rising: u64,
    /// How often each step came.
    steps: BTreeMap<RoundedStep, u64>,
    /// The step that was counted last, its key and how often it came since.
    last: Option<(f64, RoundedStep, u64)>,
    longest: Option<(f64, f64)>,
}

/// Steps that are longer than most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeGapCounts {
    /// How many there are.
    pub count: u64,
    /// The longest one [s], and the time at its beginning [s].
    pub longest: Option<(f64, f64)>,
}

impl ChannelStatistics {
    /// Takes a row without a value.
    pub fn add_gap(&mut self) {
        self.rows += 1;
    }

    /// Takes a number at a time [s], which is NaN where there is none.
    pub fn add_number(&mut self, time: f64, value: f64) {
        if value.is_nan() {
            return self.add_gap();
        }
        self.range = Some(match self.range {
            None => (value, value),
            Some((least, most)) => (least.min(value), most.max(value)),
        });
        self.count_step_to(time);
    }

    /// Takes a text.
    pub fn add_text(&mut self, time: f64, text: &str) {
        if self.texts.len() < EXAMPLES {
            let short: String = text.chars().take(LETTERS).collect();
            if !short.is_empty() && !self.texts.contains(&short) {
                self.texts.push(short);
            }
        }
        self.count_step_to(time);
    }

    fn count_step_to(&mut self, time: f64) {
        self.rows += 1;
        self.values += 1;
        if !time.is_finite() {
            return;
        }
        let Some((first, before)) = self.times else {
            self.times = Some((time, time));
            return;
        };
        self.times = Some((first, time));
        let step = time - before;
        if step <= 0.0 {
            self.not_rising += 1;
            return;
        }
        if self.longest.is_none_or(|(longest, _)| step > longest) {
            self.longest = Some((step, before));
        }
        match &mut self.last {
            Some((last, _, count)) if (*last - step).abs() <= 1e-6 * step => *count += 1,
            _ => {
                self.flush_last_steps();
                self.last = Some((step, RoundedStep::new(step), 1));
            }
        }
    }

    /// Adds the steps that came last to the others.
    fn flush_last_steps(&mut self) {
        let Some((_, key, count)) = self.last.take() else { return };
        let full = self.steps.len() >= STEPS;
        match self.steps.get_mut(&key) {
            Some(sum) => *sum += count,
            None if !full => drop(self.steps.insert(key, count)),
            None => {}
        }
    }

    /// All steps, each with how often it came.
    fn step_counts(&self) -> BTreeMap<RoundedStep, u64> {
        let mut steps = self.steps.clone();
        if let Some((_, key, count)) = self.last {
            *steps.entry(key).or_default() += count;
        }
        steps
    }

    /// The median of the steps between values, to four digits [s].
    #[must_use]
    pub fn median_step(&self) -> Option<f64> {
        let steps = self.step_counts();
        let half = steps.values().sum::<u64>().div_ceil(2);
        let mut sum = 0;
        let median = steps.iter().find(|(_, count)| {
            sum += **count;
            sum >= half
        });
        median.map(|(key, _)| key.seconds())
    }

    /// The steps that are longer than 1.5 median ones.
    #[must_use]
    pub fn gap_count(&self) -> TimeGapCounts {
        let Some(most) = self.median_step().map(|step| GAP * step) else {
            return TimeGapCounts { count: 0, longest: None };
        };
        let steps = self.step_counts();
        let count = steps.iter().filter(|(key, _)| key.seconds() > most).map(|(_, it)| it).sum();
        TimeGapCounts { count, longest: self.longest.filter(|(longest, _)| *longest > most && count > 0) }
    }
}

/// A step to four digits. The fields are in the order that sorts steps by their length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct RoundedStep {
    /// The power of ten of the first digit.
    power: i32,
    /// The digits, from 1000 on.
    digits: u32,
}

impl RoundedStep {
    fn new(step: f64) -> Self {
        let power = step.log10().floor() as i32;
        let digits = (step / 10f64.powi(power) * 1000.0).round();
        match digits >= 10_000.0 {
            true => RoundedStep { power: power + 1, digits: 1000 },
            false => RoundedStep { power, digits: digits as u32 },
        }
    }

    fn seconds(self) -> f64 {
        // By division the result is the number that is written with these digits.
        match self.power - 3 {
            power if power < 0 => f64::from(self.digits) / 10f64.powi(-power),
            power => f64::from(self.digits) * 10f64.powi(power),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_ranges_and_gaps_are_those_of_the_values() {
        let mut tally = ChannelStatistics::default();
        let times = (0..1000).map(|k| f64::from(k) * 0.01 + if k >= 700 { 3.0 } else { 0.0 });
        for (k, time) in times.enumerate() {
            let value = if k % 100 == 50 { f64::NAN } else { k as f64 };
            tally.add_number(time, value);
        }
        assert_eq!((tally.rows, tally.values), (1000, 990));
        assert_eq!((tally.range, tally.median_step()), (Some((0.0, 999.0)), Some(0.01)));
        // Ten values that are missing, and the pause.
        let TimeGapCounts { count, longest } = tally.gap_count();
        let (longest, at) = longest.expect("a pause");
        assert_eq!(count, 11);
        assert!((longest - 3.01).abs() < 1e-9 && (at - 6.99).abs() < 1e-9, "{longest} {at}");
        assert_eq!(tally.not_rising, 0);
    }

    #[test]
    fn a_channel_of_every_tenth_row_has_the_rate_of_its_values() {
        let mut tally = ChannelStatistics::default();
        for k in 0..1000 {
            let value = if k % 10 == 0 { 1.0 } else { f64::NAN };
            tally.add_number(f64::from(k) * 0.01, value);
        }
        assert_eq!((tally.median_step(), tally.gap_count().count), (Some(0.1), 0));
    }

    #[test]
    fn steps_are_rounded_to_four_digits() {
        for (step, rounded) in [(0.01, 0.01), (0.033_333, 0.033_33), (9.999_96, 10.0), (1e-6, 1e-6)] {
            assert_eq!(RoundedStep::new(step).seconds(), rounded, "{step}");
        }
        let mut tally = ChannelStatistics::default();
        assert_eq!((tally.median_step(), tally.gap_count().longest), (None, None));
        tally.add_text(0.0, "dry");
        tally.add_text(0.0, "dry");
        tally.add_text(1.0, "wet");
        assert_eq!((tally.texts.join(" "), tally.not_rising, tally.values), ("dry wet".into(), 1, 3));
    }
}
