//! Configuration of `task = "fastest_lap"`.

use std::collections::BTreeMap;

use lap::{CarParameters, LapCar, LapOptions, ParameterDraw, ParameterKey, ParameterRange, TEXT_KEYS};
use plugin::{ConfigError, ConfigFile};
use schemars::JsonSchema;
use serde::Deserialize;
use track::{TrackLine, TrackSurvey};

use super::rules::{at_least, check_positive, not_negative};

/// Draws where no number is told.
const DEFAULT_SAMPLES: usize = 200;

/// Finds the fastest lap of a car on a track, and lays the lap of the signals `x` and `y` beside it. The car is in `parameters` of the analysis.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FastestLapConfig {
    /// Nodes along the line; by default one every 4 m, from 200 to 2000.
    nodes: Option<usize>,
    /// Way from the centre of gravity to an edge that is kept [m]; by default half of the wider track width and 0.15 m, or 0.9 m.
    margin: Option<f64>,
    /// Way from the line to both edges [m], for a track without widths.
    half_width: Option<f64>,
    /// Keeps the car on the line: its speed alone is free.
    on_line: bool,
    /// Lets the body swing on springs and dampers: load moves as they pass it on, not at once.
    transients: bool,
    /// Highest speed at the beginning of an open track [m/s].
    start_speed: Option<f64>,
    /// Ranges `[low, high]` within which parameters are not known, by their names, in SI units: the lap time gets an interval.
    vary: BTreeMap<String, [f64; 2]>,
    /// Number of draws from the ranges or the file; 200 by default, or as many as the file has.
    samples: Option<usize>,
    /// Seed of the draws from ranges.
    seed: u64,
    /// Files of the scenario, from `[analysis.files]`: the `track`, and the `draws` of an identification (`tires_draws.csv`).
    #[schemars(skip)]
    files: BTreeMap<String, ConfigFile>,
    /// Values of the car, from `parameters` of the analysis.
    #[schemars(skip)]
    parameters: BTreeMap<String, toml::Value>,
}

impl FastestLapConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.nodes.map_or(Ok(()), |nodes| at_least("nodes", 20, nodes))?;
        self.samples.map_or(Ok(()), |samples| at_least("samples", 1, samples))?;
        self.margin.map_or(Ok(()), |margin| not_negative("margin", margin))?;
        self.half_width.map_or(Ok(()), |half_width| check_positive("half_width", half_width))?;
        if let Some(name) = self.files.keys().find(|name| !["track", "draws"].contains(&name.as_str())) {
            let message = format!("expected the files `track` and `draws`, found `{name}`");
            return Err(ConfigError::at_key("files", message));
        }
        self.car()?;
        self.line()?;
        self.draws().map(drop)
    }

    /// The car by its parameters.
    pub fn car_parameters(&self) -> Result<CarParameters, ConfigError> {
        let mut car = CarParameters::default();
        car.set_transients(self.transients);
        for (name, value) in &self.parameters {
            let wrong = |message: String| ConfigError::at_key("parameters", format!("`{name}`: {message}"));
            if TEXT_KEYS.contains(&name.as_str()) {
                let text = value.as_str().ok_or_else(|| wrong(format!("expected a text, found {value}")))?;
                car.set_text(name, text);
            } else if let Some(key) = ParameterKey::find(name) {
                let number = number_in_unit(value, key.unit).map_err(wrong)?;
                car.set_number(key, number).map_err(wrong)?;
            }
        }
        Ok(car)
    }

    /// The car, and what is told of its tires.
    pub fn car(&self) -> Result<(LapCar, Vec<String>), ConfigError> {
        let wrong = |message: String| ConfigError::at_key("parameters", message);
        if self.parameters.is_empty() {
            return Err(wrong(
                "expected the car, `parameters = \"cars/….toml\"` of the analysis, found none".to_owned(),
            ));
        }
        let (car, messages) = self.car_parameters()?.car().map_err(wrong)?;
        Ok((car, messages.into_iter().map(|message| message.to_string()).collect()))
    }

    /// The line of the track.
    pub fn line(&self) -> Result<TrackLine, ConfigError> {
        let wrong = |message: String| ConfigError::at_key("files", format!("track: {message}"));
        let text = self
            .text_of("track")?
            .ok_or_else(|| wrong("expected a table of the track, found none".to_owned()))?;
        let survey = TrackSurvey::from_table_text(text).map_err(|error| wrong(error.to_string()))?;
        TrackLine::from_survey(&survey).map_err(|error| wrong(error.to_string()))
    }

    /// The draws of what is not known of the car, if there are any.
    pub fn draws(&self) -> Result<Option<Vec<ParameterDraw>>, ConfigError> {
        let samples = self.samples.unwrap_or(DEFAULT_SAMPLES);
        let find = |name: &str| {
            let unknown =
                || format!("a lap has no parameter `{name}`; it has such as body.m, tire_f.LMUY, aero.C_d");
            ParameterKey::find_of_node(name).ok_or_else(unknown)
        };
        let car = self.car_parameters()?;
        if let Some(text) = self.text_of("draws")? {
            let wrong = |message| ConfigError::at_key("files", format!("draws: {message}"));
            let draws = lap::parameter_draws(text, samples, find).map_err(wrong)?;
            lap::check_draws_change_car(&draws, &car).map_err(wrong)?;
            return Ok(Some(draws));
        }
        let range = |(name, [low, high]): (&String, &[f64; 2])| {
            let wrong =
                |message: String| ConfigError { path: vec!["vary".to_owned(), name.clone()], message };
            let key = find(name).map_err(wrong)?;
            for bound in [low, high] {
                car.clone().set_number(key, *bound).map_err(wrong)?;
            }
            match low <= high {
                true => Ok(ParameterRange { key, low: *low, high: *high }),
                false => Err(wrong(format!("expected the lower number first, found {low} before {high}"))),
            }
        };
        let ranges: Vec<ParameterRange> = self.vary.iter().map(range).collect::<Result<_, _>>()?;
        if ranges.is_empty() {
            return Ok(None);
        }
        let draws = lap::draw_from_ranges(&ranges, samples, self.seed);
        lap::check_draws_change_car(&draws, &car).map_err(|message| ConfigError::at_key("vary", message))?;
        Ok(Some(draws))
    }

    /// Nodes, edges and start of the lap.
    pub fn options(&self, car: &LapCar) -> LapOptions {
        let Self { nodes, margin, half_width, on_line, start_speed, .. } = *self;
        let margin = margin.unwrap_or_else(|| LapOptions::usual_margin(car.track_widths));
        LapOptions { nodes, margin, half_width, keeps_line: on_line, start_speed }
    }

    fn text_of(&self, name: &str) -> Result<Option<&str>, ConfigError> {
        let Some(file) = self.files.get(name) else { return Ok(None) };
        let no_text = |_| ConfigError::at_key("files", format!("{name}: expected a text in UTF-8"));
        std::str::from_utf8(file.bytes()).map(Some).map_err(no_text)
    }
}

/// A number, or a text of a number and a unit of its own with a blank between them, in a unit.
///
/// # Errors
/// In words, when it is none, or has a unit of another dimension.
fn number_in_unit(value: &toml::Value, unit: &str) -> Result<f64, String> {
    let no_number =
        || format!("expected a number, or a text of a number and a unit such as \"1250 kg\", found {value}");
    if let toml::Value::String(text) = value {
        let (number, own) = text.trim().split_once(' ').ok_or_else(no_number)?;
        let number: f64 = number.parse().map_err(|_| no_number())?;
        let [from, to] = [own, unit].map(units::Unit::parse);
        let (from, to) = (from.map_err(|error| error.to_string())?, to.map_err(|error| error.to_string())?);
        let (factor, offset) = units::Unit::conversion(&from, &to)
            .ok_or_else(|| format!("expected a value in [{unit}], found one in [{own}]"))?;
        return Ok(number * factor + offset);
    }
    value.as_float().or(value.as_integer().map(|number| number as f64)).ok_or_else(no_number)
}
