//! Configuration of `task = "prediction"`.

use drive_prediction::EvenDrive;
use drive_prediction::car::{CarSpecification, ParameterVariation, SteeringSignalKind};
use drive_prediction::resampling::ResamplingOptions;
use plugin::ConfigError;
use schemars::JsonSchema;
use serde::Deserialize;

use super::car::PredictionCarConfig;
use super::rules::{self, check_rule};

/// Identifies a car that predicts its motion from speed and steering, and judges it on parts that were not fitted.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PredictionConfig {
    /// The car; `body` is needed.
    car: PredictionCarConfig,
    /// What the signal `delta` is: the angle of the wheels `"measured"` there, or what an actuator is `"commanded"`, which follows late and
    /// with an offset of the day.
    steering: SteeringSource,
    /// Points `[command, angle in rad]` in rising order, if `delta` is a command in a unit of its own: `task = "doctor"` with `staircase` finds them.
    pub steering_map: Vec<[f64; 2]>,
    /// Half width of the play between the angle and the wheels [rad].
    pub steering_play: f64,
    /// How far apart the logs are: `"laps"` of one day, or `"days"` with other floors, tires and trims.
    logs: LogVariation,
    /// Rows per second [Hz]; by default that of the slowest signal, at most 100.
    rate: Option<f64>,
    /// Corner of the zero-phase low pass of velocities, yaw rate and acceleration [Hz]; 0 for signals that are smooth already.
    smooth: f64,
    /// Slower rows do not count [m/s].
    pub least_speed: f64,
    /// Parts that are not fitted: the car is judged on them. Without any it is judged on what it was fitted to, and says so.
    pub hold_out: Vec<LogPart>,
    /// Times over which the car is let go in open loop [s].
    pub horizons: Vec<f64>,
    /// `v_y` is for judging only: the car is fitted without it, and an estimator that does not see it says what it was.
    pub hide_v_y: bool,
    /// Node that gets the start values in `tires.toml`.
    #[serde(default = "super::plant")]
    pub node: String,
    /// Seed of what is drawn.
    pub seed: u64,
}

/// What the steering signal is.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum SteeringSource {
    /// The angle of the road wheels, measured there.
    Measured,
    /// What an actuator is told.
    Commanded,
}

/// How far apart logs are.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum LogVariation {
    /// Laps of one day.
    Laps,
    /// Days.
    Days,
}

/// A part of the logs: what all of its keys say.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LogPart {
    /// Beginning [s]; the beginning of the log by default.
    from: Option<f64>,
    /// End [s]; the end of the log by default.
    to: Option<f64>,
    /// Number of the lap, as the signal `lap` has it.
    lap: Option<f64>,
    /// Number of the log, from 1, where the table has several paths.
    log: Option<usize>,
}

impl Default for PredictionConfig {
    fn default() -> Self {
        Self {
            car: PredictionCarConfig::default(),
            steering: SteeringSource::Measured,
            steering_map: Vec::new(),
            steering_play: 0.0,
            logs: LogVariation::Laps,
            rate: None,
            smooth: 5.0,
            least_speed: 5.0,
            hold_out: Vec::new(),
            horizons: vec![0.6, 3.0],
            hide_v_y: false,
            node: super::plant(),
            seed: 0,
        }
    }
}

/// The fastest rows and the longest horizon that make sense.
const FASTEST: f64 = 10_000.0;
const LONGEST: f64 = 60.0;

impl PredictionConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.car_specification()?;
        if let Some(rate) = self.rate {
            let fits = rate > 0.0 && rate <= FASTEST;
            check_rule(fits, "rate", &format!("a rate above 0, at most {FASTEST} Hz"), rate)?;
        }
        rules::not_negative("smooth", self.smooth)?;
        rules::not_negative("steering_play", self.steering_play)?;
        let points = &self.steering_map;
        check_rule(points.len() != 1, "steering_map", "two points or more, or none", "one")?;
        for (index, pair) in points.windows(2).enumerate() {
            let rises = pair[0][0] < pair[1][0] && pair.iter().flatten().all(|it| it.is_finite());
            let key = format!("steering_map.{}", index + 1);
            check_rule(rises, &key, "finite numbers, and a command above the one before", pair[1][0])?;
        }
        rules::check_positive("least_speed", self.least_speed)?;
        for (index, horizon) in self.horizons.iter().enumerate() {
            let fits = *horizon > 0.0 && *horizon <= LONGEST;
            let expected = format!("a time above 0, at most {LONGEST} s");
            check_rule(fits, &format!("horizons.{index}"), &expected, horizon)?;
        }
        self.hold_out.iter().enumerate().try_for_each(|(index, part)| part.check(index))
    }

    /// What is known of the car before any log.
    ///
    /// # Errors
    /// With all that are missing, or the first that makes no sense.
    pub fn car_specification(&self) -> Result<CarSpecification, ConfigError> {
        let (body, [front_drive, front_brake]) =
            self.car.body_and_shares().map_err(|error| error.with_parent_key("car"))?;
        let steering = match self.steering {
            SteeringSource::Measured => SteeringSignalKind::Measured,
            SteeringSource::Commanded => SteeringSignalKind::Commanded,
        };
        let variation = match self.logs {
            LogVariation::Laps => ParameterVariation::Laps,
            LogVariation::Days => ParameterVariation::Days,
        };
        Ok(CarSpecification { body, front_drive, front_brake, steering, variation })
    }

    /// How signals become rows.
    pub fn resampling_options(&self) -> ResamplingOptions {
        let smooth = (self.smooth > 0.0).then_some(self.smooth);
        ResamplingOptions { rate: self.rate, smooth, least_speed: self.least_speed }
    }

    /// The rows that are fitted, and those that are held out, as drives of which only these count.
    pub fn split_fitted_and_held_out(&self, drives: &[EvenDrive]) -> [Vec<EvenDrive>; 2] {
        [false, true].map(|held| {
            let part = |drive: &EvenDrive| {
                let mut part = drive.clone();
                for row in 0..drive.row_count() {
                    let out = self.hold_out.iter().any(|it| it.contains(drive, row));
                    part.counts[row] &= out == held;
                }
                part
            };
            drives.iter().map(part).filter(|drive| drive.counts.contains(&true)).collect()
        })
    }
}

impl LogPart {
    fn check(&self, index: usize) -> Result<(), ConfigError> {
        let key = |name: &str| format!("hold_out.{index}.{name}");
        let said = self.from.is_some() || self.to.is_some();
        let said = said || self.lap.is_some() || self.log.is_some();
        check_rule(said, &format!("hold_out.{index}"), "`from`, `to`, `lap` or `log`", "none of them")?;
        let times = [("from", self.from), ("to", self.to), ("lap", self.lap)];
        for (name, value) in times {
            let finite = value.is_none_or(f64::is_finite);
            check_rule(finite, &key(name), "a finite number", value.unwrap_or_default())?;
        }
        let (from, to) = (self.from.unwrap_or(f64::NEG_INFINITY), self.to.unwrap_or(f64::INFINITY));
        check_rule(from < to, &key("to"), &format!("a time after from = {from}"), to)?;
        check_rule(self.log != Some(0), &key("log"), "the number of a log, from 1", 0)
    }

    /// Whether a row is in this part.
    fn contains(&self, drive: &EvenDrive, row: usize) -> bool {
        let lap = drive.lap.as_ref().map(|lap| lap[row]);
        self.from.is_none_or(|from| drive.motion.t[row] >= from)
            && self.to.is_none_or(|to| drive.motion.t[row] < to)
            && self.lap.is_none_or(|wanted| lap == Some(wanted))
            && self.log.is_none_or(|wanted| drive.log == wanted)
    }
}

#[cfg(test)]
mod tests {
    use preparation::Drive;

    use super::*;
    use crate::config::IdentifyConfig;

    const CAR: &str = "task = \"prediction\"\ncar = { drive_front_share = 0.0, body = { m = 982.0, I_zz = 1605.0, l_f = 1.33, l_r = 1.07, h = 0.45 } }\n";

    fn read(more: &str) -> Result<Box<PredictionConfig>, (Vec<String>, String)> {
        match IdentifyConfig::parse(&format!("{CAR}{more}")).map_err(|it| (it.path.clone(), it.message))? {
            IdentifyConfig::Prediction(config) => Ok(config),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn parts_are_held_out() {
        let more = "hold_out = [{ log = 2, from = 3.0 }, { lap = 4.0 }]\n";
        let config = read(more).expect("it is right");
        let drive = |log: usize| EvenDrive {
            log,
            lap: Some(vec![1.0, 1.0, 4.0, 4.0, 5.0, 5.0]),
            counts: vec![true, true, true, true, true, false],
            motion: Drive { t: (0..6).map(f64::from).collect(), ..Drive::default() },
            ..EvenDrive::default()
        };
        let [fitted, held] = config.split_fitted_and_held_out(&[drive(1), drive(2)]);
        let counts = |drives: &[EvenDrive]| -> Vec<String> {
            let shown = |counts: &bool| if *counts { 'x' } else { '.' };
            drives.iter().map(|drive| drive.counts.iter().map(shown).collect()).collect()
        };
        assert_eq!(counts(&held), ["..xx..", "..xxx."]);
        assert_eq!(counts(&fitted), ["xx..x.", "xx...."]);
    }

    #[test]
    fn mistakes_are_told_at_their_keys() {
        let wrong = |more: &str| read(more).expect_err(more);
        assert_eq!(wrong("hold_out = [{}]").0, ["hold_out", "0"]);
        assert_eq!(wrong("hold_out = [{ from = 5.0, to = 2.0 }]").0, ["hold_out", "0", "to"]);
        assert_eq!(wrong("hold_out = [{ log = 0 }]").0, ["hold_out", "0", "log"]);
        assert_eq!(wrong("horizons = [0.6, -3.0]").0, ["horizons", "1"]);
        assert_eq!(wrong("rate = 0.0").0, ["rate"]);
        assert_eq!(wrong("least_speed = nan").0, ["least_speed"]);
        let missing = IdentifyConfig::parse("task = \"prediction\"\n").expect_err("no car").message;
        assert!(missing.contains("`body.m`") && missing.contains("`body.l_r`"), "{missing}");
        assert!(missing.contains("`drive_front_share`"), "{missing}");
        assert_eq!(wrong("steering = \"guessed\"").0, ["steering"]);
        assert_eq!(wrong("steering_map = [[0.0, 0.0], [0.0, 0.1]]").0, ["steering_map", "1"]);
        assert_eq!(wrong("steering_map = [[0.0, 0.0]]").0, ["steering_map"]);
    }
}
