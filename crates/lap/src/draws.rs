//! Draws parameters of a car: rows of a table, such as the one of an identification, or evenly from ranges.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::parameters::{CarParameters, ParameterKey, ParameterRange};

/// Values of some parameters, those of one draw.
pub type ParameterDraw = Vec<(&'static ParameterKey, f64)>;

/// Draws evenly from ranges.
pub fn draw_from_ranges(ranges: &[ParameterRange], samples: usize, seed: u64) -> Vec<ParameterDraw> {
    let mut random = Pcg64::seed_from_u64(seed);
    let draw = |_| ranges.iter().map(|it| (it.key, random.random_range(it.low..=it.high))).collect();
    (0..samples).map(draw).collect()
}

/// The first rows of a table of draws, as CSV; `find_key` finds the parameter of a title. Draws of an identification are in no order, so
/// the first ones are as good as any.
///
/// # Errors
/// In words, with the line.
pub fn parameter_draws(
    text: &str,
    samples: usize,
    find_key: impl Fn(&str) -> Result<&'static ParameterKey, String>,
) -> Result<Vec<ParameterDraw>, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| error.to_string())?.clone();
    let keys = header.iter().map(find_key).collect::<Result<Vec<_>, _>>()?;
    let mut draws = Vec::new();
    for row in reader.records().take(samples) {
        let row = row.map_err(|error| error.to_string())?;
        let line = row.position().map_or(0, csv::Position::line);
        let mut draw = ParameterDraw::new();
        for (key, field) in keys.iter().zip(&row) {
            let number =
                field.parse().map_err(|_| format!("line {line}: expected a number, found `{field}`"))?;
            draw.push((*key, number));
        }
        draws.push(draw);
    }
    if draws.is_empty() {
        return Err("expected a row for each draw, found none".to_owned());
    }
    Ok(draws)
}

/// Whether each parameter of the draws changes the car that they make together.
///
/// # Errors
/// In words, with the first one that does not.
pub fn check_draws_change_car(draws: &[ParameterDraw], car: &CarParameters) -> Result<(), String> {
    let mut drawn = car.clone();
    let first = draws.first().into_iter().flatten();
    for (key, value) in first.clone() {
        // A number beyond its range is no car, and the draw is told as one that was not solved.
        let _ = drawn.set_number(key, *value);
    }
    first.into_iter().try_for_each(|(key, _)| key.check_changes_car(&drawn))
}
