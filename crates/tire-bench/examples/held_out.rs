//! Prints how well fits predict what they have not seen: `held_out FOLDER [standard|extended]`, with
//! `ttc_cornering.csv.gz` and `ttc_drivebrake.csv.gz` in the folder.

use std::path::Path;
use std::time::Instant;

use tire::{Coefficients, TireAxes};
use tire_bench::{FitHoldout, TireFitOptions, fit_with_holdout, read_csv_file};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("expected a folder with the data")?;
    let mut samples = Vec::new();
    for (run, name) in ["ttc_cornering.csv.gz", "ttc_drivebrake.csv.gz"].iter().enumerate() {
        samples.extend(read_csv_file(&Path::new(&folder).join(name), run, &[], TireAxes::Iso)?);
    }
    let tire = Coefficients {
        UNLOADED_RADIUS: 0.2025,
        FNOMIN: 1700.0,
        NOMPRES: 83_000.0,
        INFLPRES: 83_000.0,
        LONGVL: 11.17,
        PRESMIN: 40_000.0,
        ..Coefficients::default()
    };
    let lefts = [
        FitHoldout::Pressure(83_200.0),
        FitHoldout::Pressure(69_500.0),
        FitHoldout::Pressure(97_000.0),
        FitHoldout::Load(1650.0),
        FitHoldout::SlipAngle(0.0425),
        FitHoldout::Nothing,
        FitHoldout::Load(2190.0),
        FitHoldout::Load(525.0),
        FitHoldout::Load(2740.0),
    ];
    let kind = std::env::args().nth(2);
    for extended in [false, true] {
        if kind.as_deref().is_some_and(|it| it != if extended { "extended" } else { "standard" }) {
            continue;
        }
        let options = TireFitOptions { tire, extended, draws: 0, seed: 1 };
        for left in lefts {
            let begin = Instant::now();
            let (fit, found) = fit_with_holdout(&samples, &options, left)?;
            let seconds = begin.elapsed().as_secs_f64();
            println!("{left:?}, extended {extended}: {seconds:.1} s");
            for it in fit.residuals {
                println!(
                    "  {:?} {} points, rms {:.1}, {:.1} alike, {:?} after {}",
                    it.channel, it.points, it.rms, it.correlated, it.status, it.iterations
                );
            }
            for it in found {
                println!(
                    "  run {} {:<12} means {:.2} %, samples {:.2} % of {:.0}; {:.1} % in bands",
                    it.run,
                    format!("{:?}", it.channel),
                    100.0 * it.means,
                    100.0 * it.samples,
                    it.peak,
                    100.0 * it.coverage
                );
            }
        }
    }
    Ok(())
}
