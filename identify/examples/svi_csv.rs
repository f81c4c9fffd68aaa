//! Finds the posterior of the curve in a CSV file (columns slip and force) by variational inference, and what it really is:
//! `svi_csv FILE`. Prints JSON; the fit is made nine times, and the median time is told.
use std::error::Error;
use std::time::Instant;

use identify::compressed::Compressed;
use identify::direction::Direction;
use identify::estimate::identify;
use identify::settings::{Method, Settings};
use identify::svi::{self, Start};

mod csv;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("which file? usage: svi_csv FILE")?;
    let samples = csv::read(&file)?;
    let settings = Settings::new(Direction::Longitudinal);
    let mut seconds = (0..9)
        .map(|_| {
            let clock = Instant::now();
            let best = settings.fit(&samples, &settings.prior, Method::LeastSquares)?;
            let data = Compressed::new(&samples);
            let best = (&best.theta, best.noise_std);
            let start = Start { samples: &samples, data: &data, prior: &settings.prior, best };
            std::hint::black_box(svi::fit(start, settings.svi, 0));
            Ok(clock.elapsed().as_secs_f64())
        })
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    seconds.sort_by(f64::total_cmp);
    let clock = Instant::now();
    let answer = identify(&samples, &settings, &[Method::Svi, Method::Reference])?;
    let all = clock.elapsed().as_secs_f64();
    let [(_, svi), (_, exact)] = &answer.estimates[..] else { return Err("two methods".into()) };
    let report = serde_json::json!({
        "seconds": seconds[4],
        "svi": svi.svi,
        "published": { "source": svi.source, "mean": svi.mean, "std": svi.std, "seconds": all },
        "exact": { "mean": exact.mean, "std": exact.std, "seconds": exact.seconds },
    });
    println!("{report}");
    Ok(())
}
