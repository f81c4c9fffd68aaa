//! Compares tires with tables that other implementations made.
//!
//! Short tables of three invented tires are in `tables`. The long ones, also of real tires, are in `data/oracles/tire` of a folder
//! `shared` beside the repository, or of `TRACKSIDE_DATA`.

use std::io::Read;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tire::{
    CoefficientKey, Coefficients, FormulaConvention, MagicFormulaVersion, MfTire, Tire, TireOperatingPoint,
};

/// So much of the largest value of a column may be wrong.
const TOLERANCE: f64 = 1e-12;

/// The table's loaded radii of one tire come from the square equation as it stands, which loses digits: 1 / (4 Q_FZ2) is large.
const LOST_DIGITS: [(&str, &str, f64); 1] = [("t61_ttc", "Rl_m", 1e-10)];

const TIRES: [&str; 8] =
    ["synth61", "synth62", "synth52", "t61_mf", "t62_tno205", "t52_mf", "t52_re050", "t61_ttc"];

type TestError = Box<dyn std::error::Error>;

#[test]
fn short_tables() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tables");
    TIRES[..3].iter().for_each(|name| agrees(name, &own, true));
}

#[test]
#[ignore = "needs data/oracles/tire"]
fn long_tables() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    TIRES.iter().for_each(|name| agrees(name, &data.join("oracles/tire"), false));
}

fn agrees(name: &str, folder: &Path, is_short: bool) {
    let wrong = compare(name, folder, is_short).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(wrong.is_empty(), "{name}: {}", wrong.join("\n"));
}

fn coefficients(name: &str, path: &Path) -> Result<Coefficients, TestError> {
    let all: Value = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    let values = all[name]["coefficients"].as_object().ok_or("no coefficients")?;
    let mut found = Coefficients::default();
    for (key, value) in values {
        let value = value.as_f64().ok_or_else(|| format!("{key} is no number"))?;
        match CoefficientKey::from_name(key) {
            Some(key) => key.set(&mut found, value),
            None if key == "FITTYP" && value == 61.0 => found.version = MagicFormulaVersion::Mf61,
            None if key == "FITTYP" && value == 62.0 => found.version = MagicFormulaVersion::Mf62,
            None if key == "FITTYP" => found.version = MagicFormulaVersion::Mf52,
            None => return Err(format!("no key {key}").into()),
        }
    }
    Ok(found)
}

fn table(path: &Path) -> Result<String, TestError> {
    let bytes = std::fs::read(path)?;
    let mut text = String::new();
    if path.extension().is_some_and(|it| it == "gz") {
        flate2::read::GzDecoder::new(&bytes[..]).read_to_string(&mut text)?;
    } else {
        text = String::from_utf8(bytes)?;
    }
    Ok(text)
}

/// One column: its largest value, and the worst row with how far it is off.
struct Column {
    name: &'static str,
    largest: f64,
    worst: (f64, String),
}

fn compare(name: &str, folder: &Path, is_short: bool) -> Result<Vec<String>, TestError> {
    let (parameters, rows) = match is_short {
        true => (format!("{name}.json"), format!("{name}.csv")),
        false => ("params.json".to_owned(), format!("{name}.csv.gz")),
    };
    let tire = MfTire::new(coefficients(name, &folder.join(parameters))?).map_err(|it| it.to_string())?;
    let text = table(&folder.join(rows))?;
    let mut lines = text.lines();
    let head: Vec<_> = lines.next().ok_or("an empty table")?.split(',').collect();
    let place = |column: &str| head.iter().position(|it| *it == column);
    let mut columns: Vec<Column> = Vec::new();
    let mut count = 0;
    for line in lines {
        let fields: Vec<_> = line.split(',').collect();
        let at = |column: &str| fields[place(column).unwrap_or(0)].parse::<f64>().unwrap_or(f64::NAN);
        let mode = fields[1];
        let tire = tire.with_convention(FormulaConvention {
            limits: mode.starts_with('1'),
            trigonometric: mode.ends_with("21"),
        });
        for (number, (column, found)) in values(&tire, &at).into_iter().enumerate() {
            if columns.len() == number {
                columns.push(Column { name: column, largest: 0.0, worst: (0.0, String::new()) });
            }
            let expected = if column == "muy" { at(column).abs() } else { at(column) };
            let column = &mut columns[number];
            if !expected.is_finite() || found.is_none() {
                continue;
            }
            let miss = found.map_or(f64::NAN, |found| (found - expected).abs());
            column.largest = column.largest.max(expected.abs());
            if miss > column.worst.0 || miss.is_nan() {
                column.worst = (miss, format!("{found:?} for {expected} in {line}"));
            }
        }
        count += 1;
    }
    if count < 50 {
        return Err(format!("only {count} rows").into());
    }
    let bound = |column: &str| {
        let known = LOST_DIGITS.iter().find(|it| (it.0, it.1) == (name, column));
        known.map_or(TOLERANCE, |it| it.2)
    };
    let wrong = columns.iter().filter(|it| it.worst.0 > bound(it.name) * it.largest || it.worst.0.is_nan());
    Ok(wrong
        .map(|it| format!("{}: off by {:e} of {:e}: {}", it.name, it.worst.0, it.largest, it.worst.1))
        .collect())
}

/// Each column that a tire computes; nothing where the table is not to be trusted.
fn values(tire: &MfTire, at: &impl Fn(&str) -> f64) -> Vec<(&'static str, Option<f64>)> {
    let slip = TireOperatingPoint {
        kappa: at("kappa"),
        alpha: at("alpha_rad"),
        gamma: at("gamma_rad"),
        F_z: at("Fz_N"),
        v_x: at("Vx_mps"),
        pressure: Some(at("P_Pa")),
        mu: 1.0,
    };
    let (forces, details) = tire.forces_and_details(&slip);
    let relaxation = tire.relaxation(&slip);
    let moment = match tire.coefficients().version {
        MagicFormulaVersion::Mf52 => "Mz_consistent_Nm",
        _ => "Mz_Nm",
    };
    // The table lets the moment of a wheel that turns backwards fade with VXLOW + VXLOW / |V_x| instead of 1 + VXLOW / |V_x|.
    let turns_backwards = slip.kappa < -1.0 && tire.coefficients().VXLOW != 1.0;
    // Radii of a wheel in the air are a matter of taste.
    let pressed = slip.F_z > tire.coefficients().FZMIN;
    let loaded = tire
        .loaded_radius(&slip, &forces)
        .filter(|_| pressed && tire.coefficients().version != MagicFormulaVersion::Mf52);
    vec![
        ("Fx_N", Some(forces.F_x)),
        ("Fy_N", Some(forces.F_y)),
        ("Mx_Nm", Some(forces.M_x)),
        ("My_Nm", Some(forces.M_y).filter(|_| !turns_backwards)),
        (moment, Some(forces.M_z)),
        ("mux", Some(details.mu[0])),
        ("muy", Some(details.mu[1].abs())),
        ("Kxk_N", Some(details.K_xk)),
        ("Kya_Nprad", Some(details.K_ya)),
        ("t_m", Some(details.trail)),
        ("Mzr_Nm", Some(details.residual)),
        ("sigmax_m", Some(relaxation.x)),
        ("sigmay_m", Some(relaxation.y)),
        ("Re_m", tire.effective_radius(&slip)),
        ("Rl_m", loaded),
    ]
}
