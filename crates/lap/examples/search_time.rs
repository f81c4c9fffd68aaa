//! Times searches for fastest laps on a track: from nothing, from the lap of a similar car, and for draws of its parameters.
//!
//! `cargo run --release --package lap --example search_time -- scenarios/tracks/road_course.csv [NODES] [DRAWS]`
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::error::Error;
use std::time::Instant;

use lap::{CarParameters, LapCar, LapOptimum, LapOptions, ParameterDraw, ParameterKey};
use track::TrackLine;
use vehicle::VehicleBody;

/// Repetitions of a search; the median counts.
const REPETITIONS: usize = 5;
/// Draws of the tires, where no number is told.
const DRAWS: usize = 200;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("expected the table of a track")?;
    let nodes = arguments.next().map(|text| text.parse()).transpose()?.unwrap_or(500);
    let draws = draws(arguments.next().map(|text| text.parse()).transpose()?.unwrap_or(DRAWS))?;
    let line = TrackLine::from_table_text(&std::fs::read_to_string(path)?)?;
    let options = LapOptions { nodes: Some(nodes), ..LapOptions::default() };
    println!("{nodes} nodes, {:.0} m, medians of {REPETITIONS}", line.length());
    for (name, width, transients) in
        [("single track", 0.0, false), ("load moves across", 1.5, false), ("body swings", 1.5, true)]
    {
        let mut parameters = parameters(width)?;
        parameters.set_transients(transients);
        let (car, _) = parameters.car()?;
        let heavier = LapCar { body: VehicleBody { m: 1.01 * car.body.m, ..car.body }, ..car.clone() };
        let lap = LapOptimum::find(&car, &line, &options)?;
        let cold = median_seconds(|| LapOptimum::find(&car, &line, &options).map(drop))?;
        let warm = median_seconds(|| lap.find_similar(&heavier, &line, &options).map(drop))?;
        let begin = Instant::now();
        let interval = lap.lap_time_interval(&parameters, &draws, &line, &options, || true)?;
        println!(
            "{name}: {:.3} s, {:?}, {} steps; search {cold:.2} s, from a similar lap {warm:.2} s, {} draws {:.1} s, {} unsolved",
            lap.lap_time,
            lap.status,
            lap.iterations,
            draws.len(),
            begin.elapsed().as_secs_f64(),
            interval.unsolved
        );
    }
    Ok(())
}

fn median_seconds(mut search: impl FnMut() -> Result<(), lap::Error>) -> Result<f64, lap::Error> {
    let mut seconds = Vec::with_capacity(REPETITIONS);
    for _ in 0..REPETITIONS {
        let begin = Instant::now();
        search()?;
        seconds.push(begin.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[REPETITIONS / 2])
}

/// A rear-wheel-drive car on tires by the simple formula.
fn parameters(width: f64) -> Result<CarParameters, String> {
    CarParameters::from_numbers(&[
        ("body.m", 1250.0),
        ("body.I_zz", 1850.0),
        ("body.l_f", 1.18),
        ("body.l_r", 1.27),
        ("body.h", 0.47),
        ("body.track_f", width),
        ("body.track_r", width),
        ("body.I_xx", 380.0),
        ("body.I_yy", 1650.0),
        ("roll.stiffness_f", 62e3),
        ("roll.stiffness_r", 44e3),
        ("roll.damping_f", 3800.0),
        ("roll.damping_r", 3500.0),
        ("roll.centre_f", 0.045),
        ("roll.centre_r", 0.08),
        ("ride.stiffness_f", 50e3),
        ("ride.stiffness_r", 48e3),
        ("ride.damping_f", 3400.0),
        ("ride.damping_r", 3100.0),
        ("pitch.centre", 0.04),
        ("aero.area", 1.95),
        ("aero.C_d", 0.34),
        ("brake.front_share", 0.62),
        ("drive.power_max", 190e3),
        ("tire_f.D", 1.1),
        ("tire_r.D", 1.15),
    ])
}

/// Frictions of both axles, evenly by the golden ratio within 3 % of their values.
fn draws(count: usize) -> Result<Vec<ParameterDraw>, &'static str> {
    let key = |name| ParameterKey::find(name).ok_or("no such parameter");
    let (front, rear) = (key("tire_f.D")?, key("tire_r.D")?);
    let draw = |i: usize| {
        let [a, b] = [0.618_033_988_75, 0.754_877_666_25].map(|step: f64| (step * i as f64).fract() - 0.5);
        vec![(front, 1.1 * (1.0 + 0.06 * a)), (rear, 1.15 * (1.0 + 0.06 * b))]
    };
    Ok((0..count).map(draw).collect())
}
