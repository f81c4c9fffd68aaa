//! Says what each parameter of a car is worth: seconds per lap and by corner for a change of one percent.

use rayon::prelude::*;
use track::TrackLine;

use crate::corners::Corner;
use crate::optimum::LapOptimum;
use crate::parameters::{CarParameters, ParameterKey};
use crate::{Error, LapOptions};

/// Relative change of a parameter for its central difference.
const CHANGE: f64 = 1e-4;

/// What one percent more of a parameter is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterWorth {
    /// Name of the parameter.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// Change of the lap time for one percent more [s]; negative makes the car faster.
    pub seconds_per_percent: f64,
    /// The same for each corner [s].
    pub by_corner: Vec<f64>,
}

impl LapOptimum {
    /// What the parameters of the car are worth, those that matter most first. The driver takes the best line for each of them.
    ///
    /// # Errors
    /// As [`LapOptimum::find`].
    pub fn parameter_worth(
        &self,
        parameters: &CarParameters,
        line: &TrackLine,
        options: &LapOptions,
        corners: &[Corner],
    ) -> Result<Vec<ParameterWorth>, Error> {
        let worth = |key: &&'static ParameterKey| self.worth_of(key, parameters, line, options, corners);
        let mut all: Vec<ParameterWorth> = parameters
            .varied_keys()
            .par_iter()
            .filter_map(|key| worth(key).transpose())
            .collect::<Result<_, _>>()?;
        all.sort_by(|a, b| b.seconds_per_percent.abs().total_cmp(&a.seconds_per_percent.abs()));
        Ok(all)
    }

    /// `None` for a parameter that cannot change to both sides.
    fn worth_of(
        &self,
        key: &'static ParameterKey,
        parameters: &CarParameters,
        line: &TrackLine,
        options: &LapOptions,
        corners: &[Corner],
    ) -> Result<Option<ParameterWorth>, Error> {
        let value = key.value(parameters);
        let mut sides = Vec::with_capacity(2);
        for sign in [1.0, -1.0] {
            let mut changed = parameters.clone();
            if changed.set_number(key, value * (1.0 + sign * CHANGE)).is_err() {
                return Ok(None);
            }
            let (car, _) = changed.car().map_err(Error::Options)?;
            sides.push(self.lagrangian_by_node(&car, line, options)?);
        }
        let percent = 0.01 / (2.0 * CHANGE);
        let by_node: Vec<f64> =
            sides[0].iter().zip(&sides[1]).map(|(more, less)| (more - less) * percent).collect();
        let by_corner =
            corners.iter().map(|corner| corner.nodes(by_node.len()).map(|k| by_node[k]).sum()).collect();
        Ok(Some(ParameterWorth {
            name: key.name,
            unit: key.unit,
            value,
            seconds_per_percent: by_node.iter().sum(),
            by_corner,
        }))
    }
}
