//! Prints mean and standard deviation of the published posterior of the points in a CSV file, as JSON: `posterior_csv FILE`.
//!
//! The file has the columns slip and force (over load); the box is that of a longitudinal curve, without shifts.

use std::time::Instant;

use identify::compressed::Compressed;
use identify::fit::{Options, Problem, least_squares};
use identify::parameters::{Parameter, Theta};
use identify::posterior::{Options as Draws, draw, mean, std};
use identify::prior::Prior;
use identify::quantity::Quantity;
use serde_json::{Map, json};

#[path = "support/points.rs"]
mod points;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let samples = points::read(&std::env::args().nth(1).ok_or("expected FILE")?)?;
    let begin = Instant::now();
    let fit = least_squares(&Problem::new(&samples), &Options::default())?;
    let optima: Vec<Theta> = fit.optima.iter().map(|(theta, _)| *theta).collect();
    let data = Compressed::new(&samples);
    let found = draw(&data, &Prior::longitudinal(), &optima, &Draws::default());
    let seconds = begin.elapsed().as_secs_f64();
    let parameters = [Parameter::B, Parameter::C, Parameter::D, Parameter::E];
    let (mut means, mut stds) = (Map::new(), Map::new());
    for quantity in parameters.map(Quantity::Parameter).into_iter().chain([Quantity::K]) {
        let values = found.posterior.values(quantity);
        means.insert(quantity.name().to_owned(), json!(mean(&values)));
        stds.insert(quantity.name().to_owned(), json!(std(&values)));
    }
    let method = found.report.method;
    println!("{}", json!({ "mean": means, "std": stds, "method": method, "seconds": seconds }));
    Ok(())
}
