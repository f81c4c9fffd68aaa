//! Turns the values of a variant into words that change its scenario.

use std::path::Path;

use cosim::system::WordPlace;
use scenario::resolve::{Override, Overrides};
use serde::{Deserialize, Serialize};

/// The name of the seed among the names that vary.
pub const SEED: &str = "seed";

/// A value of a variant, as `--set` takes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// What it sets: `plant.body.m`, or `seed`.
    pub name: String,
    /// The value, with a unit where the scenario gives one.
    pub value: String,
}

impl Setting {
    /// A number to the last bit, in its unit.
    pub(super) fn number(name: &str, value: f64, unit: Option<&str>) -> Self {
        let number = format!("{value:?}");
        let value = unit.map_or(number.clone(), |unit| format!("{number} {unit}"));
        Setting { name: name.to_owned(), value }
    }

    /// A value that the command line gives.
    #[must_use]
    pub fn of(given: &Override) -> Self {
        let Override { node, variable, value, .. } = given;
        Setting { name: format!("{node}.{variable}"), value: value.clone() }
    }

    /// The start value, signal, effect or fault that it sets; archives lie in `folder`. None for the seed.
    ///
    /// # Errors
    /// In words, when it has another form.
    fn given(&self, folder: &Path) -> Result<Option<Override>, String> {
        if self.name == SEED {
            return Ok(None);
        }
        let text = format!("{}={}", self.name, self.value);
        let mut given = Override::parse(&text, |file| folder.join(file))?;
        Ok(given.pop())
    }
}

/// The overrides of a variant with these settings, whose words stand at `place`, behind those that all variants have.
///
/// # Errors
/// In words, when a setting has no form that a scenario takes.
pub(super) fn overrides(
    all: &Overrides,
    settings: &[Setting],
    folder: &Path,
    place: impl Fn(&str) -> Option<WordPlace>,
) -> Result<Overrides, String> {
    let mut overrides = all.clone();
    for setting in settings {
        match setting.given(folder)? {
            Some(given) => overrides.starts.push(Override { place: place(&setting.name), ..given }),
            None => {
                let seed = setting.value.parse();
                overrides.seed = Some(seed.map_err(|_| {
                    format!("seed: expected a whole number from 0 on, found {}", setting.value)
                })?);
            }
        }
    }
    Ok(overrides)
}
