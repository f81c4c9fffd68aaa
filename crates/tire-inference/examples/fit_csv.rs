//! Fits a curve to a CSV file with the columns slip and force (and weight, if there is one) and prints the result as JSON.
//!
//! `fit_csv [--nelder-mead] FILE [B C D E]`: with numbers, one start there; without, several starts. The fit is made five times
//! and the median time is reported.
use std::error::Error;
use std::time::Instant;

use tire_inference::fit::{CurveFitProblem, FitError, FitOptions, least_squares, nelder_mead};

mod csv;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let simplex = arguments.first().is_some_and(|a| a == "--nelder-mead");
    arguments.drain(..usize::from(simplex));
    let file = arguments.first().ok_or("which file? usage: fit_csv FILE [B C D E]")?;
    let start = arguments[1..].iter().map(|a| a.parse()).collect::<Result<Vec<f64>, _>>()?;
    let samples = csv::read(file)?;
    let problem = CurveFitProblem::new(&samples);
    let options = match start[..] {
        [] => FitOptions::default(),
        [b, c, d, e] => FitOptions::from_start([b, c, d, e, 0.0, 0.0]),
        _ => return Err("a start has four numbers: B C D E".into()),
    };
    let fit = || {
        let clock = Instant::now();
        let solution = if simplex {
            nelder_mead::fit_nelder_mead(&problem, &options)?
        } else {
            least_squares(&problem, &options)?
        };
        Ok::<_, FitError>((clock.elapsed().as_secs_f64(), solution))
    };
    let mut fits = (0..5).map(|_| fit()).collect::<Result<Vec<_>, _>>()?;
    fits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (seconds, solution) = fits.swap_remove(2);
    let std: Vec<Option<f64>> = solution.free.iter().map(|&p| solution.parameter_std(p)).collect();
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
