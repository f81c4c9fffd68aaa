//! Distorts a connected value the way a real sensor and its bus would.

use std::collections::VecDeque;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde::Deserialize;

/// The sensor effects of one connection, in the order in which they act: delay, gain, bias, noise,
/// quantisation, then sample-and-hold with dropouts. What is absent does nothing.
///
/// ```toml
/// noise = { std = 0.1, seed = 7 }
/// bias = 0.02
/// gain = 1.01
/// delay = 0.015
/// quantise = 0.005
/// hold = 0.02
/// dropout = 0.001
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effects {
    /// Gaussian white noise, a new value at every communication step.
    pub noise: Option<Noise>,
    /// Added, in the value's unit.
    pub bias: Option<f64>,
    /// Factor.
    pub gain: Option<f64>,
    /// Dead time [s]; between communication points the value is interpolated linearly, and until
    /// the dead time is over it is the first one.
    pub delay: Option<f64>,
    /// Step between representable values, in the value's unit.
    pub quantise: Option<f64>,
    /// Sampling period [s]; in between the value is held.
    pub hold: Option<f64>,
    /// Probability that a sample is lost and the one before it is kept.
    pub dropout: Option<f64>,
}

/// Gaussian white noise.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation, in the value's unit.
    pub std: f64,
    /// Fixes the sequence independently of the scenario's seed.
    pub seed: Option<u64>,
}

/// The effects of one connection with their memory.
#[derive(Debug, Clone)]
pub struct Chain {
    effects: Effects,
    delay: Option<Delay>,
    noise: Pcg64,
    dropout: Pcg64,
    /// Communication steps per sampling period.
    period: f64,
    steps: u64,
    /// The sampling period of the last sample and what it showed.
    shown: Option<(u64, f64)>,
}

impl Chain {
    /// Prepares the effects for calls every `communication_step` [s]; `stream` is the connection's
    /// own number from [`stream_seed`].
    ///
    /// # Errors
    /// When a number is out of its range; the text names the key.
    pub fn new(effects: &Effects, communication_step: f64, stream: u64) -> Result<Self, String> {
        check(effects)?;
        if !(communication_step.is_finite() && communication_step > 0.0) {
            return Err(format!(
                "expected a positive communication step, found {communication_step}"
            ));
        }
        let noise = effects.noise.as_ref().and_then(|noise| noise.seed);
        Ok(Self {
            delay: effects
                .delay
                .filter(|delay| *delay > 0.0)
                .map(|delay| Delay::new(delay / communication_step)),
            // Each effect has its own generator: adding one leaves the other's sequence alone.
            noise: Pcg64::seed_from_u64(noise.unwrap_or_else(|| stream_seed(stream, "noise"))),
            dropout: Pcg64::seed_from_u64(stream_seed(stream, "dropout")),
            period: effects.hold.unwrap_or(0.0) / communication_step,
            steps: 0,
            shown: None,
            effects: *effects,
        })
    }

    /// Passes the value of one communication step through the effects; NaN stays NaN.
    pub fn apply(&mut self, value: f64) -> f64 {
        let mut value = match &mut self.delay {
            Some(delay) => delay.apply(value),
            None => value,
        };
        if let Some(gain) = self.effects.gain {
            value *= gain;
        }
        if let Some(bias) = self.effects.bias {
            value += bias;
        }
        if let Some(noise) = &self.effects.noise {
            let normal: f64 = StandardNormal.sample(&mut self.noise);
            value += noise.std * normal;
        }
        if let Some(step) = self.effects.quantise {
            value = (value / step).round() * step;
        }
        self.show(value)
    }

    /// Sample-and-hold, with samples that get lost.
    fn show(&mut self, value: f64) -> f64 {
        let step = self.steps;
        self.steps += 1;
        let period = if self.period > 1.0 {
            // A period of three steps may come out as 2.9999999999999996 of them.
            (step as f64 / self.period + 1e-9).floor() as u64
        } else {
            step
        };
        let Some((last, shown)) = self.shown else {
            self.shown = Some((period, value));
            return value;
        };
        if period == last {
            return shown;
        }
        let lost =
            self.effects.dropout.is_some_and(|probability| self.dropout.random_bool(probability));
        let shown = if lost { shown } else { value };
        self.shown = Some((period, shown));
        shown
    }
}

fn check(effects: &Effects) -> Result<(), String> {
    let std = effects.noise.as_ref().map(|noise| noise.std);
    let any = |_: f64| true;
    let not_negative = |x: f64| x >= 0.0;
    let positive = |x: f64| x > 0.0;
    let share = |x: f64| (0.0..=1.0).contains(&x);
    type Rule<'a> = (&'a str, Option<f64>, fn(f64) -> bool, &'a str);
    #[rustfmt::skip]
    let rules: [Rule; 7] = [
        ("noise.std", std, not_negative, "a finite number of at least 0"),
        ("bias", effects.bias, any, "a finite number"),
        ("gain", effects.gain, any, "a finite number"),
        ("delay", effects.delay, not_negative, "a finite time [s] of at least 0"),
        ("quantise", effects.quantise, positive, "a finite number above 0"),
        ("hold", effects.hold, not_negative, "a finite time [s] of at least 0"),
        ("dropout", effects.dropout, share, "a probability from 0 to 1"),
    ];
    for (key, number, is_valid, expected) in rules {
        if let Some(number) = number.filter(|x| !(x.is_finite() && is_valid(*x))) {
            return Err(format!("expected {expected} for `{key}`, found {number}"));
        }
    }
    Ok(())
}

/// A dead time that need not be a whole number of communication steps.
#[derive(Debug, Clone)]
struct Delay {
    whole: usize,
    fraction: f64,
    /// The newest `whole + 2` values at most, the newest in front.
    past: VecDeque<f64>,
}

impl Delay {
    fn new(steps: f64) -> Self {
        // 0.03 s are not exactly three steps of 0.01 s.
        let nearest = steps.round();
        let steps = if (steps - nearest).abs() < 1e-9 * nearest.max(1.0) { nearest } else { steps };
        Self { whole: steps as usize, fraction: steps.fract(), past: VecDeque::new() }
    }

    fn apply(&mut self, value: f64) -> f64 {
        self.past.push_front(value);
        self.past.truncate(self.whole.saturating_add(2));
        let at = |age: usize| self.past.get(age).or(self.past.back()).copied();
        let newer = at(self.whole).unwrap_or(value);
        // Zero times a NaN that is not due yet would be NaN.
        if self.fraction == 0.0 {
            return newer;
        }
        let older = at(self.whole.saturating_add(1)).unwrap_or(value);
        newer * (1.0 - self.fraction) + older * self.fraction
    }
}

/// The number of the random stream that belongs to a name: it depends on the scenario's seed and
/// the name alone, so that streams stay as they are when others are added.
#[must_use]
pub fn stream_seed(seed: u64, name: &str) -> u64 {
    // FNV-1a over the name, then SplitMix64's finaliser so that similar seeds share no bits.
    let offset_basis = 0xcbf2_9ce4_8422_2325;
    let hash = name.bytes().fold(offset_basis, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let mut mixed = hash ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(text: &str, stream: u64) -> Chain {
        let effects = toml::from_str(text).unwrap_or_else(|error| panic!("{error}"));
        Chain::new(&effects, 0.01, stream).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn each_effect_does_what_it_says() {
        #[rustfmt::skip]
        let cases: &[(&str, &[f64])] = &[
            ("", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
            ("bias = 0.5", &[1.5, 2.5, 4.5, 8.5, 16.5, 32.5, 64.5]),
            ("gain = -2.0", &[-2.0, -4.0, -8.0, -16.0, -32.0, -64.0, -128.0]),
            ("gain = 2.0\nbias = 1.0", &[3.0, 5.0, 9.0, 17.0, 33.0, 65.0, 129.0]),
            ("delay = 0.0", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
            ("delay = 0.03", &[1.0, 1.0, 1.0, 1.0, 2.0, 4.0, 8.0]),
            ("delay = 0.015", &[1.0, 1.0, 1.5, 3.0, 6.0, 12.0, 24.0]),
            ("delay = 0.0025", &[1.0, 1.75, 3.5, 7.0, 14.0, 28.0, 56.0]),
            ("delay = 1e9", &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
            ("quantise = 5.0", &[0.0, 0.0, 5.0, 10.0, 15.0, 30.0, 65.0]),
            ("hold = 0.0", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
            ("hold = 0.03", &[1.0, 1.0, 1.0, 8.0, 8.0, 8.0, 64.0]),
            ("hold = 0.025", &[1.0, 1.0, 1.0, 8.0, 8.0, 32.0, 32.0]),
            ("hold = 0.001", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
            ("dropout = 1.0", &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
            ("dropout = 0.0", &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
            ("delay = 0.01\ngain = 3.0\nbias = 1.0\nquantise = 4.0\nhold = 0.02", &[4.0, 4.0, 8.0, 8.0, 24.0, 24.0, 96.0]),
        ];
        for (text, expected) in cases {
            let mut chain = chain(text, 1);
            let shown: Vec<f64> = (0..7).map(|i| chain.apply(2_f64.powi(i))).collect();
            for (value, expected) in shown.iter().zip(*expected) {
                assert!((value - expected).abs() < 1e-9, "{text}: {shown:?}");
            }
        }
    }

    #[test]
    fn noise_has_its_deviation_and_is_white() {
        let mut chain = chain("noise = { std = 0.5 }", stream_seed(1, "plant.a_y"));
        let count = 20_000;
        let noise: Vec<f64> = (0..count).map(|_| chain.apply(3.0) - 3.0).collect();
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / f64::from(count);
        let variance = mean(&mut noise.iter().map(|x| x * x));
        assert!(mean(&mut noise.iter().copied()).abs() < 5.0 * 0.5 / f64::from(count).sqrt());
        assert!((variance.sqrt() / 0.5 - 1.0).abs() < 0.03, "{variance}");
        let neighbours = mean(&mut noise.windows(2).map(|pair| pair[0] * pair[1]));
        assert!((neighbours / variance).abs() < 0.04, "{neighbours}");
    }

    #[test]
    fn dropouts_are_as_frequent_as_they_should_be() {
        let mut chain = chain("dropout = 0.25", 3);
        let shown: Vec<f64> = (0..10_000).map(|i| chain.apply(f64::from(i))).collect();
        let lost = shown.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!((2300..2700).contains(&lost), "{lost}");
    }

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |text: &str, stream: u64| chain(text, stream).apply(0.0);
        let noise = "noise = { std = 1.0 }";
        let fixed = "noise = { std = 1.0, seed = 5 }";
        assert_eq!(draw(noise, 7), draw(noise, 7));
        assert_ne!(draw(noise, 7), draw(noise, 8));
        assert_eq!(draw(fixed, 7), draw(fixed, 8));
        assert_eq!(draw(noise, 7), draw(&format!("{noise}\ndropout = 0.5"), 7));
        let mut streams: Vec<u64> = (0..20)
            .flat_map(|seed| ["a.x", "a.y", "x.a", ""].map(|name| stream_seed(seed, name)))
            .collect();
        streams.sort_unstable();
        streams.dedup();
        assert_eq!(streams.len(), 80);
    }

    #[test]
    fn nan_is_delayed_and_held_but_never_becomes_a_number() {
        let all = "noise = { std = 1.0 }\nbias = 1.0\ngain = 2.0\nquantise = 0.1";
        assert!(chain(all, 1).apply(f64::NAN).is_nan());
        let mut chain = chain("delay = 0.02\nhold = 0.02", 1);
        let shown = [1.0, f64::NAN, f64::NAN, 2.0, 3.0, 4.0, 5.0].map(|x| chain.apply(x).is_nan());
        assert_eq!(shown, [false, false, false, false, true, true, false]);
    }

    #[test]
    fn errors_name_the_key() {
        #[rustfmt::skip]
        let cases = [
            ("noise = { std = -1.0 }", "at least 0 for `noise.std`, found -1"),
            ("noise = { std = nan }", "`noise.std`, found NaN"),
            ("bias = inf", "`bias`, found inf"),
            ("gain = nan", "`gain`"),
            ("delay = -0.1", "`delay`, found -0.1"),
            ("delay = inf", "`delay`"),
            ("quantise = 0.0", "above 0 for `quantise`, found 0"),
            ("hold = -1.0", "`hold`"),
            ("dropout = 1.5", "from 0 to 1 for `dropout`, found 1.5"),
        ];
        for (text, part) in cases {
            let effects = toml::from_str(text).expect(text);
            let error = Chain::new(&effects, 0.01, 0).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(Chain::new(&Effects::default(), 0.0, 0).is_err());
        assert!(toml::from_str::<Effects>("quantize = 1.0").is_err());
    }
}
