//! Configuration of `task = "bench"`.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use std::collections::BTreeMap;

use plugin::{ConfigError, File};
use schemars::JsonSchema;
use serde::Deserialize;
use tire::{Axes, Coefficients};
use tire_bench::{CHANNELS, FileUnits, Options, Reading};

/// Fits a Magic Formula 6.1 with temperature terms to data of a test bench: the files of `[analysis.files]`, which are tables as text (also packed by
/// gzip), MAT files or TYDEX.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bench {
    /// Axes of the files.
    #[serde(default)]
    pub axes: BenchAxes,
    /// Columns with other names or units, by channel. Names that benches use are found on their own.
    #[serde(default)]
    pub columns: BTreeMap<String, BenchColumn>,
    /// Channels with one value, in SI units, for files that have them not.
    #[serde(default)]
    pub constants: BTreeMap<String, f64>,
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
    pub files: BTreeMap<String, File>,
}

/// Channel, column and unit; channel and value.
pub type Said<'a> = (Vec<(&'a str, &'a str, Option<&'a str>)>, Vec<(&'a str, f64)>);

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

impl Bench {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let numbers = [
            ("unloaded_radius", self.unloaded_radius, "m"),
            ("nominal_load", self.nominal_load, "N"),
            ("nominal_pressure", self.nominal_pressure, "Pa"),
        ];
        for (key, value, unit) in numbers {
            if !(value.is_finite() && value > 0.0) {
                let message = format!("expected a number above 0 {unit}, found {value}");
                return Err(ConfigError::at(key, message));
            }
        }
        let unknown = |name: &&String| !CHANNELS.iter().any(|(known, _)| known == name);
        for (key, mut names) in [
            ("columns", self.columns.keys().collect::<Vec<_>>()),
            ("constants", self.constants.keys().collect()),
        ] {
            names.retain(unknown);
            if let Some(name) = names.first() {
                let known: Vec<_> = CHANNELS.iter().map(|(name, _)| *name).collect();
                let message = format!("no channel `{name}`; known: {}", known.join(", "));
                return Err(ConfigError::at(key, message));
            }
        }
        if let Some((name, value)) = self.constants.iter().find(|it| !it.1.is_finite()) {
            let message = format!("expected a number, found {value}");
            return Err(ConfigError::at(&format!("constants.{name}"), message));
        }
        if self.files.is_empty() {
            let message = "expected files of a bench in [analysis.files], such as cornering = \"cornering.csv\"";
            return Err(message.to_owned().into());
        }
        Ok(())
    }

    /// What the user says of the files; `columns` and `constants` are those of [`Self::said`].
    pub fn reading<'a>(&self, (columns, constants): &'a Said<'a>) -> Reading<'a> {
        let units = self.units.map(|it| match it {
            BenchUnits::TtcMetric => FileUnits::TtcMetric,
            BenchUnits::TtcEnglish => FileUnits::TtcEnglish,
        });
        Reading { axes: self.axes(), columns, constants, units, radius: self.unloaded_radius }
    }

    /// The columns and constants that the user names.
    pub fn said(&self) -> Said<'_> {
        let columns = self
            .columns
            .iter()
            .map(|(name, it)| (name.as_str(), it.column.as_str(), it.unit.as_deref()));
        (columns.collect(), self.constants.iter().map(|(name, it)| (name.as_str(), *it)).collect())
    }

    fn axes(&self) -> Axes {
        match self.axes {
            BenchAxes::Iso => Axes::Iso,
            BenchAxes::Sae => Axes::Sae,
            BenchAxes::AdaptedSae => Axes::AdaptedSae,
        }
    }

    /// What the fit is given.
    pub fn options(&self) -> Options {
        let tire = Coefficients {
            UNLOADED_RADIUS: self.unloaded_radius,
            FNOMIN: self.nominal_load,
            NOMPRES: self.nominal_pressure,
            INFLPRES: self.nominal_pressure,
            ..Coefficients::default()
        };
        Options { tire, extended: self.extended, draws: self.draws, seed: self.seed }
    }
}
