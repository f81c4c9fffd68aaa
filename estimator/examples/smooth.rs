//! Smooths the recording of a run, and estimates its noises: `smooth run.csv`.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::collections::BTreeMap;
use std::error::Error;
use std::time::Instant;

use kalman::{
    EmEstimate, EmSettings, Gaussian, NoiseParameters, NonlinearModel, filter_forward,
    linearise_along_trajectory, linearise_by_extended_filter, smooth_recording, transition_matrix,
};
use nalgebra::{Matrix4, Matrix6, SMatrix, Vector4, Vector6};
use vehicle::NominalCar;

/// Columns of a recording by name, one number for each row.
type Columns = BTreeMap<String, Vec<f64>>;

fn read(path: &str) -> Result<Columns, Box<dyn Error>> {
    let mut reader = csv::Reader::from_path(path)?;
    let names = reader.headers()?.clone();
    let mut columns = Columns::new();
    for row in reader.records() {
        for (name, field) in names.iter().zip(&row?) {
            // An empty field is a measurement that is absent.
            let value = if field.is_empty() { f64::NAN } else { field.parse()? };
            // The unit follows the name: `plant.delta [rad]`.
            let name = name.split(" [").next().unwrap_or(name);
            columns.entry(name.to_owned()).or_default().push(value);
        }
    }
    Ok(columns)
}

fn column<'a>(columns: &'a Columns, name: &str) -> Result<&'a [f64], String> {
    columns.get(name).map(Vec::as_slice).ok_or_else(|| format!("no column {name}"))
}

/// Rows of several columns.
fn rows<const D: usize>(columns: &Columns, names: [&str; D]) -> Result<Vec<SMatrix<f64, D, 1>>, String> {
    let mut found = vec![];
    for name in names {
        found.push(column(columns, name)?);
    }
    Ok((0..found[0].len()).map(|k| SMatrix::from_fn(|i, _| found[i][k])).collect())
}

/// The nominal car with the inputs of a recording.
struct Driven {
    car: NominalCar,
    /// F_x [N] and δ [rad] that acted since the row before.
    inputs: Vec<SMatrix<f64, 2, 1>>,
    /// Time between two rows [s].
    period: f64,
}

impl NonlinearModel<6, 4> for Driven {
    fn transition(&self, k: usize, x: &Vector6<f64>) -> (Vector6<f64>, Matrix6<f64>) {
        let u = self.inputs[k + 1];
        let F = transition_matrix(&self.car.state_jacobian(x), self.period);
        (self.car.advance(x, u[0], u[1], self.period), F)
    }

    fn measurement(&self, k: usize, x: &Vector6<f64>) -> (Vector4<f64>, SMatrix<f64, 4, 6>) {
        let delta = self.inputs[k][1];
        (self.car.measurement(x, delta), self.car.measurement_jacobian(x))
    }
}

/// Root mean square of the error of v_x, v_y and r.
fn error(states: &[Gaussian<6>], truth: &[SMatrix<f64, 3, 1>]) -> SMatrix<f64, 3, 1> {
    let squares =
        |(s, t): (&Gaussian<6>, &SMatrix<f64, 3, 1>)| (s.mean.fixed_rows::<3>(0) - t).map(|e| e * e);
    let sum: SMatrix<f64, 3, 1> = states.iter().zip(truth).map(squares).sum();
    sum.map(|e| (e / states.len() as f64).sqrt())
}

/// Filters and smooths with the tangents of the filter, and prints what came out of it.
fn show(
    name: &str,
    model: &Driven,
    measured: &[Vector4<f64>],
    parameters: &NoiseParameters<6, 4>,
    truth: &[SMatrix<f64, 3, 1>],
) -> Result<(), Box<dyn Error>> {
    let steps = linearise_by_extended_filter(model, measured, parameters)?;
    let filtered = filter_forward(&steps, parameters)?;
    let smoothed = smooth_recording(&steps, &filtered)?;
    let nis: f64 = filtered.fit.iter().map(|fit| fit.nis).sum();
    let observed: usize = filtered.fit.iter().map(|fit| fit.observed).sum();
    println!("{name}");
    println!(
        "  log-likelihood {:.3}, NIS per measurement {:.3}",
        filtered.log_likelihood,
        nis / observed as f64
    );
    println!("  error of v_x, v_y, r: filtered {:.5?}", error(&filtered.posterior, truth).as_slice());
    println!("                        smoothed {:.5?}", error(&smoothed.states, truth).as_slice());
    let along: Vec<_> = smoothed.states.iter().map(|state| state.mean).collect();
    let steps = linearise_along_trajectory(model, measured, &along);
    let again = smooth_recording(&steps, &filter_forward(&steps, parameters)?)?;
    println!("       smoothed along itself {:.5?}", error(&again.states, truth).as_slice());
    Ok(())
}

fn report(found: &EmEstimate<6, 4>, seconds: f64) {
    let (first, last) = (found.log_likelihood[0], found.log_likelihood[found.log_likelihood.len() - 1]);
    println!("EM: {:?} after {} evaluations in {seconds:.3} s", found.status, found.evaluations);
    println!("  log-likelihood {first:.3} -> {last:.3}, {} violations", found.violations.len());
    let (Q, R) = (found.parameters.Q.diagonal(), found.parameters.R.diagonal());
    println!("  std of Q {:.6?}", Q.map(f64::sqrt).as_slice());
    println!("  std of R {:.6?}", R.map(f64::sqrt).as_slice());
    println!("  slopes   {:.1?} {:.1?}", found.slope_Q.as_slice(), found.slope_R.as_slice());
}

/// Times an iteration of EM on fixed tangents, and on tangents that are found anew [us per step].
fn time(
    model: &Driven,
    measured: &[Vector4<f64>],
    guess: &NoiseParameters<6, 4>,
) -> Result<(), Box<dyn Error>> {
    let em = EmSettings { accelerate: false, tolerance: 0.0, max_evaluations: 10, ..EmSettings::default() };
    let begun = Instant::now();
    let steps = linearise_by_extended_filter(model, measured, guess)?;
    let tangents = begun.elapsed().as_secs_f64();
    let found = em.fit(&steps, guess)?;
    let whole = begun.elapsed().as_secs_f64() - tangents;
    let per_step = |seconds: f64| 1e6 * seconds / measured.len() as f64;
    let iteration = per_step(whole) / found.evaluations as f64;
    println!(
        "time {iteration:.4} {:.4} loglik {:.6}",
        iteration + per_step(tangents),
        found.log_likelihood[0]
    );
    Ok(())
}

/// The inputs, the measurements and the true motion of a run.
type Recorded = (Driven, Vec<Vector4<f64>>, Vec<SMatrix<f64, 3, 1>>);

fn recorded(path: &str) -> Result<Recorded, Box<dyn Error>> {
    let columns = read(path)?;
    let of = |name: &str| format!("estimator.{name}_meas");
    let measured = rows(&columns, [&of("v_x"), &of("v_y"), &of("r"), &of("a_y")])?;
    let truth = rows(&columns, ["plant.v_x", "plant.v_y", "plant.r"])?;
    let inputs = rows(&columns, ["estimator.F_x", "estimator.delta"])?;
    let time_of = column(&columns, "time")?;
    if time_of.len() < 2 {
        return Err(format!("{path} holds no two rows").into());
    }
    let period = (time_of[time_of.len() - 1] - time_of[0]) / (time_of.len() - 1) as f64;
    let model = Driven { car: NominalCar::default(), inputs, period };
    Ok((model, measured, truth))
}

/// A first guess of the noises, from the first measurement.
fn guess(y: &Vector4<f64>) -> NoiseParameters<6, 4> {
    let sensor = Vector4::new(0.05, 0.01, 0.01, 0.1).map(|std| std * std);
    let xi = 1e6;
    let start = Gaussian {
        mean: Vector6::new(y[0], y[1], y[2], 0.0, 0.0, 0.0),
        cov: Matrix6::from_diagonal(&Vector6::new(sensor[0], sensor[1], sensor[2], xi, xi, xi)),
    };
    // Rather too large: EM climbs slowly from a variance that is too small to be noticed.
    let Q = Vector6::new(1e-3, 1e-3, 1e-3, 9e4, 2.25e6, 2.25e6);
    NoiseParameters { start, Q: Matrix6::from_diagonal(&Q), R: Matrix4::from_diagonal(&sensor) }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: smooth run.csv [time]")?;
    let (model, mut measured, truth) = recorded(&path)?;
    // The first row shows the true start; sensors are read from the second one on.
    let guess = guess(&measured[0]);
    measured[0].fill(f64::NAN);
    if arguments.next().as_deref() == Some("time") {
        return time(&model, &measured, &guess);
    }
    show("as guessed", &model, &measured, &guess, &truth)?;
    let steps = linearise_by_extended_filter(&model, &measured, &guess)?;
    // A hundredth of a nat is far below the information of the recording about a variance.
    let em = EmSettings { floor_Q: guess.Q.diagonal() * 1e-6, tolerance: 1e-2, ..EmSettings::default() };
    let begun = Instant::now();
    let found = em.fit(&steps, &guess)?;
    report(&found, begun.elapsed().as_secs_f64());
    show("as estimated", &model, &measured, &found.parameters, &truth)
}
