//! Reads the ranges of a set-up.

use clap::Args;
use diagnostics::Error;
use lap::{ParameterDraw, ParameterRange};

use super::car_file::CarFile;
use super::variation::parse_range;

/// Arguments of the set-up.
#[derive(Args)]
pub struct SetupArguments {
    /// A parameter that can be set up within a range, such as brake.front_share=0.5..0.7: the fastest set-up is searched for.
    #[arg(long, value_name = "KEY=LOW..HIGH")]
    setup: Vec<String>,
}

/// Most parameters of a set-up: each costs a search for a lap at each step.
const MOST_PARAMETERS: usize = 20;

impl SetupArguments {
    /// The ranges.
    ///
    /// # Errors
    /// When one is wrong, empty, there twice, or of a parameter that the draws vary.
    pub fn ranges(
        &self,
        car: &CarFile,
        draws: Option<&[ParameterDraw]>,
    ) -> Result<Vec<ParameterRange>, Error> {
        if self.setup.len() > MOST_PARAMETERS {
            let found = self.setup.len();
            let message = format!("--setup: expected at most {MOST_PARAMETERS} parameters, found {found}");
            return Err(Error::invalid_input(message));
        }
        let mut ranges: Vec<ParameterRange> = Vec::new();
        for text in &self.setup {
            let wrong = |message: &str| Error::invalid_input(format!("--setup {text}: {message}"));
            let range = parse_range("--setup", text, car)?;
            let is_same = |name: &str| name == range.key.name;
            range.key.check_changes_car(&car.parameters).map_err(|message| wrong(&message))?;
            if range.low == range.high {
                return Err(wrong("expected two different numbers"));
            }
            if ranges.iter().any(|other| is_same(other.key.name)) {
                return Err(wrong("the parameter has a range already"));
            }
            let drawn = draws.and_then(|draws| draws.first()).into_iter().flatten();
            if drawn.into_iter().any(|(key, _)| is_same(key.name)) {
                return Err(wrong("a draw would set it again: leave it out of --vary or --draws"));
            }
            ranges.push(range);
        }
        Ok(ranges)
    }
}
