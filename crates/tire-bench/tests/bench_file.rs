//! Fits the file of the scenario tires_from_bench.toml, and finds its tire again, whichever format it comes in.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::written_bench as support;

use crate::writer::{Made, column, file};
use support::{WARM, bench_file, truth};
use tire::{Coefficients, TireAxes};
use tire_bench::{
    BenchData, BenchReadOptions, Identifiability, TireFit, TireFitOptions, fit_tire, read_bench_file,
    read_bench_files, write_tir,
};

const FILE: &str = include_str!("../../../scenarios/bench/sports_tire.csv");

fn sae() -> BenchReadOptions<'static> {
    BenchReadOptions { axes: TireAxes::Sae, radius: truth().UNLOADED_RADIUS, ..BenchReadOptions::default() }
}

/// What the scenario fits: radius, nominal load and pressure are known, nothing else of the tire.
fn fitted(found: &BenchData) -> TireFit {
    let Coefficients { UNLOADED_RADIUS, FNOMIN, NOMPRES, .. } = truth();
    let tire =
        Coefficients { UNLOADED_RADIUS, FNOMIN, NOMPRES, INFLPRES: NOMPRES, ..Coefficients::default() };
    fit_tire(&found.samples, &TireFitOptions { tire, extended: false, draws: 0, seed: 0 }).expect("a fit")
}

#[test]
fn the_file_is_what_its_program_makes() {
    assert_eq!(FILE, bench_file(), "run the example bench_file");
    assert!(FILE.len() < 300_000, "{} bytes", FILE.len());
}

#[test]
fn the_tire_of_the_file_is_found() {
    let found = read_bench_file(FILE.as_bytes(), "sports_tire", 0, &sae()).expect("samples");
    assert_eq!(
        found.notes,
        ["24 sweeps were found by their conditions; 0 samples between them were left out"]
    );
    let fit = fitted(&found);
    let truth = truth();
    for (name, expected, off) in
        [("PDX1", truth.PDX1, 0.03), ("PDY1", truth.PDY1, 0.03), ("TDY1", WARM, 0.01), ("TDX1", WARM, 0.01)]
    {
        let it = fit.estimates.iter().find(|it| it.name == name).expect("an estimate");
        assert!((it.value - expected).abs() < off, "{it:?}, expected {expected}");
        assert_eq!(it.verdict, Identifiability::Identified, "{it:?}");
    }
}

/// Without a temperature its terms stay at 0, and nothing claims to know them. One temperature says as much: the tire of the file is
/// the one that was measured at it, and no prior carries its friction to another temperature.
#[test]
fn a_file_without_temperatures_or_with_one_says_nothing_of_their_terms() {
    let mut cold = read_bench_file(FILE.as_bytes(), "a", 0, &sae()).expect("samples");
    cold.samples.iter_mut().for_each(|it| it.temperature = 299.15);
    let cold = fitted(&cold);
    let text: String = FILE.lines().filter_map(|it| Some(it.rsplit_once(',')?.0.to_owned() + "\n")).collect();
    let found = read_bench_file(text.as_bytes(), "a", 0, &sae()).expect("samples");
    assert!(found.notes.iter().any(|it| it.starts_with("no temperature of the tread")), "{:?}", found.notes);
    let fit = fitted(&found);
    for it in fit.estimates.iter().filter(|it| ["TDX1", "TKX1", "TDY1", "TKY2"].contains(&it.name)) {
        assert_eq!((it.value, it.verdict), (0.0, Identifiability::NotIdentifiable), "{it:?}");
    }
    assert!((cold.reference - 299.15).abs() < 1e-9 && fit.reference == 333.0);
    for (a, b) in cold.estimates.iter().zip(&fit.estimates) {
        assert!((a.value - b.value).abs() < 1e-6 * b.prior_std, "{a:?}, {b:?}");
        assert_eq!(a.verdict, b.verdict, "{a:?}, {b:?}");
    }
    assert!(write_tir(&cold).contains("REFERENCE_TEMPERATURE    = 299.1"));
}

/// The same numbers as vectors of a MAT file, and as one file of TYDEX for each sweep.
#[test]
fn other_formats_give_the_same_samples() {
    let expected = read_bench_file(FILE.as_bytes(), "a", 0, &sae()).expect("samples").samples;
    let lines: Vec<_> = FILE.lines().skip(1).map(|it| it.split(',').collect::<Vec<_>>()).collect();
    let (names, rows) = lines.split_first().expect("names");
    let names: Vec<_> =
        names.iter().map(|it| it.trim_end_matches(']').split_once(" [").expect("a unit")).collect();
    let text = |it: &str| Made::Text(it.to_owned());
    let numbers = |k: usize| rows.iter().map(|row| row[k].parse().expect("a number")).collect::<Vec<f64>>();
    let mut variables: Vec<_> = names.iter().enumerate().map(|(k, it)| (it.0, column(&numbers(k)))).collect();
    let units = Made::Struct(vec![
        ("name", Made::Cell(names.iter().map(|it| text(it.0)).collect())),
        ("units", Made::Cell(names.iter().map(|it| text(it.1)).collect())),
    ]);
    variables.push(("channel", units));
    let mat = read_bench_file(&file(&variables, true), "a", 0, &sae()).expect("samples");
    assert_eq!(mat.samples, expected);
    let short = [
        "RUNTIME", "TRAJVELW", "SLIPANGL", "LONGSLIP", "INCLANGL", "INFLPRES", "FXW", "FYW", "FZW", "MZW",
        "TSTC",
    ];
    let sweeps = expected.chunk_by(|a, b| a.block == b.block);
    let mut begin = 0;
    let texts: Vec<String> = sweeps
        .map(|sweep| {
            let mut text = "**HEADER\n**MEASURCHANNELS\n".to_owned();
            for (name, unit) in short.iter().zip(&names) {
                text += &format!("{name:<10}{:<30}{:<10}1\n", "", unit.1);
            }
            text += "**MEASURDATA\n";
            for row in &rows[begin..begin + sweep.len()] {
                text += &(row.join(" ") + "\n");
            }
            begin += sweep.len();
            text + "**END\n"
        })
        .collect();
    let files: Vec<_> = texts.iter().map(|it| ("a", it.as_bytes())).collect();
    assert_eq!(read_bench_files(&files, &sae()).expect("samples").samples, expected);
}
