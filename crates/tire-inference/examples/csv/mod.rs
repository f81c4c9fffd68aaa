//! Reads a CSV file with the columns slip and force, and weight, if there is one.
use std::error::Error;

use preparation::samples::CurveSamples;

/// The samples of a file, whose first line is its header.
pub fn read(file: &str) -> Result<CurveSamples, Box<dyn Error>> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{file}: {e}"))?;
    let mut samples = CurveSamples::default();
    for (number, line) in text.lines().enumerate().skip(1) {
        let row = line.split(',').map(|cell| cell.trim().parse()).collect::<Result<Vec<f64>, _>>();
        match row.map_err(|e| format!("{file}:{}: {e}", number + 1))?[..] {
            [slip, force] => samples.push(slip, force, 1.0),
            [slip, force, weight] => samples.push(slip, force, weight),
            _ => {
                return Err(format!("{file}:{}: expected slip,force or slip,force,weight", number + 1).into());
            }
        }
    }
    Ok(samples)
}
