//! Writes `tires_draws.csv`: tires drawn from the posterior, a line for each, for a sweep over what the data left open.

use std::fmt::Write;

use drive_inference::DriveIdentification;
use numerics::resampling::systematic_resample;
use preparation::direction::ForceDirection;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use tire_inference::axles::Axle;
use tire_inference::parameters::{Parameter, Theta};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;

use crate::start_values::{IdentifiedTire, parameter_key};

/// Name of the file; a sweep finds it by its ending.
pub const FILE: &str = "tires_draws.csv";
/// How many there are: the ends of 95 % intervals are then off by a twelfth of a standard deviation.
const DRAWS: usize = 1000;

/// A tire of the plant, and what its data and the box say together.
#[derive(Clone, Copy, Debug)]
pub struct TirePosterior<'a> {
    /// The tire, with what is published of it.
    pub tire: IdentifiedTire<'a>,
    /// The draws that its uncertainty is that of.
    pub posterior: &'a PosteriorSamples,
}

/// Whether draws of one index belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawDependence {
    /// They do: the posterior is that of all tires together.
    Joint,
    /// They do not: each tire has a posterior of its own.
    Independent,
}

/// The tires that drives of a node told of.
pub fn of_drives<'a>(node: &'a str, found: &'a DriveIdentification) -> [TirePosterior<'a>; 2] {
    [("tire_f", Axle::Front), ("tire_r", Axle::Rear)].map(|(tire, axle)| {
        let (estimate, posterior) = (&found.estimates[axle], &found.posterior[axle]);
        TirePosterior {
            tire: IdentifiedTire { node, tire, estimate, direction: ForceDirection::Lateral },
            posterior,
        }
    })
}

/// Why there are no draws to leave, in a sentence; `None` if there are.
pub fn reason_for_no_draws(tires: &[TirePosterior]) -> Option<String> {
    let why = |drawn: &TirePosterior| {
        let TirePosterior { tire: IdentifiedTire { tire, estimate, .. }, posterior } = drawn;
        let finite = |theta: &Theta| theta.iter().all(|value| value.is_finite());
        if estimate.source == UncertaintySource::Likelihood {
            Some(format!("there is no posterior of {tire}"))
        } else if estimate.identified.values().all(|it| *it == Identifiability::NotIdentifiable) {
            Some(format!("nothing of {tire} is identifiable"))
        } else if posterior.samples.is_empty() {
            Some(format!("there are no draws of {tire}"))
        } else if !posterior.samples.iter().all(finite) {
            Some(format!("not all draws of {tire} are finite"))
        } else {
            None
        }
    };
    let why = tires.iter().find_map(why)?;
    Some(format!("No draws are left for a sweep: {why}."))
}

/// 1,000 draws of equal weight in random order, each on a line with the parameters of all tires, under the names of `tires.toml`;
/// none where [`reason_for_no_draws`] says why. A seed gives the same bits.
pub fn draws_csv(tires: &[TirePosterior], draws: DrawDependence, seed: u64) -> Option<String> {
    if reason_for_no_draws(tires).is_some() {
        return None;
    }
    let mut columns = Vec::new();
    for (number, TirePosterior { tire, posterior }) in tires.iter().enumerate() {
        // Draws lie in the order of the cells of a grid: in that order the tires would seem to be alike.
        let stream = if draws == DrawDependence::Joint { 0 } else { number as u128 };
        let chosen = shuffled_rows(posterior.samples.len(), seed, stream);
        for parameter in Parameter::ALL {
            if tire.estimate.mean.contains_key(&Quantity::from(parameter)) {
                let value = |&row: &usize| posterior.samples[row][parameter as usize];
                let values: Vec<f64> = chosen.iter().map(value).collect();
                columns.push((csv_field(&parameter_key(tire, parameter.symbol())), values));
            }
        }
    }
    let heads: Vec<_> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = heads.join(",") + "\n";
    for line in 0..DRAWS {
        // Debug writes each number so that it reads back to the last bit.
        let values: Vec<_> = columns.iter().map(|(_, values)| format!("{:?}", values[line])).collect();
        let _ = writeln!(text, "{}", values.join(","));
    }
    Some(text)
}

/// Rows evenly from a number of them, in random order: the first lines are a sample too.
fn shuffled_rows(count: usize, seed: u64, stream: u128) -> Vec<usize> {
    let mut rows = systematic_resample(&vec![1.0; count], DRAWS, seed);
    rows.shuffle(&mut Pcg64::new(u128::from(seed), stream));
    rows
}

/// A field of CSV.
fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r', '#']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests;
