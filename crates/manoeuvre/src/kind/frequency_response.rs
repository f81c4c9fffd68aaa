//! Frequency response: gain, phase and coherence of yaw rate and lateral acceleration over the steering (ISO 7401).

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4, PI, TAU};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, ShortestPhase, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::{DiagramLayerKind, DiagramScale, TestDiagram};
use crate::log::ManoeuvreLog;

/// How the steering is excited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SteerExcitation {
    /// One frequency after the other, for several periods each.
    Sine,
    /// One sine whose frequency grows.
    #[default]
    Sweep,
    /// Random steering within the frequencies; the `seed` of the scenario decides.
    Random,
}

/// Frequency response (ISO 7401) at a constant speed, by sines, a sweep or random steering. Gains and phases are those between the
/// steering as it acts, held over each communication step, and what was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FrequencyResponse {
    /// How the steering is excited.
    #[schemars(example = &"random")]
    pub excitation: SteerExcitation,
    /// Amplitude of the road-wheel angle [rad]; of random steering three times its root mean square.
    #[schemars(example = 0.01)]
    pub amplitude: f64,
    /// Lowest frequency [Hz].
    #[schemars(example = 0.2)]
    pub from: f64,
    /// Highest frequency [Hz].
    #[schemars(example = 2.5)]
    pub to: f64,
    /// Number of frequencies in the result.
    #[schemars(example = 12)]
    pub count: u32,
    /// Duration of a sweep or of random steering [s].
    #[schemars(example = 60.0)]
    pub duration: f64,
    /// Periods of each sine that are measured.
    #[schemars(example = 5)]
    pub periods: u32,
}

impl Default for FrequencyResponse {
    fn default() -> Self {
        FrequencyResponse {
            excitation: SteerExcitation::Sweep,
            amplitude: 0.0,
            from: 0.2,
            to: 2.5,
            count: 12,
            duration: 60.0,
            periods: 5,
        }
    }
}

/// After a sweep the car gets straight for so long [s]; as long it gets used to a new frequency.
const SETTLE: f64 = 3.0;
/// A sweep and random steering go beyond both frequencies by this factor.
const BEYOND: f64 = 1.3;
/// They swell and fade in this share of their duration.
const FADE: f64 = 0.05;
/// Spectra are means over this many lines on each side.
const LINES: i32 = 2;
const MOST: u32 = 200;

/// A complex number.
type Complex = [f64; 2];

fn complex_product([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

/// The sum of samples times exp(-j 2 pi f t).
fn fourier_sum(t: &[f64], values: &[f64], frequency: f64) -> Complex {
    t.iter().zip(values).fold([0.0; 2], |[re, im], (t, value)| {
        let (sin, cos) = (TAU * frequency * t).sin_cos();
        [re + value * cos, im - value * sin]
    })
}

/// One sine of the excitation.
struct ExcitationSine {
    /// [Hz]
    frequency: f64,
    /// [s]
    begin: f64,
    /// Begin of the measured periods, after the transient [s].
    measured_from: f64,
}

/// Sums of products of the spectra of steering and answer.
#[derive(Default)]
struct CrossSpectra {
    uu: f64,
    yy: f64,
    uy: Complex,
}

impl CrossSpectra {
    fn add_spectral_sample(&mut self, u: Complex, y: Complex) {
        self.uu += u[0] * u[0] + u[1] * u[1];
        self.yy += y[0] * y[0] + y[1] * y[1];
        let [re, im] = complex_product([u[0], -u[1]], y);
        self.uy = [self.uy[0] + re, self.uy[1] + im];
    }

    /// Gain, phase [rad] and coherence.
    fn gain_phase_coherence(&self) -> [f64; 3] {
        let size = self.uy[0].hypot(self.uy[1]);
        [size / self.uu, self.uy[1].atan2(self.uy[0]), size * size / (self.uu * self.yy)]
    }
}

impl FrequencyResponse {
    /// The frequencies of the result [Hz], evenly spaced on a logarithmic axis. The period of a sine is a whole number of communication
    /// steps [s], so its spectrum has no leakage.
    #[must_use]
    pub fn result_frequencies(&self, step: f64) -> Vec<f64> {
        let last = f64::from(self.count.max(2) - 1);
        let at = |k: u32| self.from * (self.to / self.from).powf(f64::from(k) / last);
        let whole = |frequency: f64| 1.0 / ((1.0 / (frequency * step)).round() * step);
        let all = (0..self.count).map(at);
        match self.excitation {
            SteerExcitation::Sine => all.map(whole).collect(),
            SteerExcitation::Sweep | SteerExcitation::Random => all.collect(),
        }
    }

    /// The sines that are steered one after the other.
    fn excitation_sines(&self, step: f64) -> Vec<ExcitationSine> {
        let mut begin = 0.0;
        let of = |frequency: f64| {
            let sine = ExcitationSine { frequency, begin, measured_from: begin + SETTLE };
            begin += SETTLE + f64::from(self.periods) / frequency;
            sine
        };
        self.result_frequencies(step).into_iter().map(of).collect()
    }

    /// How long the steering is excited [s].
    fn excitation_duration(&self, step: f64) -> f64 {
        match self.excitation {
            SteerExcitation::Sine => self
                .excitation_sines(step)
                .last()
                .map_or(0.0, |sine| sine.measured_from + f64::from(self.periods) / sine.frequency),
            _ => self.duration,
        }
    }

    /// The steering [rad] at a time after its beginning [s].
    fn excitation_steer_angle(&self, seed: u64, step: f64, time: f64) -> f64 {
        let (low, high) = (self.from / BEYOND, self.to * BEYOND);
        let fade = FADE * self.duration;
        let faded = (time / fade).min((self.duration - time) / fade).clamp(0.0, 1.0);
        self.amplitude
            * match self.excitation {
                SteerExcitation::Sine => {
                    let sines = self.excitation_sines(step);
                    let sine = sines.iter().rev().find(|sine| time >= sine.begin);
                    sine.map_or(0.0, |ExcitationSine { frequency, begin, .. }| {
                        (TAU * frequency * (time - begin)).sin()
                    })
                }
                SteerExcitation::Sweep => {
                    let turns = low * time + 0.5 * (high - low) * time * time / self.duration;
                    faded * (TAU * turns).sin()
                }
                SteerExcitation::Random => {
                    let lines = (low * self.duration).ceil() as u64..=(high * self.duration) as u64;
                    // The root mean square of n cosines of amplitude a is a sqrt(n / 2).
                    let scale = (2.0 / lines.clone().count().max(1) as f64).sqrt() / 3.0;
                    let line =
                        |k: u64| (TAU * (k as f64 * time / self.duration + seeded_uniform(seed, k))).cos();
                    faded * scale * lines.map(line).sum::<f64>()
                }
            }
    }

    /// The spectra around a frequency.
    fn spectra_near_frequency(
        &self,
        log: &ManoeuvreLog,
        answer: &[f64],
        place: usize,
        step: f64,
    ) -> CrossSpectra {
        let mut spectra = CrossSpectra::default();
        let frequency = self.result_frequencies(step)[place];
        let mut add = |range: std::ops::Range<usize>, frequency: f64| {
            let t = &log.t[range.clone()];
            let steer = fourier_sum(t, &log.steer[range.clone()], frequency);
            // The steering is held for a step: sinc(f h), and half a step late.
            let half = PI * frequency * step;
            let (sin, cos) = half.sin_cos();
            let held = if half > 0.0 { sin / half } else { 1.0 };
            spectra.add_spectral_sample(
                complex_product(steer, [held * cos, -held * sin]),
                fourier_sum(t, &answer[range], frequency),
            );
        };
        if self.excitation == SteerExcitation::Sine {
            let begin = self.excitation_sines(step)[place].measured_from;
            for period in 0..self.periods {
                let at = |k: u32| begin + f64::from(period + k) / frequency;
                let place = |time: f64| log.t.partition_point(|t| *t < time - 1e-9);
                add(place(at(0))..place(at(1)), frequency);
            }
        } else {
            let whole = log.t.last().copied().unwrap_or(0.0) + step;
            (-LINES..=LINES).for_each(|line| add(0..log.t.len(), frequency + f64::from(line) / whole));
        }
        spectra
    }
}

/// A number from 0 to 1 of a seed and a line (SplitMix64).
fn seeded_uniform(seed: u64, line: u64) -> f64 {
    let mut z = seed.wrapping_add(line.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// The frequency at which a curve falls below a level, on the line between two frequencies.
fn falling_crossing_frequency(frequencies: &[f64], values: &[f64], level: f64) -> Option<f64> {
    let after = values.iter().position(|value| *value < level).filter(|it| *it > 0)?;
    let share = (level - values[after - 1]) / (values[after] - values[after - 1]);
    Some(frequencies[after - 1] + share * (frequencies[after] - frequencies[after - 1]))
}

/// Phases without jumps of a whole turn.
fn unwrap_phases(phases: &mut [f64]) {
    for k in 1..phases.len() {
        phases[k] -= TAU * ((phases[k] - phases[k - 1]) / TAU).round();
    }
}

impl ManoeuvreKind for FrequencyResponse {
    fn kind_title(&self) -> &'static str {
        "frequency response (ISO 7401)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::YawRate, Channel::LateralAcceleration]
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["excitation"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("frequencies", "Hz", "frequencies of the lists"),
                characteristic_value_info("yaw_rate_gain", "1/s", "yaw rate over road-wheel angle"),
                characteristic_value_info(
                    "yaw_rate_phase",
                    "rad",
                    "phase of the yaw rate, negative when it is late",
                ),
                characteristic_value_info(
                    "yaw_rate_coherence",
                    "1",
                    "share of the yaw rate that follows the steering linearly",
                ),
                characteristic_value_info(
                    "lateral_acceleration_gain",
                    "m/s2/rad",
                    "lateral acceleration over road-wheel angle",
                ),
                characteristic_value_info(
                    "lateral_acceleration_phase",
                    "rad",
                    "phase of the lateral acceleration, negative when it is late",
                ),
                characteristic_value_info(
                    "lateral_acceleration_coherence",
                    "1",
                    "share of the lateral acceleration that follows the steering linearly",
                ),
                characteristic_value_info(
                    "yaw_rate_bandwidth",
                    "Hz",
                    "frequency at which the gain is 3 dB below the first one",
                ),
                characteristic_value_info("yaw_rate_peak_ratio", "1", "largest gain over the first one"),
                characteristic_value_info("yaw_rate_peak_frequency", "Hz", "frequency of the largest gain"),
                characteristic_value_info(
                    "yaw_rate_equivalent_time",
                    "s",
                    "1 / (2 pi f) of the frequency at which the phase is -45 deg",
                ),
                characteristic_value_info(
                    "lateral_acceleration_bandwidth",
                    "Hz",
                    "frequency at which the gain is 3 dB below the first one",
                ),
                characteristic_value_info("coherence_min", "1", "lowest coherence of both"),
            ]
        }
    }

    fn shortest_phase(&self) -> Option<ShortestPhase> {
        Some(ShortestPhase { key: "to", duration: 1.0 / self.to })
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
            ("amplitude", self.amplitude, "rad"),
            ("from", self.from, "Hz"),
            ("to", self.to, "Hz"),
            ("duration", self.duration, "s"),
        ])?;
        if self.to <= self.from {
            let message =
                format!("expected a frequency above `from` = {} Hz, found {} Hz", self.from, self.to);
            return Err(ParameterError::at_kind_key("to", message));
        }
        if self.duration * self.from < 4.0 {
            let message = format!(
                "expected at least four periods of {} Hz, {} s, found {} s",
                self.from,
                4.0 / self.from,
                self.duration
            );
            return Err(ParameterError::at_kind_key("duration", message));
        }
        for (key, count, least) in [("count", self.count, 2), ("periods", self.periods, 1)] {
            if !(least..=MOST).contains(&count) {
                let message = format!("expected {least} to {MOST} for `{key}`, found {count}");
                return Err(ParameterError::at_kind_key(key, message));
            }
        }
        Ok(())
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        let time = now.time - stage.since;
        let excited = self.excitation_duration(common.step);
        if time > excited + SETTLE {
            return stage.end_test(now.time);
        }
        let steer =
            if time < excited { self.excitation_steer_angle(common.seed, common.step, time) } else { 0.0 };
        DriverAction::steer_by_angle(steer, DriveCommand::Speed(common.entry_speed))
    }

    fn characteristic_values(
        &self,
        common: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let frequencies = self.result_frequencies(common.step);
        let mut lists = Vec::new();
        for answer in [&log.r, &log.a_y] {
            let moved: Vec<f64> = answer.iter().map(|value| value - answer[0]).collect();
            let answers = (0..frequencies.len())
                .map(|k| self.spectra_near_frequency(log, &moved, k, common.step).gain_phase_coherence());
            let answers: Vec<_> = answers.collect();
            let mut list: [Vec<f64>; 3] = [0, 1, 2].map(|part| answers.iter().map(|it| it[part]).collect());
            unwrap_phases(&mut list[1]);
            lists.push(list);
        }
        let Ok([r, a_y]) = <[[Vec<f64>; 3]; 2]>::try_from(lists) else {
            return Err("there are no spectra".to_owned());
        };
        if r.iter().chain(&a_y).flatten().any(|value| !value.is_finite()) {
            return Err(
                "the car does not answer the steering: its yaw rate or its lateral acceleration stays"
                    .to_owned(),
            );
        }
        let bandwidth =
            |gain: &[f64]| falling_crossing_frequency(&frequencies, gain, gain[0] * FRAC_1_SQRT_2);
        let top = crate::log::peak_index(&r[0]).unwrap_or(0);
        let late = falling_crossing_frequency(&frequencies, &r[1], -FRAC_PI_4);
        let coherence = r[2].iter().chain(&a_y[2]).copied().fold(1.0, f64::min);
        let [[r_gain, r_phase, r_coherence], [a_gain, a_phase, a_coherence]] = [r.clone(), a_y.clone()];
        Ok(CharacteristicValues::default()
            .with_list("frequencies", frequencies.clone())
            .with_list("yaw_rate_gain", r_gain)
            .with_list("yaw_rate_phase", r_phase)
            .with_list("yaw_rate_coherence", r_coherence)
            .with_list("lateral_acceleration_gain", a_gain)
            .with_list("lateral_acceleration_phase", a_phase)
            .with_list("lateral_acceleration_coherence", a_coherence)
            .with_number("yaw_rate_bandwidth", bandwidth(&r[0]))
            .with_number("yaw_rate_peak_ratio", r[0][top] / r[0][0])
            .with_number("yaw_rate_peak_frequency", frequencies[top])
            .with_number("yaw_rate_equivalent_time", late.map(|frequency| 1.0 / (TAU * frequency)))
            .with_number("lateral_acceleration_bandwidth", bandwidth(&a_y[0]))
            .with_number("coherence_min", coherence))
    }

    fn diagrams(
        &self,
        _: &CommonParameters,
        _: &ManoeuvreLog,
        values: &CharacteristicValues,
    ) -> Vec<TestDiagram> {
        let frequencies = values.get_list("frequencies");
        let curve = |name: &str, factor: f64| -> Vec<[f64; 2]> {
            let of = values.get_list(name);
            frequencies.iter().zip(of).map(|(frequency, value)| [*frequency, factor * value]).collect()
        };
        let diagram = |title: &str, y_label| {
            TestDiagram::new(title, DiagramScale::Logarithmic, ["frequency [Hz]", y_label])
        };
        let gain = |title, y_label, name: &str, factor: f64| {
            let gain = curve(&format!("{name}_gain"), factor);
            let low = gain.first().map_or(f64::NAN, |point| FRAC_1_SQRT_2 * point[1]);
            let ends = [gain.first(), gain.last()].map(|end| [end.map_or(f64::NAN, |point| point[0]), low]);
            let bandwidth = values.get_number(&format!("{name}_bandwidth"));
            let mark = format!("bandwidth {:.2} Hz", bandwidth.unwrap_or(f64::NAN));
            diagram(title, y_label)
                .with_layer("3 dB below the lowest frequency", DiagramLayerKind::Reference, ends)
                .with_layer("gain", DiagramLayerKind::Curve, gain)
                .with_mark(mark, bandwidth.map(|frequency| [frequency, low]))
        };
        let degrees = 1_f64.to_degrees();
        let phase = |title, name: &str| {
            diagram(title, "phase [deg]").with_layer("phase", DiagramLayerKind::Curve, curve(name, degrees))
        };
        vec![
            gain("Yaw rate over road-wheel angle (ISO 7401)", "gain [1/s]", "yaw_rate", 1.0),
            phase("Phase of the yaw rate (ISO 7401)", "yaw_rate_phase"),
            gain(
                "Lateral acceleration over road-wheel angle (ISO 7401)",
                "gain [m/s²/deg]",
                "lateral_acceleration",
                degrees.recip(),
            ),
            phase("Phase of the lateral acceleration (ISO 7401)", "lateral_acceleration_phase"),
            diagram("Coherence (ISO 7401)", "coherence")
                .with_y_range([0.0, 1.05])
                .with_layer("yaw rate", DiagramLayerKind::Curve, curve("yaw_rate_coherence", 1.0))
                .with_layer(
                    "lateral acceleration",
                    DiagramLayerKind::SecondCurve,
                    curve("lateral_acceleration_coherence", 1.0),
                ),
        ]
    }
}
