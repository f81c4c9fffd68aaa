//! Searches for the fastest laps of random cars on random tracks, and counts how the searches end.
//!
//! `cargo run --release --package lap --example random_laps -- 1000 [SEED]`
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::time::Instant;

use lap::{CarParameters, LapOptimum, LapOptions};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use track::TrackLine;

/// A search that takes longer is named [s].
const SLOW: f64 = 30.0;

/// How the search of a random car on a random track ended.
struct RandomLap {
    seed: u64,
    end: String,
    seconds: f64,
    speeds: Option<[f64; 2]>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: u64 = arguments.next().ok_or("expected the number of laps")?.parse()?;
    let first: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let laps: Vec<RandomLap> = (first..first + count).into_par_iter().map(search).collect();
    let mut ends: BTreeMap<&str, Vec<&RandomLap>> = BTreeMap::new();
    for lap in &laps {
        ends.entry(&lap.end).or_default().push(lap);
    }
    for (end, laps) in &ends {
        let seeds: Vec<u64> = laps.iter().take(8).map(|lap| lap.seed).collect();
        println!("{:5}  {end}, such as {seeds:?}", laps.len());
    }
    let mut seconds: Vec<f64> = laps.iter().map(|lap| lap.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |share: f64| seconds[((seconds.len() - 1) as f64 * share) as usize];
    println!("seconds of a search: median {:.2}, 95 % {:.2}, longest {:.2}", at(0.5), at(0.95), at(1.0));
    let speeds = laps.iter().filter_map(|lap| lap.speeds);
    let [low, high] = speeds.fold([f64::INFINITY, 0.0], |[l, h], [a, b]| [a.min(l), b.max(h)]);
    println!("speeds from {low:.1} to {high:.1} m/s");
    for lap in laps.iter().filter(|lap| lap.seconds > SLOW) {
        println!("seed {} took {:.0} s: {}", lap.seed, lap.seconds, lap.end);
    }
    Ok(())
}

fn search(seed: u64) -> RandomLap {
    let begin = Instant::now();
    let mut random = Pcg64::seed_from_u64(seed);
    let (car, track) = (random_car(&mut random), random_track(&mut random));
    let found =
        TrackLine::from_table_text(&track).map_err(|error| format!("no line: {error}")).and_then(|line| {
            let (car, _) = car?.car()?;
            LapOptimum::find(&car, &line, &LapOptions::default()).map_err(|error| kind_of(&error.to_string()))
        });
    let seconds = begin.elapsed().as_secs_f64();
    match found {
        Ok(lap) => {
            let speeds = lap.nodes.iter().map(|node| node.variables.v_x);
            let range = speeds.fold([f64::INFINITY, 0.0], |[l, h]: [f64; 2], v| [l.min(v), h.max(v)]);
            RandomLap { seed, end: format!("{:?}", lap.status), seconds, speeds: Some(range) }
        }
        Err(message) => RandomLap { seed, end: message, seconds, speeds: None },
    }
}

/// A message without its numbers.
fn kind_of(message: &str) -> String {
    let mut text = String::new();
    for letter in message.chars() {
        match letter.is_ascii_digit() || letter == '.' {
            true if text.ends_with('#') => {}
            true => text.push('#'),
            false => text.push(letter),
        }
    }
    text
}

/// A closed line around the origin whose radius is a random sum of waves, with random widths, bank and grade.
fn random_track(random: &mut Pcg64) -> String {
    let size = random.random_range(40.0..600.0);
    let waves: Vec<[f64; 3]> = (2..=6)
        .map(|k| [f64::from(k), random.random_range(0.0..0.35) / f64::from(k), random.random_range(0.0..TAU)])
        .collect();
    let [left, right] = [0, 1].map(|_| random.random_range(3.0..8.0));
    let bank = random.random_range(-0.05..0.15);
    let hill = random.random_range(0.0..0.05);
    let mut text = "# closed\nx_m,y_m,left_m,right_m,bank_rad,grade_rad\n".to_owned();
    for i in 0..400 {
        let angle = TAU * f64::from(i) / 400.0;
        let radius =
            size * (1.0 + waves.iter().map(|[k, a, phase]| a * (k * angle + phase).cos()).sum::<f64>());
        let grade = hill * angle.sin();
        writeln!(text, "{},{},{left},{right},{bank},{grade}", radius * angle.cos(), radius * angle.sin())
            .expect("a text takes everything");
    }
    text
}

/// A car from a kart to a lorry, with balances from understeer to oversteer.
fn random_car(random: &mut Pcg64) -> Result<CarParameters, String> {
    let m = random.random_range(200.0..4000.0);
    let wheelbase = random.random_range(1.2..4.0);
    let l_f = wheelbase * random.random_range(0.4..0.6);
    let l_r = wheelbase - l_f;
    let track = if random.random_bool(0.5) { 0.0 } else { random.random_range(0.5..0.75) * wheelbase };
    let grip = random.random_range(0.4..1.8);
    CarParameters::from_numbers(&[
        ("body.m", m),
        ("body.I_zz", m * l_f * l_r * random.random_range(0.6..1.4)),
        ("body.l_f", l_f),
        ("body.l_r", l_r),
        ("body.h", wheelbase * random.random_range(0.08..0.28)),
        ("body.track_f", track),
        ("body.track_r", track),
        ("roll.stiffness_f", m * random.random_range(10.0..80.0)),
        ("roll.stiffness_r", m * random.random_range(10.0..80.0)),
        ("aero.area", random.random_range(0.5..6.0)),
        ("aero.C_d", random.random_range(0.2..1.2)),
        ("aero.C_lf", random.random_range(-0.1..1.5)),
        ("aero.C_lr", random.random_range(-0.1..1.5)),
        ("brake.front_share", random.random_range(0.4..0.8)),
        ("drive.front_share", if random.random_bool(0.5) { 0.0 } else { random.random() }),
        ("drive.power_max", m * random.random_range(20.0..600.0)),
        ("tire_f.B", random.random_range(5.0..20.0)),
        ("tire_r.B", random.random_range(5.0..20.0)),
        ("tire_f.D", grip * random.random_range(0.9..1.1)),
        ("tire_r.D", grip * random.random_range(0.9..1.1)),
    ])
}
