//! Fits a curve to a CSV file with the columns slip and force (and weight, if there is one) and prints the result as JSON.
//!
//! `fit_csv FILE [B C D E]`: with numbers, one start there; without, several starts.
use std::error::Error;
use std::time::Instant;

use identify::fit::{Options, Problem, least_squares};
use identify::samples::Samples;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let file = arguments.first().ok_or("which file? usage: fit_csv FILE [B C D E]")?;
    let start = arguments[1..].iter().map(|a| a.parse()).collect::<Result<Vec<f64>, _>>()?;
    let samples = read(file)?;
    let options = match start[..] {
        [] => Options::default(),
        [b, c, d, e] => Options::from_start([b, c, d, e, 0.0, 0.0]),
        _ => return Err("a start has four numbers: B C D E".into()),
    };
    let clock = Instant::now();
    let solution = least_squares(&Problem::new(&samples), &options)?;
    let seconds = clock.elapsed().as_secs_f64();
    let std: Vec<Option<f64>> = solution.free.iter().map(|&p| solution.std(p)).collect();
    let report = serde_json::json!({
        "theta": &solution.theta[..4],
        "std": std,
        "noise_std": solution.noise_std,
        "cost": solution.cost,
        "at_bound": solution.at_bound,
        "convergence": solution.convergence,
        "seconds": seconds,
    });
    println!("{report}");
    Ok(())
}

fn read(file: &str) -> Result<Samples, Box<dyn Error>> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{file}: {e}"))?;
    let mut samples = Samples::default();
    for (number, line) in text.lines().enumerate().skip(1) {
        let row = line.split(',').map(|cell| cell.trim().parse()).collect::<Result<Vec<f64>, _>>();
        match row.map_err(|e| format!("{file}:{}: {e}", number + 1))?[..] {
            [slip, force] => samples.push(slip, force, 1.0),
            [slip, force, weight] => samples.push(slip, force, weight),
            _ => {
                return Err(format!(
                    "{file}:{}: expected slip,force or slip,force,weight",
                    number + 1
                )
                .into());
            }
        }
    }
    Ok(samples)
}
