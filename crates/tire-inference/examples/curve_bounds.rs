//! Counts how many B, C, D, peaks and slips at the peak of curves in and out of the default box are identified, right and wrong:
//! `curve_bounds [COUNT [SAMPLES]]`, or `curve_bounds FILE...` for curves of others.
//!
//! Tires from a lorry's to a kart's, slips evenly to both sides up to one and three times that of the peak (0.3 at most), noise of 1 and 4 % of the height in the
//! force. Each cell is identified / right / wrong, of COUNT curves; wrong is identified with the truth out of the 95 % interval.

use std::error::Error;

use numerics::low_discrepancy::AdditiveRecurrence;
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use tire_inference::bound_extension::BoundExtension;
use tire_inference::estimate::{TireIdentification, identify_tire};
use tire_inference::fit::FitError;
use tire_inference::parameters::{Theta, magic_formula_from_theta};
use tire_inference::quantity::{HIGHEST_PEAK_SLIP, Quantity};
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::verdict::Identifiability;

mod csv;

/// Tires by name.
const TIRES: [(&str, Theta); 8] = [
    ("lorry", [5.0, 1.25, 0.75, -0.8, 0.0, 0.0]),
    ("van", [8.5, 1.35, 0.9, -0.6, 0.0, 0.0]),
    ("road car", [12.0, 1.4, 1.05, -0.4, 0.0, 0.0]),
    ("no peak", [10.0, 0.95, 0.85, 0.3, 0.0, 0.0]),
    ("slick", [22.0, 1.55, 1.7, 0.3, 0.0, 0.0]),
    ("kart", [75.0, 1.45, 1.5, -0.5, 0.0, 0.0]),
    ("kart, stiffer", [95.0, 1.4, 1.6, -0.3, 0.0, 0.0]),
    ("model car", [150.0, 1.3, 1.1, -1.0, 0.0, 0.0]),
];
/// Largest slips over that of the peak.
const LEVELS: [f64; 2] = [1.0, 3.0];
/// Noise over D.
const NOISES: [f64; 2] = [0.01, 0.04];
const QUANTITIES: [Quantity; 5] = [Quantity::B, Quantity::C, Quantity::D, Quantity::Peak, Quantity::PeakSlip];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first() {
        Some(first) if first.parse::<usize>().is_err() => describe_files(&arguments),
        _ => {
            let number = |index: usize, absent| arguments.get(index).map_or(Ok(absent), |text| text.parse());
            count_verdicts(number(0, 10)?, number(1, 400)?)?;
            Ok(())
        }
    }
}

/// The answer, and the sides of the box that were moved.
fn identify(samples: &CurveSamples) -> Result<(TireIdentification, Vec<BoundExtension>), FitError> {
    let usual = IdentificationSettings::new(ForceDirection::Lateral);
    let (settings, moved) = usual.extend_bounds(samples)?;
    Ok((identify_tire(samples, &settings, &[FitMethod::LeastSquares])?, moved))
}

fn describe_files(files: &[String]) -> Result<(), Box<dyn Error>> {
    for file in files {
        println!("{file}");
        let (found, moved) = identify(&csv::read(file)?)?;
        moved.iter().for_each(|it| println!("  {it}"));
        for it in found.judgements {
            println!("  {} {:?} {:.4?} {}", it.quantity, it.verdict, it.interval, it.reason);
        }
    }
    Ok(())
}

/// Points of a tire up to a slip, with noise in the force.
fn draw_samples(truth: &Theta, level: f64, noise: f64, count: usize, seed: u64) -> CurveSamples {
    let mut random = Pcg64::new(u128::from(seed), 1);
    let normal = Normal::new(0.0, noise * truth[2]).expect("noise is positive");
    let tire = magic_formula_from_theta(truth);
    let points = AdditiveRecurrence::<1>::new(seed);
    let slips = (0..count).map(|index| level * (2.0 * points.point(index)[0] - 1.0));
    let (slip, force) =
        slips.map(|slip| (slip, tire.friction_coefficient(slip) + normal.sample(&mut random))).unzip();
    CurveSamples::new(slip, force)
}

/// Whether a quantity is identified, and whether the truth is in its interval.
type Answer = [bool; 2];

fn count_verdicts(count: usize, size: usize) -> Result<(), FitError> {
    println!(
        "{count} curves of {size} points: identified / right / wrong of B, C, D, peak, slip at the peak"
    );
    let mut sums = [[0; 3]; QUANTITIES.len()];
    for (name, truth) in TIRES {
        for (level, noise) in LEVELS.into_iter().flat_map(|level| NOISES.map(|noise| (level, noise))) {
            let peak = Quantity::PeakSlip.value(&truth);
            let peak = if peak < HIGHEST_PEAK_SLIP { peak } else { 0.15 };
            let end = (level * peak).min(0.3);
            let one = |seed: u64| {
                let (found, moved) = identify(&draw_samples(&truth, end, noise, size, seed))?;
                let answers = QUANTITIES.map(|quantity| {
                    let truth = quantity.value(&truth);
                    found.judgements.iter().find(|it| it.quantity == quantity).map_or([false; 2], |it| {
                        let within = it.interval[0] <= truth && truth <= it.interval[1];
                        [it.verdict == Identifiability::Identified, within]
                    })
                });
                Ok((answers, !moved.is_empty()))
            };
            let rows: Vec<([Answer; QUANTITIES.len()], bool)> =
                (0..count as u64).into_par_iter().map(one).collect::<Result<_, FitError>>()?;
            let cells = std::array::from_fn::<_, { QUANTITIES.len() }, _>(|index| {
                let of = |is: fn(Answer) -> bool| rows.iter().filter(|row| is(row.0[index])).count();
                [of(|[identified, _]| identified), of(|it| it == [true, true]), of(|it| it == [true, false])]
            });
            for (sum, cell) in sums.iter_mut().zip(cells) {
                sum.iter_mut().zip(cell).for_each(|(sum, cell)| *sum += cell);
            }
            let moved = rows.iter().filter(|row| row.1).count();
            println!("{name:14} to {end:.3}, noise {noise}: {}  box moved {moved}", join(&cells));
        }
    }
    println!("all: {}", join(&sums));
    Ok(())
}

fn join(cells: &[[usize; 3]]) -> String {
    cells.iter().map(|[all, right, wrong]| format!("{all}/{right}/{wrong}")).collect::<Vec<_>>().join("  ")
}
