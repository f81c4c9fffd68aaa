//! Prints how well both axles are identified from closed-loop drives, for noises, tires, cars and seeds.
//!
//! `closed_loop [--known-noise] [--profile] [--compare] [--svi] [--em PASSES] [--seeds N] [--only NAME]` simulates; `--chirp` with slip far below the
//! peak; `closed_loop run.csv` identifies from a recording of
//! `scenarios/limit_handling.toml`, or of columns t, v_x, v_y, r, a_y, F_x, delta, of the default tires unless `--tires B,C,D,E,B,C,D,E` says otherwise.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/drive.rs"]
mod drive;

use drive_inference::likelihood::{DriveLikelihood, DriveNoise, DriveUnknowns};
use drive_inference::regression::RegressionTarget;
use drive_inference::smoothing::SmootherOptions;
use drive_inference::tires::{Tires, from_array, parameter_block, to_array};
use drive_inference::validation::{Manoeuvre, compare_tires};
use drive_inference::{
    Drive, DriveIdentification, DriveOptions, FitFormulation, NoiseOption, identify_tires,
};
use numerics::statistics;
use tire_inference::axles::Axle;
use tire_inference::parameters::{Parameter, TireParameters};
use tire_inference::quantity::Quantity;
use vehicle::{SingleTrackCar, VehicleBody};

const DEMO: TireParameters = TireParameters { B: 22.0, C: 1.8, D: 1.6, E: 0.8 };
const EQUAL: Tires = Tires { front: DEMO, rear: DEMO };
const UNEQUAL: Tires = Tires {
    front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
    rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
};

const NAMED: [(&str, Axle); 2] = [("front", Axle::Front), ("rear", Axle::Rear)];

/// Processor time of this process [s], with a resolution of 0.01 s; not a number where the system does not tell.
fn processor() -> f64 {
    let Ok(text) = std::fs::read_to_string("/proc/self/stat") else { return f64::NAN };
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2);
    ticks.filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Largest distance of two curves of an axle over 0 to 0.3 rad, in % of the peak.
fn curve_error(found: &Tires, truth: &Tires, axle: Axle) -> f64 {
    let (found, expected) = (found[axle].to_magic_formula(), truth[axle].to_magic_formula());
    let off = |k: usize| {
        let slip = 0.001 * k as f64;
        (found.friction_coefficient(slip) - expected.friction_coefficient(slip)).abs()
    };
    100.0 * (0..=300).map(off).fold(0.0, f64::max) / expected.D
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}

fn line(name: &str, found: &Tires, truth: &Tires, car: &SingleTrackCar) {
    let parameters = to_array(*found).into_iter().zip(to_array(*truth));
    let parameter = largest(parameters.map(|(found, truth)| 100.0 * (found / truth - 1.0)));
    let stiffness = |axle: Axle| found[axle].stiffness() / truth[axle].stiffness();
    let K = largest(Axle::ALL.map(|axle| 100.0 * (stiffness(axle) - 1.0)).into_iter());
    let curves = |tires: &Tires| tires.map(|tire| tire.to_magic_formula()).into_array();
    let rmse = Manoeuvre::ALL.map(|manoeuvre| {
        let off = compare_tires(manoeuvre, car, curves(found), curves(truth));
        100.0 * off[0].max(off[1])
    });
    println!(
        "{name:28} {parameter:9.3} {:9.4} {:9.4} {K:9.4}   {:8.3} {:8.3} {:8.3} {:8.3}",
        curve_error(found, truth, Axle::Front),
        curve_error(found, truth, Axle::Rear),
        rmse[0],
        rmse[1],
        rmse[2],
        rmse[3]
    );
}

fn report(name: &str, found: &DriveIdentification, truth: &Tires, car: &SingleTrackCar, seconds: f64) {
    for fitted in &found.formulations {
        let kind = match fitted.formulation {
            FitFormulation::Points(RegressionTarget::SmoothedAcceleration) => "A",
            FitFormulation::Points(RegressionTarget::Acceleration) => "B",
            FitFormulation::Points(RegressionTarget::AxleForces) => "C",
            FitFormulation::Points(RegressionTarget::AccelerationAndYaw) => "E",
            FitFormulation::PredictionError => "D",
        };
        line(&format!("{name} {kind}"), &fitted.tires, truth, car);
        println!("    {:.4?}", to_array(fitted.tires));
        let convergence = &fitted.convergence;
        println!(
            "    {:?} {:.3} s wall, {} evaluations, kkt {:.1e}, {} optima of {} starts",
            convergence.status,
            fitted.seconds,
            convergence.evaluations,
            convergence.kkt_residual.unwrap_or(f64::NAN),
            convergence.optima,
            convergence.starts
        );
    }
    for smoothed in &found.smoothed {
        let report = &smoothed.report;
        println!(
            "    smoothing: log-likelihood {:.0}, a_y {:.4} m/s2",
            report.log_likelihood, report.a_y_rmse
        );
        let exponents =
            |values: &[f64]| -> Vec<String> { values.iter().map(|v| format!("{v:.2e}")).collect() };
        println!("      Q {:?}, R {:?}", exponents(&report.Q), exponents(&report.R));
        if let Some(em) = &report.em {
            println!("      EM: {} passes, converged {}, {:?}", em.passes, em.converged, em.violations);
            println!("      {:.1?}", em.log_likelihood);
        }
    }
    println!("    {}", found.model.sentence);
    for cause in &found.causes {
        println!("    {}", cause.sentence);
    }
    let innovations = &found.innovations;
    println!(
        "    innovations {:.3} of expected, squares {:.3?}, autocorrelation {:.3?}; {seconds:.2} s of processor in all",
        innovations.cost / innovations.expected_cost,
        innovations.mean_square,
        innovations.autocorrelation
    );
}

/// Errors in standard deviations, and what the data themselves say of the truth: twice the rise of the cost from the optimum to
/// it is a sample of χ² with 8 degrees of freedom, if all is well.
fn limits(found: &DriveIdentification, truth: &Tires, car: &SingleTrackCar, recording: &Drive) {
    let likelihood = DriveLikelihood::new(car, std::slice::from_ref(recording));
    let Some(best) = found.formulations.last() else { return };
    let (theta, expected) = (to_array(best.tires), to_array(*truth));
    let std: [f64; 8] = std::array::from_fn(|i| found.covariance[i][i].sqrt());
    let rise = likelihood.cost(&DriveUnknowns::new(truth, &found.noise))
        - likelihood.cost(&DriveUnknowns::new(&best.tires, &found.noise));
    println!(
        "    standard deviations [%] {:.2?}, errors over them {:.2?}, twice the rise of the cost to the truth {:.2}",
        std::array::from_fn::<f64, 8, _>(|i| 100.0 * std[i] / expected[i]),
        std::array::from_fn::<f64, 8, _>(|i| (theta[i] - expected[i]) / std[i]),
        2.0 * rise
    );
    let short = |stds: [f64; 4]| stds.map(|std| format!("{std:.3e}")).join(" ");
    println!("    noises {}, of the process {}", short(found.noise.sensor), short(found.noise.process));
}

/// What the posterior says beside the bound of Cramér and Rao, and how many of its 95 % intervals hold the truth.
fn exact(found: &DriveIdentification, truth: &Tires) {
    let (mut held, mut all) = (0, 0);
    for (name, axle) in NAMED {
        let estimate = &found.estimates[axle];
        let Some(posterior) = &estimate.posterior else { return };
        let (tire, o) = (truth[axle], parameter_block(axle).start);
        let [B, C, D, E] = tire.into_array();
        let truths = [B, C, D, E, tire.stiffness()];
        let holds = |name: &Quantity, truth: f64| {
            let [low, high] = estimate.interval[name];
            (low..=high).contains(&truth)
        };
        let names = [Quantity::B, Quantity::C, Quantity::D, Quantity::E, Quantity::K];
        held += names.iter().zip(truths).filter(|(name, truth)| holds(name, *truth)).count();
        all += names.len();
        let ratio = |i: usize| estimate.std[&names[i]] / found.covariance[o + i][o + i].sqrt();
        println!(
            "    {name:5} posterior {:?}, {} evaluations in {} rounds, {:.2} of the draws count, k-hat {:.2}; standard deviations over the bound {:.2?}",
            posterior.status,
            posterior.cells,
            posterior.levels,
            posterior.effective_share,
            posterior.k_hat.unwrap_or(f64::NAN),
            std::array::from_fn::<f64, 4, _>(ratio)
        );
    }
    println!("    intervals that hold the truth: {held} of {all}");
}

/// How the normal distribution of variational inference compares with the weighted draws.
fn variational(found: &DriveIdentification) {
    for (name, axle) in NAMED {
        let Some(svi) = &found.estimates[axle].svi else { return };
        let quantities: Vec<Quantity> =
            Parameter::ALL[..4].iter().map(|p| Quantity::Parameter(*p)).chain([Quantity::K]).collect();
        let compared = quantities.iter().map(|quantity| {
            let draws = found.posterior[axle].quantity_values(*quantity);
            let std = statistics::std(&draws);
            let off = (svi.mean[quantity] - statistics::mean(&draws)) / std;
            (off, svi.std[quantity] / std)
        });
        let (off, ratios): (Vec<f64>, Vec<f64>) = compared.unzip();
        println!(
            "    {name:5} svi {:?} in {} steps, {} evaluations, {:.2} s, gradient norm {:.1e}, k-hat {:.2}, {}trusted; means off {off:.3?} std, ratios {ratios:.3?}",
            svi.status,
            svi.steps,
            svi.evaluations,
            svi.seconds,
            svi.gradient_norm,
            svi.diagnosis.k_hat,
            if svi.trusted { "" } else { "not " },
        );
    }
}

fn verdicts(found: &DriveIdentification) {
    for (axle, estimate) in NAMED.map(|(name, axle)| (name, &found.estimates[axle])) {
        for (name, verdict) in &estimate.identified {
            let (value, std, ends) = (estimate.mean[name], estimate.std[name], estimate.interval[name]);
            println!(
                "    {axle:5} {name:2} {value:9.4} ± {std:.4} {ends:.4?} {verdict:?}: {}",
                estimate.reason[name]
            );
        }
    }
}

fn read(path: &str) -> Result<Drive, Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines();
    let titles = lines.next().ok_or("an empty file")?.split(',');
    // The unit follows the name: `plant.delta [rad]`.
    let head: Vec<&str> = titles.map(|title| title.split(" [").next().unwrap_or(title)).collect();
    let parsed: Result<Vec<Vec<f64>>, _> =
        lines.map(|line| line.split(',').map(str::parse).collect()).collect();
    let rows = parsed?;
    let column = |names: [&str; 2]| -> Result<Vec<f64>, String> {
        let is = |title: &&str| names.contains(title);
        let i = head.iter().position(is).ok_or(format!("no column {}", names.join(" or ")))?;
        Ok(rows.iter().map(|row| row[i]).collect())
    };
    Ok(Drive {
        t: column(["time", "t"])?,
        v_x: column(["estimator.v_x_meas", "v_x"])?,
        v_y: column(["estimator.v_y_meas", "v_y"])?,
        r: column(["estimator.r_meas", "r"])?,
        a_y: column(["estimator.a_y_meas", "a_y"])?,
        F_x: column(["plant.F_x", "F_x"])?,
        delta: column(["plant.delta", "delta"])?,
        ..Drive::default()
    })
}

struct Wishes {
    known_noise: bool,
    profile: bool,
    compare: bool,
    svi: bool,
    em_passes: usize,
}

fn run(
    name: &str,
    recording: &Drive,
    truth: &Tires,
    car: &SingleTrackCar,
    noise: &[f64; 4],
    wishes: &Wishes,
) {
    let noises = if wishes.known_noise {
        NoiseOption::Known(DriveNoise::from_sensor_stds(*noise))
    } else {
        NoiseOption::Estimated
    };
    let others = [
        RegressionTarget::SmoothedAcceleration,
        RegressionTarget::Acceleration,
        RegressionTarget::AxleForces,
    ];
    let compare = if wishes.compare { others.map(FitFormulation::Points).to_vec() } else { Vec::new() };
    let smoothing = SmootherOptions { em_passes: wishes.em_passes };
    let options = DriveOptions {
        car: *car,
        noises,
        profile: wishes.profile,
        compare,
        svi: wishes.svi,
        smoothing,
        ..DriveOptions::default()
    };
    let begin = processor();
    match identify_tires(std::slice::from_ref(recording), &options, &mut |_, _| true) {
        Ok(found) => {
            report(name, &found, truth, car, processor() - begin);
            limits(&found, truth, car, recording);
            exact(&found, truth);
            variational(&found);
            if wishes.profile {
                verdicts(&found);
            }
        }
        Err(error) => println!("{name}: {error}"),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|a| a == flag);
    let after = |flag: &str| arguments.iter().position(|a| a == flag).and_then(|i| arguments.get(i + 1));
    let wishes = Wishes {
        known_noise: has("--known-noise"),
        profile: has("--profile"),
        compare: has("--compare"),
        svi: has("--svi"),
        em_passes: after("--em").map_or(Ok(SmootherOptions::default().em_passes), |n| n.parse())?,
    };
    println!(
        "{:28} {:>9} {:>9} {:>9} {:>9}   {:>8} {:>8} {:>8} {:>8}",
        "[%]", "parameter", "front", "rear", "BCD", "ramp", "step", "dwell", "lane"
    );
    let default = SingleTrackCar::default();
    if let Some(path) = arguments.first().filter(|a| a.ends_with(".csv")) {
        let tires: Vec<f64> = match after("--tires") {
            Some(text) => text.split(',').map(str::parse).collect::<Result<_, _>>()?,
            None => to_array(EQUAL).to_vec(),
        };
        let truth: [f64; 8] = tires.try_into().map_err(|_| "eight numbers after --tires")?;
        run("recording", &read(path)?, &from_array(truth), &default, &drive::USUAL, &wishes);
        return Ok(());
    }
    if has("--chirp") {
        let recording = drive::drive(&default, &drive::chirp(145.0), &drive::CLEAN, 1);
        run("chirp", &recording, &EQUAL, &default, &drive::CLEAN, &wishes);
        return Ok(());
    }
    let seeds: u64 = after("--seeds").map_or(Ok(3), |n| n.parse())?;
    let light =
        SingleTrackCar { body: VehicleBody { m: 620.0, I_zz: 800.0, l_f: 1.5, l_r: 1.5, h: 0.3 }, ..default };
    let heavy = SingleTrackCar {
        body: VehicleBody { m: 1500.0, I_zz: 2400.0, l_f: 1.3, l_r: 1.5, h: 0.5 },
        ..default
    };
    let reference = drive::limit(&[15.0, 25.0, 40.0, 60.0, 80.0], 6.0);
    let cars = [
        ("demo", default, EQUAL),
        ("demo", default, UNEQUAL),
        ("light", light, UNEQUAL),
        ("heavy", heavy, UNEQUAL),
    ];
    let only = after("--only");
    for (noise_name, noise) in [("clean", drive::CLEAN), ("usual", drive::USUAL), ("harsh", drive::HARSH)] {
        for (car_name, car, truth) in &cars {
            for seed in 1..=seeds {
                let tires = if *truth == EQUAL { "equal" } else { "unequal" };
                let name = format!("{noise_name} {car_name} {tires} {seed}");
                if only.is_some_and(|part| !name.contains(part.as_str())) {
                    continue;
                }
                let on_tires = drive::on_tires(car, truth);
                let recording = drive::drive(&on_tires, &reference, &noise, seed);
                run(&name, &recording, truth, car, &noise, &wishes);
            }
        }
    }
    Ok(())
}
