//! Configuration of `task = "bench"`.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use std::collections::BTreeMap;

use plugin::ConfigError;
use schemars::JsonSchema;
use serde::Deserialize;
use tire::{Axes, Coefficients};
use tire_bench::{CSV_NAMES, Options};

/// Fits a Magic Formula 6.1 with temperature terms to tables of a test bench, which are the text files of `[analysis.files]`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bench {
    /// Axes of the tables.
    #[serde(default)]
    pub axes: BenchAxes,
    /// Columns with other names or units, by channel.
    #[serde(default)]
    pub columns: BTreeMap<String, BenchColumn>,
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
    /// Tables of the scenario, from `[analysis.files]`.
    #[serde(default)]
    #[schemars(skip)]
    pub files: BTreeMap<String, String>,
}

/// Axes of a table of a bench.
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

/// A column of a table.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchColumn {
    /// Its title.
    #[schemars(example = &"FY")]
    pub column: String,
    /// Its unit.
    #[schemars(example = &"N")]
    pub unit: String,
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
        let unknown = |name: &&String| !CSV_NAMES.iter().any(|(known, _)| known == name);
        if let Some(name) = self.columns.keys().find(unknown) {
            let known: Vec<_> = CSV_NAMES.iter().map(|(name, _)| *name).collect();
            let message = format!("no channel `{name}`; known: {}", known.join(", "));
            return Err(ConfigError::at("columns", message));
        }
        if self.files.is_empty() {
            let message =
                "expected tables in [analysis.files], such as cornering = \"cornering.csv\"";
            return Err(message.to_owned().into());
        }
        Ok(())
    }

    /// The axes of the tables.
    pub fn axes(&self) -> Axes {
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
