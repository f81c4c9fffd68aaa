//! Reads what is not known of a car: draws from a file, such as the one of an identification, or ranges.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;
use lap::{ParameterDraw, ParameterRange};

use super::car_file::{CarFile, find_key, number_of_text};

/// The largest file of draws [B].
const LARGEST: u64 = 256 << 20;

/// Arguments for what is not known of a car.
#[derive(Args)]
pub struct VariationArguments {
    /// Draws of parameters, a row for each, such as the tires_draws.csv of an identification: the lap time gets an interval.
    #[arg(long, value_name = "FILE.csv", conflicts_with = "vary")]
    draws: Option<PathBuf>,
    /// A range within which a parameter is not known, such as body.m=1230..1270: the lap time gets an interval.
    #[arg(long, value_name = "KEY=LOW..HIGH")]
    vary: Vec<String>,
    /// Number of draws [default: 200, or as many as the file has if that is less].
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Seed of the draws from ranges.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "vary")]
    seed: u64,
}

/// Most draws.
const MOST_SAMPLES: usize = 100_000;
/// Draws where no number is told.
const DEFAULT_SAMPLES: usize = 200;

impl VariationArguments {
    /// The file of draws.
    pub fn file(&self) -> Option<&Path> {
        self.draws.as_deref()
    }

    /// The draws, if any are asked for.
    ///
    /// # Errors
    /// When a range or the file is wrong.
    pub fn draws(&self, car: &CarFile) -> Result<Option<Vec<ParameterDraw>>, Error> {
        let samples = self.samples.unwrap_or(DEFAULT_SAMPLES);
        if !(1..=MOST_SAMPLES).contains(&samples) {
            let message = format!("--samples: expected 1 to {MOST_SAMPLES}, found {samples}");
            return Err(Error::invalid_input(message));
        }
        if let Some(path) = &self.draws {
            let draws = read_draws(path, samples)?;
            lap::check_draws_change_car(&draws, &car.parameters)
                .map_err(|why| Error::invalid_input(format!("{}: {why}", path.display())))?;
            return Ok(Some(draws));
        }
        if self.vary.is_empty() {
            return match self.samples {
                Some(_) => {
                    Err(Error::invalid_input("--samples: expected --draws or --vary with it, found none"))
                }
                None => Ok(None),
            };
        }
        let range = |text: &String| parse_range("--vary", text, car);
        let ranges = self.vary.iter().map(range).collect::<Result<Vec<_>, _>>()?;
        let draws = lap::draw_from_ranges(&ranges, samples, self.seed);
        lap::check_draws_change_car(&draws, &car.parameters)
            .map_err(|why| Error::invalid_input(format!("--vary: {why}")))?;
        Ok(Some(draws))
    }
}

/// The range `KEY=LOW..HIGH` of an option.
///
/// # Errors
/// When it is none, or is beyond what the parameter can be.
pub fn parse_range(option: &str, text: &str, car: &CarFile) -> Result<ParameterRange, Error> {
    let wrong = |message: String| Error::invalid_input(format!("{option} {text}: {message}"));
    let (name, range) = text.split_once('=').ok_or_else(|| wrong("expected KEY=LOW..HIGH".to_owned()))?;
    let (low, high) =
        range.split_once("..").ok_or_else(|| wrong("expected LOW..HIGH after the =".to_owned()))?;
    let key = find_key(name.trim()).map_err(wrong)?;
    let bound = |text: &str| {
        let number = number_of_text(text.trim(), key.unit)?;
        car.parameters.clone().set_number(key, number).map(|()| number)
    };
    let (low, high) = (bound(low).map_err(wrong)?, bound(high).map_err(wrong)?);
    if low > high {
        return Err(wrong(format!("expected the lower number first, found {low} before {high}")));
    }
    Ok(ParameterRange { key, low, high })
}

/// The first rows of a file of draws: those of an identification are in no order.
fn read_draws(path: &Path, samples: usize) -> Result<Vec<ParameterDraw>, Error> {
    let name = path.display();
    let wrong = |message: String| Error::invalid_input(format!("{name}: {message}"));
    let text = diagnostics::read_text_bounded(path, LARGEST)
        .map_err(|error| wrong(format!("the draws cannot be read: {error}")))?;
    lap::parameter_draws(&text, samples, find_key).map_err(wrong)
}
