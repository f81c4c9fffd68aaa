//! Finds the posterior of the curve in a CSV file (columns slip and force) by variational inference, and what it really is:
//! `svi_csv FILE [FITS]`. Prints JSON; the fit is made nine times, or FITS times, and the median time is reported.
//!
//! `exact` can be held against any sampler whose prior is uniform in the box `wide` and flat in σ. That of NumPyro (NUTS, dense mass, 9000
//! draws for the second, 3000 for the others) on three data sets of 1000 points to a slip of 0.75, B 15, C 2, D 1.5, E 0.8, noise 0.05:
//! means of B, C, D, E and K differ by at most 0.08 standard deviations, widths by at most 4 %, which is the noise of those draws.
use std::error::Error;
use std::time::Instant;

use preparation::direction::ForceDirection;
use tire_inference::compressed::CompressedSamples;
use tire_inference::estimate::identify_tire;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::variational::{self, VariationalStart};

mod csv;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("which file? usage: svi_csv FILE [FITS]")?;
    let fits: usize = arguments.next().map_or(Ok(9), |fits| fits.parse())?;
    let samples = csv::read(&file)?;
    let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
    let mut seconds = (0..fits.max(1))
        .map(|_| {
            let clock = Instant::now();
            let best = settings.fit(&samples, &settings.prior, FitMethod::LeastSquares)?;
            let data = CompressedSamples::new(&samples);
            let best = (&best.theta, best.noise_std);
            let start = VariationalStart { samples: &samples, data: &data, prior: &settings.prior, best };
            std::hint::black_box(variational::fit_variational(start, settings.svi, 0));
            Ok(clock.elapsed().as_secs_f64())
        })
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    seconds.sort_by(f64::total_cmp);
    let clock = Instant::now();
    let answer = identify_tire(&samples, &settings, &[FitMethod::Svi, FitMethod::Reference])?;
    let all = clock.elapsed().as_secs_f64();
    let [(_, svi), (_, exact)] = &answer.estimates[..] else { return Err("two methods".into()) };
    let report = serde_json::json!({
        "seconds": seconds[seconds.len() / 2],
        "svi": svi.svi,
        "published": { "source": svi.source, "mean": svi.mean, "std": svi.std, "seconds": all },
        "exact": { "mean": exact.mean, "std": exact.std, "seconds": exact.seconds },
    });
    println!("{report}");
    Ok(())
}
