//! Builds CommonRoad's cars of our blocks, and compares derivatives and trajectories with tables that CommonRoad's own package made.
//!
//! The tables are in `data/oracles/vehicle` of a folder `shared` beside the repository, or of `TRACKSIDE_DATA`.

#[path = "common_road/car.rs"]
mod car;
#[path = "common_road/multi_body.rs"]
mod multi_body;
#[path = "common_road/single_track.rs"]
mod single_track;
#[path = "common_road/tires.rs"]
mod tires;

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use libtest_mimic::{Arguments, Failed, Trial};
use nalgebra::SVector;
use serde_json::Value;

use car::{Car, Demand};

/// Time derivative of a state.
type Rates = fn(&Car, &[f64], Demand) -> Vec<f64>;

/// A model: its name, its number of states, its equations, the largest difference of a derivative over the largest value of its column, and
/// the longest sub-steps of a hundredth of a second.
struct Model(&'static str, usize, Rates, f64, usize);

const MODELS: [Model; 5] = [
    Model("ks", 5, single_track::ks, 1e-12, 5),
    Model("kst", 6, single_track::kst, 1e-12, 20),
    Model("st", 7, single_track::st, 1e-12, 10),
    Model("std", 9, single_track::std, 1e-12, 20),
    Model("mb", 29, multi_body::mb, 1e-7, 50),
];

/// Largest difference of a state after a second or some, over the largest value of its column.
const PATHS: f64 = 1e-8;
/// The interval of the trajectories [s].
const INTERVAL: f64 = 0.01;

fn main() {
    let arguments = Arguments::from_args();
    let folder = shared();
    let trial = |name: String, test: fn(&Model, &Path, &str) -> Result<(), Failed>, model, file: String| {
        let folder = folder.clone();
        Trial::test(name, move || test(model, &folder, &file))
            .with_kind("needs data/oracles/vehicle")
            .with_ignored_flag(true)
    };
    let mut trials = Vec::new();
    for model in &MODELS {
        let name = model.0;
        let packed = if name == "mb" { ".gz" } else { "" };
        trials.push(trial(
            format!("derivatives_of_{name}"),
            derivatives,
            model,
            format!("derivatives_{name}.csv{packed}"),
        ));
        let files: &[&str] = match name {
            "kst" => &[],
            "std" => &["trajectories_std.csv.gz", "trajectories_std_long.csv.gz"],
            "mb" => &["trajectories_mb.csv.gz"],
            "st" => &["trajectories_st.csv"],
            _ => &["trajectories_ks.csv"],
        };
        for file in files {
            let long = if file.contains("long") { "long_" } else { "" };
            trials.push(trial(
                format!("{long}trajectories_of_{name}"),
                trajectories,
                model,
                (*file).to_owned(),
            ));
        }
    }
    libtest_mimic::run(&arguments, trials).exit();
}

fn shared() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    data.join("oracles/vehicle")
}

/// The cars by their numbers.
fn cars(folder: &Path) -> Result<BTreeMap<String, Car>, Failed> {
    let all: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("params.json"))?)?;
    assert!(single_track::gravity_is(all["gravity"].as_f64().unwrap_or_default()));
    let numbers = all["vehicles"].as_object().ok_or("no vehicles")?.keys();
    numbers.map(|number| Ok((number.clone(), Car::new(&all, number)?))).collect()
}

type TextsAndNumbers = (Vec<String>, Vec<f64>);

/// The rows of a table: texts of the columns before the numbers, and the numbers.
fn rows(path: &Path, texts: usize) -> Result<Vec<TextsAndNumbers>, Failed> {
    let bytes = std::fs::read(path)?;
    let mut text = String::new();
    if path.extension().is_some_and(|it| it == "gz") {
        flate2::read::GzDecoder::new(&bytes[..]).read_to_string(&mut text)?;
    } else {
        text = String::from_utf8(bytes)?;
    }
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        let numbers = cells[texts..].iter().map(|cell| cell.parse()).collect::<Result<_, _>>()?;
        Ok((cells[..texts].iter().map(|cell| (*cell).to_owned()).collect(), numbers))
    };
    text.lines().skip(1).map(row).collect()
}

/// The largest difference in each column over the largest value there.
#[derive(Default)]
struct Differences(Vec<[f64; 2]>);

impl Differences {
    fn take(&mut self, found: &[f64], expected: &[f64]) {
        self.0.resize(expected.len(), [0.0; 2]);
        assert_eq!(found.len(), expected.len());
        for ((found, expected), [worst, largest]) in found.iter().zip(expected).zip(&mut self.0) {
            let off = (found - expected).abs();
            // A value that is no number is the largest difference of all.
            *worst = if off.is_nan() { f64::INFINITY } else { worst.max(off) };
            *largest = largest.max(expected.abs());
        }
    }

    fn judge(&self, tolerance: f64) -> Result<(), Failed> {
        let share = |[worst, largest]: &[f64; 2]| if *worst == 0.0 { 0.0 } else { worst / largest };
        let wrong: Vec<_> = self.0.iter().map(share).enumerate().filter(|it| it.1 > tolerance).collect();
        if wrong.is_empty() { Ok(()) } else { Err(format!("states and differences: {wrong:?}").into()) }
    }
}

fn derivatives(model: &Model, folder: &Path, file: &str) -> Result<(), Failed> {
    let Model(_, states, rates, tolerance, _) = *model;
    let cars = cars(folder)?;
    let mut differences: BTreeMap<String, Differences> = BTreeMap::new();
    for (texts, numbers) in rows(&folder.join(file), 1)? {
        let (x, rest) = numbers.split_at(states);
        let found = rates(&cars[&texts[0]], x, Demand { steer: rest[0], a: rest[1] });
        differences.entry(texts[0].clone()).or_default().take(&found, &rest[2..]);
    }
    assert!(!differences.is_empty());
    differences.values().try_for_each(|it| it.judge(tolerance))
}

fn trajectories(model: &Model, folder: &Path, file: &str) -> Result<(), Failed> {
    let states = model.1;
    match states {
        5 => follow::<5>(model, folder, file),
        7 => follow::<7>(model, folder, file),
        9 => follow::<9>(model, folder, file),
        _ => follow::<29>(model, folder, file),
    }
}

/// A step is halved at most so often.
const HALVES: u32 = 24;

/// The state a step later, which is halved while two halves lead elsewhere: the shifts of the tires jump with the sign of the camber.
fn ahead<const N: usize>(
    x: SVector<f64, N>,
    step: f64,
    rates: &impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    halves: u32,
) -> SVector<f64, N> {
    let half = |x| vehicle::rk4_step(x, 0.5 * step, rates);
    let (whole, first) = (vehicle::rk4_step(&x, step, rates), half(&x));
    let second = half(&first);
    let off = |i: usize| (whole[i] - second[i]).abs() > 1e-12 * (second[i].abs() + 1e-3);
    if halves == 0 || !(0..N).any(off) {
        return second;
    }
    let middle = ahead(x, 0.5 * step, rates, halves - 1);
    ahead(middle, 0.5 * step, rates, halves - 1)
}

/// Each row is where the one before leads in an interval: errors add up along the way.
fn follow<const N: usize>(model: &Model, folder: &Path, file: &str) -> Result<(), Failed> {
    let Model(_, _, rates, _, parts) = *model;
    let (cars, rows) = (cars(folder)?, rows(&folder.join(file), 2)?);
    let mut differences: BTreeMap<String, Differences> = BTreeMap::new();
    let mut at: Option<(Vec<String>, Demand, SVector<f64, N>)> = None;
    for (texts, numbers) in rows {
        let demand = Demand { steer: numbers[1], a: numbers[2] };
        let expected = &numbers[3..];
        let x = match at {
            Some((before, held, mut x)) if before == texts => {
                let car = &cars[&texts[0]];
                let rates = |x: &SVector<f64, N>| SVector::from_vec(rates(car, x.as_slice(), held));
                let step = INTERVAL / parts as f64;
                (0..parts).for_each(|_| x = ahead(x, step, &rates, HALVES));
                x
            }
            _ => SVector::from_column_slice(expected),
        };
        differences.entry(texts[0].clone()).or_default().take(x.as_slice(), expected);
        at = Some((texts, demand, x));
    }
    assert!(!differences.is_empty());
    differences.values().try_for_each(|it| it.judge(PATHS))
}
