//! Reads small files as benches write them: tables as text and MAT files, good and bad.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::io::Write as _;

use crate::writer::{Made, column, file};
use tire::TireAxes;
use tire_bench::{
    BenchData, BenchReadOptions, ConstantChannel, FileUnits, read_bench_file, read_bench_files,
};

const OWN: &str = "block,time_s,slip_ratio,slip_angle_rad,camber_rad,fz_n,pressure_pa,speed_mps,temp_centre_k,fx_n,fy_n,mz_nm";

/// Rows of TTC: ET V SA SL IA P FX FY FZ MZ TSTC, in SAE axes and metric units; a sweep of slip angle at 1000 N.
const TTC: [&str; 11] = ["ET", "V", "SA", "SL", "IA", "P", "FX", "FY", "FZ", "MZ", "TSTC"];
const METRIC: [&str; 11] = ["sec", "kph", "deg", "none", "deg", "kPa", "N", "N", "N", "N-m", "degC"];

fn ttc_row(k: usize) -> [f64; 11] {
    let phase = (k as f64 / 500.0 * std::f64::consts::TAU).sin();
    let sa = 8.0 * phase;
    [0.01 * k as f64, 40.0, sa, 0.0, 1.5, 83.0, -3.0, 180.0 * -sa, -1000.0, 2.0 * sa, 60.0]
}

fn sae() -> BenchReadOptions<'static> {
    BenchReadOptions { axes: TireAxes::Sae, radius: 0.2, ..BenchReadOptions::default() }
}

fn refused(bytes: &[u8], reading: &BenchReadOptions) -> String {
    read_bench_file(bytes, "a", 0, reading).map(|it| it.samples.len()).expect_err("refused").to_string()
}

/// What row 125, at 8 degrees of SAE, is in ISO-W and SI.
fn is_ttc(found: &BenchData) {
    let it = found.samples[125];
    assert_eq!((found.samples.len(), it.F_z, it.F_y.round(), it.block), (500, 1000.0, 1440.0, 0));
    assert!((it.alpha + 8f64.to_radians()).abs() < 1e-12 && (it.M_z + 16.0).abs() < 1e-9, "{it:?}");
    assert!((it.gamma - 1.5f64.to_radians()).abs() < 1e-12 && (it.pressure - 83e3).abs() < 1e-9);
    assert!((it.v_x - 40.0 / 3.6).abs() < 1e-12 && (it.temperature - 333.15).abs() < 1e-9);
    assert!(found.notes.iter().any(|it| it.starts_with("1 sweeps were found")), "{:?}", found.notes);
}

fn dat(delimiter: &str, comma: bool) -> String {
    let number = |it: f64| if comma { format!("{it:.12}").replace('.', ",") } else { format!("{it:.12}") };
    let rows = (0..500).map(|k| ttc_row(k).map(number).join(delimiter));
    rows.collect::<Vec<_>>().join("\r\n")
}

#[test]
fn dat_of_ttc_and_its_relatives_are_read_with_their_units() {
    let (names, units) = (TTC.join("\t"), METRIC.join("\t"));
    let title = "Title: Tire=Größe 18x6;\tSpeed=40 kph; Units: MKS, SAE\r\n";
    let text = format!("{title}{names}\r\n{units}\r\n{}\r\n", dat("\t", false));
    let sides = TTC.iter().zip(METRIC).map(|(name, unit)| format!("{name} [{unit}]"));
    let sides = sides.collect::<Vec<_>>().join(";");
    let german = format!("sep=;\r\n{sides}\r\n{}", dat(";", true));
    let brackets = TTC.iter().zip(METRIC).map(|(name, unit)| format!("{name}({unit})"));
    let commas = format!("# a note\n{}\n{}", brackets.collect::<Vec<_>>().join(","), dat(",", false));
    let latin: Vec<u8> = text.chars().map(|it| it as u32 as u8).collect();
    let marked = [b"\xef\xbb\xbf", german.as_bytes()].concat();
    let wide: Vec<u8> =
        "\u{feff}".chars().chain(german.chars()).flat_map(|it| (it as u16).to_le_bytes()).collect();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(commas.as_bytes()).expect("memory");
    let packed = packed.finish().expect("memory");
    for bytes in [text.as_bytes(), &latin, german.as_bytes(), &marked, &wide, commas.as_bytes(), &packed] {
        is_ttc(&read_bench_file(bytes, "a", 0, &sae()).expect("samples"));
    }
    let error = refused(&packed[..packed.len() / 2], &sae());
    assert!(error.contains("cannot be unpacked"), "{error}");
}

/// The layout of a cornering run of FSAE TTC: the belt stands at the beginning, and SR has a standard for a unit.
#[test]
fn rows_of_a_standing_belt_and_the_slip_ratio_of_a_free_wheel_are_left_out() {
    let names = TTC.join("\t").replace("SL", "SR");
    let standing = (0..100).map(|k| {
        let [_, _, _, _, camber, pressure, .., warm] = ttc_row(0);
        let row = [0.01 * k as f64 - 1.0, 0.03, 0.0, -1.0, camber, pressure, -4.0, 0.0, -650.0, 0.0, warm];
        row.map(|it| it.to_string()).join("\t")
    });
    // SR of a free wheel is that of the loaded radius: it moves with the load, and F_x stays small.
    let rolling = (0..500).map(|k| {
        let row = ttc_row(k);
        let loaded = [row[0], row[1], row[2], -0.03 - 0.005 * row[2]];
        [&loaded[..], &row[4..]].concat().iter().map(f64::to_string).collect::<Vec<_>>().join("\t")
    });
    let rows = standing.chain(rolling).collect::<Vec<_>>().join("\n");
    for unit in ["SAE", "none"] {
        let units = METRIC.join("\t").replace("none", unit);
        let text = format!("TIRF Data File: Run 1\n{names}\n{units}\n{rows}\n");
        let found = read_bench_file(text.as_bytes(), "a", 0, &sae()).expect("samples");
        is_ttc(&found);
        assert!(found.samples.iter().all(|it| it.kappa == 0.0));
        let notes = found.notes.join("\n");
        assert!(notes.contains("100 rows below 1 m/s were left out: the belt stands"), "{notes}");
        assert!(notes.contains("the wheel rolls freely, so the slip ratio is 0"), "{notes}");
    }
}

#[test]
fn units_are_stated_and_never_guessed() {
    let text = format!("{}\n{}", TTC.join(","), dat(",", false));
    let error = refused(text.as_bytes(), &sae());
    assert!(
        error.starts_with("a:1: FZ: expected a unit for fz_n, found none in the file: give it"),
        "{error}"
    );
    let stated = BenchReadOptions { units: Some(FileUnits::TtcMetric), ..sae() };
    is_ttc(&read_bench_file(text.as_bytes(), "a", 0, &stated).expect("samples"));
    // The user knows better than the file.
    let columns = [("fz_n", "FZ", Some("kN"))];
    let other = BenchReadOptions { columns: &columns, ..stated };
    assert_eq!(read_bench_file(text.as_bytes(), "a", 0, &other).expect("samples").samples[0].F_z, 1e6);
    let columns = [("fz_n", "FZ", Some("furlong"))];
    let error = refused(text.as_bytes(), &BenchReadOptions { columns: &columns, ..stated });
    assert_eq!(error, "a:1: FZ: expected a unit like N, found furlong");
    let columns = [("fz_n", "load", None)];
    let error = refused(text.as_bytes(), &BenchReadOptions { columns: &columns, ..stated });
    assert!(error.starts_with("a:1: expected a column load for fz_n, found ET, V"), "{error}");
}

#[test]
fn what_a_file_lacks_is_told_or_refused_with_what_to_do() {
    let without = |lacking: &[&str]| {
        let keep: Vec<_> = (0..11).filter(|k| !lacking.contains(&TTC[*k])).collect();
        let head = keep.iter().map(|k| format!("{} [{}]", TTC[*k], METRIC[*k])).collect::<Vec<_>>().join(",");
        let row = |k: usize| keep.iter().map(|j| ttc_row(k)[*j].to_string()).collect::<Vec<_>>().join(",");
        format!("{head}\n{}\n", (0..500).map(row).collect::<Vec<_>>().join("\n"))
    };
    let found = read_bench_file(without(&["SL", "TSTC", "FX"]).as_bytes(), "a", 0, &sae()).expect("samples");
    let notes = found.notes.join("\n");
    for note in ["no slip ratio: taken as 0", "no F_x", "no temperature of the tread: its terms stay at 0"] {
        assert!(notes.contains(note), "{notes}");
    }
    let of_all = |(channel, value)| ConstantChannel { file: None, channel, value };
    let constant = [("pressure_pa", 80e3), ("camber_rad", 0.0), ("speed_mps", 11.0)].map(of_all);
    let lacking = without(&["P", "IA", "V"]);
    let error = refused(lacking.as_bytes(), &sae());
    assert!(
        error.contains("expected a column camber_rad, found ET, SA")
            && error.contains("constants.camber_rad = ..."),
        "{error}"
    );
    let reading = BenchReadOptions { constants: &constant, ..sae() };
    assert_eq!(
        read_bench_file(lacking.as_bytes(), "a", 0, &reading).expect("samples").samples[3].pressure,
        80e3
    );
    let error = refused(without(&["FY"]).as_bytes(), &sae());
    assert!(
        error.starts_with("a:1: expected a column fy_n, found ET") && !error.contains("constants"),
        "{error}"
    );
    let found = read_bench_file(without(&["MZ"]).as_bytes(), "a", 0, &sae()).expect("samples");
    assert!(found.notes.contains(&"no M_z: the aligning moment is not fitted".to_owned()));
    assert!(found.samples.len() == 500 && found.samples.iter().all(|it| it.M_z.is_nan()));
    // Two runs at two pressures, which no column has.
    let lacking = without(&["P"]);
    let constant = [(None, 80e3), (Some("b"), 97e3)].map(|(file, value)| ConstantChannel {
        file,
        channel: "pressure_pa",
        value,
    });
    let reading = BenchReadOptions { constants: &constant, ..sae() };
    let files = [("a", lacking.as_bytes()), ("b", lacking.as_bytes())];
    let samples = read_bench_files(&files, &reading).expect("samples").samples;
    assert_eq!([samples[0].pressure, samples[500].pressure], [80e3, 97e3]);
    let found = read_bench_file(without(&["ET"]).as_bytes(), "a", 0, &sae()).expect("samples");
    assert!(found.notes.join("").contains("each row counts as a steady state"));
}

/// A table of seven points for each load, as people type it from a report.
#[test]
fn a_few_steady_states_are_a_sweep() {
    let mut text = "SA [deg];FZ [kN];FY [N];MZ [Nm];IA [deg];P [bar];V [km/h]\n".to_owned();
    for load in [2, 4, 6] {
        for angle in -3..=3 {
            text += &format!("{};{load};{};{};0;2,3;60\n", 2 * angle, -100 * load * angle, 3 * angle);
        }
    }
    let found = read_bench_file(text.as_bytes(), "a", 0, &BenchReadOptions::default()).expect("samples");
    let sweeps: Vec<_> = found.samples.chunk_by(|a, b| a.block == b.block).collect();
    assert!(sweeps.len() == 3 && sweeps.iter().all(|it| it.len() == 7), "{:?}", found.notes);
    assert!((found.samples[0].pressure - 2.3e5).abs() < 1e-9);
}

#[test]
fn signs_and_slips_of_no_tire_are_refused() {
    let row = |v: &str| format!("{OWN}\n0,0,0,{v}\n");
    let iso = BenchReadOptions::default();
    let error = refused(row("0.03,0,-1000,80000,11,330,0,-900,9").as_bytes(), &iso);
    assert!(error.contains("SAE benches write F_z < 0"), "{error}");
    let error = refused(row("0.03,0,1000,80000,11,330,0,-900,x").as_bytes(), &iso);
    assert_eq!(error, "a:2: mz_nm: expected a number, found `x`");
    let error = refused(row("0.03,0,1000,80000,11,330,0,,").as_bytes(), &iso);
    assert!(error.contains("fy_n: expected numbers, found none in the whole column"), "{error}");
    let driven = |scale: f64, shift: f64| {
        let rows = (0..400).map(|k| {
            let kappa = 0.15 * (k as f64 / 400.0 * std::f64::consts::TAU).sin();
            format!(
                "0,{},{},0,0,1000,80000,11,330,{},0,0\n",
                0.01 * k as f64,
                scale * kappa + shift,
                9000.0 * kappa
            )
        });
        format!("{OWN}\n{}", rows.collect::<String>())
    };
    assert_eq!(
        read_bench_file(driven(1.0, 0.0).as_bytes(), "a", 0, &iso).expect("samples").samples.len(),
        400
    );
    assert!(refused(driven(100.0, 0.0).as_bytes(), &iso).contains("it may be %"));
    let error = refused(driven(1.0, -0.12).as_bytes(), &iso);
    assert!(error.contains("this is a slip ratio by the loaded radius (SR of TTC)"), "{error}");
    assert!(
        refused(driven(-1.0, 0.0).as_bytes(), &iso).contains("expected F_x > 0 where the slip ratio is > 0")
    );
    for (text, what) in [
        ("", "expected a line with names"),
        ("ET,FX\n", "expected rows below the names"),
        ("a\0b", "found other bytes"),
    ] {
        assert!(refused(text.as_bytes(), &iso).contains(what), "{text}");
    }
}

#[test]
fn mat_files_of_ttc_are_read_with_the_units_of_their_channels() {
    let vectors = || {
        let of = |j: usize| column(&(0..500).map(|k| ttc_row(k)[j]).collect::<Vec<_>>());
        (0..11).map(move |j| (TTC[j], of(j)))
    };
    let texts = |all: &[&str]| Made::Cell(all.iter().map(|it| Made::Text((*it).to_owned())).collect());
    let channel = || Made::Struct(vec![("name", texts(&TTC)), ("units", texts(&METRIC))]);
    let mut plain: Vec<(&str, Made)> = vectors().collect();
    plain.push(("tireid", Made::Text("R25B".to_owned())));
    plain.push(("channel", channel()));
    for packed in [false, true] {
        is_ttc(&read_bench_file(&file(&plain, packed), "a", 0, &sae()).expect("samples"));
    }
    let structs = [("data", Made::Struct(vectors().collect())), ("channel", channel())];
    let found = read_bench_file(&file(&structs, true), "a", 0, &sae()).expect("samples");
    assert!(found.notes.contains(&"channels of the struct `data`".to_owned()));
    is_ttc(&found);
    let bare: Vec<(&str, Made)> = vectors().collect();
    let error = refused(&file(&bare, true), &sae());
    assert!(error.contains("FZ: expected a unit for fz_n, found none in the file"), "{error}");
    let mut short: Vec<(&str, Made)> = vectors().filter(|it| it.0 != "FZ").collect();
    short.push(("FZ", column(&[1.0; 499])));
    let error = refused(&file(&short, true), &sae());
    assert_eq!(error, "a: FZ: expected 500 values as other channels have, found 499");
    let error = refused(&file(&[("log", Made::Object)], true), &sae());
    assert!(error.contains("`log` is an object, such as a string, table"), "{error}");
    let error = refused(b"MATLAB 7.3 MAT-file", &sae());
    assert!(error.contains("was the file copied whole?"), "{error}");
}
