//! What tries damaged files of test benches.

use std::path::Path;

use damage::FuzzTarget;
use tire::TireAxes;
use tire_bench::{BenchReadOptions, FileUnits, read_bench_file};

use super::writer::{Made, column, file};

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "bench_files",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../tire-bench/tests/corpus/bench_files"),
    sound,
    words: &[
        "**HEADER",
        "**CONSTANTS",
        "**MEASURCHANNELS",
        "**MEASURDATA",
        "**END",
        "FZW",
        "SLIPANGL",
        "FZ",
        "SA",
        "deg",
        "N-m",
        "kPa",
        "\t",
        ";",
        "1.5D+03",
        "NOTAVAIL",
        "\r",
        "[",
        "]",
        "channel",
    ],
    own: None,
    attempt,
};

const NAMES: [&str; 7] = ["SA", "FZ", "FY", "MZ", "IA", "P", "V"];
const UNITS: [&str; 7] = ["deg", "N", "N", "N-m", "deg", "kPa", "kph"];

fn row(k: usize) -> [f64; 7] {
    let angle = 8.0 * (k as f64 / 40.0 * std::f64::consts::TAU).sin();
    [angle, 1000.0, -150.0 * angle, 3.0 * angle, 0.0, 80.0, 40.0]
}

fn sound() -> Vec<Vec<u8>> {
    let lines = |delimiter: &str| {
        let rows = (0..40).map(|k| row(k).map(|it| format!("{it:.3}")).join(delimiter) + "\n");
        rows.collect::<String>()
    };
    let csv = format!("{}\n{}\n{}", NAMES.join(","), UNITS.join(","), lines(","));
    let tabs = format!("a title\n{}\n{}\n{}", NAMES.join("\t"), UNITS.join("\t"), lines("\t"));
    let mut tydex =
        "**HEADER\n**CONSTANTS\nINFLPRES  a pressure                    bar       2.0\n**MEASURCHANNELS\n"
            .to_owned();
    for (name, unit) in
        ["SLIPANGL", "FZH", "FYH", "MZH", "INCLANGL", "INFLPRES", "TRAJVELH"].iter().zip(UNITS)
    {
        tydex += &format!("{name:<10}{:<30}{unit:<10}{:<10}{:<10}{}\n", "a comment", 1, 0, 0);
    }
    tydex += &format!("**MEASURDATA\n{}**END\n", lines(" "));
    let of = |j: usize| column(&(0..40).map(|k| row(k)[j]).collect::<Vec<_>>());
    let vectors: Vec<_> = (0..7).map(|j| (NAMES[j], of(j))).collect();
    let packed = file(&vectors, true);
    let data = [("data", Made::Struct((0..7).map(|j| (NAMES[j], of(j))).collect()))];
    vec![csv.into(), tabs.into(), tydex.into(), packed, file(&data, false)]
}

fn attempt(bytes: &[u8], _folder: &Path) -> bool {
    let reading = BenchReadOptions {
        axes: TireAxes::Iso,
        units: Some(FileUnits::TtcMetric),
        radius: 0.3,
        ..BenchReadOptions::default()
    };
    read_bench_file(bytes, "a", 0, &reading).is_ok()
}
