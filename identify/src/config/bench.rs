//! Configuration of `task = "bench"`.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use std::collections::BTreeMap;

use plugin::{ConfigError, ConfigFile};
use schemars::JsonSchema;
use serde::Deserialize;
use tire::{Coefficients, TireAxes};
use tire_bench::{BenchReadOptions, CHANNELS, ConstantChannel, FileUnits, TireFitOptions};

/// Fits a Magic Formula 6.1 with temperature terms to data of a test bench: the files of `[analysis.files]`, which are tables as text (also packed by
/// gzip), MAT files or TYDEX.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchConfig {
    /// Axes of the files.
    #[serde(default)]
    pub axes: BenchAxes,
    /// Columns with other names or units, by channel. Names that benches use are found on their own.
    #[serde(default)]
    pub columns: BTreeMap<String, BenchColumn>,
    /// Channels with one value, in SI units, for files that have them not. A table under the name of a file has those of this file.
    #[serde(default)]
    #[schemars(example = serde_json::json!({"camber_rad": 0.0, "cornering": {"pressure_pa": 83e3}}))]
    pub constants: BTreeMap<String, BenchConstant>,
    /// Units of files that state none.
    #[serde(default)]
    pub units: Option<BenchUnits>,
    /// Radius of the tire without load [m].
    #[schemars(example = 0.2025)]
    pub unloaded_radius: f64,
    /// Nominal load [N].
    #[schemars(example = 1700.0)]
    pub nominal_load: f64,
    /// Nominal pressure [Pa].
    #[schemars(example = 83e3)]
    pub nominal_pressure: f64,
    /// Fits terms beyond the formula, which stand in a section of their own.
    #[serde(default)]
    pub extended: bool,
    /// Joint draws of the posterior in the result.
    #[serde(default)]
    pub draws: usize,
    /// Seed of the draws.
    #[serde(default)]
    pub seed: u64,
    /// Files of the scenario, from `[analysis.files]`.
    #[serde(default)]
    #[schemars(skip)]
    pub files: BTreeMap<String, ConfigFile>,
}

/// Channel, column and unit; channels with one value.
pub type DeclaredChannels<'a> = (Vec<(&'a str, &'a str, Option<&'a str>)>, Vec<ConstantChannel<'a>>);

/// The value of a channel, or the values of channels of one file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum BenchConstant {
    /// A value.
    Value(f64),
    /// Values by channel.
    OfFile(BTreeMap<String, f64>),
}

/// Axes of a file of a bench.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BenchAxes {
    /// ISO-W: y to the left, z up.
    #[default]
    Iso,
    /// SAE: y to the right, z down.
    Sae,
    /// SAE with the slip angle of ISO.
    AdaptedSae,
}

/// Units of a file of a bench that states none.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BenchUnits {
    /// Of FSAE TTC: s, deg, kPa, N, N m, km/h, degC, cm.
    TtcMetric,
    /// Of FSAE TTC: s, deg, psi, lbf, lbf ft, mph, degF, in.
    TtcEnglish,
}

/// A column of a table, a vector of a MAT file, or a channel of TYDEX.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchColumn {
    /// Its title.
    #[schemars(example = &"FY")]
    pub column: String,
    /// Its unit, before that of the file.
    #[schemars(example = &"N")]
    pub unit: Option<String>,
}

impl BenchConstant {
    fn is_file_specific(&self) -> bool {
        matches!(self, Self::OfFile(_))
    }

    /// The constants under a name, which is that of a channel or of a file.
    fn constants<'a>(&'a self, name: &'a str) -> Vec<ConstantChannel<'a>> {
        match self {
            Self::Value(value) => {
                vec![ConstantChannel { file: None, channel: name, value: *value }]
            }
            Self::OfFile(values) => {
                let constant = |(channel, value): (&'a String, &f64)| ConstantChannel {
                    file: Some(name),
                    channel,
                    value: *value,
                };
                values.iter().map(constant).collect()
            }
        }
    }
}

impl BenchConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let numbers = [
            ("unloaded_radius", self.unloaded_radius, "m"),
            ("nominal_load", self.nominal_load, "N"),
            ("nominal_pressure", self.nominal_pressure, "Pa"),
        ];
        for (key, value, unit) in numbers {
            if !(value.is_finite() && value > 0.0) {
                let message = format!("expected a number above 0 {unit}, found {value}");
                return Err(ConfigError::at_key(key, message));
            }
        }
        let unknown = |name: &&String| !CHANNELS.iter().any(|(known, _)| known == name);
        let no_channel = |key: &str, name: &str| {
            let known: Vec<_> = CHANNELS.iter().map(|(name, _)| *name).collect();
            let message = format!("no channel `{name}`; known: {}", known.join(", "));
            ConfigError::at_key(key, message)
        };
        if let Some(name) = self.columns.keys().find(unknown) {
            return Err(no_channel("columns", name));
        }
        for name in self.constants.iter().filter_map(|(name, it)| it.is_file_specific().then_some(name)) {
            if !self.files.contains_key(name) {
                let files: Vec<_> = self.files.keys().map(String::as_str).collect();
                let message = format!("no file `{name}` in [analysis.files]; known: {}", files.join(", "));
                return Err(ConfigError::at_key("constants", message));
            }
        }
        for ConstantChannel { file, channel, value } in self.declared_channels().1 {
            let key = file.map_or("constants".to_owned(), |file| format!("constants.{file}"));
            if unknown(&&channel.to_owned()) {
                return Err(no_channel(&key, channel));
            }
            if !value.is_finite() {
                let message = format!("expected a number, found {value}");
                return Err(ConfigError::at_key(&format!("{key}.{channel}"), message));
            }
        }
        if self.files.is_empty() {
            let message =
                "expected files of a bench in [analysis.files], such as cornering = \"cornering.csv\"";
            return Err(message.to_owned().into());
        }
        Ok(())
    }

    /// What the user says of the files; `columns` and `constants` are those of [`Self::declared_channels`].
    pub fn reading_options<'a>(
        &self,
        (columns, constants): &'a DeclaredChannels<'a>,
    ) -> BenchReadOptions<'a> {
        let units = self.units.map(|it| match it {
            BenchUnits::TtcMetric => FileUnits::TtcMetric,
            BenchUnits::TtcEnglish => FileUnits::TtcEnglish,
        });
        BenchReadOptions { axes: self.file_axes(), columns, constants, units, radius: self.unloaded_radius }
    }

    /// The columns and constants that the user names.
    pub fn declared_channels(&self) -> DeclaredChannels<'_> {
        let columns =
            self.columns.iter().map(|(name, it)| (name.as_str(), it.column.as_str(), it.unit.as_deref()));
        let constants = self.constants.iter().flat_map(|(name, it)| it.constants(name));
        (columns.collect(), constants.collect())
    }

    fn file_axes(&self) -> TireAxes {
        match self.axes {
            BenchAxes::Iso => TireAxes::Iso,
            BenchAxes::Sae => TireAxes::Sae,
            BenchAxes::AdaptedSae => TireAxes::AdaptedSae,
        }
    }

    /// What the fit is given.
    pub fn fit_options(&self) -> TireFitOptions {
        let tire = Coefficients {
            UNLOADED_RADIUS: self.unloaded_radius,
            FNOMIN: self.nominal_load,
            NOMPRES: self.nominal_pressure,
            INFLPRES: self.nominal_pressure,
            ..Coefficients::default()
        };
        TireFitOptions { tire, extended: self.extended, draws: self.draws, seed: self.seed }
    }
}
